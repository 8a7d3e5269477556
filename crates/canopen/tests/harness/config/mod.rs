//! A device with everything, driven by bytes: PDOs are configured, mapped anew and used, SYNC,
//! guarding and heartbeats come and go, time passes. Every configuration is judged by a model that
//! was written from CiA 301, every frame by what may be sent, with which data and when.
//!
//! The first byte's bit 0 says whether the host takes each frame at once; only then its data and
//! its time can be told.

mod clock;
mod frames;
mod model;
mod script;

use can::Frame;
use canopen::{CommunicationErrors, Events, Instant, News, NmtState, Node, NodeId, TimeOfDay};

use super::full::FULL;
use super::stand::{Host, ID};
use clock::Clock;
use frames::{SENDERS, Sender};
use model::{Pdo, Services};

pub use model::Parameter;
pub use script::{Doing, OBJECTS};

/// Does what `input` says and checks what must hold.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let Some((first, mut rest)) = input.split_first() else {
        return;
    };
    let start = (first & 2 != 0).then_some(START).into_iter();
    let doings = core::iter::from_fn(|| script::doing(&mut rest));
    let mut world = play(first & 1 != 0, start.chain(doings));
    world.check_parameters(usize::from(first >> 2 & 7));
}

/// Leads into operational.
pub const START: Doing = Doing::Command(0x01);

/// Does all of `doings`, for a host that takes each frame at once or not.
///
/// # Panics
/// If a rule is broken.
pub fn play(eager: bool, doings: impl Iterator<Item = Doing>) -> World {
    let mut world = World::new(eager);
    doings.for_each(|doing| world.act(doing));
    world.act(Doing::Take(true));
    world
}

/// The node, and what is known of it from outside.
#[derive(Debug)]
pub struct World {
    node: Node<Vec<u8>>,
    host: Host,
    now: Instant,
    pdos: [Pdo; 8],
    services: Services,
    /// Frames are taken as soon as they are there.
    eager: bool,
    /// The boot-up frame was not taken yet.
    boots: bool,
    /// An SDO answer was not taken yet.
    answer: Option<[u8; 8]>,
    awaits_answer: bool,
    clock: Clock,
}

impl World {
    fn new(eager: bool) -> World {
        let id = NodeId::new(ID as u8).expect("a node ID");
        let mut world = World {
            node: Node::new(&FULL, vec![0; FULL.table.image_bytes()], id),
            host: Host::default(),
            now: Instant(1_000),
            pdos: core::array::from_fn(|n| Pdo::new(n as u16)),
            services: Services::DEFAULT,
            eager,
            boots: true,
            answer: None,
            awaits_answer: false,
            clock: Clock::default(),
        };
        world.node.start(world.now);
        world
    }

