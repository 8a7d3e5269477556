//! One of each documented drive on one bus: every drive shows status, position and velocity with each
//! SYNC and gets a set-point that moves.
//!
//! Every cycle the master sends a SYNC and the set-points; each TPDO must be there before the next
//! SYNC, of type 1, or 0 where that is every SYNC. How each drive is configured stands in `mixes.rs`.

mod mixes;

use std::fmt;
use std::time::{Duration, Instant as RealTime};

use can::Frame;
use canopen::{Instant, NodeId};
use personalities::Personality;
use sim::{Bus, BusSettings, DriveSettings, ErrorCounters, Sender, Traffic, VirtualDrive};

pub use self::mixes::{MIXES, Mix, Rpdo, Shown, Tpdo, Wave, Write};

/// SYNC per second.
pub const SYNC_HZ: u32 = 250;
/// How often the set-points go to and fro in a second.
const WAVE_HZ: f64 = 0.5;
/// Cycles until the drives have what the first set-points asked for.
const WARM_UP: u64 = 3;

/// A TPDO of a drive.
#[derive(Clone, Copy, Debug)]
struct Answer {
    identifier: u32,
    shown: Shown,
    /// Since the last SYNC.
    count: u64,
}

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// SYNCs sent.
    pub cycles: u64,
    /// TPDOs that did not come exactly once between a SYNC and the next.
    pub missed: u64,
    /// How often each TPDO came: node, identifier, number.
    pub answers: Vec<(u8, u32, u64)>,
    /// TPDOs that showed a drive which was not as it should be.
    pub not_following: u64,
    /// Frames of drives that were no such TPDO and no heartbeat: emergencies, say.
    pub unexpected: Vec<Frame>,
    /// Frames on the bus.
    pub frames: u64,
    /// Share of the time for which the wire was busy, interframe spaces included.
    pub load: f64,
    /// How far each shaft turned in all, turns: node, axis, from its least to its greatest position.
    pub moved: Vec<(u8, usize, f64)>,
    /// The error counters of each drive at the end.
    pub counters: Vec<(u8, ErrorCounters)>,
    /// Frames that a drive's controller had no room for.
    pub lost: u64,
    /// Real time that it took.
    pub wall: Duration,
}

/// Something is not as it must be before the cycle can begin.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoMix {
    /// No such drive.
    #[error("there is no drive '{0}'")]
    NoDrive(&'static str),
    /// A drive refuses an access, or does not answer.
    #[error("node {node} ({drive}) refuses 0x{index:04X},{sub}: {why}")]
    Refused {
        /// The drive.
        node: u8,
        /// Its name.
        drive: &'static str,
        /// What was written or read.
        index: u16,
        /// What was written or read.
        sub: u8,
        /// The abort, or that there was no answer.
        why: Refusal,
    },
}

/// How an access failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// With this code.
    Abort(u32),
    /// No answer.
    Silence,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Abort(code) => write!(f, "0x{code:08X}"),
            Refusal::Silence => f.write_str("no answer"),
        }
    }
}

/// A drive of the bus.
#[derive(Clone, Copy, Debug)]
struct Member {
    node: u8,
    mix: &'static Mix,
    personality: &'static Personality,
}

/// The bus.
#[derive(Debug)]
pub struct MixedBus {
    bus: Bus,
    members: Vec<Member>,
    begin: Instant,
    answers: Vec<Answer>,
    ranges: Vec<(u8, usize, f64, f64)>,
    busy_before_ns: u64,
    outcome: Outcome,
}

fn frame(id: u32, data: &[u8]) -> Frame {
    let mut bytes = [0; 8];
    for (place, byte) in bytes.iter_mut().zip(data) {
        *place = *byte;
    }
    Frame::classic(id as u16, bytes, data.len() as u8)
}

