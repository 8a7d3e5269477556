//! Applying a receive PDO: from its data into the image.

use crate::{Address, Events, Image, Instant, Node, NodeMemory, Owner};

impl<M: NodeMemory> Node<M> {
    /// Writes the data of receive PDO `n` into the image. An object whose value is out of range or
    /// which the owner refuses keeps its value; the others are written.
    pub(crate) fn apply<O: Owner>(
        &mut self,
        n: usize,
        data: u64,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let Some(rpdo) = self.rpdo.get(n) else { return };
        let mapping = rpdo.mapping;
        if mapping.is_walked() {
            return self.apply_walked(n, data, now, owner, events);
        }
        for copy in mapping.copies() {
            let raw = copy.extract(data);
            if copy.is_judged() {
                let Some(row) = self.device.table.rows().get(usize::from(copy.row)) else {
                    continue;
                };
                let address = Address::new(row.address.index, copy.sub);
                if let Ok(entry) = self.device.table.find(address.index, address.sub) {
                    // A refusal has no one to be told to.
                    let _ = self.write(address, &entry, raw, now, owner, events);
                }
            } else {
                Image::new(self.memory.as_mut()).set_raw(copy.field(), raw);
                events.changed.insert(copy.class());
            }
        }
    }
}
