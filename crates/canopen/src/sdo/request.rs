//! What an SDO client's frame asks.

use can::Frame;

use crate::{Abort, Address, Dialect};

/// A request to the SDO server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// Read an object.
    Upload(Address),
    /// Write an object with the bytes that came.
    Download {
        address: Address,
        raw: u32,
        size: Size,
    },
    /// Something the server does not offer.
    Unknown(Address),
    /// The client gives up.
    Abort,
}

/// How many data bytes a download carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    /// As the size bits say; `None` if they say nothing: as many as the object has.
    indicated: Option<u8>,
    /// As many as the frame has room for.
    carried: u8,
}

impl Request {
    /// Reads a frame addressed to the server. `None` for one too short to be a request, which is
    /// met with silence (P55; CiA 301 wants eight bytes).
    #[inline]
    pub(crate) fn parse(frame: &Frame, dialect: &Dialect) -> Option<Request> {
        let shortest = if dialect.short_requests { 4 } else { 8 };
        if frame.len() < shortest || frame.is_remote() {
            return None;
        }
        let [command, index_low, index_high, sub, data @ ..] = frame.bytes();
        let address = Address::new(u16::from_le_bytes([index_low, index_high]), sub);
        Some(match command >> 5 {
            2 => Request::Upload(address),
            // Expedited only: bit 1 clear announces segments.
            1 if command & 0b10 != 0 => Request::Download {
                address,
                raw: u32::from_le_bytes(data),
                size: Size {
                    indicated: (command & 1 != 0).then_some(4 - (command >> 2 & 3)),
                    carried: frame.len().saturating_sub(4),
                },
            },
            4 => Request::Abort,
            _ => Request::Unknown(address),
        })
    }
}

impl Size {
    /// Whether the object's `bytes` can be taken from what came.
    ///
    /// # Errors
    /// [`Abort::TOO_LONG`] or [`Abort::TOO_SHORT`].
    #[inline]
    pub(crate) fn check(self, bytes: u8) -> Result<(), Abort> {
        match self.indicated {
            Some(size) if size > bytes => Err(Abort::TOO_LONG),
            Some(size) if size < bytes => Err(Abort::TOO_SHORT),
            // A request shorter than the object (P55).
            _ if self.carried < bytes => Err(Abort::TOO_SHORT),
            _ => Ok(()),
        }
    }
}
