//! What follows from the values of the communication objects.

use super::PdoParameter;
use crate::device::PdoObjects;
use crate::outbox::Slot;
use crate::pdo::{Direction, Mapping, Rpdo, RpdoParameters, Tpdo, TpdoParameters};
use crate::sync::{Sync, SyncParameters};
use crate::{
    Address, CobId, CommunicationErrors, Events, Handle, Image, Instant, NmtState, Node,
    NodeMemory, PDOS, SDO_SERVERS, Wire,
};

impl<M: NodeMemory> Node<M> {
    /// Acts upon a write to a communication object.
    pub(crate) fn communication_changed(
        &mut self,
        address: Address,
        now: Instant,
        events: &mut Events,
    ) {
        let objects = &self.device.objects;
        match (address.index, address.sub) {
            (0x1003, 0) => {
                for handle in objects.history.iter().flatten() {
                    Image::new(self.memory.as_mut()).set(*handle, 0);
                }
            }
            (0x1005..=0x1007 | 0x1019, 0) => self.read_sync_parameters(now, events),
            (0x100C | 0x100D, 0) => self.read_guarding_parameters(events),
            (0x1012, 0) => self.read_time_parameters(),
            (0x1014 | 0x1015, 0) => self.read_emcy_parameters(now),
            (0x1016, _) => {
                self.read_consumers();
                self.sum_up_monitor(events);
            }
            (0x1028, _) => self.read_emcy_consumers(),
            (0x1017, 0) => self.read_heartbeat_parameters(now, events),
            (0x1201..=0x127F, _) => self.read_sdo_parameters(),
            _ => match PdoParameter::of(address.index) {
                Some(PdoParameter {
                    way: Direction::Receive,
                    n,
                    is_mapping,
                }) => {
                    match address.sub {
                        5 if !is_mapping => self.read_rpdo_deadline(n),
                        _ => self.read_rpdo(n),
                    }
                    self.sum_up_errors(events);
                }
                Some(PdoParameter {
                    is_mapping: false,
                    n,
                    ..
                }) if matches!(address.sub, 3 | 5) => self.read_tpdo_times(n, now),
                Some(PdoParameter { n, .. }) => self.read_tpdo(n, now),
                None => {}
            },
        }
        self.due = self.earliest();
    }

    /// Reads every communication parameter from the image: after a start, or after stored values
    /// were put there. A stored mapping that cannot be is an empty one.
    pub(crate) fn read_communication_parameters(&mut self, now: Instant) {
        // A start tells that everything is new.
        let mut events = Events::NOTHING;
        self.read_sync_parameters(now, &mut events);
        self.read_guarding_parameters(&mut events);
        self.read_time_parameters();
        self.read_emcy_parameters(now);
        self.read_consumers();
        self.read_emcy_consumers();
        self.read_heartbeat_parameters(now, &mut events);
        self.read_sdo_parameters();
        for n in 0..PDOS {
            self.read_rpdo(n);
            self.read_tpdo(n, now);
        }
    }

    fn value<T: Wire>(&self, object: Option<Handle<T>>) -> u32 {
        object.map_or(0, |at| self.raw(at.field()))
    }

    fn read_sync_parameters(&mut self, now: Instant, events: &mut Events) {
        let objects = &self.device.objects;
        let dialect = &self.device.dialect;
        let mut cob_id = objects.sync_cob_id.map_or(0x80, |at| self.raw(at.field()));
        if !dialect.produces_sync {
            cob_id &= !(1 << 30);
        }
        let parameters = SyncParameters {
            cob_id: CobId(cob_id),
            period_us: self.value(objects.sync_period_us),
            window_us: self.value(objects.sync_window_us),
            overflow: objects.sync_counter.map(|at| self.raw(at.field()) as u8),
            extended: dialect.extended_identifiers,
        };
        let counted = self.sync.overflow > 1;
        self.sync = Sync::new(&parameters, &self.sync, now);
        self.due = self.due.min(self.sync.due);
        let counts = self.sync.overflow > 1;
        if counted != counts {
            // Start values count with a counter only (CiA 301 7.5.2.37).
            for tpdo in &mut self.tpdo {
                tpdo.count_anew(counts);
            }
        }
        if parameters.window_us == 0 {
            self.note(CommunicationErrors::SYNC_WINDOW, false, events);
        }
        self.outbox.withdraw(Slot::Sync);
        self.outbox.set_key(Slot::Sync, CobId(cob_id).key());
    }

    fn read_emcy_parameters(&mut self, now: Instant) {
        let objects = &self.device.objects;
        let Some(handle) = objects.emcy_cob_id else {
            return;
        };
        let cob_id = CobId(self.raw(handle.field()));
        let dialect = &self.device.dialect;
        self.emcy_exists = dialect.emergencies && cob_id.is_usable(dialect.extended_identifiers);
        self.emergencies.inhibit = match dialect.emcy_inhibit {
            true => self.value(objects.emcy_inhibit) as u16,
            false => 0,
        };
        self.outbox.set_key(Slot::Emergency, cob_id.key());
        if !self.emcy_exists {
            self.outbox.withdraw(Slot::Emergency);
            self.emergencies.clear();
        }
        self.release_emergency(now);
    }