    fn act(&mut self, doing: Doing) {
        match doing {
            Doing::Write(n, parameter, value) => self.write_pdo(n, parameter, value),
            Doing::Remap(n, cob_id, transmission_type, objects, count) => {
                let old = self.pdos[n].cob_id;
                self.write_pdo(n, Parameter::CobId, old | 1 << 31);
                self.write_pdo(n, Parameter::Type, transmission_type.into());
                self.write_pdo(n, Parameter::Count, 0);
                for (object, sub) in objects.iter().zip(1..=count) {
                    let entry = OBJECTS[usize::from(object & 31)];
                    self.write_pdo(n, Parameter::Entry(sub), entry);
                }
                self.write_pdo(n, Parameter::Count, count.into());
                self.write_pdo(n, Parameter::CobId, cob_id);
            }
            Doing::Parameter(index, sub, value) => {
                if self.write(index, sub, value) == Some(Ok(())) {
                    self.services.set(index, value & self.mask(index, sub));
                    self.clock.parameter(index, &self.services, self.now);
                }
            }
            Doing::Command(command) => {
                self.give(&Frame::classic(0, [command, ID as u8, 0, 0, 0, 0, 0, 0], 2));
            }
            Doing::Receive(frame) => self.receive(&frame),
            Doing::Rpdo(n, length, data) => {
                let key = self.pdos[n].key();
                self.receive(&Frame::keyed(key, data, length));
            }
            Doing::Request(n) => {
                let key = self.pdos[4 + n].key();
                let id = can::StandardId::new(key as u16 & 0x7FF).expect("11 bits");
                let wide = can::ExtendedId::new(key & 0x1FFF_FFFF).expect("29 bits");
                let frame = match key >> 31 {
                    0 => Frame::remote_frame(id, 8),
                    _ => Frame::remote_frame(wide, 8),
                };
                self.receive(&frame.expect("a frame"));
            }
            Doing::Wait(ns) => self.wait(ns),
            Doing::Sleep(ns) => {
                self.now = self.now.plus_ns(ns);
                self.poll(false);
            }
            Doing::Poll => self.spurious_poll(),
            Doing::Set(object, value) => self.set(OBJECTS[usize::from(object & 31)], value),
            Doing::Detect => self.node.detect_events(self.now, &mut self.host),
            Doing::Trigger(n) => self.node.trigger(n, self.now, &mut self.host),
            Doing::Announce(code) => self.node.announce(code, code as u8, [0; 5], self.now),
            Doing::Time(ms) => {
                let talks = self.talks();
                assert!(!self.node.send_time(TimeOfDay { ms, days: 1 }) || talks);
            }
            Doing::Take(false) => {
                self.take(true);
            }
            Doing::Take(true) => self.take_all(true),
            Doing::Restart => {
                let id = self.node.id();
                self.node.restart_communication(&[], id);
                assert!(self.node.is_silent() && self.node.next_deadline() == Instant::NEVER);
                self.node.start(self.now);
                self.pdos = core::array::from_fn(|n| Pdo::new(n as u16));
                self.services = Services::DEFAULT;
                self.boots = true;
                self.clock = Clock::default();
            }
        }
        if self.eager {
            self.take_all(true);
        }
        self.check_errors();
    }

    fn talks(&self) -> bool {
        matches!(
            self.node.state(),
            NmtState::Operational | NmtState::PreOperational
        )
    }

    /// The bits that an object has.
    fn mask(&self, index: u16, sub: u8) -> u32 {
        let found = FULL.table.find(index, sub).expect("an object");
        u32::MAX >> (32 - 8 * u32::from(found.field.size()))
    }

    fn value(&mut self, index: u16, sub: u8) -> u64 {
        let field = FULL.table.find(index, sub).expect("an object").field;
        self.node.image().wide(field)
    }

    fn set(&mut self, entry: u32, value: u64) {
        if entry >> 16 == 0x2008 {
            self.host.position = value as i32;
            return;
        }
        let (index, sub) = ((entry >> 16) as u16, (entry >> 8) as u8);
        let Ok(found) = FULL.table.find(index, sub) else {
            return;
        };
        let mask = u64::MAX >> (64 - u32::from(found.field.data_type().bits()));
        let bytes = (value & mask).to_le_bytes();
        self.node.image().set_bytes(found.field, &bytes);
    }

    /// Requests of SDO would change what the model does not know of, and LSS is tested elsewhere.
    fn receive(&mut self, frame: &Frame) {
        if !matches!(frame.key(), 0x605 | 0x7E5) {
            self.give(frame);
        }
    }

    fn give(&mut self, frame: &Frame) {
        let before = self.node.errors();
        let events = self.node.receive(frame, self.now, &mut self.host);
        self.told(&events, before);
    }

    /// What events tell is so.
    fn told(&mut self, events: &Events, before: CommunicationErrors) {
        let (told, changed) = (events.news.has(News::ERRORS), before != self.node.errors());
        // One may come and go in one call: with the state, or with two RPDOs of one identifier.
        assert!(told || !changed, "errors that nobody is told of");
        if let Some(state) = events.entered {
            assert_eq!(state, self.node.state());
            self.clock.entered(state, self.now);
        }
    }

