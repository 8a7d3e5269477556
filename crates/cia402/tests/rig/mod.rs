//! A drive around the axis: an ideal motor that follows every demand exactly, interpolated here at
//! 20 kHz with formulas of its own.
#![allow(dead_code)]

use cia402::{
    Actual, Axis, Configuration, Demand, Dialect, Mode, ModeSet, Outcome, State, Target, Targets,
};

/// The manual's drive: one write resets and shuts down, modes only when enabled, no ramps.
pub(crate) static P3: Dialect = Dialect {
    reset_and_command_in_one_write: true,
    modes_only_when_enabled: true,
    mode_display_cleared_on_enable: true,
    ramps_on_stop: false,
    halt_bit: false,
    set_points_at_once: false,
    resting_modes: ModeSet::EMPTY,
    remote_bit: false,
    modes: ModeSet::IMPLEMENTED,
};

pub(crate) static STANDARD: Dialect = Dialect::STANDARD;

/// A control period of the rig, ns.
pub(crate) const PERIOD_NS: u32 = 50_000;

/// One control period: the exact demand values in f64.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sample {
    /// Not wrapped.
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) torque_pm: f64,
}

pub(crate) struct Rig {
    pub(crate) axis: Axis,
    pub(crate) configuration: Configuration,
    pub(crate) targets: Targets,
    pub(crate) actual: Actual,
    pub(crate) demand: Demand,
    pub(crate) elapsed_ns: u64,
    pub(crate) now_ns: u64,
    /// Of each control period since the last `clear`.
    pub(crate) trace: Vec<Sample>,
    /// The motor's position lags the demand by this much, counts.
    pub(crate) lag: i32,
    /// The motor does not move.
    pub(crate) stuck: bool,
    pub(crate) unwrapped: f64,
    /// By how much positions have become greater since the start.
    pub(crate) renamed: i32,
}

impl Rig {
    pub(crate) fn new(dialect: &'static Dialect) -> Rig {
        let mut axis = Axis::new(dialect);
        axis.initialised();
        Rig {
            axis,
            configuration: Configuration {
                profile_velocity: 10_000.0,
                acceleration: 100_000.0,
                deceleration: 200_000.0,
                quick_stop_deceleration: 400_000.0,
                ..Configuration::default()
            },
            targets: Targets::default(),
            actual: Actual {
                voltage: true,
                ..Actual::default()
            },
            demand: Demand::Off,
            elapsed_ns: 0,
            now_ns: 0,
            trace: Vec::new(),
            lag: 0,
            stuck: false,
            unwrapped: 0.0,
            renamed: 0,
        }
    }

    /// In operation enabled with a mode.
    pub(crate) fn enabled(dialect: &'static Dialect, mode: Mode) -> Rig {
        let mut rig = Rig::new(dialect);
        rig.word(0x06);
        rig.word(0x0F);
        assert_eq!(rig.axis.state(), State::OperationEnabled);
        rig.mode(mode).expect("the mode exists");
        rig
    }

    pub(crate) fn word(&mut self, word: u16) -> Outcome {
        let outcome =
            self.axis
                .write_controlword(word, &self.configuration, &self.targets, &self.actual);
        self.fetch();
        outcome
    }

    pub(crate) fn mode(&mut self, mode: Mode) -> Result<(), cia402::ModeRefused> {
        let result = self
            .axis
            .write_mode(mode.0, &self.configuration, &self.targets, &self.actual);
        self.fetch();
        result
    }

    pub(crate) fn receive(&mut self, target: Target) {
        self.axis
            .set_point(target, &self.configuration, &self.targets, &self.actual);
        self.fetch();
    }

    pub(crate) fn status(&self) -> u16 {
        self.axis.statusword().0
    }

