//! A node: one device on one bus.

use can::Frame;

use crate::emergency::EmergencyQueue;
use crate::guarding::Guarding;
use crate::heartbeat::Heartbeat;
use crate::monitor::{Consumer, MONITORED};
use crate::nmt::command_for;
use crate::outbox::{Outbox, Slot};
use crate::pdo::{Rpdo, Tpdo};
use crate::sdo::SdoServer;
use crate::sync::Sync;
use crate::time_stamp::TimeStamp;
use crate::{
    Changed, CommunicationErrors, Device, Emergency, Events, Image, Instant, News, NmtState,
    NodeId, Owner, PDOS, SDO_SERVERS,
};

/// Memory for an image: `[u8; OBJECTS.image_bytes()]`, or anything that lends bytes.
pub trait NodeMemory: AsRef<[u8]> + AsMut<[u8]> {}

impl<T: AsRef<[u8]> + AsMut<[u8]>> NodeMemory for T {}

/// Bit 30 of [`Frame::key`]: a remote request.
const REMOTE: u32 = 1 << 30;

/// A CANopen node.
///
/// Build it with [`Node::new`], put stored parameters into its image ([`crate::store::load`]), and
/// [`Node::start`] it. From then on, after each call of any function, take frames with
/// [`Node::transmit`] until it gives `None`, and call [`Node::poll`] at [`Node::next_deadline`].
/// A call that comes too early or too often changes nothing.
#[derive(Clone, Debug)]
pub struct Node<M> {
    pub(crate) device: &'static Device,
    pub(crate) memory: M,
    pub(crate) id: NodeId,
    pub(crate) state: NmtState,
    pub(crate) outbox: Outbox,
    /// When time asks for something next; never later than that.
    pub(crate) due: Instant,
    pub(crate) heartbeat: Heartbeat,
    pub(crate) guarding: Guarding,
    pub(crate) monitor: [Consumer; MONITORED],
    pub(crate) sync: Sync,
    pub(crate) time: TimeStamp,
    pub(crate) servers: [SdoServer; SDO_SERVERS],
    /// The server whose write the owner has not answered yet.
    pub(crate) waiting: Option<u8>,
    /// The server that uses the room where strings are gathered.
    pub(crate) gathering: Option<u8>,
    pub(crate) rpdo: [Rpdo; PDOS],
    /// A receive PDO may hold data for a SYNC.
    pub(crate) rpdo_waits: bool,
    pub(crate) tpdo: [Tpdo; PDOS],
    /// A transmit PDO is sent by events.
    pub(crate) has_event_pdos: bool,
    pub(crate) emergencies: EmergencyQueue,
    pub(crate) emcy_exists: bool,
    /// 0x1028 names a node whose emergencies are listened for.
    pub(crate) hears_emergencies: bool,
    pub(crate) received: Option<(NodeId, Emergency)>,
    /// Errors of SYNC and error control; those of the PDOs are with them.
    pub(crate) service_errors: CommunicationErrors,
    pub(crate) errors: CommunicationErrors,
    /// A parameter was written since 0x1020 was.
    pub(crate) is_reconfigured: bool,
}

impl<M: NodeMemory> Node<M> {
    /// A node with every object at its default, silent until [`Node::start`].
    ///
    /// `memory` holds at least `device.table.image_bytes()` bytes; objects past its end read as 0
    /// and do not keep what is written.
    pub fn new(device: &'static Device, mut memory: M, id: NodeId) -> Node<M> {
        device.table.defaults(&mut Image::new(memory.as_mut()), id);
        Node {
            device,
            memory,
            id,
            state: NmtState::Initialising,
            outbox: Outbox::EMPTY,
            due: Instant::NEVER,
            heartbeat: Heartbeat::OFF,
            guarding: Guarding::OFF,
            monitor: [Consumer::OFF; MONITORED],
            sync: Sync::DEFAULT,
            time: TimeStamp::OFF,
            servers: [SdoServer::OFF; SDO_SERVERS],
            waiting: None,
            gathering: None,
            rpdo: [Rpdo::OFF; PDOS],
            rpdo_waits: false,
            tpdo: [Tpdo::OFF; PDOS],
            has_event_pdos: false,
            emergencies: EmergencyQueue::EMPTY,
            emcy_exists: false,
            hears_emergencies: false,
            received: None,
            service_errors: CommunicationErrors::NOTHING,
            errors: CommunicationErrors::NOTHING,
            is_reconfigured: false,
        }
    }