    fn poll(&mut self, in_time: bool) {
        let before = self.node.errors();
        let events = self.node.poll(self.now, &mut self.host);
        self.told(&events, before);
        if self.eager {
            self.take_all(in_time);
            if self.node.next_deadline() == Instant::ZERO {
                // An emergency that has left asks for the time, once, and nothing else.
                let events = self.node.poll(self.now, &mut self.host);
                assert!(events == Events::NOTHING && self.node.is_silent());
            }
        }
        let deadline = self.node.next_deadline();
        assert!(
            deadline > self.now || self.now == Instant::NEVER,
            "a deadline that was met"
        );
        self.clock.passed(self.now);
        assert!(
            deadline <= self.clock.next(),
            "a deadline that will be missed"
        );
        if self.eager && self.node.state() == NmtState::Operational {
            for n in (0..4).filter(|n| self.is_known(Sender::Tpdo(*n))) {
                self.clock.check_timer(n, &self.pdos[4 + n], self.now);
            }
        }
    }

    /// A host that polls at each deadline; after many of them it is busy until the end.
    fn wait(&mut self, ns: u64) {
        let end = self.now.plus_ns(ns);
        let mut polls = 0;
        while self.node.next_deadline() <= end && polls < 50 && end != Instant::NEVER {
            let late = self.node.next_deadline() < self.now;
            self.now = self.now.max(self.node.next_deadline());
            self.poll(!late);
            polls += 1;
        }
        self.now = end;
        self.poll(polls < 50);
    }

    fn spurious_poll(&mut self) {
        self.poll(false);
        let before = (self.node.clone(), self.host.publications);
        assert_eq!(self.node.poll(self.now, &mut self.host), Events::NOTHING);
        let node = &self.node;
        assert_eq!(before.0.bytes(), node.bytes());
        assert_eq!(before.0.next_deadline(), node.next_deadline());
        assert_eq!(before.0.state(), node.state());
        assert_eq!(before.0.is_silent(), node.is_silent());
        assert_eq!(before.0.lost_transmissions(), node.lost_transmissions());
        assert_eq!(before.1, self.host.publications);
    }

    /// Writes by SDO; `None` if no SDO is answered in this state.
    fn write(&mut self, index: u16, sub: u8, value: u32) -> Option<Result<(), u32>> {
        if !self.talks() {
            return None;
        }
        self.take_all(true);
        let [low, high] = index.to_le_bytes();
        let size = FULL
            .table
            .find(index, sub)
            .map_or(4, |found| found.field.size());
        let bytes = value.to_le_bytes();
        let mut request = [0x23 | (4 - size) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + usize::from(size)].copy_from_slice(&bytes[..usize::from(size)]);
        self.awaits_answer = true;
        self.give(&Frame::classic(0x605, request, 8));
        self.take_all(true);
        let answer = self.answer.take().expect("an answer");
        assert_eq!(answer[1..4], [low, high, sub]);
        match answer[0] {
            0x60 => Some(Ok(())),
            0x80 => Some(Err(u32::from_le_bytes([
                answer[4], answer[5], answer[6], answer[7],
            ]))),
            other => panic!("answer {other:02X}"),
        }
    }

    fn write_pdo(&mut self, n: usize, parameter: Parameter, value: u32) {
        let size = if parameter == Parameter::Count {
            0xFF
        } else {
            u32::MAX
        };
        let (index, sub) = parameter.address(self.pdos[n].index);
        let Some(got) = self.write(index, sub, value & size) else {
            return;
        };
        let written = self.pdos[n].write(parameter, value & size);
        assert_eq!(got, written, "PDO {n}: {parameter:?} = 0x{value:X}");
        if got.is_ok() {
            assert_eq!(
                self.value(index, sub),
                u64::from(self.pdos[n].get(parameter))
            );
            if n >= 4 {
                self.clock.configured(n - 4, parameter, self.now);
            }
        }
    }

    fn take_all(&mut self, in_time: bool) {
        // Eight emergencies and one frame of each producer.
        for _ in 0..32 {
            if !self.take(in_time) {
                return;
            }
        }
        panic!("transmit has no end");
    }

