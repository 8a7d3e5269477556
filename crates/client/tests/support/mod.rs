//! Two links in virtual time: one that plays a script, one with real CANopen nodes on it.

#![allow(dead_code, reason = "each test file uses its part")]

use std::collections::VecDeque;

use can::Frame;
use canopen::{
    Abort, Address, Image, Instant, NmtState, Node, NodeId, Owner, Reset, Verdict, store,
};
use cia402::{Controlword, Mode, State};
use client::decode::DriveWords;
use client::transcript::{Physics, Reading};
use client::{Link, LinkError};
use personalities::p3::{self, P3};
use personalities::{Personality, class};

/// What a drive's document says.
pub(crate) fn words_of(drive: &Personality) -> DriveWords {
    DriveWords {
        table: Some(drive.device.table),
        modes: drive.words.modes,
        mode_bits: drive.words.mode_bits,
        bits: drive.words.bits,
        errors: drive.words.errors,
    }
}

pub(crate) const NODE: NodeId = NodeId::new(1).unwrap();

/// A frame in candump's notation, `601#40`.
pub(crate) fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once('#').unwrap();
    let bytes: Vec<u8> = (0..data.len() / 2)
        .map(|n| u8::from_str_radix(&data[2 * n..2 * n + 2], 16).unwrap())
        .collect();
    let id = u16::from_str_radix(id, 16).unwrap();
    Frame::data_frame(can::StandardId::new(id).unwrap(), &bytes).unwrap()
}

/// Answers given frames with given frames, and sends some by itself.
#[derive(Default)]
pub(crate) struct Scripted {
    pub(crate) now_ns: u64,
    pub(crate) sent: Vec<String>,
    pub(crate) answers: VecDeque<(String, Vec<(u64, Frame)>)>,
    pub(crate) coming: Vec<(u64, Frame)>,
    pub(crate) quantities: Vec<(&'static str, f64, &'static str)>,
    pub(crate) broken: bool,
}

impl Scripted {
    pub(crate) fn new() -> Scripted {
        Scripted::default()
    }

    /// After the frame `sent`, the frames `answers`, each so many microseconds later. Each answer is
    /// given once, in the order of these calls.
    pub(crate) fn on(mut self, sent: &str, answers: &[(u64, &str)]) -> Scripted {
        let answers = answers
            .iter()
            .map(|(us, text)| (*us, frame(text)))
            .collect();
        self.answers.push_back((sent.to_owned(), answers));
        self
    }

    /// A frame that comes by itself.
    pub(crate) fn at_us(mut self, us: u64, text: &str) -> Scripted {
        self.coming.push((us * 1000, frame(text)));
        self
    }
}

impl Link for Scripted {
    fn now(&self) -> Instant {
        Instant(self.now_ns)
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        if self.broken {
            return Err(LinkError::Closed {
                door: "script".into(),
            });
        }
        let text = frame.to_string();
        if let Some(at) = self.answers.iter().position(|(wanted, _)| *wanted == text) {
            let (_, answers) = self.answers.remove(at).unwrap();
            let now = self.now_ns;
            self.coming.extend(
                answers
                    .into_iter()
                    .map(|(us, frame)| (now + us * 1000, frame)),
            );
        }
        self.sent.push(text);
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        self.coming.sort_by_key(|(at, _)| *at);
        match self.coming.first().copied() {
            Some((at, frame)) if at <= until.0 => {
                self.coming.remove(0);
                self.now_ns = self.now_ns.max(at);
                Ok(Some((Instant(at), frame)))
            }
            _ => {
                self.now_ns = self.now_ns.max(until.0);
                Ok(None)
            }
        }
    }
}

impl Physics for Scripted {
    fn quantity(&mut self, node: NodeId, name: &str) -> Reading {
        if self.quantities.is_empty() {
            return Reading::NoPlant;
        }
        if node != NODE {
            return Reading::UnknownNode;
        }
        match self.quantities.iter().find(|(known, _, _)| *known == name) {
            Some((_, value, unit)) => Reading::Value {
                value: *value,
                unit,
            },
            None => Reading::UnknownQuantity {
                known: &["position", "current"],
            },
        }
    }
}

/// The P3's state machine without a motor: what its statusword and its refusals need.
struct App {
    state: State,
    controlword: Controlword,
    mode: i8,
    display: i8,
    /// Homing is done, and in the mode in force.
    is_homed: bool,
    attained: bool,
    /// A set-point has come in a cyclic mode.
    follows: bool,
    save: Option<store::Request>,
    id: Option<NodeId>,
}