impl MixedBus {
    /// Boots one drive of each mix, nodes 1 and on, maps their PDOs and enables them.
    ///
    /// # Errors
    /// [`NoMix`].
    pub fn new(mixes: &'static [Mix], seed: u64) -> Result<MixedBus, NoMix> {
        let mut members = Vec::new();
        for (node, mix) in (1..).zip(mixes) {
            let personality = personalities::by_name(mix.drive).ok_or(NoMix::NoDrive(mix.drive))?;
            members.push(Member {
                node,
                mix,
                personality,
            });
        }
        let settings = members.iter().filter_map(|member| {
            let id = NodeId::new(member.node)?;
            Some(DriveSettings::new(id, member.personality))
        });
        let mut bus = Bus::new(BusSettings::new(seed, settings.collect()));
        bus.run_until(Instant::ZERO.plus_ms(100));
        // Those that wait for it boot now.
        bus.send(0, frame(0, &[0x80, 0]));
        bus.run_until(Instant::ZERO.plus_ms(200));
        bus.take_traffic();
        let mut it = MixedBus {
            begin: bus.now(),
            bus,
            answers: Vec::new(),
            ranges: Vec::new(),
            busy_before_ns: 0,
            outcome: Outcome::default(),
            members,
        };
        for member in it.members.clone() {
            it.configure(&member)?;
        }
        it.bus.send(0, frame(0, &[0x01, 0]));
        it.bus.run_until(it.bus.now().plus_ms(20));
        for member in it.members.clone() {
            for (index, sub, data) in member.mix.enable {
                it.write(&member, *index, *sub, data)?;
            }
        }
        it.bus.take_traffic();
        it.begin = it.bus.now();
        it.busy_before_ns = it.bus.busy_ns();
        Ok(it)
    }

    /// The present simulated time.
    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    /// The drive at a node, to act upon.
    pub fn drive(&mut self, node: u8) -> Option<&mut VirtualDrive> {
        self.bus.drive(NodeId::new(node)?)
    }

    fn configure(&mut self, member: &Member) -> Result<(), NoMix> {
        for (index, sub, data) in member.mix.configure {
            self.write(member, *index, *sub, data)?;
        }
        let node = u32::from(member.node);
        for rpdo in member.mix.rpdos {
            let id = 0x100 + 0x100 * u32::from(rpdo.number) + node;
            self.map(member, 0x1400 + rpdo.number - 1, id, 1, rpdo.mapped)?;
        }
        for tpdo in member.mix.tpdos {
            let identifier = 0x080 + 0x100 * u32::from(tpdo.number) + node;
            let kind = u8::from(!member.personality.device.dialect.tpdo_type_0_is_cyclic);
            let index = 0x1800 + tpdo.number - 1;
            self.map(member, index, identifier, kind, tpdo.mapped)?;
            self.answers.push(Answer {
                identifier,
                shown: tpdo.shown,
                count: 0,
            });
            self.outcome.answers.push((member.node, identifier, 0));
        }
        let worlds = self.worlds(member.node);
        for (axis, turns) in worlds.into_iter().enumerate() {
            self.ranges.push((member.node, axis, turns, turns));
        }
        Ok(())
    }

    /// Maps a PDO: the standard's way, with the PDO off, or while it is valid where that is the way.
    fn map(
        &mut self,
        member: &Member,
        index: u16,
        identifier: u32,
        kind: u8,
        mapped: &[u32],
    ) -> Result<(), NoMix> {
        let dialect = &member.personality.device.dialect;
        // No remote requests: bit 30 of a TPDO's COB-ID.
        let cob_id = match index {
            0x1800.. if !dialect.reconfigure_while_valid => identifier | 1 << 30,
            _ => identifier,
        };
        if !dialect.reconfigure_while_valid {
            self.write(member, index, 1, &(cob_id | 1 << 31).to_le_bytes())?;
        }
        self.write(member, index, 2, &[kind])?;
        // Empty: mapped as it came.
        if !mapped.is_empty() {
            self.write(member, index + 0x200, 0, &[0])?;
            for (sub, object) in (1..).zip(mapped) {
                self.write(member, index + 0x200, sub, &object.to_le_bytes())?;
            }
            self.write(member, index + 0x200, 0, &[mapped.len() as u8])?;
        }
        self.write(member, index, 1, &cob_id.to_le_bytes())
    }

    fn write(&mut self, member: &Member, index: u16, sub: u8, data: &[u8]) -> Result<(), NoMix> {
        let [low, high] = index.to_le_bytes();
        let mut bytes = vec![0x22, low, high, sub];
        bytes.extend(data);
        if !member.personality.device.dialect.short_requests {
            bytes[0] |= 1 | (4 - data.len() as u8) << 2;
            bytes.resize(8, 0);
        }
        self.ask(member, &bytes).map(|_| ())
    }

    fn read(&mut self, member: &Member, index: u16, sub: u8) -> Result<[u8; 4], NoMix> {
        let [low, high] = index.to_le_bytes();
        self.ask(member, &[0x40, low, high, sub, 0, 0, 0, 0])
    }

