//! Bytes as a script: frames, time, sensors and the host's doings for a whole P3, with the rules
//! that hold whatever the script says.
//!
//! The first byte chooses between a simulated motor and sensors that read anything, the second says
//! how many bytes after it are the stored parameters, the rest are steps ([`steps`]).

use canopen::nmt::Reset;
use canopen::{Instant, NodeId, NodeMemory};
use control::Feedback;
use control::io::{Duty, Sample, Signals};
use drive::{Body, Drive, Hardware, Health, NoHost, Request};
use personalities::own::OwnBehaviour;
use personalities::p3::{IMAGE_BYTES, P3};
use plant::{Parameters, Plant};

use super::canopen_harness::script::{Step, steps};

const ID: u8 = 5;
/// Control periods that one step simulates at most.
const PERIODS: u64 = 40;

type P3Drive = Drive<[u8; IMAGE_BYTES]>;

/// Runs a whole script.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let [kind, stored, rest @ ..] = input else {
        return;
    };
    let (stored, rest) = rest.split_at(usize::from(*stored).min(rest.len()));
    let mut world = World::new(kind & 1 != 0, stored);
    if kind & 2 != 0 {
        world.enable();
    }
    for step in steps(&P3.device.table, ID, rest) {
        world.act(step);
    }
    world.act(Step::TakeAll);
}

/// A drive, its surroundings and the clock.
pub struct World {
    pub drive: P3Drive,
    pub plant: Plant<f32>,
    has_motor: bool,
    stored: Vec<u8>,
    pending: bool,
    now: Instant,
    random: u32,
}

fn boot(stored: &[u8], health: Health, now: Instant) -> P3Drive {
    let hardware = Hardware {
        scales: plant::VIRTUAL_P3.scales,
        duty_margin: 0.0,
    };
    let id = NodeId::new(ID).expect("a node ID");
    let (mut drive, _) = Drive::new(&P3, hardware, [0; IMAGE_BYTES], id, 1, stored, health)
        .expect("the defaults make a drive");
    drive.start(now);
    drive
}

impl World {
    pub fn new(has_motor: bool, stored: &[u8]) -> World {
        World {
            drive: boot(stored, Health::default(), Instant::ZERO),
            plant: Plant::new(&Parameters::default()),
            has_motor,
            stored: stored.to_vec(),
            pending: false,
            now: Instant::ZERO,
            random: 0x2545_F491,
        }
    }

    fn enable(&mut self) {
        self.periods(2);
        for word in [0x86, 0x0F] {
            let data = [0x22, 0x40, 0x60, 0, word, 0, 0, 0];
            self.act(Step::Receive(can::Frame::classic(0x605, data, 8)));
        }
        self.act(Step::TakeAll);
    }

