//! A node: one device on one bus.

use can::Frame;

use crate::emergency::EmergencyQueue;
use crate::heartbeat::Heartbeat;
use crate::nmt::{Command, Reset, command_for};
use crate::outbox::{Outbox, Slot};
use crate::pdo::{Rpdo, Tpdo};
use crate::sdo::SdoConnection;
use crate::sync::SyncConsumer;
use crate::{Changed, Device, Emergency, Image, Instant, NmtState, NodeId, Owner, PDOS};

/// Memory for an image: `[u8; OBJECTS.image_bytes()]`, or anything that lends bytes.
pub trait NodeMemory: AsRef<[u8]> + AsMut<[u8]> {}

impl<T: AsRef<[u8]> + AsMut<[u8]>> NodeMemory for T {}

/// What happened in a call, for the owner to act upon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Events {
    /// Classes of objects that were written.
    pub changed: Changed,
    /// A reset was asked for. The owner builds the node anew.
    pub reset: Option<Reset>,
    /// The NMT state was entered.
    pub entered: Option<NmtState>,
    /// A SYNC was received (in a state that takes it).
    pub sync: bool,
    /// A receive PDO was shorter than its mapping and was not applied; whoever keeps the error
    /// register may announce 0x8210 (CiA 301 table 26).
    pub short_rpdo: bool,
}

