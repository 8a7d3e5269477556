//! LSS slaves and a master on a wire that loses frames, and a model of a slave that was written
//! from CiA 305 in bytes, without any type of the crate. Bytes make a script: the fuzz target, the
//! replay of its corpus and the property tests run the same code.

use canopen::lss::{
    Answer, BitTiming, BitTimings, Event, Identity, Job, Known, Master, Reply, Request, Settings,
    Slave, State, StoreError,
};
use canopen::{Instant, NodeId};

/// A slave as CiA 305 describes it.
#[derive(Clone, Debug)]
pub struct Model {
    /// Vendor, product, revision, serial.
    pub address: [u32; 4],
    /// Indices of table 0 that the device can do.
    pub rates: Vec<u8>,
    /// Mode of "switch state global": 0 waiting, 1 configuration.
    pub mode: u8,
    /// 1 to 127 or 0xFF.
    pub active: u8,
    /// 1 to 127 or 0xFF.
    pub pending: u8,
    /// Pending index of table 0.
    pub rate: u8,
    /// Numbers of "switch state selective" that agreed so far, without repetitions.
    selective: Vec<u8>,
    /// The same of "identify remote slave".
    identify: Vec<u8>,
    /// LSSPos.
    position: u8,
    /// A store is under way.
    pub storing: bool,
    /// Two delays run.
    pub silent: bool,
}

/// What the model expects of a slave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expected {
    Silence,
    Answer([u8; 8]),
    Store(u8, u8),
    Boot(u8),
    Delays(u16),
}

fn answer(command: u8, number: u32) -> Expected {
    let [a, b, c, d] = number.to_le_bytes();
    Expected::Answer([command, a, b, c, d, 0, 0, 0])
}

impl Model {
    pub fn new(address: [u32; 4], active: u8, rate: u8, rates: Vec<u8>) -> Model {
        Model {
            address,
            rates,
            mode: 0,
            active,
            pending: active,
            rate,
            selective: Vec::new(),
            identify: Vec::new(),
            position: 0,
            storing: false,
            silent: false,
        }
    }

    fn unconfigured(&self) -> bool {
        self.active == 0xFF && self.pending == 0xFF
    }

    fn to_mode(&mut self, mode: u8) {
        if mode == 0 {
            self.identify.clear();
            self.storing = false;
        }
        if mode == 0 || self.mode == 0 {
            self.selective.clear();
            self.position = 0;
        }
        self.mode = mode;
    }

    pub fn reset_communication(&mut self) {
        self.to_mode(0);
        self.active = self.pending;
    }

    /// What comes of eight bytes on 0x7E5.
    pub fn receive(&mut self, data: [u8; 8]) -> Expected {
        let number = u32::from_le_bytes([data[1], data[2], data[3], data[4]]);
        let [vendor, product, revision, serial] = self.address;
        if self.silent {
            return Expected::Silence;
        }
        match (self.mode, data[0]) {
            (mode, 4) if data[1] <= 1 => {
                self.to_mode(data[1]);
                if mode == 1 && data[1] == 0 && self.active == 0xFF && self.pending != 0xFF {
                    self.active = self.pending;
                    return Expected::Boot(self.active);
                }
                Expected::Silence
            }
            (0, command @ 64..=67) => {
                let agrees = number == self.address[usize::from(command - 64)];
                if row(&mut self.selective, command, 64, agrees) == [64, 65, 66, 67] {
                    self.to_mode(1);
                    return answer(68, 0);
                }
                Expected::Silence
            }
            (_, command @ 70..=75) => {
                let agrees = [
                    number == vendor,
                    number == product,
                    number <= revision,
                    number >= revision,
                    number <= serial,
                    number >= serial,
                ][usize::from(command - 70)];
                if row(&mut self.identify, command, 70, agrees).len() == 6 {
                    self.identify.clear();
                    return answer(79, 0);
                }
                Expected::Silence
            }
            (_, 76) if self.unconfigured() => answer(80, 0),
            (0, 81) if self.unconfigured() && data[6] < 4 && data[7] < 4 => {
                let [.., bit, sub, next] = data;
                let counts = match bit {
                    128 => {
                        self.position = 0;
                        return answer(79, 0);
                    }
                    0..=31 => u32::MAX << bit,
                    _ => return Expected::Silence,
                };
                let own = self.address[usize::from(sub)];
                if sub != self.position || own & counts != number & counts {
                    return Expected::Silence;
                }
                self.position = next;
                if bit == 0 && next < sub {
                    self.to_mode(1);
                }
                answer(79, 0)
            }
            (1, 17) => {
                let valid = matches!(data[1], 1..=127 | 255);
                if valid {
                    self.pending = data[1];
                }
                answer(17, if valid { 0 } else { 1 })
            }
            (1, 19) => {
                let valid = data[1] == 0 && self.rates.contains(&data[2]);
                if valid {
                    self.rate = data[2];
                }
                answer(19, if valid { 0 } else { 1 })
            }
            (1, 21) if !self.rates.is_empty() => {
                self.silent = true;
                Expected::Delays(u16::from_le_bytes([data[1], data[2]]))
            }
            (1, 23) if !self.storing => {
                self.storing = true;
                Expected::Store(self.pending, self.rate)
            }
            (1, command @ 90..=93) => answer(command, self.address[usize::from(command - 90)]),
            (1, 94) => answer(94, self.active.into()),
            _ => Expected::Silence,
        }
    }
}