    fn read_heartbeat_parameters(&mut self, now: Instant, events: &mut Events) {
        let period = self.value(self.device.objects.heartbeat_ms);
        self.heartbeat.configure(period as u16, now);
        self.due = self.due.min(self.heartbeat.due);
        if self.heartbeat.is_on() {
            self.end_life_guarding(events);
        }
    }

    /// A server exists while bit 31 of neither of its identifiers is set.
    fn read_sdo_parameters(&mut self) {
        let extended = self.device.dialect.extended_identifiers;
        for (n, objects) in (1..SDO_SERVERS as u8).zip(&self.device.objects.sdo) {
            let Some(objects) = objects else { continue };
            let request = CobId(self.raw(objects.request.field()));
            let reply = CobId(self.raw(objects.reply.field()));
            let exists = [request, reply]
                .iter()
                .all(|cob_id| cob_id.0 != 0 && cob_id.is_usable(extended));
            let server = self.server(n);
            server.request_key = match exists {
                true => request.key(),
                false => CobId::NO_KEY,
            };
            self.outbox.set_key(Slot::Sdo(n), reply.key());
        }
    }

    fn read_rpdo(&mut self, n: usize) {
        let Some(objects) = self.device.objects.rpdo.get(n).copied().flatten() else {
            return;
        };
        let parameters = RpdoParameters {
            transmission_type: self.raw(objects.transmission_type.field()) as u8,
            deadline_ms: self.value(objects.event_timer_ms) as u16,
        };
        let mapping = self.read_mapping(&objects, Direction::Receive);
        let rpdo = Rpdo::new(self.pdo_key(&objects), parameters, mapping);
        if let Some(place) = self.rpdo.get_mut(n) {
            *place = rpdo;
        }
    }

    /// A new deadline begins with the next frame; what waits for a SYNC goes on waiting.
    fn read_rpdo_deadline(&mut self, n: usize) {
        let Some(Some(objects)) = self.device.objects.rpdo.get(n) else {
            return;
        };
        let deadline_ms = self.value(objects.event_timer_ms) as u16;
        if let Some(rpdo) = self.rpdo.get_mut(n) {
            rpdo.set_deadline(deadline_ms);
        }
    }

    fn read_tpdo(&mut self, n: usize, now: Instant) {
        let Some(objects) = self.device.objects.tpdo.get(n).copied().flatten() else {
            return;
        };
        let key = self.pdo_key(&objects);
        let dialect = &self.device.dialect;
        let cob_id = CobId(self.raw(objects.cob_id.field()));
        let parameters = TpdoParameters {
            transmission_type: self.raw(objects.transmission_type.field()) as u8,
            inhibit: self.value(objects.inhibit) as u16,
            event_timer_ms: self.value(objects.event_timer_ms) as u16,
            sync_start: self.value(objects.sync_start) as u8,
            on_request: key.is_some() && dialect.remote_requests && cob_id.0 & 1 << 30 == 0,
        };
        let mapping = self.read_mapping(&objects, Direction::Transmit);
        let mut tpdo = Tpdo::new(key.is_some(), parameters, mapping, dialect);
        tpdo.count_anew(self.sync.overflow > 1);
        let slot = Slot::Tpdo(n as u8);
        let goes_on = key == Some(self.outbox.key(slot)) && !self.outbox.is_waiting(slot);
        // What was sampled under the old parameters is not sent under the new ones.
        self.outbox.withdraw(slot);
        self.outbox.set_key(slot, key.unwrap_or(0));
        if let Some(place) = self.tpdo.get_mut(n) {
            if goes_on {
                tpdo.free_at = place.free_at;
            }
            *place = tpdo;
        }
        self.has_event_pdos = self.tpdo.iter().any(Tpdo::is_sent_by_events);
        if self.state == NmtState::Operational {
            self.start_event_timers(now);
        }
    }

    /// Inhibit time and event timer do not make a PDO count its SYNCs anew.
    fn read_tpdo_times(&mut self, n: usize, now: Instant) {
        let Some(objects) = self.device.objects.tpdo.get(n).copied().flatten() else {
            return;
        };
        let (inhibit, timer) = (
            self.value(objects.inhibit) as u16,
            self.value(objects.event_timer_ms) as u16,
        );
        if let Some(tpdo) = self.tpdo.get_mut(n) {
            tpdo.parameters.inhibit = inhibit;
            tpdo.parameters.event_timer_ms = timer;
            tpdo.timer_due = Instant::NEVER;
        }
        if self.state == NmtState::Operational {
            self.start_event_timers(now);
        }
    }

    /// The key of the frames of a PDO that exists.
    fn pdo_key(&self, objects: &PdoObjects) -> Option<u32> {
        let cob_id = CobId(self.raw(objects.cob_id.field()));
        cob_id
            .is_usable(self.device.dialect.extended_identifiers)
            .then(|| cob_id.key())
    }

    fn read_mapping(&mut self, objects: &PdoObjects, way: Direction) -> Mapping {
        let count = self
            .raw(objects.map_count.field())
            .min(u32::from(objects.map_entries)) as u8;
        let entries = self.map_entries(objects, count);
        match Mapping::compile(self.device, entries, way) {
            Ok(mapping) => mapping,
            Err(_) => {
                Image::new(self.memory.as_mut()).set(objects.map_count, 0);
                Mapping::EMPTY
            }
        }
    }
}
