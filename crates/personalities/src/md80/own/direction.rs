//! Whether the main encoder counts the way that its calibration has found: told by the voltage that the
//! turning rotor makes.
//!
//! A rotor at the electrical angle φ that turns with ω makes the voltage e = jωψ·e^jφ. It is what the
//! bridge gives less what the winding takes, e = v − Ri − jωLi. If the encoder is right, e goes with
//! jωψ·e^jφ, with φ and ω as it tells them. If it counts the other way round, the true angle is a constant
//! less φ, and e goes with −jωψ·e^−jφ. Over a way that tells both apart, the one that leaves less of e
//! unexplained shows which it is, whatever the constant and ψ are. The loops may drive the rotor, or
//! something else turn it against shorted phases. One that locks at once, as a wrong angle can make it, does
//! not tell.

use canopen::Image;

use super::FIELDS;
use super::turning::TURN;
use crate::md80::internal::COUNTS_PER_TURN;
use crate::own::AxisView;

/// Below this a rotor's voltage tells nothing, V.
const LEAST_V: f32 = 0.12;
/// Milliseconds that a judgement needs.
const LEAST_TICKS: u16 = 10;
/// Part of what is there, in squares, that a right encoder must leave unexplained before it is doubted,
const DOUBT: f32 = 0.1;
/// and the part of that which the other way round may leave.
const REST: f32 = 0.4;
const RAD: f32 = core::f32::consts::TAU;

/// Sums over a turn's way, forth or back. From a quarter of it on they are judged.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Direction {
    reading: Option<i32>,
    /// Of the voltage that is there times the expected one, if the encoder is right,
    with: Vector,
    /// and if it counts the other way round.
    against: Vector,
    /// Of the expected voltage's square, V²,
    square: f32,
    /// and of that which is there.
    energy: f32,
    /// Electrical way, 2³² a turn.
    way: i64,
    ticks: u16,
}

#[derive(Clone, Copy, Debug, Default)]
struct Vector {
    d: f32,
    q: f32,
}

impl Vector {
    fn turned(self, angle: i32) -> Vector {
        let (sine, cosine) = control::sin_cos::<f32>(angle);
        Vector {
            d: self.d * cosine - self.q * sine,
            q: self.q * cosine + self.d * sine,
        }
    }

    fn add(&mut self, other: Vector, by: f32) {
        self.d += by * other.d;
        self.q += by * other.q;
    }

    fn square(self) -> f32 {
        self.d * self.d + self.q * self.q
    }
}

impl Direction {
    /// A millisecond in which the bridge is on; whether the encoder was found to count the other way
    /// round. The phases are `shorted`, or the loops drive.
    pub(super) fn tick(&mut self, image: &Image<'_>, view: &AxisView, shorted: bool) -> bool {
        let before = self.reading.replace(view.encoder);
        let pole_pairs = image.number(FIELDS.pole_pairs) as i32;
        let polarity = image.number(FIELDS.electrical_polarity) as i32;
        let Some(before) = before.filter(|_| pole_pairs > 0) else {
            return false;
        };
        let turn = COUNTS_PER_TURN as i32;
        let step = (view.encoder.wrapping_sub(before) + turn / 2).rem_euclid(turn) - turn / 2;
        if step.abs() > turn / 4 {
            // No rotor is that fast.
            return false;
        }
        let per_turn = (pole_pairs * polarity) as f32;
        let speed = step as f32 / turn as f32 * RAD * 1000.0 * per_turn;
        let flux = image.real(FIELDS.torque_constant) / (1.5 * pole_pairs as f32);
        let expected = speed * flux;
        if expected.abs() >= LEAST_V {
            let resistance = image.real(FIELDS.resistance);
            let reactance = speed * image.real(FIELDS.inductance);
            let [d, q] = view.current_a;
            // In the rotor's frame it is shown in the user's direction, which is the polarity's.
            let q = if shorted { q } else { q * polarity as f32 };
            let [v_d, v_q] = view.voltage_v;
            // e, turned back by a quarter.
            let there = Vector {
                d: v_q - resistance * q - reactance * d,
                q: -(v_d - resistance * d + reactance * q),
            };
            let per_count = (TURN / i64::from(COUNTS_PER_TURN)) as i32;
            let zero = image.number(FIELDS.electrical_zero) as i32;
            let rotor = (view.encoder.wrapping_sub(zero))
                .wrapping_mul(per_count)
                .wrapping_mul(pole_pairs * polarity);
            let angle = i32::from(view.electrical_angle) << 16;
            self.with
                .add(there.turned(angle.wrapping_sub(rotor)), expected);
            self.against
                .add(there.turned(angle.wrapping_add(rotor)), -expected);
            self.square += expected * expected;
            self.energy += there.square();
            self.ticks = self.ticks.saturating_add(1);
        }
        self.way += i64::from(step.abs()) * TURN / i64::from(turn) * i64::from(pole_pairs);
        if self.way < TURN / 4 || self.ticks < LEAST_TICKS {
            return false;
        }
        let left = |sum: Vector| self.energy - sum.square() / self.square;
        let (with, against) = (left(self.with), left(self.against));
        let is_wrong = with > DOUBT * self.energy && against < REST * with;
        if self.way >= TURN {
            *self = Direction {
                reading: self.reading,
                ..Direction::default()
            };
        }
        is_wrong
    }
}
