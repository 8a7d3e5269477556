//! A whole drive on a simulated motor, with switches at places of its shaft.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file is a crate of its own and uses a part"
)]

use can::Frame;
use canopen::{Instant, NodeId};
use control::io::{Duty, Signals};
use drive::{Drive, Hardware, Health, NoHost};
use personalities::Personality;
use plant::{Parameters, Plant};

pub const COUNTS: f64 = 4096.0;
pub const ID: u16 = 5;
/// The encoder's reading at the shaft's place 0: the rotor stands under phase A (0x3011,1).
pub const ENCODER_AT_START: f64 = 3_576.0;
pub const HOME_SWITCH: u32 = 1 << 2;

/// Switches as ranges of the shaft's place, in encoder counts from its start.
#[derive(Clone, Copy, Default)]
pub struct Switches {
    pub negative_limit: Option<f64>,
    pub positive_limit: Option<f64>,
    pub home: Option<(f64, f64)>,
    /// Which inputs read inverted.
    pub inverted: u32,
}

pub struct Bench {
    pub drive: Drive<Vec<u8>>,
    pub plant: Plant<f32>,
    pub switches: Switches,
    pub now: Instant,
    pub extra_inputs: u32,
    pub torque_off: bool,
    pub auxiliary_adc: [f32; 2],
    /// What the bridge was last told.
    pub duty: Duty<f32>,
    /// The shaft does not leave this range of places.
    pub stops: Option<(f64, f64)>,
}

impl Bench {
    pub fn new(personality: &'static Personality, switches: Switches) -> Bench {
        let hardware = Hardware {
            scales: plant::VIRTUAL_P3.scales,
            duty_margin: 0.0,
        };
        let memory = vec![0; personality.device.table.image_bytes()];
        let id = NodeId::new(ID as u8).expect("a node ID");
        let made = Drive::new(personality, hardware, memory, id, 1, &[], Health::default());
        let (mut drive, _) = made.expect("defaults that make a drive");
        drive.start(Instant::ZERO);
        let mut parameters = Parameters::default();
        // The friction that virtual drives have.
        parameters.motor.coulomb_friction_nm *= 0.02;
        parameters.motor.static_friction_nm *= 0.02;
        parameters.motor.viscous_friction_nms *= 0.02;
        let mut bench = Bench {
            drive,
            plant: Plant::new(&parameters),
            switches,
            now: Instant::ZERO,
            extra_inputs: 0,
            torque_off: false,
            auxiliary_adc: [2048.0; 2],
            duty: Duty {
                phase: [0.5; 3],
                enabled: false,
            },
            stops: None,
        };
        bench.run_ms(10);
        while bench.drive.transmit(&mut NoHost).is_some() {}
        bench
    }

    /// Place of the shaft, counts of the encoder.
    pub fn place(&self) -> f64 {
        self.plant.truth().position_turns() * COUNTS
    }

    pub fn inputs(&self) -> u32 {
        let place = self.place();
        let mut inputs = self.extra_inputs;
        inputs |= u32::from(self.switches.negative_limit.is_some_and(|at| place < at));
        inputs |= u32::from(self.switches.positive_limit.is_some_and(|at| place >= at)) << 1;
        let home = self.switches.home;
        inputs |= u32::from(home.is_some_and(|(from, to)| (from..to).contains(&place))) << 2;
        inputs ^ self.switches.inverted
    }

    /// One control period.
    pub fn period(&mut self) {
        let signals = Signals {
            inputs: self.inputs(),
            torque_off: self.torque_off,
            auxiliary_adc: self.auxiliary_adc,
            ..Signals::QUIET
        };
        self.duty = self.drive.control_period(&self.plant.sample(), &signals);
        self.plant.load(&self.duty);
        let timing = self.drive.timing();
        self.plant
            .set_timer_dead_time_s(f64::from(timing.dead_time_ns) * 1e-9);
        for _ in 0..timing.periods_per_control {
            self.plant.step();
        }
        if let Some((low, high)) = self.stops {
            let (place, speed) = (self.place(), self.plant.truth().speed_rad_s);
            // A stiff spring with its own damping.
            let into = (place - place.clamp(low, high)) as f32;
            let torque = if into == 0.0 {
                0.0
            } else {
                0.002 * into + 3e-4 * speed
            };
            self.plant.set_load_torque_nm(torque);
        }
        self.now = self.now.plus_ns(50_000);
        if self.now >= self.drive.next_deadline() {
            self.drive.poll(self.now, &mut NoHost);
        }
    }

