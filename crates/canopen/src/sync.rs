//! SYNC consumer (CiA 301 7.2.5).

use crate::CobId;

/// Which frame is a SYNC.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SyncConsumer {
    /// [`can::Frame::key`] of the SYNC frame, or a key that no frame has.
    pub(crate) key: u32,
}

impl SyncConsumer {
    pub(crate) fn new(cob_id: u32) -> SyncConsumer {
        let cob_id = CobId(cob_id);
        // Bit 31 of 0x1005 says nothing (CiA 301 7.5.2.5).
        let key = if cob_id.is_extended() || cob_id.is_restricted() {
            CobId::NO_KEY
        } else {
            u32::from(cob_id.id())
        };
        SyncConsumer { key }
    }
}