impl Events {
    /// Nothing happened.
    pub const NOTHING: Events = Events {
        changed: Changed::NOTHING,
        reset: None,
        entered: None,
        sync: false,
        short_rpdo: false,
    };
}

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
    pub(crate) heartbeat: Heartbeat,
    pub(crate) sync: SyncConsumer,
    pub(crate) sdo: SdoConnection,
    pub(crate) rpdo: [Rpdo; PDOS],
    pub(crate) tpdo: [Tpdo; PDOS],
    pub(crate) emergencies: EmergencyQueue,
    pub(crate) emcy_exists: bool,
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
            heartbeat: Heartbeat::OFF,
            sync: SyncConsumer::new(0x80),
            sdo: SdoConnection::new(id),
            rpdo: [Rpdo::OFF; PDOS],
            tpdo: [Tpdo::OFF; PDOS],
            emergencies: EmergencyQueue::EMPTY,
            emcy_exists: false,
        }
    }

    /// Puts the communication parameters (0x1000 to 0x1FFF) back to what is `stored`, or to their
    /// defaults; all other objects stay. The answer to [`Reset::Communication`]; then
    /// [`Node::start`]. Damaged parameters count as none.
    pub fn restart_communication(&mut self, stored: &[u8]) {
        self.state = NmtState::Initialising;
        self.emergencies = EmergencyQueue::EMPTY;
        self.sdo = SdoConnection::new(self.id);
        let table = &self.device.table;
        let mut image = Image::new(self.memory.as_mut());
        // What cannot be stored is no parameter: the error history and the serial number stay.
        table.communication_defaults(&mut image, self.id);
        let _ = crate::store::load_communication(table, &mut image, stored);
    }

    /// Boots up: reads the communication parameters from the image, posts the boot-up frame and
    /// enters the state that 0x1F80 says. Call once; take the boot-up frame with
    /// [`Node::transmit`].
    pub fn start(&mut self, now: Instant) -> Events {
        let id = u16::from(self.id.get());
        self.outbox = Outbox::EMPTY;
        self.emergencies = EmergencyQueue::EMPTY;
        self.outbox.set_id(Slot::BootUp, 0x700 + id);
        self.outbox.set_id(Slot::Heartbeat, 0x700 + id);
        self.outbox.set_id(Slot::Sdo, self.sdo.reply_id);
        self.read_communication_parameters(now);
        self.outbox.post(Slot::BootUp);
        let startup = self.device.objects.startup;
        // CiA 302-2, 0x1F80: bit 2 set keeps the node from entering operational by itself.
        let stay = startup.is_some_and(|startup| self.image().get(startup) & 4 != 0);
        let operational = self.device.dialect.boots_to_operational && !stay;
        let state = if operational {
            NmtState::Operational
        } else {
            NmtState::PreOperational
        };
        self.enter(state);
        Events {
            entered: Some(state),
            changed: Changed::EVERYTHING,
            ..Events::NOTHING
        }
    }

    /// Takes a frame from the bus. Anything malformed is met with the abort or the silence that
    /// the standard asks for. Afterwards call [`Node::transmit`].
    #[inline]
    pub fn receive<O: Owner>(&mut self, frame: &Frame, now: Instant, owner: &mut O) -> Events {
        let mut events = Events::NOTHING;
        let key = frame.key();
        if key == self.sdo.request_key {
            if self.answers_sdo() {
                self.serve(frame, now, owner, &mut events);
            }
        } else if key == self.sync.key {
            self.synchronise(now, owner, &mut events);
        } else if key == 0 {
            if let Some(command) = command_for(self.id, frame.data()) {
                self.obey(command, &mut events);
            }
        } else if self.state == NmtState::Operational {
            self.receive_pdo(key, frame, now, owner, &mut events);
        }
        events
    }

    /// Does what time asks for. Call at [`Node::next_deadline`].
    #[inline]
    pub fn poll(&mut self, now: Instant) {
        if now >= self.heartbeat.due && self.heartbeat.take_due(now) {
            self.outbox.post(Slot::Heartbeat);
        }
    }

    /// When [`Node::poll`] must be called next; [`Instant::NEVER`] if nothing is due. May become
    /// earlier with every call of [`Node::receive`] or [`Node::start`].
    #[inline]
    pub fn next_deadline(&self) -> Instant {
        self.heartbeat.due
    }

    /// The next frame to send: of those waiting, the one with the lowest identifier. Call until it
    /// gives `None`; call again after any other function.
    #[inline]
    pub fn transmit(&mut self) -> Option<Frame> {
        let (slot, id) = self.outbox.take()?;
        Some(match slot {
            Slot::Sdo => Frame::classic(id, self.sdo.reply, 8),
            Slot::Tpdo(n) => {
                let tpdo = self.tpdo.get(usize::from(n))?;
                Frame::classic(id, tpdo.data.to_le_bytes(), tpdo.mapping.bytes())
            }
            Slot::Emergency => {
                let emergency = self.emergencies.pop()?;
                if !self.emergencies.is_empty() {
                    self.outbox.post(Slot::Emergency);
                }
                Frame::classic(id, emergency.to_bytes(), 8)
            }
            // Boot-up is a heartbeat of value 0 (CiA 301 7.2.8.3.3).
            Slot::BootUp => Frame::classic(id, [0; 8], 1),
            Slot::Heartbeat => Frame::classic(id, [self.state as u8, 0, 0, 0, 0, 0, 0, 0], 1),
        })
    }

    /// Whether [`Node::transmit`] would give nothing.
    #[inline]
    pub fn is_silent(&self) -> bool {
        self.outbox.is_empty()
    }

    /// Announces an error, or the end of one (`code` 0x0000): sends an emergency frame with the
    /// error register `register`, which becomes 0x1001, and puts a code other than 0 in front of
    /// the error history 0x1003.
    pub fn announce(&mut self, code: u16, register: u8, vendor: [u8; 5]) {
        let objects = &self.device.objects;
        let mut image = Image::new(self.memory.as_mut());
        if let Some(handle) = objects.error_register {
            image.set(handle, register);
        }
        if code != 0 {
            let mut newest = u32::from(code);
            let mut count = 0;
            for handle in objects.history.iter().flatten() {
                let older = image.get(*handle);
                image.set(*handle, newest);
                count += 1;
                newest = older;
                if older == 0 {
                    break;
                }
            }
            if let Some(handle) = objects.history_count {
                image.set(handle, count);
            }
        }
        if self.emcy_exists && self.state != NmtState::Initialising {
            self.emergencies.push(Emergency {
                code,
                register,
                vendor,
            });
            self.outbox.post(Slot::Emergency);
        }
    }

    /// Answers the write that the owner judged [`crate::Verdict::Later`]. Does nothing if no such
    /// write waits (its client may have given up). Afterwards call [`Node::transmit`].
    pub fn complete(&mut self, result: Result<(), crate::Abort>) {
        let Some((address, raw)) = self.sdo.waiting.take() else {
            return;
        };
        match result {
            Ok(()) => self.sdo.downloaded(address, raw, &self.device.dialect),
            Err(abort) => self.sdo.aborted(address, abort),
        }
        if self.answers_sdo() {
            self.outbox.post(Slot::Sdo);
        }
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

    /// Frames that were replaced by newer ones before they could be sent, and emergencies that did
    /// not fit the ring.
    pub fn lost_transmissions(&self) -> u32 {
        self.outbox
            .overwritten()
            .wrapping_add(self.emergencies.lost())
    }

    #[inline]
    fn answers_sdo(&self) -> bool {
        matches!(self.state, NmtState::Operational | NmtState::PreOperational)
    }

    /// Whether TPDOs answer SYNC in `state`.
    fn sends_pdos(&self, state: NmtState) -> bool {
        match state {
            NmtState::Operational => true,
            NmtState::PreOperational => self.device.dialect.tpdo_in_pre_operational,
            NmtState::Initialising | NmtState::Stopped => false,
        }
    }

    fn obey(&mut self, command: Command, events: &mut Events) {
        match command {
            Command::Start => self.change_state(NmtState::Operational, events),
            Command::Stop => self.change_state(NmtState::Stopped, events),
            Command::EnterPreOperational => {
                self.change_state(NmtState::PreOperational, events);
            }
            Command::ResetNode => events.reset = Some(Reset::Node),
            Command::ResetCommunication => events.reset = Some(Reset::Communication),
        }
    }

    fn change_state(&mut self, state: NmtState, events: &mut Events) {
        if self.state != state && self.state != NmtState::Initialising {
            self.enter(state);
            events.entered = Some(state);
        }
    }

    fn enter(&mut self, state: NmtState) {
        self.state = state;
        let sends_pdos = self.sends_pdos(state);
        for (n, tpdo) in self.tpdo.iter_mut().enumerate() {
            tpdo.restart();
            if !sends_pdos {
                self.outbox.withdraw(Slot::Tpdo(n as u8));
            }
        }
        for rpdo in &mut self.rpdo {
            rpdo.discard();
        }
        if state == NmtState::Stopped {
            // No SDO in stopped (CiA 301 table 37), so a transfer that waits ends here.
            self.outbox.withdraw(Slot::Sdo);
            self.sdo.waiting = None;
        }
        self.outbox.hold_emergencies(state == NmtState::Stopped);
    }

    fn receive_pdo<O: Owner>(
        &mut self,
        key: u32,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let data = u64::from_le_bytes(frame.bytes());
        let length = frame.len();
        for n in 0..PDOS {
            let Some(rpdo) = self.rpdo.get_mut(n) else {
                return;
            };
            if rpdo.key != key {
                continue;
            }
            // A frame shorter than its mapping is not applied (CiA 301 7.2.2.4); a longer one is,
            // with the bytes that are mapped.
            if length < rpdo.mapping.bytes() {
                events.short_rpdo = true;
                continue;
            }
            if let Some(data) = rpdo.accept(data, &self.device.dialect) {
                self.apply(n, data, now, owner, events);
            }
        }
    }

    fn synchronise<O: Owner>(&mut self, now: Instant, owner: &mut O, events: &mut Events) {
        if matches!(self.state, NmtState::Initialising | NmtState::Stopped) {
            return;
        }
        events.sync = true;
        if self.state == NmtState::Operational {
            for n in 0..PDOS {
                let due = self.rpdo.get_mut(n).and_then(Rpdo::sync);
                if let Some(data) = due {
                    self.apply(n, data, now, owner, events);
                }
            }
        }
        if !self.sends_pdos(self.state) {
            return;
        }
        let mut published = false;
        for (n, tpdo) in self.tpdo.iter_mut().enumerate() {
            if !tpdo.sync() {
                continue;
            }
            if tpdo.mapping.is_live() && !published {
                owner.publish(&mut Image::new(self.memory.as_mut()));
                published = true;
            }
            tpdo.sample(self.memory.as_ref());
            self.outbox.post(Slot::Tpdo(n as u8));
        }
    }
}