    /// Takes a frame, which one of the node's producers may send now.
    fn take(&mut self, in_time: bool) -> bool {
        let silent = self.node.is_silent();
        let errors = self.node.errors();
        let Some(frame) = self.node.transmit(&mut self.host) else {
            assert!(silent, "silent without saying so");
            return false;
        };
        assert!(!silent && !frame.is_remote() && errors == self.node.errors());
        let mut known = SENDERS
            .into_iter()
            .filter(|sender| self.key(*sender) == Some(frame.key()));
        let valid = known.clone().find(|sender| self.may_send(*sender, &frame));
        // With an identifier of its own the sender is known, and with it the time.
        let only = known
            .next()
            .filter(|_| known.next().is_none() && self.eager);
        assert!(valid.is_some(), "{frame} in {}", self.node.state());
        let boots = self.boots;
        match valid {
            Some(Sender::ErrorControl) if self.boots => self.boots = false,
            Some(Sender::Sdo) => {
                self.awaits_answer = false;
                self.answer = Some(frame.bytes());
            }
            _ => {}
        }
        if only.is_none() {
            for n in (0..4).filter(|n| self.pdos[4 + n].key() == frame.key()) {
                self.clock.unknown(n);
            }
        }
        match only {
            Some(Sender::Tpdo(n)) => {
                self.check_data(n, &frame);
                self.clock.sent(n, &self.pdos[4 + n], self.now);
            }
            Some(Sender::ErrorControl) if !boots && self.services.get(0x1017) != 0 => {
                self.clock.heartbeat(self.now, in_time);
            }
            Some(Sender::Sync) => self.clock.sync(self.now, in_time),
            _ => {}
        }
        true
    }

    /// The data are the mapped values, packed without gaps. Type 252 shows those of its SYNC.
    fn check_data(&mut self, n: usize, frame: &Frame) {
        if self.pdos[4 + n].transmission_type == 252 {
            return;
        }
        let (mut data, mut shift) = (0u64, 0);
        for at in 0..self.pdos[4 + n].count as usize {
            let entry = self.pdos[4 + n].entries[at];
            let bits = entry & 0xFF;
            let value = self.value((entry >> 16) as u16, (entry >> 8) as u8);
            data |= (value & u64::MAX >> (64 - bits)) << shift;
            shift += bits;
        }
        assert_eq!(u64::from_le_bytes(frame.bytes()), data, "TPDO {n}");
    }

    /// Errors are there only where they can be.
    fn check_errors(&mut self) {
        let errors = self.node.errors();
        let receives = self.node.state() == NmtState::Operational;
        let has = |wanted: fn(&Pdo) -> bool| receives && self.pdos[..4].iter().any(wanted);
        let carries = has(|pdo| pdo.exists() && pdo.bits != 0);
        let times = has(|pdo| pdo.exists() && pdo.timer_ms != 0);
        assert!(carries || !errors.has(CommunicationErrors::RPDO_TOO_SHORT));
        assert!(carries || !errors.has(CommunicationErrors::RPDO_TOO_LONG));
        assert!(times || !errors.has(CommunicationErrors::RPDO_TIMEOUT));
        let lost = self.node.monitored().any(|node| node.is_lost);
        assert_eq!(errors.has(CommunicationErrors::HEARTBEAT), lost);
        let guards = self.services.get(0x100C) * self.services.get(0x100D) != 0;
        let is_guarded = guards && self.services.get(0x1017) == 0;
        assert!(is_guarded || !errors.has(CommunicationErrors::LIFE_GUARD));
        let has_window = self.services.get(0x1007) != 0;
        assert!(has_window || !errors.has(CommunicationErrors::SYNC_WINDOW));
    }

    /// Every parameter of PDO `n` is the model's.
    fn check_parameters(&mut self, n: usize) {
        let pdo = self.pdos[n].clone();
        let mut parameters = vec![Parameter::CobId, Parameter::Type, Parameter::Timer];
        parameters.push(Parameter::Count);
        if pdo.transmits() {
            parameters.extend([Parameter::Inhibit, Parameter::SyncStart]);
        }
        parameters.extend((1..=64).map(Parameter::Entry));
        for parameter in parameters {
            let (index, sub) = parameter.address(pdo.index);
            assert_eq!(self.value(index, sub), u64::from(pdo.get(parameter)));
        }
    }
}
