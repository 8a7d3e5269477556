//! Which frames a client sends and listens to.

use can::{ExtendedId, Frame, Id, StandardId};

use crate::{CobId, NodeId};

/// The two identifiers of an SDO connection, of 11 or 29 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// [`Frame::key`] of the client's frames.
    request_key: u32,
    /// [`Frame::key`] of the server's frames.
    answer_key: u32,
}

impl Channel {
    /// Requests go out with `request`, answers come in with `answer`.
    pub fn new(request: impl Into<Id>, answer: impl Into<Id>) -> Channel {
        Channel {
            request_key: Frame::key_of(request),
            answer_key: Frame::key_of(answer),
        }
    }

    /// The default connection of a node: 0x600 and 0x580 plus its ID (CiA 301 7.3.3).
    pub fn of(node: NodeId) -> Channel {
        let node = u16::from(node.get());
        let id = |base: u16| StandardId::new(base + node).unwrap_or(StandardId::ZERO);
        Channel::new(id(0x600), id(0x580))
    }

    /// From the COB-IDs of an SDO parameter, client to server and server to client (CiA 301
    /// 7.5.2.33). `None` if one of them says that the connection does not exist.
    pub fn from_cob_ids(request: CobId, answer: CobId) -> Option<Channel> {
        Some(Channel::new(id(request)?, id(answer)?))
    }

    /// Whether the server sent `frame` on this connection.
    #[inline]
    pub fn is_answer(&self, frame: &Frame) -> bool {
        frame.key() == self.answer_key
    }

    /// A request with these data, of which `len` bytes are sent.
    #[inline]
    pub(super) fn request(&self, data: [u8; 8], len: u8) -> Frame {
        Frame::keyed(self.request_key, data, len)
    }
}

fn id(cob_id: CobId) -> Option<Id> {
    if cob_id.is_off() {
        None
    } else if cob_id.is_extended() {
        ExtendedId::new(cob_id.0 & 0x1FFF_FFFF).map(Id::Extended)
    } else {
        StandardId::new(cob_id.id()).map(Id::Standard)
    }
}