    /// Puts the communication parameters (0x1000 to 0x1FFF) back to what is `stored`, or to their
    /// defaults for the node ID `id`, which may be a new one; all other objects stay. The answer to
    /// [`crate::Reset::Communication`]; then [`Node::start`]. Damaged parameters count as none.
    /// Transfers to streams are over; their owner is not told.
    pub fn restart_communication(&mut self, stored: &[u8], id: NodeId) {
        // Silent until the start, whatever was due or waits.
        self.state = NmtState::Initialising;
        self.outbox = Outbox::EMPTY;
        self.due = Instant::NEVER;
        self.waiting = None;
        self.id = id;
        self.emergencies = EmergencyQueue::EMPTY;
        let before = self.verification();
        let table = &self.device.table;
        let mut image = Image::new(self.memory.as_mut());
        // What cannot be stored is no parameter: the error history and the serial number stay.
        table.communication_defaults(&mut image, id);
        let _ = crate::store::load_communication(table, &mut image, stored);
        // Another 0x1020 than the last written knows nothing of the application's parameters,
        // which stay.
        self.is_reconfigured |= self.verification() != before;
    }

    /// Boots up: reads the communication parameters from the image, posts the boot-up frame and
    /// enters the state that 0x1F80 says. Call once; take the boot-up frame with
    /// [`Node::transmit`].
    pub fn start(&mut self, now: Instant) -> Events {
        let id = u32::from(self.id.get());
        self.outbox = Outbox::EMPTY;
        self.emergencies = EmergencyQueue::EMPTY;
        self.servers = [SdoServer::OFF; SDO_SERVERS];
        *self.server(0) = SdoServer::default_of(self.id);
        (self.waiting, self.gathering) = (None, None);
        self.guarding = Guarding::OFF;
        self.monitor = [Consumer::OFF; MONITORED];
        self.sync = Sync::DEFAULT;
        self.time = TimeStamp::OFF;
        self.received = None;
        self.service_errors = CommunicationErrors::NOTHING;
        self.errors = CommunicationErrors::NOTHING;
        self.outbox.set_key(Slot::BootUp, 0x700 + id);
        self.outbox.set_key(Slot::ErrorControl, 0x700 + id);
        self.outbox.set_key(Slot::Sdo(0), 0x580 + id);
        self.read_communication_parameters(now);
        self.outbox.post(match self.device.dialect.boot_up {
            true => Slot::BootUp,
            false => Slot::ErrorControl,
        });
        let startup = self.device.objects.startup;
        // CiA 302-2, 0x1F80: bit 2 set keeps the node from entering operational by itself.
        let stay = startup.is_some_and(|startup| self.image().get(startup) & 4 != 0);
        let operational = self.device.dialect.boots_to_operational && !stay;
        let state = if operational {
            NmtState::Operational
        } else {
            NmtState::PreOperational
        };
        let mut events = Events {
            entered: Some(state),
            changed: Changed::EVERYTHING,
            ..Events::NOTHING
        };
        self.enter(state, now, &mut events);
        self.due = self.earliest();
        events
    }

    /// Takes a frame from the bus. Anything malformed is met with the abort or the silence that
    /// the standard asks for. Afterwards call [`Node::transmit`].
    #[inline]
    pub fn receive<O: Owner>(&mut self, frame: &Frame, now: Instant, owner: &mut O) -> Events {
        let key = frame.key();
        if key == self.server(0).request_key && self.upload_at_once(0, frame, owner) {
            return Events::NOTHING;
        }
        self.receive_any(key, frame, now, owner)
    }