    /// Runs for some milliseconds, each beginning with a tick.
    pub(crate) fn run_ms(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.axis
                .tick(&self.configuration, &self.targets, &self.actual);
            self.fetch();
            for _ in 0..1_000_000 / PERIOD_NS {
                self.period();
            }
        }
    }

    /// A millisecond tick alone.
    pub(crate) fn tick(&mut self) {
        self.axis
            .tick(&self.configuration, &self.targets, &self.actual);
        self.fetch();
    }

    pub(crate) fn fetch(&mut self) {
        if let Some(shift) = self.axis.take_position_shift() {
            self.unwrapped += f64::from(shift);
            self.renamed += shift;
            if let Demand::Position { start, .. } = &mut self.demand {
                *start = start.wrapping_add(shift);
            }
            self.settle();
        }
        if let Some(demand) = self.axis.take_demand() {
            self.unwrapped = self.sample().position;
            if let Demand::Position {
                start, fraction, ..
            } = demand
            {
                // Continue the unwrapped count.
                let here = self.unwrapped.floor() as i64;
                let step = start.wrapping_sub(here as i32);
                self.unwrapped = here as f64 + f64::from(step) + f64::from(fraction);
            }
            self.demand = demand;
            self.elapsed_ns = 0;
            self.settle();
        }
    }

    /// One control period.
    pub(crate) fn period(&mut self) {
        self.elapsed_ns += u64::from(PERIOD_NS);
        self.now_ns += u64::from(PERIOD_NS);
        if let Demand::Velocity { .. } = self.demand
            && !self.stuck
        {
            // Trapezoidal rule: exact within a segment.
            let mean = 0.5 * (f64::from(self.actual.demand_velocity) + self.sample().velocity);
            self.unwrapped += mean * f64::from(PERIOD_NS) * 1e-9;
        }
        self.settle();
        let sample = self.sample();
        self.trace.push(sample);
        // The crate's own evaluation agrees with this one.
        let point = self
            .demand
            .at(self.elapsed_ns.min(u64::from(u32::MAX)) as u32);
        if let Demand::Position { .. } = self.demand {
            let whole = sample.position.floor();
            let off = f64::from(point.position.wrapping_sub(whole as i64 as i32))
                + f64::from(point.fraction)
                - (sample.position - whole);
            assert!(off.abs() < 1e-3, "{sample:?} {point:?}");
        }
        if !matches!(
            self.demand,
            Demand::Off | Demand::Idle | Demand::Shorted | Demand::TurningVoltage { .. }
        ) {
            let off = f64::from(point.velocity) - sample.velocity;
            assert!(
                off.abs() <= 1e-6 * sample.velocity.abs() + 1e-3,
                "{sample:?} {point:?}"
            );
            assert!((f64::from(point.torque_pm) - sample.torque_pm).abs() < 1e-3);
        }
    }

    /// The demand's value now.
    pub(crate) fn sample(&self) -> Sample {
        let time = |duration: u32| {
            (
                self.elapsed_ns.min(u64::from(duration)) as f64 * 1e-9,
                self.elapsed_ns <= u64::from(duration),
            )
        };
        match self.demand {
            Demand::Off
            | Demand::Idle
            | Demand::Shorted
            | Demand::TurningVoltage { .. }
            | Demand::RotorVoltage { .. }
            | Demand::PhaseVoltage { .. } => Sample {
                position: self.unwrapped,
                ..Sample::default()
            },
            Demand::Torque {
                start_pm,
                slope_pm_per_s,
                duration_ns,
            }
            | Demand::TorqueWithAngle {
                start_pm,
                slope_pm_per_s,
                duration_ns,
                ..
            } => {
                let (t, _) = time(duration_ns);
                Sample {
                    position: self.unwrapped,
                    torque_pm: f64::from(start_pm) + f64::from(slope_pm_per_s) * t,
                    ..Sample::default()
                }
            }
            Demand::Velocity {
                start,
                acceleration,
                duration_ns,
                ..
            } => {
                let (t, runs) = time(duration_ns);
                let a = f64::from(acceleration);
                Sample {
                    position: self.unwrapped,
                    velocity: f64::from(start) + a * t,
                    acceleration: if runs { a } else { 0.0 },
                    ..Sample::default()
                }
            }
            Demand::Position {
                velocity,
                acceleration,
                duration_ns,
                ..
            } => {
                let (t, runs) = time(duration_ns);
                let (v, a) = (f64::from(velocity), f64::from(acceleration));
                Sample {
                    position: self.unwrapped + v * t + a * t * t / 2.0,
                    velocity: if runs { v + a * t } else { 0.0 },
                    acceleration: if runs { a } else { 0.0 },
                    torque_pm: 0.0,
                }
            }
        }
    }

    /// The ideal motor: it is where the demand is.
    fn settle(&mut self) {
        let sample = self.sample();
        match self.demand {
            Demand::Position { duration_ns, .. } => {
                self.actual.demand_left_ns =
                    u64::from(duration_ns).saturating_sub(self.elapsed_ns) as u32;
                let whole = sample.position.floor();
                self.actual.demand_position = whole as i64 as i32;
                self.actual.demand_fraction = (sample.position - whole) as f32;
                self.actual.demand_velocity = sample.velocity as f32;
                if !self.stuck {
                    let rounded = (sample.position + 0.5).floor() as i64 as i32;
                    self.actual.position = rounded.wrapping_sub(self.lag);
                    self.actual.velocity = sample.velocity as f32;
                }
            }
            Demand::Velocity { .. } => {
                self.actual.demand_velocity = sample.velocity as f32;
                if !self.stuck {
                    self.actual.position = self.unwrapped.floor() as i64 as i32;
                    self.actual.velocity = sample.velocity as f32;
                }
            }
            Demand::Torque { .. } => {
                self.actual.demand_torque_pm = sample.torque_pm as f32;
                self.actual.torque_pm = sample.torque_pm as f32;
            }
            Demand::TorqueWithAngle {
                angle, duration_ns, ..
            } => {
                self.actual.electrical_angle = angle;
                self.actual.demand_torque_pm = sample.torque_pm as f32;
                self.actual.torque_pm = sample.torque_pm as f32;
                let left = u64::from(duration_ns).saturating_sub(self.elapsed_ns);
                self.actual.demand_left_ns = u32::try_from(left).unwrap_or(u32::MAX);
            }
            Demand::PhaseVoltage { angle, .. } => {
                self.actual.electrical_angle = angle;
                self.actual.torque_pm = 0.0;
            }
            Demand::Off
            | Demand::Idle
            | Demand::Shorted
            | Demand::TurningVoltage { .. }
            | Demand::RotorVoltage { .. } => {
                self.actual.torque_pm = 0.0;
            }
        }
    }

    /// Puts the motor somewhere while it is free.
    pub(crate) fn place(&mut self, position: i32) {
        self.unwrapped = f64::from(position);
        self.actual.position = position;
    }
}

/// A small generator of pseudo-random numbers (xorshift64*), the same in every run.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// 0 to below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Evenly over the orders of magnitude.
    pub(crate) fn scaled(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    pub(crate) fn sign(&mut self) -> f64 {
        if self.next() & 1 == 0 { 1.0 } else { -1.0 }
    }

    pub(crate) fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
}