/// Adds to the numbers that agreed in a row; one that comes twice counts once.
fn row<'a>(so_far: &'a mut Vec<u8>, command: u8, first: u8, agrees: bool) -> &'a [u8] {
    let next = so_far.last().map_or(first, |last| last + 1);
    if !agrees {
        so_far.clear();
    } else if command == first {
        *so_far = vec![first];
    } else if command == next {
        so_far.push(command);
    } else if so_far.last() != Some(&command) {
        so_far.clear();
    }
    so_far
}

/// A slave and its model, which have to agree.
#[derive(Clone, Debug)]
pub struct Pair {
    pub slave: Slave,
    pub model: Model,
}

fn node_id(byte: u8) -> Option<NodeId> {
    NodeId::new(byte)
}

fn id_byte(id: Option<NodeId>) -> u8 {
    id.map_or(0xFF, NodeId::get)
}

impl Pair {
    /// `rates` are indices of table 0.
    pub fn new(address: [u32; 4], active: u8, rates: &[BitTiming]) -> Pair {
        let [vendor, product, revision, serial] = address;
        let identity = Identity {
            vendor,
            product,
            revision,
            serial,
        };
        let set = rates
            .iter()
            .fold(BitTimings::NONE, |set, rate| set.with(*rate));
        let start = BitTiming::Kbit1000;
        let indices = rates.iter().map(|rate| rate.index()).collect();
        Pair {
            slave: Slave::new(identity, node_id(active), start, set),
            model: Model::new(address, id_byte(node_id(active)), start.index(), indices),
        }
    }

    /// Hands eight bytes to both; gives the answer, and what is to be done.
    pub fn receive(&mut self, data: [u8; 8], now: Instant) -> Option<Reply> {
        let expected = self.model.receive(data);
        let reply = Request::from_bytes(data).and_then(|request| self.slave.receive(request, now));
        let got = match reply {
            None => Expected::Silence,
            Some(Reply::Answer(answer)) => Expected::Answer(answer.to_bytes()),
            Some(Reply::Event(Event::StoreConfiguration {
                node_id,
                bit_timing,
            })) => Expected::Store(id_byte(node_id), bit_timing.index()),
            Some(Reply::Event(Event::NodeIdConfigured(id))) => Expected::Boot(id.get()),
            Some(Reply::Event(Event::Silence { delay_ms })) => Expected::Delays(delay_ms),
            Some(Reply::Event(other)) => panic!("{other:?} on a request"),
        };
        assert_eq!(got, expected, "{data:02X?}");
        self.agree();
        reply
    }

    pub fn poll(&mut self, now: Instant) -> Vec<Event> {
        let mut events = Vec::new();
        while let Some(event) = self.slave.poll(now) {
            assert!(self.model.silent, "{event:?}");
            match event {
                Event::SwitchBitTiming(timing) => assert_eq!(timing.index(), self.model.rate),
                Event::SpeakAgain => self.model.silent = false,
                other => panic!("{other:?} by time alone"),
            }
            events.push(event);
        }
        assert!(self.slave.next_deadline() > now, "poll left something");
        self.agree();
        events
    }

    pub fn complete(&mut self, stored: Result<(), StoreError>) -> Option<[u8; 8]> {
        let asked = std::mem::take(&mut self.model.storing) && !self.model.silent;
        let answer = self.slave.complete(stored).map(Answer::to_bytes);
        let (error, specific) = match stored {
            Ok(()) => (0, 0),
            Err(StoreError::NotSupported) => (1, 0),
            Err(StoreError::Access) => (2, 0),
            Err(StoreError::Specific(code)) => (255, code),
        };
        assert_eq!(answer, asked.then_some([23, error, specific, 0, 0, 0, 0, 0]));
        self.agree();
        answer
    }

