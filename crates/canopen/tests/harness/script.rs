//! Bytes as a script: frames, time and the owner's doings for one node, with the rules that hold
//! whatever the script says. The fuzz target, the replay of its corpus and the property tests run
//! this same code.
//!
//! A script's first byte chooses the device; then each step is one byte that says what it is, and
//! the bytes it needs. Where the bytes end, the script ends.

use can::{ExtendedId, Frame, StandardId};
use canopen::{
    Abort, Address, CobId, Device, Emergency, Image, Instant, NmtState, Node, NodeId, Owner, Table,
    Verdict,
};

use super::devices::{BASIC, OBJECTS_CONST, P3_LIKE};

/// Node ID of the scripts' node.
pub const ID: u8 = 5;

/// One step of a script.
#[derive(Clone, Copy, Debug)]
pub enum Step {
    /// A frame comes in.
    Receive(Frame),
    /// Time passes, then a poll.
    Wait {
        /// Nanoseconds.
        ns: u64,
    },
    /// A poll too many.
    Poll,
    /// The owner announces an error.
    Announce {
        /// Error code.
        code: u16,
        /// Error register.
        register: u8,
    },
    /// The owner completes what it postponed.
    Complete(Result<(), Abort>),
    /// One frame is taken.
    TakeOne,
    /// All frames are taken.
    TakeAll,
    /// How the owner judges from now on.
    Judge(Verdict),
    /// Communication starts over from its defaults.
    Restart,
}

/// The steps in `input`, for a node `id` with the dictionary `table`.
pub fn steps<'a>(
    table: &'a Table,
    id: u8,
    mut input: &'a [u8],
) -> impl Iterator<Item = Step> + use<'a> {
    core::iter::from_fn(move || step(table, id, &mut input))
}

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

fn step(table: &Table, id: u8, input: &mut &[u8]) -> Option<Step> {
    let [what] = take(input)?;
    let request = 0x600 + u16::from(id);
    Some(match what & 0x0F {
        // An SDO request to an object that exists, so that luck is not needed to find one.
        0..=3 => {
            let [command, row, value] = take(input)?;
            let rows = table.rows();
            let row = rows.get(usize::from(row) % rows.len().max(1))?;
            let [low, high] = row.address.index.to_le_bytes();
            let sub = row.address.sub.wrapping_add(what >> 4);
            let data = match what & 3 {
                // A small number, or four bytes.
                0 => [value, 0, 0, 0],
                // A mapping entry for an object that exists.
                1 => mapping_entry(rows.get(usize::from(value) % rows.len())?),
                _ => {
                    let [d1, d2, d3] = take(input)?;
                    [value, d1, d2, d3]
                }
            };
            let [d0, d1, d2, d3] = data;
            Step::Receive(Frame::classic(
                request,
                [command, low, high, sub, d0, d1, d2, d3],
                8,
            ))
        }
        // Any frame to the identifiers of a CANopen node, its own or nearly so.
        4 | 5 => {
            let [function, data @ ..] = take::<9>(input)?;
            let number = u16::from(function & 0x0F) << 7 | u16::from(id & function >> 4 | id);
            Step::Receive(Frame::classic(number, data, what >> 4))
        }
        // Any frame whatever.
        6 => {
            let [a, b, c, d, data @ ..] = take::<12>(input)?;
            let raw = u32::from_le_bytes([a, b, c, d]);
            let length = usize::from((what >> 4).min(8));
            let frame = match raw >> 30 {
                0 => Frame::data_frame(ExtendedId::new(raw & 0x1FFF_FFFF)?, data.get(..length)?)?,
                1 => Frame::remote_frame(StandardId::new(raw as u16 & 0x7FF)?, length as u8)?,
                _ => Frame::data_frame(StandardId::new(raw as u16 & 0x7FF)?, data.get(..length)?)?,
            };
            Step::Receive(frame)
        }
        7 => Step::Receive(Frame::classic(0x80, [0; 8], what >> 7)),
        8 => {
            let command = [0x01, 0x02, 0x80, 0x81][usize::from(what >> 4 & 3)];
            Step::Receive(Frame::classic(0, [command, id, 0, 0, 0, 0, 0, 0], 2))
        }
        9 => {
            let [low, high] = take(input)?;
            let count = u64::from(u16::from_le_bytes([low, high]));
            let unit = [1, 1_000, 1_000_000, 1 << 44][usize::from(what >> 4 & 3)];
            Step::Wait { ns: count * unit }
        }
        10 => Step::Poll,
        11 => {
            let [low, high, register] = take(input)?;
            Step::Announce {
                code: u16::from_le_bytes([low, high]),
                register,
            }
        }
        12 => Step::Complete(if what & 0x10 == 0 {
            Ok(())
        } else {
            Err(Abort::HARDWARE)
        }),
        13 if what & 0x10 == 0 => Step::TakeOne,
        13 => Step::TakeAll,
        14 if what & 0x80 != 0 => Step::Restart,
        _ => Step::Judge(match what >> 4 & 3 {
            0 => Verdict::Accept,
            1 => Verdict::Done,
            2 => Verdict::Refuse(Abort::DEVICE_STATE),
            _ => Verdict::Later,
        }),
    })
}

