//! Serving an SDO request: from the client's frame to the answer that waits.

use can::Frame;

use super::Request;
use crate::access::Written;
use crate::outbox::Slot;
use crate::row::flag;
use crate::{
    Abort, Address, DataType, Default, Entry, Events, Image, Instant, Node, NodeMemory, Owner, Row,
};

impl<M: NodeMemory> Node<M> {
    /// Serves one SDO request.
    #[inline]
    pub(crate) fn serve<O: Owner>(
        &mut self,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let Some(request) = Request::parse(frame, &self.device.dialect) else {
            return;
        };
        let dialect = &self.device.dialect;
        match request {
            Request::Upload(address) => match self.upload(address, owner) {
                Ok((raw, bytes)) => self.sdo.uploaded(address, raw, bytes, dialect),
                Err(abort) => self.sdo.aborted(address, abort),
            },
            Request::Download { address, raw, size } => {
                if self.sdo.waiting.is_some() {
                    // The one connection is busy until the owner has answered.
                    self.sdo.aborted(address, Abort::DEVICE_STATE);
                } else {
                    let found = self.device.table.find(address.index, address.sub);
                    let written = found.and_then(|entry| {
                        if !entry.has(flag::WRITE) {
                            return Err(Abort::READ_ONLY);
                        }
                        size.check(entry.field.size())?;
                        let raw = low_bytes(raw, entry.field.size());
                        self.write(address, &entry, raw, now, owner, events)
                            .map(|written| (written, raw))
                    });
                    match written {
                        Ok((Written::Now, raw)) => self.sdo.downloaded(address, raw, dialect),
                        Ok((Written::Later, raw)) => {
                            self.sdo.waiting = Some((address, raw));
                            return;
                        }
                        Err(abort) => self.sdo.aborted(address, self.sub_0(address, abort)),
                    }
                }
            }
            Request::Unknown(address) => self.sdo.aborted(address, Abort::COMMAND),
            // An abort is never answered (CiA 301 7.2.4.3.17); it ends what waits.
            Request::Abort => {
                self.sdo.waiting = None;
                return;
            }
        }
        self.outbox.post(Slot::Sdo);
    }

    #[inline]
    fn upload<O: Owner>(&mut self, address: Address, owner: &mut O) -> Result<(u32, u8), Abort> {
        let table = &self.device.table;
        let entry = match table.find(address.index, address.sub) {
            Ok(entry) => entry,
            // Sub-index 0 that no row declares is the highest sub-index (CiA 301 7.4.3).
            Err(abort) if address.sub == 0 => {
                return table
                    .highest_sub_index(address.index)
                    .map(|highest| (u32::from(highest), 1))
                    .ok_or(abort);
            }
            Err(abort) => return Err(abort),
        };
        if !entry.has(flag::READ) {
            return Err(Abort::WRITE_ONLY);
        }
        if entry.field.data_type() == DataType::Text {
            return self.text(&entry);
        }
        if address.index == 0x1003 && !self.history_has(address.sub) {
            return Err(Abort::NO_DATA);
        }
        let mut image = Image::new(self.memory.as_mut());
        if entry.has(flag::LIVE) {
            owner.publish(&mut image);
        }
        Ok((image.raw(entry.field), entry.field.size()))
    }

    /// A constant text of at most four characters.
    fn text(&self, entry: &Entry) -> Result<(u32, u8), Abort> {
        match self.device.table.row(entry) {
            // No expedited answer can say "0 bytes".
            Some(Row {
                default: Default::Text(text),
                ..
            }) if !text.is_empty() => {
                let mut bytes = [0; 4];
                for (place, byte) in bytes.iter_mut().zip(text.bytes()) {
                    *place = byte;
                }
                Ok((u32::from_le_bytes(bytes), text.len().min(4) as u8))
            }
            _ => Err(Abort::NO_DATA),
        }
    }

    /// A write to the sub-index 0 that [`Node::upload`] makes up is a write to a constant.
    fn sub_0(&self, address: Address, abort: Abort) -> Abort {
        let made_up = address.sub == 0
            && abort == Abort::NO_SUB_INDEX
            && self.device.table.highest_sub_index(address.index).is_some();
        if made_up { Abort::READ_ONLY } else { abort }
    }
}

/// The low `bytes` (1 to 4) of `raw`.
#[inline]
fn low_bytes(raw: u32, bytes: u8) -> u32 {
    match bytes {
        1 => raw & 0xFF,
        2 => raw & 0xFFFF,
        _ => raw,
    }
}
