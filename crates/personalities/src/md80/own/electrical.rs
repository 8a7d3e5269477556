//! Resistance and inductance of a phase, by voltages injected along one axis.
//!
//! The resistance is the difference of two voltages over that of their currents, with the rotor held by
//! them; so what dead times take off both has no part in it. The inductance is told by a voltage that
//! turns 2,000 times a second, faster than any rotor follows: in its own frame voltage and current
//! stand still. A winding of resistance R and inductance L, whose voltage V is held for a control
//! period T and comes one period after the sample, has i(k+1) = a·i(k) + b·v(k−1) with
//! a = exp(−RT/L) and b = (1−a)/R. At the angle φ per period that is (e^jφ − a)·I = b·e^−jφ·V.

use cia402::Demand;
use control::Real as _;

use super::turning::{no_voltage, phase_voltage, units};
use crate::md80::internal::LOOP_HZ;
use crate::md80::settings::REAL_RANGES;
use crate::own::AxisView;

/// Turns per second of the voltage that measures the inductance: a twentieth of the loops' rate.
const TURNS_PER_S: f32 = LOOP_HZ / 20.0;
/// Sine and cosine of a twentieth of a turn.
const SIN: f32 = 0.309_017;
const COS: f32 = 0.951_056_5;

const SETTLE_TICKS: u32 = 100;
const MEAN_TICKS: u32 = 50;
/// Part of the longest vector that the ramps go to.
const MOST_PART: f32 = 0.9;
/// Below this a current tells nothing, A.
const LEAST_CURRENT_A: f32 = 0.5;

/// What a millisecond of measuring brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    Demands(Demand),
    /// The resistance lies outside its range, or no current flows.
    NoResistance,
    /// The inductance lies outside its range.
    NoInductance,
    Done {
        resistance: f32,
        inductance: f32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Ramp,
    High,
    Low,
    TurnRamp,
    Turn,
}

/// Sums of voltage and current along both axes.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    voltage: [f32; 2],
    current: [f32; 2],
}

/// The measurement of resistance and inductance.
#[derive(Clone, Debug)]
pub(super) struct Electrical {
    step: Step,
    ticks: u32,
    volts: f32,
    sums: Sums,
    high: (f32, f32),
    resistance: f32,
}

impl Electrical {
    pub(super) fn new() -> Electrical {
        Electrical {
            step: Step::Ramp,
            ticks: 0,
            volts: 0.0,
            sums: Sums::default(),
            high: (0.0, 0.0),
            resistance: 0.0,
        }
    }

    fn go(&mut self, step: Step) {
        self.step = step;
        self.ticks = 0;
        self.sums = Sums::default();
    }

    /// A step of the ramp; whether it is at its end.
    fn ramp(&mut self, view: &AxisView, current_a: f32) -> bool {
        let [d, q] = view.current_a;
        let most = MOST_PART * super::turning::longest_v(view.bus_voltage_v);
        if d * d + q * q >= current_a * current_a || self.volts >= most {
            return true;
        }
        // Slow enough for windings of any time constant below 50 ms.
        self.volts = (self.volts + (0.02 * self.volts).greatest(0.005)).least(most);
        false
    }

    /// Takes the mean once all has settled; `None` until then.
    fn mean(&mut self, view: &AxisView) -> Option<Sums> {
        self.ticks += 1;
        if self.ticks <= SETTLE_TICKS {
            return None;
        }
        for (sum, value) in self.sums.voltage.iter_mut().zip(view.voltage_v) {
            *sum += value / MEAN_TICKS as f32;
        }
        for (sum, value) in self.sums.current.iter_mut().zip(view.current_a) {
            *sum += value / MEAN_TICKS as f32;
        }
        (self.ticks == SETTLE_TICKS + MEAN_TICKS).then_some(self.sums)
    }

    /// A millisecond more, with at most `current_a`.
    pub(super) fn tick(&mut self, view: &AxisView, current_a: f32) -> Outcome {
        match self.step {
            Step::Ramp => {
                if self.ramp(view, current_a) {
                    self.go(Step::High);
                }
            }
            Step::High => {
                if let Some(mean) = self.mean(view) {
                    let ([volts, _], [amperes, _]) = (mean.voltage, mean.current);
                    if amperes < LEAST_CURRENT_A {
                        return Outcome::NoResistance;
                    }
                    self.high = (volts, amperes);
                    self.volts *= 0.5;
                    self.go(Step::Low);
                }
            }
            Step::Low => {
                if let Some(mean) = self.mean(view) {
                    let ([volts, _], [amperes, _]) = (mean.voltage, mean.current);
                    let resistance = (self.high.0 - volts) / (self.high.1 - amperes);
                    if !in_range(4, resistance) {
                        return Outcome::NoResistance;
                    }
                    self.resistance = resistance;
                    self.volts = 0.0;
                    self.go(Step::TurnRamp);
                }
            }
            Step::TurnRamp => {
                if self.ramp(view, 0.5 * current_a) {
                    self.go(Step::Turn);
                }
            }
            Step::Turn => {
                if let Some(mean) = self.mean(view) {
                    return self.inductance(&mean);
                }
            }
        }
        Outcome::Demands(match self.step {
            Step::TurnRamp | Step::Turn if self.volts > 0.0 => Demand::TurningVoltage {
                turns_per_s: TURNS_PER_S,
                voltage: units(self.volts, view.bus_voltage_v),
            },
            Step::TurnRamp | Step::Turn => no_voltage(),
            _ => phase_voltage(0, self.volts, view.bus_voltage_v),
        })
    }

    fn inductance(&self, mean: &Sums) -> Outcome {
        let [i_d, i_q] = mean.current;
        let [v_d, v_q] = mean.voltage;
        let square = i_d * i_d + i_q * i_q;
        if square < LEAST_CURRENT_A * LEAST_CURRENT_A {
            return Outcome::NoInductance;
        }
        // e^−jφ·V, and the imaginary part of it over I.
        let (r_d, r_q) = (v_d * COS + v_q * SIN, v_q * COS - v_d * SIN);
        let imaginary = (r_q * i_d - r_d * i_q) / square;
        let part = self.resistance * SIN / imaginary;
        let inductance = self.resistance / (LOOP_HZ * minus_ln_1_minus(part));
        match in_range(3, inductance) {
            true => Outcome::Done {
                resistance: self.resistance,
                inductance,
            },
            false => Outcome::NoInductance,
        }
    }
}

/// −ln(1 − x) for x from 0 to below 1: its series, which ends early because x = 1 − exp(−RT/L) is
/// small where an inductance can be told at all.
fn minus_ln_1_minus(x: f32) -> f32 {
    let mut sum = 0.0;
    let mut power = x;
    for n in 1..=40u8 {
        sum += power / f32::from(n);
        power *= x;
    }
    sum
}

/// Whether a figure lies in the range of 0x2000, `sub`.
fn in_range(sub: u8, value: f32) -> bool {
    let mut ranges = REAL_RANGES.iter();
    let range = ranges.find(|range| range.object.index == 0x2000 && range.object.sub == sub);
    range.is_some_and(|range| value >= range.least && value <= range.greatest)
}
