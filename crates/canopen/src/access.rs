//! The judged write: what an SDO download passes on its way into the image, and with it an object
//! of a received PDO that has rules.

use crate::row::flag;
use crate::{
    Abort, Address, DataType, Entry, Events, Image, Instant, Node, NodeMemory, Owner, RangeAbort,
    Verdict,
};

/// How a write ended.
pub(crate) enum Written {
    /// Done, and acknowledged.
    Now,
    /// Its owner will say.
    Later,
}

impl<M: NodeMemory> Node<M> {
    /// Judges and commits a write whose access and length were checked.
    pub(crate) fn write<O: Owner>(
        &mut self,
        address: Address,
        entry: &Entry,
        raw: u32,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) -> Result<Written, Abort> {
        if entry.has(flag::RANGE) {
            self.check_range(entry, raw)?;
        }
        if entry.has(flag::NODE) {
            self.judge_communication(address, raw)?;
        }
        let mut image = Image::new(self.memory.as_mut());
        if entry.has(flag::ASKS) {
            let bytes = raw.to_le_bytes();
            let new = bytes.get(..usize::from(entry.field.size())).unwrap_or(&[]);
            match owner.write(&image, address, new) {
                Verdict::Accept => {}
                Verdict::Done => {
                    events.changed.insert(entry.class);
                    return Ok(Written::Now);
                }
                Verdict::Refuse(abort) => return Err(abort),
                Verdict::Later => return Ok(Written::Later),
            }
        }
        image.set_raw(entry.field, raw);
        events.changed.insert(entry.class);
        if entry.has(flag::STORED) {
            self.is_reconfigured = address.index != 0x1020;
        }
        if entry.has(flag::NODE) {
            self.communication_changed(address, now, events);
            if let 0x1201..=0x127F = address.index {
                self.drop_switched_off(owner);
            }
        }
        Ok(Written::Now)
    }

    /// The same for an object that is no number of at most four bytes: `new` are as many bytes as a
    /// number has, or of a string at most as many as its object has.
    #[cold]
    pub(crate) fn write_long<O: Owner>(
        &mut self,
        address: Address,
        entry: &Entry,
        new: &[u8],
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) -> Result<Written, Abort> {
        let room = usize::from(entry.field.size());
        let may_be_shorter = entry.field.data_type() == DataType::Text;
        match new.len() {
            long if long > room => return Err(Abort::TOO_LONG),
            short if short < room && !may_be_shorter => return Err(Abort::TOO_SHORT),
            _ => {}
        }
        if entry.has(flag::RANGE)
            && let (Some(row), Some(wide)) = (self.device.table.row(entry), new.first_chunk())
        {
            row.check_wide_range(u64::from_le_bytes(*wide))
                .map_err(|exact| self.range_abort(exact))?;
        }
        let mut image = Image::new(self.memory.as_mut());
        if entry.has(flag::ASKS) {
            match owner.write(&image, address, new) {
                Verdict::Accept => {}
                Verdict::Done => {
                    events.changed.insert(entry.class);
                    return Ok(Written::Now);
                }
                Verdict::Refuse(abort) => return Err(abort),
                Verdict::Later => return Ok(Written::Later),
            }
        }
        image.set_bytes(entry.field, new);
        self.replaced(entry.field);
        events.changed.insert(entry.class);
        if entry.has(flag::STORED) {
            self.is_reconfigured = address.index != 0x1020;
        }
        if entry.has(flag::NODE) {
            self.communication_changed(address, now, events);
        }
        Ok(Written::Now)
    }

    fn check_range(&self, entry: &Entry, raw: u32) -> Result<(), Abort> {
        let Some(row) = self.device.table.row(entry) else {
            return Ok(());
        };
        row.check_range(raw)
            .map_err(|exact| self.range_abort(exact))
    }

    pub(crate) fn range_abort(&self, exact: Abort) -> Abort {
        match self.device.dialect.range_abort {
            RangeAbort::TooHighTooLow => exact,
            RangeAbort::Invalid => Abort::INVALID_VALUE,
        }
    }
}
