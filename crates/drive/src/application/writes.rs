//! What a write to an object means to the drive as a whole; what it means to an axis, the axis
//! knows.

use canopen::{Abort, Address, Image, NodeId, Verdict, store};

use personalities::own::OwnBehaviour;

use super::Application;
use crate::body::Body;
use crate::gains::stored_together;

impl<O: OwnBehaviour, B: Body> Application<O, B> {
    /// What a write to an object that asks means.
    pub(crate) fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        if let Some(verdict) = self.write_own(image, object, new) {
            return verdict;
        }
        let mut raw = [0; 4];
        for (place, byte) in raw.iter_mut().zip(new) {
            *place = *byte;
        }
        let raw = u32::from_le_bytes(raw);
        if self
            .personality
            .node_id
            .is_some_and(|own| own.at_once && own.address == object)
        {
            // Its row has judged the range.
            self.new_node_id = NodeId::new(raw as u8);
            return Verdict::Accept;
        }
        match object.index {
            0x1010 => self.write_store(object, raw),
            0x1011 => match store::Request::from_restore(object.sub, raw) {
                Ok(request) => {
                    self.storage_request = Some(request);
                    self.restores = true;
                    Verdict::Later
                }
                Err(abort) => Verdict::Refuse(abort),
            },
            _ => self.write_to_axis(image, object, raw),
        }
    }

    /// An axis knows its objects.
    fn write_to_axis(&mut self, image: &Image<'_>, object: Address, raw: u32) -> Verdict {
        let verdict = self.noting(|axes, common| {
            axes.iter_mut()
                .find_map(|axis| axis.write(common, image, object, raw))
        });
        verdict.unwrap_or(Verdict::Refuse(Abort::DEVICE_STATE))
    }

    fn write_store(&mut self, object: Address, value: u32) -> Verdict {
        let request = if self.personality.stores_single_entry == Some(object) {
            // P4: index << 8 | sub-index. Only an object that is stored at all can be saved.
            let address = Address::from_key(value);
            match address.filter(|address| store::is_stored(&self.table(), *address)) {
                Some(address) => {
                    let mut axes = self.personality.axes.iter();
                    match axes.find_map(|axis| stored_together(&axis.amplifier.gains, address)) {
                        Some((first, count)) => store::Request::Run { first, count },
                        None => store::Request::Single(address),
                    }
                }
                None => return Verdict::Refuse(Abort::CANNOT_STORE),
            }
        } else {
            match store::Request::from_write(object.sub, value) {
                Ok(request) => request,
                Err(abort) => return Verdict::Refuse(abort),
            }
        };
        self.storage_request = Some(request);
        self.restores = false;
        Verdict::Later
    }

    fn table(&self) -> canopen::Table {
        self.personality.device.table
    }
}