    fn receive_any<O: Owner>(
        &mut self,
        key: u32,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
    ) -> Events {
        let mut events = Events::NOTHING;
        if key == self.sync.key {
            self.receive_sync(frame, now, owner, &mut events);
        } else if key == self.server(0).request_key {
            if self.answers_sdo() {
                self.serve(0, frame, now, owner, &mut events);
            }
        } else if key == 0 {
            if let Some(command) = command_for(self.id, frame.data()) {
                self.obey(command, now, owner, &mut events);
            }
        } else {
            let is_mine = self.state == NmtState::Operational
                && self.receive_pdo(key, frame, now, owner, &mut events);
            if !is_mine {
                self.receive_other(key, frame, now, owner, &mut events);
            }
        }
        events
    }

    /// Frames that are rarer than SDO, SYNC and PDO, or not for this node.
    #[cold]
    fn receive_other<O: Owner>(
        &mut self,
        key: u32,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        if self.state == NmtState::Initialising {
            return;
        }
        let identifier = key & !REMOTE;
        if key & REMOTE != 0 {
            if identifier == 0x700 + u32::from(self.id.get()) {
                self.guarded(now, events);
            } else if self.state == NmtState::Operational {
                self.request_pdo(identifier, now, owner);
            }
            return;
        }
        if self.answers_sdo() {
            for n in 1..SDO_SERVERS as u8 {
                if key == self.server(n).request_key {
                    return self.serve(n, frame, now, owner, events);
                }
            }
        }
        if key == self.time.key {
            if self.receive_time(frame.data(), now) {
                events.news.insert(News::TIME);
            }
        } else if self.state != NmtState::Stopped
            && self.receive_emergency(key, frame.data(), events)
        {
            // Noted.
        } else if let 0x701..=0x77F = key
            && let (Some(node), &[byte]) = (NodeId::new((key & 0x7F) as u8), frame.data())
        {
            self.heard(node, byte, now, events);
        }
    }

    /// Does what time asks for. Call at [`Node::next_deadline`]; afterwards [`Node::transmit`].
    #[inline]
    pub fn poll<O: Owner>(&mut self, now: Instant, owner: &mut O) -> Events {
        if now < self.due {
            return Events::NOTHING;
        }
        self.poll_due(now, owner)
    }

    fn poll_due<O: Owner>(&mut self, now: Instant, owner: &mut O) -> Events {
        let mut events = Events::NOTHING;
        if self.state == NmtState::Initialising {
            return events;
        }
        // "Never" does not come, not even at the end of time.
        let is_due = |at: Instant| now >= at && at != Instant::NEVER;
        if self.heartbeat.take_due(now) {
            self.outbox.post(Slot::ErrorControl);
        }
        if is_due(self.sync.window_due()) {
            self.close_window(&mut events);
        }
        if is_due(self.sync.due) {
            self.produce_sync(now, owner, &mut events);
        }
        if self.state == NmtState::Operational {
            self.send_due_events(now, owner);
            self.check_deadlines(now, &mut events);
        }
        if is_due(self.guarding.due) {
            self.guard_lost(now, owner, &mut events);
        }
        self.check_heartbeats(now, owner, &mut events);
        if is_due(self.emergencies.due) {
            self.release_emergency(now);
        }
        self.give_clients_up(now, owner);
        self.due = self.earliest();
        events
    }

    /// The earliest time that any service waits for.
    pub(crate) fn earliest(&self) -> Instant {
        let mut next = self
            .heartbeat
            .due
            .min(self.sync.due)
            .min(self.sync.window_due())
            .min(self.guarding.due)
            .min(self.emergencies.due);
        for server in &self.servers {
            next = next.min(server.due);
        }
        for consumer in &self.monitor {
            next = next.min(consumer.due);
        }
        if self.state == NmtState::Operational {
            for rpdo in &self.rpdo {
                next = next.min(rpdo.deadline);
            }
            next = next.min(self.next_event_due());
        }
        next
    }

    /// When [`Node::poll`] must be called next; [`Instant::NEVER`] if nothing is due. May become
    /// earlier with every call of another function, [`Node::transmit`] among them: an emergency
    /// that has left makes a poll due at once, from which its inhibit time (0x1015) counts.
    #[inline]
    pub fn next_deadline(&self) -> Instant {
        self.due
    }