    pub fn reset_communication(&mut self) {
        self.model.reset_communication();
        let active = self.slave.reset_communication();
        assert_eq!(id_byte(active), self.model.active);
        self.agree();
    }

    fn agree(&self) {
        let Pair { slave, model } = self;
        assert_eq!(slave.state() as u8, model.mode);
        assert_eq!(id_byte(slave.node_id()), model.active);
        assert_eq!(id_byte(slave.pending_node_id()), model.pending);
        assert_eq!(slave.pending_bit_timing().index(), model.rate);
        assert_eq!(slave.is_unconfigured(), model.unconfigured());
        assert_eq!(slave.is_silent(), model.silent);
        assert_eq!(slave.next_deadline() == Instant::NEVER, !model.silent);
    }
}

/// Some slaves, a master, a wire.
#[derive(Debug)]
pub struct Wire {
    pub pairs: Vec<Pair>,
    pub master: Master,
    pub now: Instant,
    pub attempts: u8,
    busy: bool,
}

impl Wire {
    pub fn new(pairs: Vec<Pair>, settings: Settings) -> Wire {
        Wire {
            pairs,
            master: Master::new(settings),
            now: Instant(5_000_000),
            attempts: settings.attempts,
            busy: false,
        }
    }

    pub fn start(&mut self, job: Job) {
        assert_eq!(self.master.start(job, self.now).is_err(), self.busy);
        self.busy = true;
    }

    /// Brings what the master has to say to all slaves and their answers back. `lost` says of each
    /// delivery whether it fails.
    pub fn exchange(&mut self, lost: &mut dyn FnMut() -> bool) {
        while let Some(frame) = self.master.transmit() {
            assert!(!frame.is_extended() && !frame.is_remote());
            assert_eq!((frame.raw_id(), frame.len()), (0x7E5, 8));
            for at in 0..self.pairs.len() {
                if lost() {
                    continue;
                }
                match self.pairs[at].receive(frame.bytes(), self.now) {
                    Some(Reply::Answer(answer)) if !lost() => {
                        self.master.receive(&answer.frame(), self.now);
                    }
                    Some(Reply::Event(Event::StoreConfiguration { .. })) => {
                        let answer = self.pairs[at].complete(Ok(()));
                        if let Some(bytes) = answer.filter(|_| !lost()) {
                            let frame = can::Frame::classic(0x7E4, bytes, 8);
                            self.master.receive(&frame, self.now);
                        }
                    }
                    _ => {}
                }
            }
        }
        self.check_master();
    }

    /// Lets `ns` pass, then polls everybody.
    pub fn wait(&mut self, ns: u64) {
        self.now = self.now.plus_ns(ns);
        for pair in &mut self.pairs {
            pair.poll(self.now);
        }
        self.master.poll(self.now);
        self.check_master();
    }

    fn check_master(&mut self) {
        if let Some(outcome) = self.master.take_outcome() {
            assert!(self.busy, "{outcome:?} of nothing");
            self.busy = false;
        }
        assert_eq!(self.busy, self.master.next_deadline() != Instant::NEVER);
    }

    /// Without any answer every job ends, after a known number of time-outs.
    fn finish(&mut self) {
        let most = 140 * u32::from(self.attempts.max(1)) + 20;
        for _ in 0..most {
            if !self.busy {
                return;
            }
            while self.master.transmit().is_some() {}
            let until = self.master.next_deadline();
            if until == Instant::NEVER {
                break;
            }
            self.now = self.now.max(until);
            self.master.poll(self.now);
            self.check_master();
        }
        assert!(!self.busy, "the job does not end");
    }
}

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

/// Runs a script: what is on the wire, then steps of one byte and the bytes each needs.
pub fn run(input: &[u8]) {
    script(&mut { input });
}

fn script(input: &mut &[u8]) -> Option<()> {
    let [count, ids, rates, attempts] = take(input)?;
    let rates = match rates {
        0..=15 => &[][..],
        16..=63 => &[BitTiming::Kbit10, BitTiming::Automatic],
        _ => &BitTiming::ALL,
    };
    let mut pairs = Vec::new();
    for at in 0..1 + usize::from(count % 3) {
        let [vendor, product, revision, serial] = take(input)?;
        // Few bits differ, so that slaves share beginnings.
        let address = [
            0x0408,
            u32::from(product & 1) << 31 | u32::from(vendor & 3),
            u32::from(revision),
            u32::from_le_bytes([serial, 0, 0, serial]),
        ];
        let active = if ids >> at & 1 == 0 { 0xFF } else { 5 };
        pairs.push(Pair::new(address, active, rates));
    }
    let settings = Settings {
        answer_ms: 5,
        store_ms: 10,
        scan_ms: u16::from(attempts >> 4),
        settle_ms: u16::from(attempts >> 6),
        gap_ms: u16::from(attempts >> 3 & 1),
        attempts: attempts & 3,
    };
    let mut wire = Wire::new(pairs, settings);
    while step(&mut wire, input).is_some() {}
    wire.finish();
    Some(())
}