    fn ask(&mut self, member: &Member, request: &[u8]) -> Result<[u8; 4], NoMix> {
        let node = u32::from(member.node);
        self.bus.take_traffic();
        self.bus.send(0, frame(0x600 + node, request));
        self.bus.run_until(self.bus.now().plus_ms(5));
        let traffic = self.bus.take_traffic();
        let answer = traffic
            .iter()
            .find(|traffic| traffic.frame.raw_id() == 0x580 + node);
        let why = match answer.map(|answer| answer.frame.bytes()) {
            Some([0x80, _, _, _, code @ ..]) => Refusal::Abort(u32::from_le_bytes(code)),
            Some([_, _, _, _, data @ ..]) => return Ok(data),
            None => Refusal::Silence,
        };
        Err(NoMix::Refused {
            node: member.node,
            drive: member.mix.drive,
            index: u16::from_le_bytes([request[1], request[2]]),
            sub: request[3],
            why,
        })
    }

    /// The true positions of a drive's shafts, turns.
    fn worlds(&mut self, node: u8) -> Vec<f64> {
        self.drive(node).map_or(vec![], |drive| {
            let worlds = drive.worlds().iter();
            worlds.map(|world| world.truth().position_turns()).collect()
        })
    }

    /// Runs for so many cycles. What the bus carries is shown to `see`.
    pub fn run(&mut self, cycles: u64, mut see: impl FnMut(&Traffic)) -> Outcome {
        let began = RealTime::now();
        let period_ns = 1_000_000_000 / u64::from(SYNC_HZ);
        for _ in 0..cycles {
            let seconds = self.outcome.cycles as f64 / f64::from(SYNC_HZ);
            self.bus.send(0, frame(0x80, &[]));
            for Member { node, mix, .. } in &self.members {
                for rpdo in mix.rpdos {
                    let id = 0x100 + 0x100 * u32::from(rpdo.number) + u32::from(*node);
                    let data = rpdo.data((WAVE_HZ * seconds + 0.2 * f64::from(*node)).fract());
                    self.bus.send(0, frame(id, &data));
                }
            }
            self.outcome.cycles += 1;
            self.bus
                .run_until(self.begin.plus_ns(self.outcome.cycles * period_ns));
            self.look(&mut see);
        }
        let busy_ns = self.bus.busy_ns() - self.busy_before_ns;
        self.outcome.load = busy_ns as f64 / self.bus.now().since_ns(self.begin) as f64;
        self.outcome.wall += began.elapsed();
        let mut outcome = self.outcome.clone();
        let ranges = self.ranges.iter();
        outcome.moved = ranges
            .map(|(node, axis, least, greatest)| (*node, *axis, greatest - least))
            .collect();
        for member in self.members.clone() {
            let drive = NodeId::new(member.node).and_then(|id| self.bus.drive(id));
            let (counters, lost) = drive
                .map(|drive| (drive.error_counters(), drive.lost_frames()))
                .unwrap_or_default();
            outcome.counters.push((member.node, counters));
            outcome.lost += lost;
        }
        outcome
    }

    /// The error register 0x1001 of each drive. This takes time: no cycle may follow.
    ///
    /// # Errors
    /// A drive does not tell it.
    pub fn error_registers(&mut self) -> Result<Vec<(u8, u8)>, NoMix> {
        let members = self.members.clone().into_iter();
        members
            .map(|member| {
                let [register, ..] = self.read(&member, 0x1001, 0)?;
                Ok((member.node, register))
            })
            .collect()
    }

    /// What came since the last SYNC, which must be all answers, once each.
    fn look(&mut self, see: &mut impl FnMut(&Traffic)) {
        for traffic in self.bus.take_traffic() {
            see(&traffic);
            self.outcome.frames += 1;
            let Sender::Drive(_) = traffic.sender else {
                continue;
            };
            let identifier = traffic.frame.raw_id();
            let mut answers = self.answers.iter_mut();
            match answers.find(|answer| answer.identifier == identifier) {
                Some(answer) => {
                    answer.count += 1;
                    if self.outcome.cycles > WARM_UP && !answer.shown.is_in(&traffic.frame) {
                        self.outcome.not_following += 1;
                    }
                }
                None if identifier & !0x7F == 0x700 => {}
                None => self.outcome.unexpected.push(traffic.frame),
            }
        }
        for (answer, (_, _, all)) in self.answers.iter_mut().zip(&mut self.outcome.answers) {
            self.outcome.missed += u64::from(answer.count != 1);
            *all += core::mem::take(&mut answer.count);
        }
        for (node, axis, least, greatest) in &mut self.ranges {
            let drive = NodeId::new(*node).and_then(|id| self.bus.drive(id));
            if let Some(world) = drive.as_ref().and_then(|drive| drive.worlds().get(*axis)) {
                *least = least.min(world.truth().position_turns());
                *greatest = greatest.max(world.truth().position_turns());
            }
        }
    }
}