    fn next_random(&mut self) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random
    }

    fn sample(&mut self) -> Sample<f32> {
        if self.has_motor {
            return self.plant.sample();
        }
        let mut adc = || (self.next_random() >> 20) as f32;
        let (phase_adc, bus_adc, temperature_adc) = ([adc(), adc()], adc(), adc());
        let encoder = match self.next_random() % 16 {
            0 => self.next_random() as i32,
            _ => (self.next_random() % 4096) as i32,
        };
        Sample {
            phase_adc,
            encoder,
            bus_adc,
            temperature_adc,
            overcurrent: false,
            encoder_valid: true,
        }
    }

    /// Control periods, and what must be true of each.
    pub fn periods(&mut self, count: u64) {
        for _ in 0..count {
            let sample = self.sample();
            let duty = self.drive.control_period(&sample, &Signals::QUIET);
            self.check_duty(&duty);
            if self.has_motor {
                self.plant.load(&duty);
                let dead_time_ns = self.drive.timing().dead_time_ns;
                self.plant
                    .set_timer_dead_time_s(f64::from(dead_time_ns) * 1e-9);
                for _ in 0..5 {
                    self.plant.step();
                }
            }
        }
        check_feedback(&self.drive.feedback());
    }

    fn check_duty(&self, duty: &Duty<f32>) {
        for phase in duty.phase {
            assert!((0.0..=1.0).contains(&phase), "{duty:?}");
        }
        let axis = self.drive.comms().axis();
        let powered = matches!(
            axis.state(),
            cia402::State::OperationEnabled | cia402::State::QuickStopActive
        );
        assert!(!duty.enabled || powered, "{:?}", axis.state());
    }

    /// Does one step.
    ///
    /// # Panics
    /// If a rule is broken.
    pub fn act(&mut self, step: Step) {
        match step {
            Step::Receive(frame) => self.drive.receive(&frame, self.now, &mut NoHost),
            Step::Wait { ns } => {
                self.now = self.now.plus_ns(ns);
                self.periods((ns / 50_000).min(PERIODS));
                self.drive.poll(self.now, &mut NoHost);
                let deadline = self.drive.next_deadline();
                assert!(deadline > self.now || self.now == Instant::NEVER);
            }
            Step::Poll => self.spurious_poll(),
            Step::Announce { code, register } => self.drive.report(Health {
                watchdog_reset: code & 1 != 0,
                store_damaged: code & 2 != 0,
                can_overrun: code & 4 != 0,
                bus_off_recovered: register & 1 != 0,
                error_passive: register & 2 != 0,
            }),
            Step::Complete(result) => {
                if core::mem::take(&mut self.pending) {
                    self.drive.store_done(result, self.now);
                }
            }
            Step::TakeOne => {
                self.drive.transmit(&mut NoHost);
            }
            Step::TakeAll => {
                // Eight emergencies, four TPDOs, one SDO answer, boot-up, heartbeat.
                let taken = (0..=15).take_while(|_| self.drive.transmit(&mut NoHost).is_some());
                assert!(taken.count() <= 15, "transmit has no end");
            }
            Step::Judge(_) => self.periods(1),
            Step::Restart => {
                let id = self.drive.comms().node().id();
                self.drive.reset_communication(&self.stored, id, self.now);
            }
        }
        self.obey();
        self.check_words();
    }

    fn spurious_poll(&mut self) {
        self.drive.poll(self.now, &mut NoHost);
        let before = (
            self.drive.next_deadline(),
            self.drive.comms().node().is_silent(),
        );
        self.drive.poll(self.now, &mut NoHost);
        let after = (
            self.drive.next_deadline(),
            self.drive.comms().node().is_silent(),
        );
        assert_eq!(before, after);
    }

    /// What the drive asks of its host, done at once but for the acknowledge of a store.
    fn obey(&mut self) {
        while let Some(request) = self.drive.take_request() {
            match request {
                Request::Store(_) | Request::Restore(_) => {
                    keep(&mut self.drive, &request, &mut self.stored);
                    self.pending = true;
                }
                Request::Reset(Reset::Communication) => {
                    let id = self.drive.comms().node().id();
                    self.drive.reset_communication(&self.stored, id, self.now);
                }
                Request::Reset(Reset::Node) => {
                    self.drive = boot(&self.stored, Health::default(), self.now);
                    self.pending = false;
                }
            }
        }
    }

    fn check_words(&mut self) {
        let axis = self.drive.comms().axis();
        let word = axis.statusword().0;
        // CiA 402 table 28: the eight patterns.
        let known = matches!(word & 0x4F, 0x00 | 0x40 | 0x0F | 0x08)
            || matches!(word & 0x6F, 0x21 | 0x23 | 0x27 | 0x07);
        assert!(known, "{word:04X}");
        assert!(P3.cia402.modes().contains(axis.mode()) || axis.mode() == cia402::Mode::IDLE);
    }
}

/// What a request to store or restore leaves in `stored`.
pub(super) fn keep<M: NodeMemory, O: OwnBehaviour, B: Body>(
    drive: &mut Drive<M, O, B>,
    request: &Request,
    stored: &mut Vec<u8>,
) {
    let mut bytes = vec![0; 16 * 1024];
    let used = match *request {
        Request::Store(request) => drive
            .stored(request, stored, &mut bytes)
            .expect("16 KiB hold every object"),
        Request::Restore(request) => drive
            .restored(request, stored, &mut bytes)
            .expect("less than was stored"),
        Request::Reset(_) => return,
    };
    bytes.truncate(used);
    *stored = bytes;
}

pub(super) fn check_feedback(feedback: &Feedback<f32>) {
    for value in [
        feedback.velocity,
        feedback.velocity_reported,
        feedback.current_q_a,
        feedback.current_d_a,
        feedback.demand_velocity,
        feedback.demand_current_a,
        feedback.next_velocity,
        feedback.next_current_a,
        feedback.following_error,
        feedback.bus_voltage_v,
        feedback.temperature_c,
    ] {
        assert!(value.is_finite(), "{feedback:?}");
    }
    for fraction in [feedback.demand_fraction, feedback.next_fraction] {
        assert!((0.0..1.0).contains(&fraction), "{fraction}");
    }
}
