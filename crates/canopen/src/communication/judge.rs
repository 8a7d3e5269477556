//! What may be written to a communication object.

use super::PdoParameter;
use crate::device::PdoObjects;
use crate::pdo::{Direction, Mapping, is_known_type, mapped_entry};
use crate::{Abort, Address, CobId, Handle, Node, NodeId, NodeMemory, SDO_SERVERS};

/// Bits 30 and 31, which say something else in each COB-ID.
const BIT_30: u32 = 1 << 30;
const BIT_31: u32 = 1 << 31;
/// The last SDO server that a node can have.
const LAST_SERVER: u16 = 0x1200 + SDO_SERVERS as u16 - 1;

impl<M: NodeMemory> Node<M> {
    /// Whether a value may be written to a communication object.
    pub(crate) fn judge_communication(&self, address: Address, raw: u32) -> Result<(), Abort> {
        let objects = &self.device.objects;
        match (address.index, address.sub) {
            // Only 0 may be written: it clears the history (CiA 301 7.5.2.4).
            (0x1003, 0) if raw != 0 || !self.device.dialect.history_clearable => {
                Err(Abort::INVALID_VALUE)
            }
            (0x1005, 0) => self.judge_sync(CobId(raw)),
            (0x1012, 0) => self.judge_time(CobId(raw)),
            (0x1014, 0) => self.judge_emcy(CobId(raw)),
            (0x1016, sub) => self.judge_consumer(sub, raw),
            // Not while SYNC has a period; 1 and 241 to 255 are reserved (CiA 301 7.5.2.22).
            (0x1019, 0) => match objects.sync_period_us.map(|at| self.raw(at.field())) {
                Some(period) if period != 0 => Err(Abort::DEVICE_STATE),
                _ if matches!(raw, 0 | 2..=240) => Ok(()),
                _ => Err(Abort::INVALID_VALUE),
            },
            (0x1028, sub) => {
                let old = objects
                    .emcy_consumers
                    .map_or(0, |run| self.raw(run.nth(sub.saturating_sub(1))));
                self.judge_service(CobId(old), CobId(raw))
            }
            // Leave operational, stay, stop; others are reserved (CiA 301 7.5.2.32).
            (0x1029, 1..) if raw > 2 => Err(Abort::INVALID_VALUE),
            (0x1201..=LAST_SERVER, sub @ 1..=2) => self.judge_sdo(address.index, sub, raw),
            _ => match PdoParameter::of(address.index) {
                Some(parameter) if parameter.is_mapping => {
                    self.judge_mapping(&parameter, address.sub, raw)
                }
                Some(parameter) => self.judge_pdo(&parameter, address.sub, raw),
                None => Ok(()),
            },
        }
    }

    /// An identifier that a service may be moved onto: not one of the restricted ones, and of 29
    /// bits only where the device has those.
    fn judge_cob_id(&self, cob_id: CobId) -> Result<(), Abort> {
        let strange = cob_id.is_extended() && !self.device.dialect.extended_identifiers;
        if strange || cob_id.has_stray_bits() || cob_id.is_restricted() {
            Err(Abort::INVALID_VALUE)
        } else {
            Ok(())
        }
    }

    /// A COB-ID whose bit 31 switches its service off and whose bit 30 is reserved: bits 0 to 29
    /// may not change while it is on.
    fn judge_service(&self, old: CobId, new: CobId) -> Result<(), Abort> {
        if new.is_off() {
            return Ok(());
        }
        self.judge_cob_id(new)?;
        if new.0 & BIT_30 != 0 || (old.0 != 0 && !old.is_off() && differ(old, new)) {
            return Err(Abort::INVALID_VALUE);
        }
        Ok(())
    }

    /// Bit 30 makes this node the producer; bits 0 to 29 may not change while it is (CiA 301
    /// 7.5.2.5).
    fn judge_sync(&self, new: CobId) -> Result<(), Abort> {
        let objects = &self.device.objects;
        let produces = new.0 & BIT_30 != 0;
        if produces && !(self.device.dialect.produces_sync && objects.sync_period_us.is_some()) {
            return Err(Abort::INVALID_VALUE);
        }
        self.judge_cob_id(new)?;
        let old = self.cob_id(objects.sync_cob_id, new);
        if old.0 & BIT_30 != 0 && produces && differ(old, new) {
            return Err(Abort::INVALID_VALUE);
        }
        Ok(())
    }

    /// Bit 31 consumes, bit 30 produces; bits 0 to 29 may not change while one of them is set (CiA
    /// 301 7.5.2.15).
    fn judge_time(&self, new: CobId) -> Result<(), Abort> {
        self.judge_cob_id(new)?;
        let old = self.cob_id(self.device.objects.time_cob_id, new);
        let on = BIT_30 | BIT_31;
        if old.0 & on != 0 && new.0 & on != 0 && differ(old, new) {
            return Err(Abort::INVALID_VALUE);
        }
        Ok(())
    }

