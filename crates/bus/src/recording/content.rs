//! What a record tells.

use can::Frame;

/// What a record is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A frame.
    Frame(Frame),
    /// A message about errors from the recording controller's driver, not from the bus.
    Error {
        /// Class of error, bits 0–28 (linux/can/error.h).
        class: u32,
        /// Particulars.
        data: [u8; 8],
    },
}

/// Seen from the recording machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// candump's `R`.
    Received,
    /// candump's `T`.
    Sent,
}
