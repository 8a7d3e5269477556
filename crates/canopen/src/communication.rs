//! The rules of the communication objects 0x1000 to 0x1FFF, which the node judges itself.

use crate::device::PdoObjects;
use crate::emergency::EmergencyQueue;
use crate::outbox::Slot;
use crate::pdo::{Direction, Mapping, Rpdo, Tpdo, is_known_type, mapped_entry};
use crate::sync::SyncConsumer;
use crate::{Abort, Address, CobId, Field, Image, Instant, MAPPED_PER_PDO, Node, NodeMemory, PDOS};

/// Which parameter of which PDO an address is.
struct PdoParameter {
    way: Direction,
    n: usize,
    is_mapping: bool,
}

impl PdoParameter {
    fn of(index: u16) -> Option<PdoParameter> {
        let (way, is_mapping, base) = match index {
            0x1400..=0x15FF => (Direction::Receive, false, 0x1400),
            0x1600..=0x17FF => (Direction::Receive, true, 0x1600),
            0x1800..=0x19FF => (Direction::Transmit, false, 0x1800),
            0x1A00..=0x1BFF => (Direction::Transmit, true, 0x1A00),
            _ => return None,
        };
        let n = usize::from(index - base);
        (n < PDOS).then_some(PdoParameter { way, n, is_mapping })
    }
}

impl<M: NodeMemory> Node<M> {
    /// Whether a value may be written to a communication object.
    pub(crate) fn judge_communication(&self, address: Address, raw: u32) -> Result<(), Abort> {
        match (address.index, address.sub) {
            // Only 0 may be written: it clears the history (CiA 301 7.5.2.4).
            (0x1003, 0) if raw != 0 || !self.device.dialect.history_clearable => {
                Err(Abort::INVALID_VALUE)
            }
            // Bit 30 would make this node the SYNC producer, which it is not.
            (0x1005, 0) if CobId(raw).0 & (1 << 30) != 0 => Err(Abort::INVALID_VALUE),
            (0x1005, 0) => self.judge_cob_id(CobId(raw)),
            (0x1014, 0) => self.judge_emcy(CobId(raw)),
            _ => match PdoParameter::of(address.index) {
                Some(parameter) if parameter.is_mapping => {
                    self.judge_mapping(&parameter, address.sub, raw)
                }
                Some(parameter) => self.judge_pdo(&parameter, address.sub, raw),
                None => Ok(()),
            },
        }
    }

    /// An identifier that a service may be moved onto: 11 bits, not one of the restricted ones.
    fn judge_cob_id(&self, cob_id: CobId) -> Result<(), Abort> {
        let reserved = cob_id.0 & 0x1FFF_F800 != 0 || cob_id.is_extended();
        if reserved || cob_id.is_restricted() {
            Err(Abort::INVALID_VALUE)
        } else {
            Ok(())
        }
    }

    /// Bit 30 is reserved; bits 0 to 29 may not change while the EMCY exists (CiA 301 7.5.2.17).
    fn judge_emcy(&self, new: CobId) -> Result<(), Abort> {
        if new.is_off() {
            return Ok(());
        }
        self.judge_cob_id(new)?;
        let old = match self.device.objects.emcy_cob_id {
            Some(handle) => CobId(self.raw(handle.field())),
            None => new,
        };
        let moves = !old.is_off() && old.id() != new.id();
        if new.0 & (1 << 30) != 0 || (moves && !self.device.dialect.reconfigure_while_valid) {
            return Err(Abort::INVALID_VALUE);
        }
        Ok(())
    }