    /// The next frame to send: of those waiting, the one with the lowest identifier. Segments of a
    /// block are read from their `owner` here, one a call. Call until it gives `None`; call again
    /// after any other function.
    #[inline]
    pub fn transmit<O: Owner>(&mut self, owner: &mut O) -> Option<Frame> {
        let (slot, key) = self.outbox.take()?;
        if let Slot::Tpdo(n) = slot
            && let Some(tpdo) = self.tpdo.get(usize::from(n))
        {
            let data = tpdo.data.to_le_bytes();
            return Some(Frame::keyed(key, data, tpdo.mapping.bytes()));
        }
        if let Slot::Sdo(n) = slot
            && let Some(answer) = self.sdo_answer(n)
        {
            return Some(Frame::keyed(key, answer, 8));
        }
        self.rare_frame(slot, key, owner)
    }

    // Kept out of the way of the others, which need no registers saved for it.
    #[cold]
    #[inline(never)]
    fn rare_frame<O: Owner>(&mut self, slot: Slot, key: u32, owner: &mut O) -> Option<Frame> {
        Some(match slot {
            Slot::Sdo(n) => Frame::keyed(key, self.next_segment(n, owner), 8),
            Slot::Emergency => Frame::keyed(key, self.take_emergency()?.to_bytes(), 8),
            // Boot-up is a heartbeat of value 0 (CiA 301 7.2.8.3.3).
            Slot::BootUp => Frame::keyed(key, [0; 8], 1),
            Slot::ErrorControl => {
                let state = self.state as u8;
                let byte = match self.guarding.is_answer {
                    true => self.guarding.answer(state),
                    false => state,
                };
                Frame::keyed(key, [byte, 0, 0, 0, 0, 0, 0, 0], 1)
            }
            Slot::Sync => self.sync.frame(key),
            Slot::Time => {
                let [t0, t1, t2, t3, t4, t5] = self.time.sent.to_bytes();
                Frame::keyed(key, [t0, t1, t2, t3, t4, t5, 0, 0], 6)
            }
            Slot::Tpdo(_) => return None,
        })
    }

    /// Whether [`Node::transmit`] would give nothing.
    #[inline]
    pub fn is_silent(&self) -> bool {
        self.outbox.is_empty()
    }

    /// The values of the dictionary.
    #[inline]
    pub fn image(&mut self) -> Image<'_> {
        Image::new(self.memory.as_mut())
    }

    /// The values' bytes.
    pub fn bytes(&self) -> &[u8] {
        self.memory.as_ref()
    }

    /// What kind of device this is.
    pub fn device(&self) -> &'static Device {
        self.device
    }

    /// The node ID.
    pub fn id(&self) -> NodeId {
        self.id
    }

    /// The NMT state.
    pub fn state(&self) -> NmtState {
        self.state
    }

    /// The communication errors that are there now.
    pub fn errors(&self) -> CommunicationErrors {
        self.errors
    }

    /// Date and time in 0x1020.
    fn verification(&self) -> [u32; 2] {
        let run = self.device.objects.verification;
        [0, 1].map(|n| match run {
            Some(run) if n < run.count => self.raw(run.nth(n)),
            _ => 0,
        })
    }

    /// What is about to be stored becomes what the device boots with. If a parameter was written
    /// since 0x1020 (verify configuration) was, that object becomes 0 (CiA 301 7.5.2.23): whoever
    /// verifies the configuration sees that it is another one.
    pub fn withdraw_verification(&mut self) {
        if let Some(run) = self.device.objects.verification
            && core::mem::take(&mut self.is_reconfigured)
        {
            let mut image = Image::new(self.memory.as_mut());
            for n in 0..run.count {
                image.set_raw(run.nth(n), 0);
            }
        }
    }

    /// Frames that were replaced by newer ones before they could be sent, and emergencies that did
    /// not fit the ring.
    pub fn lost_transmissions(&self) -> u32 {
        self.outbox
            .overwritten()
            .wrapping_add(self.emergencies.lost())
    }

    #[inline]
    pub(crate) fn answers_sdo(&self) -> bool {
        matches!(self.state, NmtState::Operational | NmtState::PreOperational)
    }

    /// Notes that a communication error is there, or is not.
    pub(crate) fn note(&mut self, error: CommunicationErrors, is: bool, events: &mut Events) {
        if self.service_errors.has(error) != is {
            self.service_errors.set(error, is);
            self.sum_up_errors(events);
        }
    }
}