fn mapping_entry(row: &canopen::Row) -> [u8; 4] {
    let [low, high] = row.address.index.to_le_bytes();
    [row.data_type.bits(), row.address.sub, low, high]
}

/// Runs a whole script and takes what is left to send.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let Some((first, rest)) = input.split_first() else {
        return;
    };
    let device = if first & 1 == 0 { &BASIC } else { &P3_LIKE };
    let mut world = World::new(device);
    if first & 2 != 0 {
        world.act(Step::Receive(Frame::classic(
            0,
            [0x01, 0, 0, 0, 0, 0, 0, 0],
            2,
        )));
    }
    for step in steps(&device.table, ID, rest) {
        world.act(step);
    }
    world.act(Step::TakeAll);
    world.check_image();
}

/// The owner of a script's node: one verdict for all.
#[derive(Debug)]
struct Judge(Verdict);

impl Owner for Judge {
    fn write(&mut self, _: &Image<'_>, _: Address, new: &[u8]) -> Verdict {
        assert!(matches!(new.len(), 1 | 2 | 4));
        self.0
    }

    fn publish(&mut self, image: &mut Image<'_>) {
        const POSITION: canopen::Handle<i32> = OBJECTS_CONST.handle(0x2008, 0);
        image.set(POSITION, image.get(POSITION).wrapping_add(1));
    }
}

/// A node and what is known of it from outside.
#[derive(Debug)]
pub struct World {
    device: &'static Device,
    /// The node, for tests that set it up themselves.
    pub node: Node<Vec<u8>>,
    owner: Judge,
    /// The clock, likewise.
    pub now: Instant,
    /// SDO requests that may still be answered.
    unanswered: u32,
}

impl World {
    /// A node that has started.
    pub fn new(device: &'static Device) -> World {
        let id = NodeId::new(ID).expect("a node ID");
        let mut node = Node::new(device, vec![0; device.table.image_bytes()], id);
        node.start(Instant::ZERO);
        World {
            device,
            node,
            owner: Judge(Verdict::Accept),
            now: Instant::ZERO,
            unanswered: 0,
        }
    }

    /// Does one step.
    ///
    /// # Panics
    /// If a rule is broken.
    pub fn act(&mut self, step: Step) {
        match step {
            Step::Receive(frame) => {
                if frame.key() == 0x600 + u32::from(ID) && frame.bytes()[0] >> 5 != 4 {
                    self.unanswered += 1;
                }
                let events = self.node.receive(&frame, self.now, &mut self.owner);
                if let Some(state) = events.entered {
                    assert_eq!(state, self.node.state());
                }
            }
            Step::Wait { ns } => {
                self.now = self.now.plus_ns(ns);
                self.node.poll(self.now, &mut self.owner);
                self.check_deadline();
            }
            Step::Poll => self.spurious_poll(),
            Step::Announce { code, register } => {
                self.node.announce(code, register, [0; 5], self.now)
            }
            Step::Complete(result) => self.node.complete(result, self.now),
            Step::TakeOne => {
                self.take();
            }
            Step::TakeAll => {
                // Eight emergencies, four TPDOs, one SDO answer, boot-up, heartbeat.
                for _ in 0..=15 {
                    if !self.take() {
                        return;
                    }
                }
                panic!("transmit has no end");
            }
            Step::Judge(verdict) => self.owner.0 = verdict,
            Step::Restart => {
                self.node.restart_communication(&[], self.node.id());
                assert_eq!(self.node.state(), NmtState::Initialising);
                self.node.start(self.now);
            }
        }
    }

    /// An early poll, and a second one at the same time, change nothing.
    fn spurious_poll(&mut self) {
        self.node.poll(self.now, &mut self.owner);
        let before = (
            self.node.next_deadline(),
            self.node.is_silent(),
            self.node.state(),
            self.node.lost_transmissions(),
        );
        self.node.poll(self.now, &mut self.owner);
        let after = (
            self.node.next_deadline(),
            self.node.is_silent(),
            self.node.state(),
            self.node.lost_transmissions(),
        );
        assert_eq!(before, after);
    }

    /// After a poll the next deadline lies ahead, at most a heartbeat period.
    fn check_deadline(&mut self) {
        let period = u64::from(self.value(0x1017, 0));
        let deadline = self.node.next_deadline();
        if period == 0 {
            assert_eq!(deadline, Instant::NEVER);
        } else {
            assert!(deadline > self.now || self.now == Instant::NEVER);
            assert!(deadline <= self.now.plus_ms(period));
        }
    }