fn step(wire: &mut Wire, input: &mut &[u8]) -> Option<()> {
    let [what] = take(input)?;
    let at = usize::from(what >> 4) % wire.pairs.len();
    match what & 0x0F {
        // Any eight bytes from some master.
        0 => {
            let data = take::<8>(input)?;
            parsing(data);
            for pair in &mut wire.pairs {
                pair.receive(data, wire.now);
            }
        }
        // A request that means this slave, or nearly so.
        1..=4 => {
            let [command, change] = take(input)?;
            let address = wire.pairs[at].model.address;
            let number = match command {
                64..=67 => address[usize::from(command - 64)],
                70 | 71 => address[usize::from(command - 70)],
                72 | 73 => address[2],
                74 | 75 => address[3],
                81 => address[usize::from(change & 3)],
                _ => u32::from(change),
            };
            let wrong = if change & 0x80 == 0 { 0 } else { 1 << (change & 31) };
            let [a, b, c, d] = (number ^ wrong).to_le_bytes();
            let (bit, next) = (change & 0x1F, (change & 3) + (change >> 5 & 1));
            let data = match command {
                81 => [81, a, b, c, d, bit, change & 3, next & 3],
                _ => [command, a, b, c, d, 0, 0, 0],
            };
            for pair in &mut wire.pairs {
                pair.receive(data, wire.now);
            }
        }
        5 => {
            let [a, b] = take(input)?;
            wire.wait(u64::from(u16::from_le_bytes([a, b])) * 100_000);
        }
        6 => {
            let stored = match what >> 4 & 3 {
                0 => Ok(()),
                1 => Err(StoreError::NotSupported),
                2 => Err(StoreError::Access),
                _ => Err(StoreError::Specific(what)),
            };
            for pair in &mut wire.pairs {
                pair.complete(stored);
            }
        }
        7 => wire.pairs[at].reset_communication(),
        8 | 9 => {
            let [which, id] = take(input)?;
            wire.start(job(which, id, wire.pairs[at].slave.identity()));
        }
        // Exchanges until the losses are used up.
        10..=12 => {
            let [losses, rounds] = take(input)?;
            let mut left = u32::from(losses);
            for _ in 0..=rounds {
                wire.exchange(&mut || {
                    let lost = left & 1 != 0;
                    left >>= 1;
                    lost
                });
                wire.wait(1_000_000);
            }
        }
        // Any answer to the master.
        13 => {
            let data = take::<8>(input)?;
            parsing(data);
            let frame = can::Frame::classic(0x7E4, data, what >> 4);
            wire.master.receive(&frame, wire.now);
            wire.check_master();
        }
        14 => {
            wire.master.cancel();
            wire.busy = false;
            wire.check_master();
        }
        _ => wire.master.receive(&can::Frame::classic(0x7E5, [what; 8], 8), wire.now),
    }
    Some(())
}

fn job(which: u8, id: u8, identity: Identity) -> Job {
    match which % 12 {
        0 => Job::Switch(State::Waiting),
        1 => Job::Switch(State::Configuration),
        2 => Job::Select(identity),
        3 => Job::ConfigureNodeId(node_id(id)),
        4 => Job::ConfigureBitTiming(BitTiming::ALL[usize::from(id) % BitTiming::ALL.len()]),
        5 => Job::ActivateBitTiming {
            delay_ms: u16::from(id),
        },
        6 => Job::Store,
        7 => Job::InquireIdentity,
        8 => Job::InquireNodeId,
        9 => Job::Identify {
            low: identity,
            high: identity,
        },
        10 => Job::IdentifyNonConfigured,
        _ => Job::Fastscan(Known {
            vendor: (id & 1 != 0).then_some(identity.vendor),
            product: (id & 2 != 0).then_some(identity.product),
            revision: (id & 4 != 0).then_some(identity.revision),
            serial: (id & 8 != 0).then_some(u32::from(id)),
        }),
    }
}

/// What is written as it was read is read as it was written.
fn parsing(data: [u8; 8]) {
    if let Some(request) = Request::from_bytes(data) {
        assert_eq!(Request::from_bytes(request.to_bytes()), Some(request));
    }
    if let Some(answer) = Answer::from_bytes(data) {
        assert_eq!(Answer::from_bytes(answer.to_bytes()), Some(answer));
    }
}