    /// Bit 30 is reserved; bits 0 to 29 may not change while the EMCY exists (CiA 301 7.5.2.17).
    fn judge_emcy(&self, new: CobId) -> Result<(), Abort> {
        let old = match self.device.dialect.reconfigure_while_valid {
            true => CobId(BIT_31),
            false => self.cob_id(self.device.objects.emcy_cob_id, new),
        };
        self.judge_service(old, new)
    }

    /// A node may be listened for once only (CiA 301 7.5.2.19).
    fn judge_consumer(&self, sub: u8, raw: u32) -> Result<(), Abort> {
        let Some(run) = self.device.objects.heartbeat_consumers else {
            return Ok(());
        };
        if raw >> 24 != 0 {
            return Err(Abort::INVALID_VALUE);
        }
        let (node, time) = ((raw >> 16) as u8, raw as u16);
        if NodeId::new(node).is_none() || time == 0 {
            return Ok(());
        }
        let twice = (0..run.count)
            .filter(|n| n.saturating_add(1) != sub)
            .map(|n| self.raw(run.nth(n)))
            .any(|other| (other >> 16) as u8 == node && other as u16 != 0);
        if twice {
            Err(Abort::PARAMETER_INCOMPATIBLE)
        } else {
            Ok(())
        }
    }

    /// Bits 0 to 29 may not change while the server exists, which it does while bit 31 of neither
    /// identifier is set (CiA 301 7.5.2.33).
    fn judge_sdo(&self, index: u16, sub: u8, raw: u32) -> Result<(), Abort> {
        let n = usize::from(index - 0x1201);
        let Some(Some(objects)) = self.device.objects.sdo.get(n) else {
            return Ok(());
        };
        let (request, reply) = (
            CobId(self.raw(objects.request.field())),
            CobId(self.raw(objects.reply.field())),
        );
        let old = match (request.is_off() || reply.is_off(), sub) {
            (true, _) => CobId(BIT_31),
            (false, 1) => request,
            (false, _) => reply,
        };
        self.judge_service(old, CobId(raw))
    }

    fn judge_pdo(&self, parameter: &PdoParameter, sub: u8, raw: u32) -> Result<(), Abort> {
        let Some(objects) = self.pdo_objects(parameter) else {
            return Ok(());
        };
        let dialect = &self.device.dialect;
        let old = CobId(self.raw(objects.cob_id.field()));
        let fixed = !old.is_off() && !dialect.reconfigure_while_valid;
        let is_transmit = parameter.way == Direction::Transmit;
        match sub {
            1 => {
                let new = CobId(raw);
                if is_transmit && dialect.tpdo_forbids_remote && new.0 & BIT_30 == 0 {
                    return Err(Abort::INVALID_VALUE);
                }
                let lenient = dialect.reconfigure_while_valid;
                if new.is_off() || (lenient && raw == 0) {
                    return Ok(());
                }
                self.judge_cob_id(new)?;
                // Bits 0 to 29 may not change while the PDO exists (CiA 301 7.5.2.35).
                if fixed && differ(old, new) {
                    return Err(Abort::INVALID_VALUE);
                }
                Ok(())
            }
            2 if !is_known_type(raw, parameter.way, dialect.remote_requests) => {
                Err(Abort::INVALID_VALUE)
            }
            // Nor may inhibit time and SYNC start value (CiA 301 7.5.2.37).
            3 if is_transmit && fixed && self.has_changed(objects.inhibit, raw) => {
                Err(Abort::INVALID_VALUE)
            }
            6 if is_transmit && fixed && self.has_changed(objects.sync_start, raw) => {
                Err(Abort::INVALID_VALUE)
            }
            6 if is_transmit && raw > 240 => Err(Abort::INVALID_VALUE),
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
            return self.judge_count(objects, parameter.way, raw);
        }
        if self.raw(objects.map_count.field()) != 0 {
            return Err(Abort::UNSUPPORTED_ACCESS);
        }
        // 0 marks an entry as unused; it counts for nothing unless sub-index 0 includes it.
        if raw == 0 {
            return Ok(());
        }
        mapped_entry(self.device, raw, parameter.way).map(|_| ())
    }

    fn judge_count(&self, objects: &PdoObjects, way: Direction, raw: u32) -> Result<(), Abort> {
        if raw > u32::from(objects.map_entries) {
            return Err(Abort::MAP_TOO_LONG);
        }
        let entries = self.map_entries(objects, raw as u8);
        Mapping::compile(self.device, entries, way).map(|_| ())
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

    fn has_changed<T: crate::Wire>(&self, object: Option<Handle<T>>, new: u32) -> bool {
        object.is_some_and(|at| self.raw(at.field()) != new)
    }

    fn cob_id(&self, object: Option<Handle<u32>>, otherwise: CobId) -> CobId {
        object.map_or(otherwise, |at| CobId(self.raw(at.field())))
    }
}

/// Whether two COB-IDs have different identifiers.
fn differ(old: CobId, new: CobId) -> bool {
    old.key() != new.key()
}
