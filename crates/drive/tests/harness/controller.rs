//! Bytes as a script: frames, serial bytes, time, sensors and the host's doings for a Roboteq controller
//! with one to three channels, with the rules that hold whatever the script says.
//!
//! The first byte says how many channels there are, whether they have motors and whether the state
//! machine is on. Of the rest the first half are steps ([`steps`]), the second half comes over the serial
//! line, some bytes after each step.

use canopen::nmt::Reset;
use canopen::{Address, Instant, NodeId};
use control::io::{Duty, Sample, Signals};
use drive::{Body, Drive, Hardware, Health, List, NoHost, ParameterError, Request};
use personalities::Personality;
use personalities::own::AnyOwn;
use personalities::roboteq::with_channels;
use personalities::serial::{CommandLine, Objects};
use plant::{EC_45_FLAT_339281, Encoder, Parameters, Plant, VIRTUAL_P3};

use super::canopen_harness::script::{Step, steps};

const ID: u8 = 5;
/// Control periods that one step simulates at most.
const PERIODS: u64 = 40;

/// A body for any number of axes.
#[derive(Clone, Debug)]
struct Many;

#[derive(Clone, Debug)]
struct Members<T>(Vec<T>);

impl Body for Many {
    type List<T: Clone + core::fmt::Debug> = Members<T>;
}

impl<T> AsRef<[T]> for Members<T> {
    fn as_ref(&self) -> &[T] {
        &self.0
    }
}

impl<T> AsMut<[T]> for Members<T> {
    fn as_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T: Clone + core::fmt::Debug> List<T> for Members<T> {
    fn build(
        count: usize,
        make: impl FnMut(usize) -> Result<T, ParameterError>,
    ) -> Result<Members<T>, ParameterError> {
        (0..count).map(make).collect::<Result<_, _>>().map(Members)
    }

    fn first(&self) -> &T {
        &self.0[0]
    }
}

type Controller = Drive<Vec<u8>, AnyOwn, Many>;

/// Runs a whole script.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let [kind, rest @ ..] = input else {
        return;
    };
    let personality = with_channels(kind % 3 + 1).expect("one to three");
    let (script, line) = rest.split_at(rest.len() / 2);
    let mut world = World::new(personality, kind & 4 != 0);
    if kind & 8 != 0 {
        world.enable();
    }
    let mut line = line.chunks(usize::from(kind >> 4) + 1);
    for step in steps(&personality.device.table, ID, script) {
        world.act(step);
        world.say(line.next().unwrap_or(&[]));
        world.check();
    }
    for bytes in line {
        world.say(bytes);
        world.act(Step::Wait { ns: 1_000_000 });
        world.check();
    }
    world.act(Step::TakeAll);
}

struct World {
    personality: &'static Personality,
    drive: Controller,
    line: CommandLine,
    plants: Vec<Plant<f32>>,
    has_motors: bool,
    stored: Vec<u8>,
    pending: bool,
    now: Instant,
    random: u32,
    /// For how many milliseconds each axis has been in fault.
    faulty_ticks: Vec<u32>,
}

fn boot(personality: &'static Personality, stored: &[u8], now: Instant) -> Controller {
    let hardware = Hardware {
        scales: VIRTUAL_P3.scales,
        duty_margin: 0.0,
    };
    let id = NodeId::new(ID).expect("a node ID");
    let memory = vec![0; personality.device.table.image_bytes()];
    let made = Drive::build(
        personality,
        hardware,
        memory,
        id,
        1,
        stored,
        Health::default(),
    );
    let (mut drive, _) = made.expect("the defaults make a drive");
    drive.start(now);
    drive
}

fn command_line(personality: &Personality) -> CommandLine {
    let port = personality.serial.expect("a serial line");
    CommandLine::new(port.commands, personality.axes.len() as u8)
}

