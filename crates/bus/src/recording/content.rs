//! What a record tells.

use can::Frame;

use crate::ErrorFrame;

/// What a record is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A frame.
    Frame(Frame),
    /// A message about errors from the recording controller's driver, not from the bus.
    Error(ErrorFrame),
}

/// Seen from the recording machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// candump's `R`.
    Received,
    /// candump's `T`.
    Sent,
}