    /// Takes a frame and checks that this node may send it now.
    fn take(&mut self) -> bool {
        let silent = self.node.is_silent();
        let Some(frame) = self.node.transmit(&mut self.owner) else {
            assert!(silent, "silent without saying so");
            return false;
        };
        assert!(!silent, "said to be silent");
        assert!(!frame.is_extended() && !frame.is_remote());
        let id = frame.raw_id() as u16;
        let state = self.node.state();
        let talks = matches!(state, NmtState::Operational | NmtState::PreOperational);
        let pdos = match state {
            NmtState::Operational => true,
            NmtState::PreOperational => self.device.dialect.tpdo_in_pre_operational,
            _ => false,
        };
        let own = u16::from(ID);
        let valid = if id == 0x700 + own {
            frame.len() == 1 && (frame.data()[0] == 0 || frame.data()[0] == state as u8)
        } else if id == 0x580 + own {
            talks && self.is_sdo_answer(&frame)
        } else {
            (talks && self.is_emergency(&frame)) || (pdos && self.is_tpdo(&frame))
        };
        assert!(valid, "{frame} in {state}");
        true
    }

    fn is_sdo_answer(&mut self, frame: &Frame) -> bool {
        let Some(rest) = self.unanswered.checked_sub(1) else {
            return false;
        };
        self.unanswered = rest;
        let [command, _, _, _, data @ ..] = frame.bytes();
        frame.len() == 8
            && match command {
                0x42 | 0x43 | 0x47 | 0x4B | 0x4F | 0x60 => true,
                0x80 => Abort::ALL.contains(&Abort(u32::from_le_bytes(data))),
                _ => false,
            }
    }

    fn is_emergency(&mut self, frame: &Frame) -> bool {
        let cob_id = CobId(self.value(0x1014, 0));
        let vendor = Emergency::from_bytes(frame.bytes()).vendor;
        !cob_id.is_off()
            && u32::from(cob_id.id()) == frame.raw_id()
            && frame.len() == 8
            && vendor == [0; 5]
    }

    fn is_tpdo(&mut self, frame: &Frame) -> bool {
        (0..4).any(|n| {
            let cob_id = CobId(self.value(0x1800 + n, 1));
            let (entries, count) = self.entries(0x1A00 + n);
            let bits: u32 = entries[..count].iter().map(|entry| entry & 0xFF).sum();
            !cob_id.is_off()
                && u32::from(cob_id.id()) == frame.raw_id()
                && u32::from(frame.len()) == bits.div_ceil(8)
                && bits != 0
        })
    }

    /// The mapping entries, and how many of them count.
    fn entries(&mut self, index: u16) -> ([u32; 8], usize) {
        let count = self.value(index, 0) as usize;
        assert!(count <= 8, "{index:04X}: {count} entries");
        let mut entries = [0; 8];
        for (entry, sub) in entries.iter_mut().zip(1..) {
            *entry = self.value(index, sub);
        }
        (entries, count)
    }

    fn value(&mut self, index: u16, sub: u8) -> u32 {
        let field = self.device.table.find(index, sub).expect("an object").field;
        self.node.image().raw(field)
    }

    /// What holds of the values whatever was sent.
    ///
    /// # Panics
    /// If it does not.
    pub fn check_image(&mut self) {
        for n in 0..4 {
            for (index, transmit) in [(0x1400 + n, false), (0x1800 + n, true)] {
                self.check_pdo(index, transmit);
            }
        }
        assert!(!CobId(self.value(0x1005, 0)).is_restricted());
        assert!(self.value(0x1003, 0) <= 8);
        for sub in 1..=8u8 {
            let holds = u32::from(sub) <= self.value(0x1003, 0);
            assert_eq!(self.value(0x1003, sub) != 0, holds, "0x1003,{sub}");
        }
        let limited = self.value(0x2004, 1) as u16 as i16;
        assert!((-10..=10).contains(&limited));
        assert!((5..=100).contains(&self.value(0x2004, 2)));
        let real = f32::from_bits(self.value(0x2004, 3));
        assert!((-1.0..=1.0).contains(&real));
        assert!(self.value(0x2000, 8) <= 1);
        assert_eq!(self.value(0x2001, 0), 0x1234);
        assert_eq!(self.value(0x2003, 0), 0xCAFE_F00D);
        assert_eq!(self.value(0x1018, 4), 7);
    }

    fn check_pdo(&mut self, index: u16, transmit: bool) {
        let cob_id = CobId(self.value(index, 1));
        let lenient_off = self.device.dialect.reconfigure_while_valid && cob_id.0 == 0;
        if !cob_id.is_off() && !lenient_off {
            assert!(!cob_id.is_restricted() && cob_id.0 & 0x3FFF_F800 == 0);
        }
        assert!(!matches!(self.value(index, 2), 241..=253));
        let mut bits = 0;
        let (entries, count) = self.entries(index + 0x200);
        for entry in &entries[..count] {
            let object = self
                .device
                .table
                .find((entry >> 16) as u16, (entry >> 8) as u8)
                .expect("a mapped object exists");
            assert_eq!(entry & 0xFF, u32::from(object.field.data_type().bits()));
            assert!(if transmit {
                object.maps_tpdo()
            } else {
                object.maps_rpdo()
            });
            bits += entry & 0xFF;
        }
        assert!(bits <= 64, "{index:04X} maps {bits} bits");
    }
}