    fn judge_pdo(&self, parameter: &PdoParameter, sub: u8, raw: u32) -> Result<(), Abort> {
        let Some(objects) = self.pdo_objects(parameter) else {
            return Ok(());
        };
        match sub {
            1 => {
                let new = CobId(raw);
                let lenient = self.device.dialect.reconfigure_while_valid;
                if new.is_off() || (lenient && raw == 0) {
                    return Ok(());
                }
                self.judge_cob_id(new)?;
                // Bits 0 to 29 may not change while the PDO exists (CiA 301 7.5.2.35).
                let old = CobId(self.raw(objects.cob_id.field()));
                let changes = old.id() != new.id();
                if !lenient && !old.is_off() && changes {
                    return Err(Abort::INVALID_VALUE);
                }
                Ok(())
            }
            2 if !is_known_type(raw) => Err(Abort::INVALID_VALUE),
            _ => Ok(()),
        }
    }

    /// The remapping procedure (CiA 301 7.5.2.36): PDO off, sub-index 0 to 0, entries, count, on.
    /// Dialects may do without the first and the last step.
    fn judge_mapping(&self, parameter: &PdoParameter, sub: u8, raw: u32) -> Result<(), Abort> {
        let Some(objects) = self.pdo_objects(parameter) else {
            return Ok(());
        };
        let exists = !CobId(self.raw(objects.cob_id.field())).is_off();
        if exists && !self.device.dialect.reconfigure_while_valid {
            return Err(Abort::UNSUPPORTED_ACCESS);
        }
        if sub == 0 {
            if raw > u32::from(objects.map_entries) {
                return Err(Abort::MAP_TOO_LONG);
            }
            let entries = self.map_entries(objects, raw as u8);
            return Mapping::compile(&self.device.table, entries, parameter.way).map(|_| ());
        }
        if self.raw(objects.map_count.field()) != 0 {
            return Err(Abort::UNSUPPORTED_ACCESS);
        }
        // 0 marks an entry as unused; it counts for nothing unless sub-index 0 includes it.
        if raw == 0 {
            return Ok(());
        }
        mapped_entry(&self.device.table, raw, parameter.way).map(|_| ())
    }

    /// Whether 0x1003,`sub` may be read: an entry that holds no error has no data (CiA 301
    /// 7.5.2.4).
    #[cold]
    pub(crate) fn history_has(&self, sub: u8) -> bool {
        let count = self
            .device
            .objects
            .history_count
            .map_or(u32::MAX, |at| self.raw(at.field()));
        u32::from(sub) <= count
    }

    /// Acts upon a write to a communication object.
    pub(crate) fn communication_changed(&mut self, address: Address, now: Instant) {
        let objects = &self.device.objects;
        match (address.index, address.sub) {
            (0x1003, 0) => {
                for handle in objects.history.iter().flatten() {
                    Image::new(self.memory.as_mut()).set(*handle, 0);
                }
            }
            (0x1005, 0) => self.read_sync_parameters(),
            (0x1014, 0) => self.read_emcy_parameters(),
            (0x1017, 0) => self.read_heartbeat_parameters(now),
            _ => match PdoParameter::of(address.index) {
                // Inhibit time, event timer: nothing that the PDO's course depends on.
                Some(PdoParameter {
                    is_mapping: false, ..
                }) if !matches!(address.sub, 1 | 2) => {}
                Some(PdoParameter {
                    way: Direction::Receive,
                    n,
                    ..
                }) => self.read_rpdo(n),
                Some(PdoParameter {
                    way: Direction::Transmit,
                    n,
                    ..
                }) => self.read_tpdo(n),
                None => {}
            },
        }
    }

    /// Reads every communication parameter from the image: after a start, or after stored values
    /// were put there. A stored mapping that cannot be is an empty one.
    pub(crate) fn read_communication_parameters(&mut self, now: Instant) {
        self.read_sync_parameters();
        self.read_emcy_parameters();
        self.read_heartbeat_parameters(now);
        for n in 0..PDOS {
            self.read_rpdo(n);
            self.read_tpdo(n);
        }
    }