impl World {
    fn new(personality: &'static Personality, has_motors: bool) -> World {
        let parameters = Parameters {
            motor: EC_45_FLAT_339281,
            encoder: Encoder::ideal(4096, 0),
            supply_v: 24.0,
            thermal: None,
            ..VIRTUAL_P3
        };
        World {
            personality,
            drive: boot(personality, &[], Instant::ZERO),
            line: command_line(personality),
            plants: vec![Plant::new(&parameters); personality.axes.len()],
            has_motors,
            stored: Vec::new(),
            pending: false,
            now: Instant::ZERO,
            random: 0x2545_F491,
            faulty_ticks: vec![0; personality.axes.len()],
        }
    }

    /// With the state machine, and every channel in operation.
    fn enable(&mut self) {
        self.periods(2);
        self.say(b"^ECHOF 1\r^FSA 1\r");
        for channel in 1..=self.personality.axes.len() {
            self.say(format!("!CW {channel} 6\r!CW {channel} 15\r").as_bytes());
        }
        for (channel, part) in (1..).zip(self.drive.comms().axes()) {
            assert_eq!(
                part.state(),
                cia402::State::OperationEnabled,
                "channel {channel}"
            );
        }
    }

    fn next_random(&mut self) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random
    }

    fn sample(&mut self, axis: usize) -> Sample<f32> {
        if self.has_motors {
            return self.plants[axis].sample();
        }
        let mut adc = || (self.next_random() >> 20) as f32;
        let (phase_adc, bus_adc, temperature_adc) = ([adc(), adc()], adc(), adc());
        Sample {
            phase_adc,
            encoder: (self.next_random() % 4096) as i32,
            bus_adc,
            temperature_adc,
            overcurrent: false,
            encoder_valid: !self.next_random().is_multiple_of(64),
        }
    }

    fn periods(&mut self, count: u64) {
        for _ in 0..count {
            for axis in 0..self.plants.len() {
                let sample = self.sample(axis);
                let duty = self.drive.axis_period(axis, &sample, &Signals::QUIET);
                self.check_duty(axis, &duty);
                self.plants[axis].load(&duty);
            }
            if self.has_motors {
                for _ in 0..5 {
                    Plant::step_axes(&mut self.plants);
                }
            }
        }
    }

    fn check_duty(&self, axis: usize, duty: &Duty<f32>) {
        for phase in duty.phase {
            assert!((0.0..=1.0).contains(&phase), "{duty:?}");
        }
        let mut axes = self.drive.comms().axes();
        let state = axes.nth(axis).expect("an axis").state();
        let powered = matches!(
            state,
            cia402::State::OperationEnabled
                | cia402::State::QuickStopActive
                | cia402::State::FaultReactionActive
        );
        // In open loop the voltage is the controller's own: a fault ends it with the next millisecond.
        let ends = state == cia402::State::Fault && self.faulty_ticks[axis] < 2;
        assert!(!duty.enabled || powered || ends, "{state:?}");
    }

    /// Some bytes over the serial line; what comes back is text.
    fn say(&mut self, bytes: &[u8]) {
        let mut host = NoHost;
        let mut objects = self.drive.local(self.now, &mut host);
        for byte in bytes {
            self.line.receive(*byte, self.now, &mut objects);
            while let Some(sent) = self.line.transmit() {
                assert!(matches!(sent, b'\r' | 0x06 | b' '..=b'~'), "{sent:#04X}");
            }
        }
        self.obey();
    }

    fn act(&mut self, step: Step) {
        match step {
            Step::Receive(frame) => self.drive.receive(&frame, self.now, &mut NoHost),
            Step::Wait { ns } => {
                self.now = self.now.plus_ns(ns);
                self.periods((ns / 50_000).min(PERIODS));
                self.drive.poll(self.now, &mut NoHost);
                let axes = self.drive.comms().axes();
                for (ticks, axis) in self.faulty_ticks.iter_mut().zip(axes) {
                    let is_faulty = axis.state() == cia402::State::Fault;
                    *ticks = if is_faulty { *ticks + 1 } else { 0 };
                }
                let deadline = self.drive.next_deadline();
                assert!(deadline > self.now || self.now == Instant::NEVER);
                if self.now >= self.line.next_deadline() {
                    let mut host = NoHost;
                    let mut objects = self.drive.local(self.now, &mut host);
                    self.line.poll(self.now, &mut objects);
                }
            }
            Step::Poll => self.drive.poll(self.now, &mut NoHost),
            Step::Announce { code, register } => self.drive.report(Health {
                watchdog_reset: code & 1 != 0,
                store_damaged: code & 2 != 0,
                can_overrun: code & 4 != 0,
                bus_off_recovered: register & 1 != 0,
                error_passive: register & 2 != 0,
            }),
            Step::Complete(result) => {
                if core::mem::take(&mut self.pending) {
                    self.line.stored(result.is_ok());
                    self.drive.store_done(result, self.now);
                }
            }
            Step::TakeOne => {
                self.drive.transmit(&mut NoHost);
            }
            Step::TakeAll => {
                // Emergencies, four TPDOs, one SDO answer, boot-up, heartbeat.
                let taken = (0..=20).take_while(|_| self.drive.transmit(&mut NoHost).is_some());
                assert!(taken.count() <= 20, "transmit has no end");
            }
            Step::Judge(_) => self.periods(1),
            Step::Restart => {
                let id = self.drive.comms().node().id();
                self.drive.reset_communication(&self.stored, id, self.now);
            }
        }
        self.obey();
    }

    fn obey(&mut self) {
        while let Some(request) = self.drive.take_request() {
            match request {
                Request::Store(_) | Request::Restore(_) => {
                    super::script::keep(&mut self.drive, &request, &mut self.stored);
                    self.pending = true;
                }
                Request::Reset(Reset::Communication) => {
                    let id = self.drive.comms().node().id();
                    self.drive.reset_communication(&self.stored, id, self.now);
                }
                Request::Reset(Reset::Node) => {
                    self.drive = boot(self.personality, &self.stored, self.now);
                    self.line = command_line(self.personality);
                    self.pending = false;
                }
            }
        }
    }

    fn read(&mut self, index: u16, sub: u8) -> i64 {
        let mut host = NoHost;
        let mut objects = self.drive.local(self.now, &mut host);
        let value = objects.read(Address::new(index, sub));
        value.unwrap_or_else(|abort| panic!("{index:04X},{sub}: {abort:?}"))
    }

    /// What each channel shows.
    fn check(&mut self) {
        let has_machine = self.read(0x30F1, 0) != 0;
        for channel in 0..self.plants.len() as u16 {
            let window = 0x6000 + 0x800 * channel;
            let word = self.read(window + 0x41, 0) as u16;
            if has_machine {
                assert_eq!(word & 0xE290, 0x0210, "{word:04X}: bits that never change");
                // Table 14.
                let known = matches!(word & 0x4F, 0x40 | 0x0F | 0x08)
                    || matches!(word & 0x6F, 0x21 | 0x23 | 0x27 | 0x07);
                assert!(known, "{word:04X}");
            } else {
                assert_eq!(word, 0, "R24");
            }
            let mode = self.read(window + 0x61, 0);
            assert!((-4..=4).contains(&mode), "{mode}");
            let position = self.read(window + 0x64, 0);
            if matches!(mode, -1 | -2) {
                assert!((-1000..=1000).contains(&position), "{position}");
            }
            let speed = self.read(window + 0xFF, 0);
            assert!((-500_000..=500_000).contains(&speed) || self.fresh_speed(window, speed));
            assert!(self.read(0x2111, 0) & !0x1FF == 0);
        }
        for feedback in self.drive.feedbacks() {
            super::script::check_feedback(&feedback);
        }
    }

    /// R10: a speed beyond what the controller takes is cut within a millisecond.
    fn fresh_speed(&mut self, window: u16, speed: i64) -> bool {
        for _ in 0..3 {
            self.now = self.now.plus_ns(1_000_000);
            self.drive.poll(self.now, &mut NoHost);
        }
        self.read(window + 0xFF, 0) != speed
    }
}
