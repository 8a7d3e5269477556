//! A test bench: an EC-max 22 on an ideal averaging inverter, integrated exactly in the stator's
//! frame for one PWM period at constant speed, with a load delay and a quantised encoder.

#![allow(dead_code, unreachable_pub)] // each test file uses its part

use control::i2t::I2t;
use control::io::{Duty, Sample, Scales};
use control::tuning::{self, Pi, Rule};
use control::velocity::Cutoff;
use control::{Cascade, EncoderSettings, Gains, Motor, Parameters, PowerStage};
use std::f64::consts::TAU;

pub const PHASE_R_OHM: f64 = 13.1 / 2.0;
pub const PHASE_L_H: f64 = 0.729e-3 / 2.0;
pub const KT_NM_PER_A: f64 = 0.031_56;
pub const INERTIA_KG_M2: f64 = 4.45e-7;
pub const COUNTS: f64 = 4096.0;
pub const PWM_S: f64 = 10e-6;
pub const CONTROL_S: f64 = 50e-6;
pub const SCALES: Scales = Scales {
    motor_temperature_k: 0.05,
    motor_temperature_zero_c: -50.0,
    current_a: 5.0 / 2048.0,
    current_zero: 2048.0,
    voltage_v: 80.0 / 4096.0,
    temperature_k: 0.05,
    temperature_zero_c: -50.0,
};
pub const RPM: f64 = TAU / 60.0;

/// Counts/s of a speed in rpm.
pub fn counts(rpm: f64) -> f32 {
    (rpm / 60.0 * COUNTS) as f32
}

pub fn parameters(current: Pi, velocity_hz: f32, position_hz: f32) -> Parameters<f32> {
    let (j, kt, n) = (INERTIA_KG_M2 as f32, KT_NM_PER_A as f32, COUNTS as f32);
    let velocity = tuning::velocity(velocity_hz, 1.0, j, kt, n).unwrap();
    Parameters {
        period_s: CONTROL_S as f32,
        pwm_period_s: PWM_S as f32,
        load_delay_s: PWM_S as f32,
        motor: Motor {
            phase_resistance_ohm: PHASE_R_OHM as f32,
            phase_inductance_h: PHASE_L_H as f32,
            torque_constant_nm_per_a: kt,
            pole_pairs: 1,
        },
        encoder: EncoderSettings {
            counts_per_turn: 4096,
            electrical_zero: 0,
            electrical_polarity: 1,
            user_polarity: 1,
            lag_s: 0.0,
            loop_cutoff: Cutoff::LOOP,
            reported_cutoff: Cutoff::REPORTED,
        },
        stage: PowerStage {
            scales: SCALES,
            current_zero: [2048.0, 2048.0],
            current_limit_a: 5.0,
            voltage_limit_v: 100.0,
            duty_margin: 0.0,
            dead_time_s: 0.0,
            propagation_s: 0.0,
        },
        gains: Gains {
            current_d: current,
            current_q: current,
            decoupling: 1.0,
            emf_feed_forward: 1.0,
            velocity,
            velocity_derivative: 0.0,
            velocity_integral_limit_a: 5.0,
            speed_limit: velocity.kp,
            position: Pi {
                kp: tuning::position(position_hz, 1.0).unwrap().kp,
                ki: 0.0,
            },
            position_derivative: 0.0,
            position_integral_limit: 0.0,
        },
        i2t: I2t {
            enabled: false,
            literal: true,
            continuous_a: 0.716,
            peak_a: 3.5,
            peak_time_s: 0.5,
        },
    }
}

/// The defaults of the EC-max 22: 2,000 Hz second order, 100 Hz, 20 Hz.
pub fn defaults() -> Parameters<f32> {
    parameters(second_order(2000.0), 100.0, 20.0)
}

pub fn second_order(hz: f32) -> Pi {
    let (r, l) = (PHASE_R_OHM as f32, PHASE_L_H as f32);
    tuning::current(Rule::SecondOrder, hz, 1.0, r, l).unwrap()
}

pub fn pole_zero(hz: f32) -> Pi {
    let (r, l) = (PHASE_R_OHM as f32, PHASE_L_H as f32);
    tuning::current(Rule::PoleZero, hz, 1.0, r, l).unwrap()
}

