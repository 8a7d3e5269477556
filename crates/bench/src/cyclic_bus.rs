//! Cyclic synchronous position on one bus: how many drives a bus carries at which SYNC rate, and how
//! long the simulation takes.
//!
//! Every cycle the master sends a SYNC and a target position to each drive; each drive answers the
//! SYNC with statusword and position, and acts upon the target of the cycle before (RPDO and TPDO of
//! type 1). The targets are sines, 90° apart.

use std::time::{Duration, Instant as RealTime};

use can::Frame;
use canopen::{Instant, NodeId};
use sim::{Bus, BusSettings, DriveSettings, Sender, Traffic};

/// Amplitude of the targets, counts, and their frequency, Hz: at most 25,000 counts/s, 368 rpm.
const AMPLITUDE: f64 = 4_000.0;
const TARGET_HZ: f64 = 1.0;

/// What runs on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// Drives, nodes 1 to this; at most 15.
    pub drives: u8,
    /// SYNC per second, a divisor of 1000 from 4 on: the drives are told whole milliseconds in a byte
    /// (0x60C2,1).
    pub sync_hz: u32,
}

impl Cycle {
    /// Four drives at 1 kHz: four fifths of 1 Mbit/s.
    pub const FAST: Cycle = Cycle {
        drives: 4,
        sync_hz: 1000,
    };
    /// Six drives at 500 Hz.
    pub const WIDE: Cycle = Cycle {
        drives: 6,
        sync_hz: 500,
    };

    /// What 0x60C2,1 is told.
    ///
    /// # Errors
    /// [`NoCycle::Rate`].
    pub fn period_ms(self) -> Result<u8, NoCycle> {
        let sync_hz = self.sync_hz;
        let ms = 1000u32
            .checked_div(sync_hz)
            .filter(|ms| ms * sync_hz == 1000);
        ms.and_then(|ms| u8::try_from(ms).ok())
            .ok_or(NoCycle::Rate { sync_hz })
    }
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// SYNCs sent.
    pub cycles: u64,
    /// SYNCs that some drive did not answer before the next.
    pub missed: u64,
    /// Answers in which a drive was not in operation enabled, or did not follow its command.
    pub not_following: u64,
    /// Frames on the bus.
    pub frames: u64,
    /// Share of the time for which the wire was busy, interframe spaces included.
    pub load: f64,
    /// Largest following error that a drive measured in any control period, counts.
    pub following_error_counts: f64,
    /// Real time that it took.
    pub wall: Duration,
}

/// Something is not as it must be before the cycle can begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCycle {
    /// The drives cannot be told the period.
    #[error(
        "{sync_hz} SYNC per second are no whole milliseconds up to 255 between two; use a divisor of \
         1000 from 4 on: 4, 5, 8, 10, 20, 25, 40, 50, 100, 125, 200, 250, 500 or 1000"
    )]
    Rate {
        /// What was asked for.
        sync_hz: u32,
    },
    /// A drive refuses a write, or does not answer.
    #[error("node {node} does not take 0x{index:04X},{sub}")]
    Refused {
        /// The drive.
        node: u8,
        /// What was written.
        index: u16,
        /// What was written.
        sub: u8,
    },
}

/// A bus on which the cycle runs.
#[derive(Debug)]
pub struct CyclicBus {
    cycle: Cycle,
    period_ms: u8,
    bus: Bus,
    begin: Instant,
    answered: Vec<bool>,
    outcome: Outcome,
    busy_before_ns: u64,
}

fn frame(id: u16, data: &[u8]) -> Frame {
    let mut bytes = [0; 8];
    for (place, byte) in bytes.iter_mut().zip(data) {
        *place = *byte;
    }
    Frame::classic(id, bytes, data.len() as u8)
}

impl CyclicBus {
    /// Boots the drives, maps the PDOs and enables mode 8.
    ///
    /// # Errors
    /// [`NoCycle`].
    pub fn new(cycle: Cycle, seed: u64) -> Result<CyclicBus, NoCycle> {
        let period_ms = cycle.period_ms()?;
        let ids = (1..=cycle.drives).filter_map(NodeId::new);
        let drives: Vec<DriveSettings> = ids
            .map(|id| DriveSettings::new(id, &personalities::p3::P3))
            .collect();
        let mut bus = Bus::new(BusSettings::new(seed, drives));
        bus.run_until(Instant::ZERO.plus_ms(100));
        bus.take_traffic();
        let mut it = CyclicBus {
            cycle,
            period_ms,
            begin: bus.now(),
            bus,
            answered: vec![false; usize::from(cycle.drives)],
            outcome: Outcome {
                cycles: 0,
                missed: 0,
                not_following: 0,
                frames: 0,
                load: 0.0,
                following_error_counts: 0.0,
                wall: Duration::ZERO,
            },
            busy_before_ns: 0,
        };
        for node in 1..=cycle.drives {
            it.configure(node)?;
        }
        it.begin = it.bus.now();
        it.busy_before_ns = it.bus.busy_ns();
        for drive in 1..=cycle.drives {
            if let Some(drive) = NodeId::new(drive).and_then(|id| it.bus.drive(id)) {
                drive.take_extremes();
            }
        }
        Ok(it)
    }