    pub fn run_ms(&mut self, ms: u32) {
        for _ in 0..ms * 20 {
            self.period();
        }
    }

    /// The answer to an SDO request.
    pub fn ask(&mut self, data: [u8; 8]) -> [u8; 8] {
        let frame = Frame::classic(0x600 + ID, data, 8);
        self.drive.receive(&frame, self.now, &mut NoHost);
        loop {
            let frame = self.drive.transmit(&mut NoHost).expect("an answer");
            if frame.raw_id() == u32::from(0x580 + ID) {
                return frame.bytes();
            }
        }
    }

    pub fn try_write(&mut self, index: u16, sub: u8, value: i32, bytes: u8) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let mut data = [0; 4];
        data[..usize::from(bytes)].copy_from_slice(&[a, b, c, d][..usize::from(bytes)]);
        let [a, b, c, d] = data;
        let command = 0x23 | (4 - bytes) << 2;
        let answer = self.ask([command, low, high, sub, a, b, c, d]);
        match answer {
            [0x60, ..] => Ok(()),
            [0x80, _, _, _, abort @ ..] => Err(u32::from_le_bytes(abort)),
            other => panic!("{other:02X?}"),
        }
    }

    #[track_caller]
    pub fn write(&mut self, index: u16, sub: u8, value: i32, bytes: u8) {
        let result = self.try_write(index, sub, value, bytes);
        assert_eq!(result, Ok(()), "{index:04X},{sub} := {value}");
    }

    #[track_caller]
    pub fn read(&mut self, index: u16, sub: u8) -> i32 {
        let [low, high] = index.to_le_bytes();
        let answer = self.ask([0x40, low, high, sub, 0, 0, 0, 0]);
        let [command, _, _, _, value @ ..] = answer;
        assert_ne!(command, 0x80, "{index:04X},{sub}: {answer:02X?}");
        i32::from_le_bytes(value)
    }

    /// Bits 10, 12 and 13.
    pub fn bits(&mut self) -> (bool, bool, bool) {
        let status = self.read(0x6041, 0);
        let bit = |n: i32| status >> n & 1 == 1;
        (bit(10), bit(12), bit(13))
    }

    /// In operation enabled and mode 6.
    pub fn enable(&mut self) {
        self.write(0x6040, 0, 0x06, 2);
        self.write(0x6040, 0, 0x0F, 2);
        self.write(0x6060, 0, 6, 1);
        assert_eq!(self.read(0x6061, 0), 6);
        assert_eq!(self.bits(), (true, false, false), "not started");
    }

    pub fn start(&mut self, method: i32, offset: i32) {
        self.write(0x6098, 0, method, 1);
        self.write(0x607C, 0, offset, 4);
        self.write(0x6040, 0, 0x0F, 2);
        self.write(0x6040, 0, 0x1F, 2);
    }

    /// Until homing has ended; what bits 10, 12, 13 are then.
    pub fn finish(&mut self) -> (bool, bool, bool) {
        for _ in 0..20_000 {
            self.run_ms(1);
            let bits = self.bits();
            if bits.0 {
                return bits;
            }
        }
        panic!("homing does not end");
    }

    /// Lets the drive turn its shaft to a position, and chooses mode 6 again.
    pub fn put(&mut self, position: i32) {
        self.write(0x6060, 0, 1, 1);
        self.write(0x607A, 0, position, 4);
        self.write(0x6081, 0, 200_000, 4);
        self.write(0x6040, 0, 0x2F, 2);
        self.write(0x6040, 0, 0x3F, 2);
        for _ in 0..3_000 {
            self.run_ms(1);
            if self.bits().0 {
                break;
            }
        }
        self.run_ms(50);
        self.write(0x6040, 0, 0x0F, 2);
        self.write(0x6060, 0, 6, 1);
        self.run_ms(50);
    }

    /// The place that has position 0, in counts of the shaft's place.
    pub fn zero(&mut self) -> f64 {
        let position = self.drive.feedback().position;
        self.place() - f64::from(position)
    }
}
