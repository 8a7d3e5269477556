//! Hard stops.

use control::Real;

use crate::body::Body;
use crate::exponential::decayed_fraction;
use crate::load::{Stops, angle_and_turns};

/// The two stops of a mass; see [`Stops`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact<R: Real> {
    lowest: (R::Count, R::Count),
    highest: (R::Count, R::Count),
    /// Nm/rad.
    stiffness: R,
    /// What takes off the speed what the damper alone would in a period, Nm s/rad.
    damping: R,
}

/// Angle of the resonance in a period up to which a stop is followed. At this one a bounce off an
/// elastic stop may gain or lose 0.25 % of the energy, by where between two steps it is touched.
const MAX_ANGLE: f64 = 0.1;

impl<R: Real> Contact<R> {
    /// For a mass of `inertia`, kg m², and PWM periods of `period_s`.
    pub(crate) fn new(stops: &Stops, inertia: f64, period_s: f64) -> Self {
        let stiffest = inertia * (MAX_ANGLE / period_s) * (MAX_ANGLE / period_s);
        let stiffness = if stops.stiffness_nm_per_rad < stiffest {
            stops.stiffness_nm_per_rad
        } else {
            stiffest
        };
        let damping = 2.0 * stops.damping_ratio * root(stiffness * inertia);
        let damping = decayed_fraction(damping * period_s / inertia) * inertia / period_s;
        let position = |turns: f64| {
            let (angle, turns) = angle_and_turns(turns);
            (R::count(angle), R::count(turns))
        };
        let real = |value: f64| R::splat(value as f32);
        Self {
            lowest: position(stops.lowest_turns),
            highest: position(stops.highest_turns),
            stiffness: real(stiffness),
            damping: real(damping),
        }
    }

    /// Torque of the stops on `body`, Nm.
    #[inline(always)]
    pub(crate) fn torque(&self, body: &Body<R>) -> R {
        let zero = R::splat(0.0);
        let above = body.beyond(self.highest.0, self.highest.1).greatest(zero);
        let below = body.beyond(self.lowest.0, self.lowest.1).least(zero);
        // One of the two is zero.
        let spring = -(above + below) * self.stiffness;
        let push = spring - body.period_speed() * self.damping;
        let push = R::select(zero.lt(above), push.least(zero), push);
        let push = R::select(below.lt(zero), push.greatest(zero), push);
        R::select(zero.lt(above - below), push, zero)
    }
}

/// The square root of a number that is not negative; 0 for others.
pub(crate) fn root(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 || value.is_infinite() {
        return if value == f64::INFINITY { value } else { 0.0 };
    }
    // Half the exponent, then Newton until it no longer gets smaller.
    let mut guess = f64::from_bits((value.to_bits() >> 1) + (1023_u64 << 51));
    for _ in 0..8 {
        guess = 0.5 * (guess + value / guess);
    }
    guess
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::root;

    #[test]
    fn the_root_agrees_with_the_host_library() {
        for exponent in -700..700 {
            let value = 2.5_f64.powi(exponent);
            assert!((root(value) / value.sqrt() - 1.0).abs() < 1e-15, "{value}");
        }
        for value in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(root(value), 0.0);
        }
        assert_eq!(root(f64::INFINITY), f64::INFINITY);
    }
}
