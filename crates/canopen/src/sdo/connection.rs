//! The SDO server's connection: its identifiers, and the answer that waits.

use crate::{Abort, AcknowledgeData, Address, Dialect, NodeId, UploadReply};

/// The default SDO connection: which frames are its requests, and the answer that waits to be sent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SdoConnection {
    /// [`can::Frame::key`] of requests.
    pub(crate) request_key: u32,
    pub(crate) reply_id: u16,
    pub(crate) reply: [u8; 8],
    /// A download whose owner answers later.
    pub(crate) waiting: Option<(Address, u32)>,
}

impl SdoConnection {
    /// The default connection of a node: 0x600 and 0x580 plus its ID (CiA 301 7.3.3).
    pub(crate) fn new(node: NodeId) -> SdoConnection {
        let id = u16::from(node.get());
        SdoConnection {
            request_key: u32::from(0x600 + id),
            reply_id: 0x580 + id,
            reply: [0; 8],
            waiting: None,
        }
    }

    #[inline]
    fn answer(&mut self, command: u8, address: Address, data: u32) {
        let [index_low, index_high] = address.index.to_le_bytes();
        let [d0, d1, d2, d3] = data.to_le_bytes();
        self.reply = [command, index_low, index_high, address.sub, d0, d1, d2, d3];
    }

    /// Answers an upload with `bytes` bytes (CiA 301 7.2.4.3.6).
    #[inline]
    pub(crate) fn uploaded(&mut self, address: Address, raw: u32, bytes: u8, dialect: &Dialect) {
        let command = match dialect.upload_reply {
            UploadReply::Sized => 0x43 | (4u8.saturating_sub(bytes) & 3) << 2,
            UploadReply::Unsized => 0x42,
        };
        self.answer(command, address, raw);
    }

    /// Acknowledges a download (CiA 301 7.2.4.3.3).
    #[inline]
    pub(crate) fn downloaded(&mut self, address: Address, raw: u32, dialect: &Dialect) {
        let data = match dialect.acknowledge_data {
            AcknowledgeData::Zeros => 0,
            AcknowledgeData::Echo => raw,
        };
        self.answer(0x60, address, data);
    }

    /// Aborts (CiA 301 7.2.4.3.17).
    #[inline]
    pub(crate) fn aborted(&mut self, address: Address, abort: Abort) {
        self.answer(0x80, address, abort.0);
    }
}