impl App {
    fn new() -> App {
        App {
            state: State::SwitchOnDisabled,
            controlword: Controlword(0),
            mode: 0,
            display: 0,
            is_homed: false,
            attained: false,
            follows: false,
            save: None,
            id: None,
        }
    }
}

impl Owner for App {
    fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        let mut raw = [0; 4];
        raw[..new.len()].copy_from_slice(new);
        let raw = u32::from_le_bytes(raw);
        match (object.index, object.sub) {
            (0x6040, 0) => {
                let option = image.raw(p3::OBJECTS.need(0x605A, 0));
                let stays = matches!(option, 5..=8);
                let word = Controlword(raw as u16);
                let step = self
                    .state
                    .written(self.controlword, word, stays, &P3.cia402);
                let entered = step.state == State::OperationEnabled && step.state != self.state;
                (self.state, self.controlword) = (step.state, word);
                if entered {
                    (self.mode, self.display) = (0, 0);
                    self.follows = false;
                }
                // Homing where it stands.
                if self.display == 6 && self.controlword.start_homing() {
                    (self.is_homed, self.attained) = (true, true);
                }
                if self.state == State::QuickStopActive && !stays {
                    self.state = State::SwitchOnDisabled;
                }
                Verdict::Accept
            }
            (0x6060, 0) => {
                let mode = Mode(raw as i8);
                if mode != Mode::IDLE && !P3.cia402.modes.contains(mode) {
                    return Verdict::Refuse(Abort::INVALID_VALUE);
                }
                if mode != Mode::IDLE && self.state != State::OperationEnabled {
                    return Verdict::Refuse(Abort::DEVICE_STATE);
                }
                (self.mode, self.display) = (mode.0, mode.0);
                self.attained = false;
                self.follows = false;
                Verdict::Accept
            }
            (0x21B0, 0) => {
                self.id = NodeId::new(raw as u8);
                Verdict::Accept
            }
            (0x60EA, 0) | (0x3010, 4 | 5) => match self.display {
                11 if object.index == 0x60EA => Verdict::Accept,
                12 => Verdict::Accept,
                _ => Verdict::Refuse(Abort::DEVICE_STATE),
            },
            (0x1010, 4) => match Address::from_key(raw) {
                Some(address) => {
                    self.save = Some(store::Request::Single(address));
                    Verdict::Done
                }
                None => Verdict::Refuse(Abort::CANNOT_STORE),
            },
            (0x1010, sub) => match store::Request::from_write(sub, raw) {
                Ok(request) => {
                    self.save = Some(request);
                    Verdict::Done
                }
                Err(abort) => Verdict::Refuse(abort),
            },
            _ => Verdict::Accept,
        }
    }

    fn publish(&mut self, image: &mut Image<'_>) {
        let homing = match (self.display, self.attained) {
            (6, true) => 0x1400,
            (6, false) => 0x0400,
            _ if self.follows => 0x1000,
            _ => 0,
        };
        let status = u32::from(self.state.pattern()) | 0x10 | homing;
        image.set_raw(p3::OBJECTS.need(0x2402, 0), u32::from(self.is_homed));
        if self.is_homed {
            let offset = image.raw(p3::OBJECTS.need(0x607C, 0));
            image.set_raw(p3::OBJECTS.need(0x6064, 0), offset);
        }
        image.set_raw(p3::OBJECTS.need(0x6041, 0), status);
        image.set_raw(p3::OBJECTS.need(0x6061, 0), self.display as u8 as u32);
        image.set_raw(p3::OBJECTS.need(0x3000, 2), 25);
        image.set_raw(p3::OBJECTS.need(0x3008, 1), 0x7296);
        image.set_raw(p3::OBJECTS.need(0x3012, 1), 0x0DF8);
    }
}

fn stored_id(stored: &[u8]) -> Option<NodeId> {
    let mut records = store::records(stored).unwrap();
    let record = records.find(|record| record.address.index == 0x21B0)?;
    NodeId::new(record.bytes[0])
}

struct Drive {
    /// Until another one is stored.
    first_id: NodeId,
    id: NodeId,
    node: Node<[u8; p3::IMAGE_BYTES]>,
    app: App,
    stored: Vec<u8>,
    /// Silent until then.
    boots_at: Option<Instant>,
}