pub struct Rig {
    pub cascade: Cascade<f32>,
    pub bus_v: f64,
    pub locked: bool,
    /// Opposes motion, Nm s/rad.
    pub friction: f64,
    /// Constant, Nm.
    pub load: f64,
    /// PWM periods between the start of a control period and its duty's effect.
    pub delay: usize,
    /// Whether phases B and C are exchanged.
    pub swapped: bool,
    /// Whether the current converters count in whole numbers.
    pub quantised: bool,
    /// Whether the encoder answers.
    pub blind: bool,
    /// Mechanical angle, rad, not wrapped; the d axis stands at phase A at 0.
    pub angle: f64,
    /// Mechanical speed, rad/s.
    pub speed: f64,
    /// Current, stator frame.
    pub current: (f64, f64),
    duty: Duty<f32>,
    /// Greatest length of the current at the control instants since it was last set, A.
    pub peak_a: f64,
}

fn multiply(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn divide(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let square = b.0 * b.0 + b.1 * b.1;
    let (re, im) = multiply(a, (b.0, -b.1));
    (re / square, im / square)
}

impl Rig {
    pub fn new(parameters: &Parameters<f32>) -> Self {
        Self {
            cascade: Cascade::new(parameters),
            bus_v: 48.0,
            locked: false,
            friction: 0.0,
            load: 0.0,
            delay: 1,
            swapped: false,
            quantised: true,
            blind: false,
            angle: 0.0,
            speed: 0.0,
            current: (0.0, 0.0),
            duty: Duty {
                phase: [0.5; 3],
                enabled: false,
            },
            peak_a: 0.0,
        }
    }

    /// Current in the rotor's frame: d, q.
    pub fn rotor_current(&self) -> (f64, f64) {
        multiply(self.current, (self.angle.cos(), -self.angle.sin()))
    }

    pub fn sample(&self) -> Sample<f32> {
        let (alpha, beta) = self.current;
        let half = 3.0_f64.sqrt() / 2.0;
        let b = -0.5 * alpha + half * beta;
        let c = -0.5 * alpha - half * beta;
        let adc = |current: f64| {
            let value = 2048.0 + current / f64::from(SCALES.current_a);
            let value = if self.quantised { value.round() } else { value };
            value as f32
        };
        let encoder = (self.angle / TAU * COUNTS).floor().rem_euclid(COUNTS);
        Sample {
            phase_adc: [adc(alpha), adc(if self.swapped { c } else { b })],
            encoder: if self.blind { 0 } else { encoder as i32 },
            bus_adc: (self.bus_v / f64::from(SCALES.voltage_v)).round() as f32,
            temperature_adc: 1500.0,
            overcurrent: false,
            encoder_valid: !self.blind,
        }
    }

    /// One control period.
    pub fn period(&mut self) {
        let (alpha, beta) = self.current;
        self.peak_a = self.peak_a.max(alpha.hypot(beta));
        let next = self.cascade.period(&self.sample());
        for pwm in 0..5 {
            if pwm == self.delay {
                self.duty = next;
            }
            self.pwm_period();
        }
        if self.delay >= 5 {
            self.duty = next;
        }
    }

    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / CONTROL_S).round() as usize {
            self.period();
        }
    }

    fn pwm_period(&mut self) {
        let (r, l) = (PHASE_R_OHM, PHASE_L_H);
        let psi = KT_NM_PER_A / 1.5;
        let before = self.rotor_current().1;
        if self.duty.enabled {
            let [a, b, c] = self.duty.phase.map(|duty| f64::from(duty) * self.bus_v);
            let (b, c) = if self.swapped { (c, b) } else { (b, c) };
            let v = ((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt());
            let decay = (-r * PWM_S / l).exp();
            let turn = self.speed * PWM_S;
            // −(jωψ/L)·e^{jθ}·(e^{jωh} − decay)/(R/L + jω)
            let numerator = multiply(
                multiply(
                    (0.0, -self.speed * psi / l),
                    (self.angle.cos(), self.angle.sin()),
                ),
                (turn.cos() - decay, turn.sin()),
            );
            let emf = divide(numerator, (r / l, self.speed));
            let gain = (1.0 - decay) / r;
            self.current = (
                decay * self.current.0 + gain * v.0 + emf.0,
                decay * self.current.1 + gain * v.1 + emf.1,
            );
        } else {
            self.current = (0.0, 0.0);
        }
        if self.locked {
            return;
        }
        self.angle += self.speed * PWM_S;
        let torque = KT_NM_PER_A * 0.5 * (before + self.rotor_current().1);
        let accelerating = torque - self.friction * self.speed - self.load;
        self.speed += accelerating / INERTIA_KG_M2 * PWM_S;
    }
}