    /// The present simulated time.
    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    fn configure(&mut self, node: u8) -> Result<(), NoCycle> {
        let id = u32::from(node);
        let period_ms = self.period_ms;
        let mut write = |index: u16, sub: u8, data: &[u8]| self.write(node, index, sub, data);
        write(0x1400, 1, &(0x200 + id).to_le_bytes())?;
        write(0x1400, 2, &[1])?;
        write(0x1600, 0, &[0])?;
        write(0x1600, 1, &0x607A_0020_u32.to_le_bytes())?;
        write(0x1600, 0, &[1])?;
        write(0x1800, 1, &(0x180 + id).to_le_bytes())?;
        write(0x1800, 2, &[1])?;
        write(0x1A00, 0, &[0])?;
        write(0x1A00, 1, &0x6041_0010_u32.to_le_bytes())?;
        write(0x1A00, 2, &0x6064_0020_u32.to_le_bytes())?;
        write(0x1A00, 0, &[2])?;
        write(0x60C2, 1, &[period_ms])?;
        write(0x60C2, 2, &[0xFD])?;
        // The present position is where the sine begins.
        write(0x6064, 0, &target(node, 0.0).to_le_bytes())?;
        write(0x607A, 0, &target(node, 0.0).to_le_bytes())?;
        write(0x6040, 0, &[0x86, 0])?;
        write(0x6040, 0, &[0x0F, 0])?;
        write(0x6060, 0, &[8])
    }

    fn write(&mut self, node: u8, index: u16, sub: u8, data: &[u8]) -> Result<(), NoCycle> {
        let [low, high] = index.to_le_bytes();
        let mut bytes = vec![0x22, low, high, sub];
        bytes.extend(data);
        self.bus.send(0, frame(0x600 + u16::from(node), &bytes));
        self.bus.run_until(self.bus.now().plus_ms(2));
        let acknowledged = |traffic: &Traffic| {
            traffic.frame.raw_id() == 0x580 + u32::from(node) && traffic.frame.bytes()[0] == 0x60
        };
        match self.bus.take_traffic().iter().any(acknowledged) {
            true => Ok(()),
            false => Err(NoCycle::Refused { node, index, sub }),
        }
    }

    /// Runs for so many cycles. What the bus carries is shown to `see`.
    pub fn run(&mut self, cycles: u64, mut see: impl FnMut(&Traffic)) -> Outcome {
        let began = RealTime::now();
        for _ in 0..cycles {
            self.bus.run_until(self.begins(self.outcome.cycles));
            self.look(&mut see);
            if self.outcome.cycles > 0 && self.answered.contains(&false) {
                self.outcome.missed += 1;
            }
            self.answered.fill(false);
            self.bus.send(0, frame(0x80, &[]));
            let seconds = self.outcome.cycles as f64 / f64::from(self.cycle.sync_hz);
            for node in 1..=self.cycle.drives {
                let position = target(node, seconds).to_le_bytes();
                self.bus.send(0, frame(0x200 + u16::from(node), &position));
            }
            self.outcome.cycles += 1;
        }
        let end = self.begins(self.outcome.cycles);
        self.bus.run_until(end);
        self.look(&mut see);
        for node in 1..=self.cycle.drives {
            if let Some(drive) = NodeId::new(node).and_then(|id| self.bus.drive(id)) {
                let error = f64::from(drive.take_extremes().following_error_counts);
                self.outcome.following_error_counts =
                    self.outcome.following_error_counts.max(error);
            }
        }
        let busy_ns = self.bus.busy_ns() - self.busy_before_ns;
        self.outcome.load = busy_ns as f64 / end.since_ns(self.begin) as f64;
        self.outcome.wall += began.elapsed();
        self.outcome
    }

    /// When a cycle begins.
    fn begins(&self, cycle: u64) -> Instant {
        self.begin.plus_ms(cycle * u64::from(self.period_ms))
    }

    fn look(&mut self, see: &mut impl FnMut(&Traffic)) {
        for traffic in self.bus.take_traffic() {
            see(&traffic);
            self.outcome.frames += 1;
            let Sender::Drive(_) = traffic.sender else {
                continue;
            };
            let drive = traffic.frame.raw_id().wrapping_sub(0x181) as usize;
            let Some(answered) = self.answered.get_mut(drive) else {
                continue;
            };
            *answered = true;
            let [low, high, ..] = traffic.frame.bytes();
            let statusword = u16::from_le_bytes([low, high]);
            // Operation enabled, and bit 12: the drive follows the command. The first target is applied
            // with the second SYNC, and its answer shows the moment before.
            if self.outcome.cycles > 2 && statusword & 0x106F != 0x1027 {
                self.outcome.not_following += 1;
            }
        }
    }
}

/// Target of a drive, counts.
fn target(node: u8, seconds: f64) -> i32 {
    let angle = core::f64::consts::TAU * (TARGET_HZ * seconds + 0.25 * f64::from(node));
    (AMPLITUDE * angle.sin()).round() as i32
}
