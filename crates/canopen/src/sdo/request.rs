//! What an SDO client's frame asks.

use can::Frame;

use crate::{Abort, Address, DataType, Dialect, Entry};

/// A request to an SDO server (CiA 301 7.2.4.3). The client command specifier is the first three
/// bits of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// 2: read an object.
    Upload(Address),
    /// 1, expedited: write an object with the bytes that came.
    Download {
        address: Address,
        raw: u32,
        size: Size,
    },
    /// 1: segments follow, of so many bytes together if that is said.
    DownloadSegments { address: Address, size: Option<u32> },
    /// 0: a segment.
    Segment {
        toggle: bool,
        bytes: [u8; 7],
        count: u8,
        is_last: bool,
    },
    /// 3: the next segment is asked for.
    UploadSegment { toggle: bool },
    /// 5, 0: blocks are asked for.
    BlockUpload {
        address: Address,
        with_crc: bool,
        block_size: u8,
        /// An object of at most so many bytes need not be sent in blocks; 0: never.
        switch_bytes: u8,
    },
    /// 5, 3: send.
    BlockUploadStart,
    /// 5, 2: so many segments of the block have come.
    BlockUploadAcknowledge { segments: u8, block_size: u8 },
    /// 5, 1: all has come.
    BlockUploadEnd,
    /// 6, 0: blocks follow.
    BlockDownload {
        address: Address,
        with_crc: bool,
        size: Option<u32>,
    },
    /// 6, 1: the last block was the last; so many bytes of its last segment count not.
    BlockDownloadEnd { unused: u8, crc: u16 },
    /// 4: the client gives up.
    Abort(Abort),
    /// 7, or a form that does not exist.
    Unknown(Address),
}

/// How many data bytes an expedited download carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    /// As the size bits say; `None` if they say nothing: as many as the object has.
    indicated: Option<u8>,
    /// As many as the frame has room for.
    carried: u8,
}

impl Request {
    /// Reads a frame addressed to a server. `None` for one too short to be a request, which is
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
            // Bit 1 clear announces segments.
            1 if command & 0b10 != 0 => Request::Download {
                address,
                raw: u32::from_le_bytes(data),
                size: Size {
                    indicated: (command & 1 != 0).then_some(4 - (command >> 2 & 3)),
                    carried: frame.len().saturating_sub(4),
                },
            },
            _ => Request::long(command, address, frame),
        })
    }

    /// Everything but expedited transfers.
    #[cold]
    fn long(command: u8, address: Address, frame: &Frame) -> Request {
        let [_, b1, b2, b3, b4, b5, b6, b7] = frame.bytes();
        let number = u32::from_le_bytes([b4, b5, b6, b7]);
        match (command >> 5, command & 3) {
            (0, _) => Request::Segment {
                toggle: command & 0x10 != 0,
                bytes: [b1, b2, b3, b4, b5, b6, b7],
                count: 7 - (command >> 1 & 7),
                is_last: command & 1 != 0,
            },
            (1, _) => Request::DownloadSegments {
                address,
                size: (command & 1 != 0).then_some(number),
            },
            (3, _) => Request::UploadSegment {
                toggle: command & 0x10 != 0,
            },
            (4, _) => Request::Abort(Abort(number)),
            (5, 0) => Request::BlockUpload {
                address,
                with_crc: command & 4 != 0,
                block_size: b4,
                switch_bytes: b5,
            },
            (5, 1) => Request::BlockUploadEnd,
            (5, 2) => Request::BlockUploadAcknowledge {
                segments: b1,
                block_size: b2,
            },
            (5, _) => Request::BlockUploadStart,
            // Bit 1 says whether the size is indicated, bit 0 is the sub-command.
            (6, 0 | 2) => Request::BlockDownload {
                address,
                with_crc: command & 4 != 0,
                size: (command & 2 != 0).then_some(number),
            },
            (6, _) => Request::BlockDownloadEnd {
                unused: command >> 2 & 7,
                crc: u16::from_le_bytes([b1, b2]),
            },
            _ => Request::Unknown(address),
        }
    }
}

impl Size {
    /// Whether the object's `bytes` can be taken from `raw`, which came.
    ///
    /// # Errors
    /// [`Abort::TOO_LONG`] or [`Abort::TOO_SHORT`].
    #[inline]
    pub(crate) fn check(self, bytes: u8, raw: u32, dialect: &Dialect) -> Result<(), Abort> {
        match self.indicated {
            Some(size) if size > bytes => {
                let padded = raw.checked_shr(8 * u32::from(bytes)) == Some(0);
                match dialect.zero_padded_writes && padded {
                    true => Ok(()),
                    false => Err(Abort::TOO_LONG),
                }
            }
            Some(size) if size < bytes => Err(Abort::TOO_SHORT),
            // A request shorter than the object (P55).
            _ if self.carried < bytes => Err(Abort::TOO_SHORT),
            _ => Ok(()),
        }
    }

    /// How many bytes there are for an object that is no number of at most four.
    ///
    /// # Errors
    /// [`Abort::TOO_SHORT`] for an object that has more, [`Abort::LENGTH`] for one of any length if
    /// it is not said how many there are.
    pub(crate) fn of_string(self, entry: &Entry) -> Result<u8, Abort> {
        let room = entry.field.size();
        match (self.indicated, entry.field.data_type()) {
            (Some(size), _) => Ok(size),
            (None, DataType::Text | DataType::Domain) => Err(Abort::LENGTH),
            (None, _) if self.carried < room => Err(Abort::TOO_SHORT),
            (None, _) => Ok(room),
        }
    }
}
