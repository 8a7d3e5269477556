//! A value that runs to its target with one rate for speeding up and one for slowing down.

use crate::Demand;
use crate::arithmetic::{least, magnitude, sign};
use crate::path::{TICK_NS, TICK_S};

/// A velocity on its way, and how it changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Velocity {
    /// Counts/s.
    pub(crate) velocity: f64,
    /// Counts/s²; 0 on linear ramps.
    pub(crate) acceleration: f64,
}

impl Velocity {
    /// `dt` seconds later on the way to `target`, with limited jerk or on a linear [`ramp`].
    pub(crate) fn towards(self, target: f64, up: f64, down: f64, jerk: f32, dt: f64) -> Velocity {
        if jerk > 0.0 {
            return self.softly_towards(target, up, down, magnitude(jerk), dt);
        }
        Velocity {
            velocity: ramp(self.velocity, target, up, down, dt),
            acceleration: 0.0,
        }
    }
}

/// The demand that takes a velocity from `from` to `to` in a tick, counts/s; without duration if they
/// are the same.
pub(crate) fn velocity_segment(from: f64, to: f64) -> Demand {
    Demand::Velocity {
        start: from as f32,
        acceleration: ((to - from) / TICK_S) as f32,
        torque_offset_pm: 0.0,
        duration_ns: if from == to { 0 } else { TICK_NS },
    }
}

/// The velocity `dt` seconds after `value`, on the way to `target`. `up` is the rate away from
/// zero, `down` the rate towards zero; through zero one follows the other.
pub(crate) fn ramp(value: f64, target: f64, up: f64, down: f64, dt: f64) -> f64 {
    // First towards zero: to the target if it lies there, else to zero.
    let slowed = if value * target > 0.0 {
        sign(value) * least(value.abs(), target.abs())
    } else {
        0.0
    };
    let away = (value - slowed).abs();
    if away > down * dt {
        return value - sign(value) * down * dt;
    }
    let left = if away > 0.0 { dt - away / down } else { dt };
    let missing = target - slowed;
    if missing.abs() > up * left {
        slowed + sign(missing) * up * left
    } else {
        target
    }
}

#[cfg(test)]
mod tests {
    use super::ramp;

    #[test]
    fn each_direction_has_its_rate() {
        // value, target, up, down, dt, expected by hand
        let table = [
            (0.0, 100.0, 1000.0, 500.0, 0.05, 50.0),
            (0.0, 100.0, 1000.0, 500.0, 0.2, 100.0),
            (100.0, 0.0, 1000.0, 500.0, 0.1, 50.0),
            (-100.0, -20.0, 1000.0, 500.0, 0.1, -50.0),
            (-100.0, -20.0, 1000.0, 500.0, 1.0, -20.0),
            // 0.1 s to zero at 500, then 0.05 s away from it at 1000.
            (50.0, -200.0, 1000.0, 500.0, 0.15, -50.0),
            (-50.0, 200.0, 1000.0, 500.0, 0.15, 50.0),
            (30.0, 30.0, 1000.0, 500.0, 0.1, 30.0),
            (0.0, 100.0, 0.0, 500.0, 1.0, 0.0),
        ];
        for (value, target, up, down, dt, expected) in table {
            let got = ramp(value, target, up, down, dt);
            assert!(
                (got - expected).abs() < 1e-9,
                "{value} to {target}: {got}, not {expected}"
            );
        }
    }
}