    fn read_sync_parameters(&mut self) {
        let cob_id = self
            .device
            .objects
            .sync_cob_id
            .map_or(0x80, |at| self.raw(at.field()));
        self.sync = SyncConsumer::new(cob_id);
    }

    fn read_emcy_parameters(&mut self) {
        let Some(handle) = self.device.objects.emcy_cob_id else {
            return;
        };
        let cob_id = CobId(self.raw(handle.field()));
        self.emcy_exists = cob_id.is_usable();
        self.outbox.set_id(Slot::Emergency, cob_id.id());
        if !self.emcy_exists {
            self.outbox.withdraw(Slot::Emergency);
            self.emergencies = EmergencyQueue::EMPTY;
        }
    }

    fn read_heartbeat_parameters(&mut self, now: Instant) {
        let period = self
            .device
            .objects
            .heartbeat_ms
            .map_or(0, |at| self.raw(at.field()));
        self.heartbeat.configure(period as u16, now);
    }

    fn read_rpdo(&mut self, n: usize) {
        let Some(objects) = self.device.objects.rpdo.get(n).copied().flatten() else {
            return;
        };
        let transmission_type = self.raw(objects.transmission_type.field()) as u8;
        let mapping = self.read_mapping(&objects, Direction::Receive);
        let rpdo = Rpdo::new(self.pdo_id(&objects), transmission_type, mapping);
        if let Some(place) = self.rpdo.get_mut(n) {
            *place = rpdo;
        }
    }

    fn read_tpdo(&mut self, n: usize) {
        let Some(objects) = self.device.objects.tpdo.get(n).copied().flatten() else {
            return;
        };
        let id = self.pdo_id(&objects);
        let transmission_type = self.raw(objects.transmission_type.field()) as u8;
        let mapping = self.read_mapping(&objects, Direction::Transmit);
        let dialect = &self.device.dialect;
        let tpdo = Tpdo::new(id.is_some(), transmission_type, mapping, dialect);
        // What was sampled under the old parameters is not sent under the new ones.
        self.outbox.withdraw(Slot::Tpdo(n as u8));
        self.outbox.set_id(Slot::Tpdo(n as u8), id.unwrap_or(0));
        if let Some(place) = self.tpdo.get_mut(n) {
            *place = tpdo;
        }
    }

    /// The identifier of a PDO that exists.
    fn pdo_id(&self, objects: &PdoObjects) -> Option<u16> {
        let cob_id = CobId(self.raw(objects.cob_id.field()));
        cob_id.is_usable().then(|| cob_id.id())
    }

    fn read_mapping(&mut self, objects: &PdoObjects, way: Direction) -> Mapping {
        let count = self
            .raw(objects.map_count.field())
            .min(u32::from(objects.map_entries)) as u8;
        let entries = self.map_entries(objects, count);
        match Mapping::compile(&self.device.table, entries, way) {
            Ok(mapping) => mapping,
            Err(_) => {
                Image::new(self.memory.as_mut()).set(objects.map_count, 0);
                Mapping::EMPTY
            }
        }
    }

    /// The first `count` mapping entries.
    fn map_entries(&self, objects: &PdoObjects, count: u8) -> impl Iterator<Item = u32> {
        let mut entries = [0; MAPPED_PER_PDO + 1];
        for (entry, step) in entries.iter_mut().zip(0..u16::from(count)) {
            *entry = self.raw(objects.map_first.nth(step));
        }
        // One more than fits is enough for the compiler to say "too long".
        entries.into_iter().take(usize::from(count))
    }

    fn pdo_objects(&self, parameter: &PdoParameter) -> Option<&'static PdoObjects> {
        let objects = &self.device.objects;
        let all = match parameter.way {
            Direction::Receive => &objects.rpdo,
            Direction::Transmit => &objects.tpdo,
        };
        all.get(parameter.n)?.as_ref()
    }

    fn raw(&self, field: Field) -> u32 {
        crate::image::raw(self.memory.as_ref(), field)
    }
}
