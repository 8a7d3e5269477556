//! An SDO server: its identifiers, the answer that waits, and the transfer that goes on.

use super::crc::Crc16;
use crate::{Abort, AcknowledgeData, Address, CobId, Dialect, Instant, NodeId, UploadReply};

/// One SDO server.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SdoServer {
    /// [`can::Frame::key`] of requests.
    pub(crate) request_key: u32,
    pub(crate) reply: [u8; 8],
    pub(crate) transfer: Transfer,
    /// When a client that has not taken the next step is given up.
    pub(crate) due: Instant,
}

/// A transfer of more than one request.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transfer {
    pub(crate) phase: Phase,
    pub(crate) address: Address,
    pub(crate) place: Place,
    /// Bytes that are done: delivered in order, or acknowledged.
    pub(crate) at: u32,
    /// How many there will be; [`Transfer::UNKNOWN`] if that was not said.
    pub(crate) size: u32,
    /// Of the segment that comes next.
    pub(crate) toggle: bool,
    /// Segments in a block.
    pub(crate) block_size: u8,
    /// Number of the segment that comes next, from 1.
    pub(crate) next: u8,
    /// The last segment of all was sent, or came.
    pub(crate) is_last: bool,
    /// A segment of the block has come, in order or not.
    pub(crate) has_begun: bool,
    /// A block transfer with a checksum.
    pub(crate) with_crc: bool,
    pub(crate) crc: Crc16,
    /// Bytes that `crc` covers: those that are sent again do not count again.
    pub(crate) crc_at: u32,
    /// The value of an object that has at most eight bytes.
    pub(crate) value: [u8; 8],
    /// A block's last segment, of which the end of the transfer says how much of it counts.
    pub(crate) held: Option<[u8; 7]>,
}

/// What a server waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The next request.
    Idle,
    /// Its owner's answer.
    Waiting(Wait),
    /// The request of the next segment.
    Upload,
    /// The next segment.
    Download,
    /// The client's word to begin sending blocks.
    BlockUploadStart,
    /// Its turn to send the next segment of a block.
    BlockUpload,
    /// The client's word that the end of a block upload has come.
    BlockUploadEnd,
    /// The next segment of a block.
    BlockDownload,
    /// The client's word that the last block was the last.
    BlockDownloadEnd,
}

/// What is answered when the owner has said yes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wait {
    /// An expedited download, whose bytes are in [`Transfer::value`].
    Expedited,
    /// The first request of a segmented download.
    SegmentsBegin,
    /// Its last segment.
    SegmentsEnd,
    /// The first request of a block download.
    BlocksBegin,
    /// The end of a block download.
    BlocksEnd,
}

/// Where the bytes of a transfer are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    /// In [`Transfer::value`], as many as this.
    Value(u8),
    /// A constant text: the default of this row.
    Flash(u16),
    /// A string in the image; of a download, in the room where strings are gathered.
    String(crate::Field),
    /// The owner's.
    Stream,
    /// Replaced by another value while it was being read.
    Gone,
}

impl Transfer {
    /// A size that was not said. (An object of so many bytes is announced without its size.)
    const UNKNOWN: u32 = u32::MAX;

    /// How many bytes there will be, if that was said.
    pub(crate) fn size(&self) -> Option<u32> {
        (self.size != Transfer::UNKNOWN).then_some(self.size)
    }

    /// The same transfer, of `size` bytes.
    pub(crate) fn of_size(self, size: Option<u32>) -> Transfer {
        Transfer {
            size: size.unwrap_or(Transfer::UNKNOWN),
            ..self
        }
    }

    pub(crate) const IDLE: Transfer = Transfer {
        phase: Phase::Idle,
        address: Address::new(0, 0),
        place: Place::Value(0),
        at: 0,
        size: Transfer::UNKNOWN,
        toggle: false,
        block_size: 0,
        next: 1,
        is_last: false,
        has_begun: false,
        with_crc: false,
        crc: Crc16::START,
        crc_at: 0,
        value: [0; 8],
        held: None,
    };
}

impl SdoServer {
    /// The default server of a node: 0x600 and 0x580 plus its ID (CiA 301 7.3.3).
    pub(crate) fn default_of(node: NodeId) -> SdoServer {
        SdoServer::new(0x600 + u32::from(node.get()))
    }

    /// A server that does not exist.
    pub(crate) const OFF: SdoServer = SdoServer::new(CobId::NO_KEY);

    pub(crate) const fn new(request_key: u32) -> SdoServer {
        SdoServer {
            request_key,
            reply: [0; 8],
            transfer: Transfer::IDLE,
            due: Instant::NEVER,
        }
    }

    /// Whether there is such a server.
    pub(crate) fn exists(&self) -> bool {
        self.request_key != CobId::NO_KEY
    }

    #[inline]
    pub(crate) fn is_idle(&self) -> bool {
        self.transfer.phase == Phase::Idle
    }

    /// Whether its owner's answer is awaited.
    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.transfer.phase, Phase::Waiting(_))
    }

    /// The transfer is over.
    pub(crate) fn finish(&mut self) {
        self.transfer.phase = Phase::Idle;
        self.due = Instant::NEVER;
    }

    #[inline]
    pub(crate) fn answer(&mut self, command: u8, address: Address, data: u32) {
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