impl Drive {
    fn new(id: NodeId) -> Drive {
        let node = Node::new(&P3.device, [0; p3::IMAGE_BYTES], id);
        Drive {
            first_id: id,
            id,
            node,
            app: App::new(),
            stored: Vec::new(),
            boots_at: Some(Instant(1_000_000)),
        }
    }

    fn boot(&mut self, now: Instant) {
        self.boots_at = None;
        self.id = stored_id(&self.stored).unwrap_or(self.first_id);
        self.node = Node::new(&P3.device, [0; p3::IMAGE_BYTES], self.id);
        self.app = App::new();
        store::load(&P3.device.table, &mut self.node.image(), &self.stored).unwrap();
        let shown = u16::from(self.id.get());
        let object = P3.node_id.unwrap();
        self.node.image().set_raw(object.field, u32::from(shown));
        self.node.start(now);
    }

    fn receive(&mut self, frame: &Frame, now: Instant) {
        if self.boots_at.is_some() {
            return;
        }
        let events = self.node.receive(frame, now, &mut self.app);
        let is_cyclic = matches!(self.app.display, 8..=11);
        if is_cyclic && self.app.state == State::OperationEnabled {
            let targets = [
                class::TARGET_POSITION,
                class::TARGET_VELOCITY,
                class::TARGET_TORQUE,
            ];
            self.app.follows |= targets.iter().any(|target| events.changed.has(*target));
        }
        if let Some(request) = self.app.save.take() {
            let mut out = vec![0; 4096];
            let image = self.node.image();
            let table = &P3.device.table;
            let used = store::save(table, &image, self.id, request, &self.stored, &mut out);
            out.truncate(used.unwrap());
            self.stored = out;
        }
        if let Some(Reset::Node | Reset::Communication) = events.reset {
            self.boots_at = Some(now.plus_ms(20));
        }
    }

    fn next(&self) -> Instant {
        self.boots_at.unwrap_or_else(|| self.node.next_deadline())
    }
}

/// P3 nodes without motors on a bus that takes 100 µs for a frame.
pub(crate) struct Nodes {
    now: Instant,
    drives: Vec<Drive>,
    coming: VecDeque<(Instant, Frame)>,
}

impl Nodes {
    pub(crate) fn new(ids: &[NodeId]) -> Nodes {
        let drives = ids.iter().map(|id| Drive::new(*id)).collect();
        Nodes {
            now: Instant::ZERO,
            drives,
            coming: VecDeque::new(),
        }
    }

    pub(crate) fn state(&self, id: NodeId) -> Option<NmtState> {
        self.drives
            .iter()
            .find(|drive| drive.id == id)
            .map(|drive| drive.node.state())
    }

    fn collect(&mut self) {
        for drive in &mut self.drives {
            while let Some(frame) = drive.node.transmit(&mut drive.app) {
                let last = self.coming.back().map_or(self.now, |(at, _)| *at);
                self.coming
                    .push_back((last.max(self.now).plus_us(100), frame));
            }
            if let Some(id) = drive.app.id.take() {
                drive.id = id;
                drive.node.rename(id);
            }
        }
    }
}

impl Link for Nodes {
    fn now(&self) -> Instant {
        self.now
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.now = self.now.plus_us(100);
        for drive in &mut self.drives {
            drive.receive(&frame, self.now);
        }
        self.collect();
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        loop {
            let due = self
                .drives
                .iter()
                .map(Drive::next)
                .min()
                .unwrap_or(Instant::NEVER);
            let arrives = self.coming.front().map_or(Instant::NEVER, |(at, _)| *at);
            if arrives.min(due) > until {
                self.now = self.now.max(until);
                return Ok(None);
            }
            if arrives <= due {
                let received = self.coming.pop_front();
                self.now = self.now.max(arrives);
                return Ok(received);
            }
            self.now = self.now.max(due);
            let now = self.now;
            for drive in &mut self.drives {
                match drive.boots_at {
                    Some(at) if at <= now => drive.boot(now),
                    Some(_) => {}
                    None => {
                        drive.node.poll(now, &mut drive.app);
                    }
                }
            }
            self.collect();
        }
    }
}

impl Physics for Nodes {
    fn quantity(&mut self, _: NodeId, _: &str) -> Reading {
        Reading::NoPlant
    }
}
