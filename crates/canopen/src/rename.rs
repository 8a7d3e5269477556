//! Another node ID while the node runs, without LSS and without a new start.

use can::Frame;

use crate::outbox::Slot;
use crate::row::Default;
use crate::{CobId, Image, Node, NodeId, NodeMemory};

/// The PDOs' parameters and mappings, whose identifiers stay.
const PDO_AREA: core::ops::RangeInclusive<u16> = 0x1400..=0x1BFF;

impl<M: NodeMemory> Node<M> {
    /// Answers to `id` from now on. No boot-up is sent and the NMT state stays. The identifiers of
    /// heartbeat and default SDO server follow, and those in the dictionary that are at their
    /// default for the node ID before (EMCY), but for the PDOs': they stay what they are, though
    /// their defaults at the next start are the new node ID's. What waits to be sent is sent with
    /// its new identifier, so let an answer go before.
    pub fn rename(&mut self, id: NodeId) {
        let (old, new) = (u32::from(self.id.get()), u32::from(id.get()));
        self.id = id;
        let mut image = Image::new(self.memory.as_mut());
        for row in self.device.table.rows() {
            let Default::PlusNode(base) = row.default else {
                continue;
            };
            let address = row.address;
            if PDO_AREA.contains(&address.index) {
                continue;
            }
            if let Ok(entry) = self.device.table.find(address.index, address.sub)
                && image.raw(entry.field) == base.wrapping_add(old)
            {
                image.set_raw(entry.field, base.wrapping_add(new));
            }
        }
        self.outbox.set_key(Slot::BootUp, 0x700 + new);
        self.outbox.set_key(Slot::ErrorControl, 0x700 + new);
        self.outbox.set_key(Slot::Sdo(0), 0x580 + new);
        self.server(0).request_key = 0x600 + new;
        if let Some(at) = self.device.objects.emcy_cob_id {
            let cob_id = CobId(self.image().get(at));
            self.outbox.set_key(Slot::Emergency, cob_id.key());
        }
    }

    /// Whether `frame` is an answer of the default SDO server.
    pub fn is_sdo_answer(&self, frame: &Frame) -> bool {
        frame.key() == 0x580 + u32::from(self.id.get())
    }
}
