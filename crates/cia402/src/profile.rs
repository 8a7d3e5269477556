//! The trapezoidal velocity profile from any speed to rest at a distance.

use crate::arithmetic::{AT_ONCE, greatest, least, sign, square_root};

/// What a profile may use. Not positive or NaN: see [`Profile::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileLimits {
    /// Speed, counts/s.
    pub velocity: f64,
    /// Rate of speeding up, counts/s².
    pub acceleration: f64,
    /// Rate of slowing down, counts/s².
    pub deceleration: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Phase {
    acceleration: f64,
    duration_s: f64,
}

/// A planned move: at most four phases of constant acceleration, evaluated at any time, so nothing
/// accumulates and the end is exact. Positions are relative to the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    start_velocity: f64,
    phases: [Phase; 4],
    distance: f64,
    arrives: bool,
}

impl Profile {
    /// The quickest profile over `distance` counts that ends at rest.
    ///
    /// It starts with `velocity` counts/s of any sign and size. If that leads away from the target
    /// or cannot be stopped before it, the axis stops first and comes back; if it exceeds the
    /// limit, the axis slows down to the limit first.
    ///
    /// A deceleration that is not positive is replaced by the acceleration, and if that is not
    /// positive either, by a stop at once. Without a positive speed, or from rest without a
    /// positive acceleration, there is no move: the axis comes to rest where it can, and
    /// [`Profile::arrives`] is false.
    pub fn new(distance: f64, velocity: f64, limits: ProfileLimits) -> Profile {
        let usable = |x: f64| if x > 0.0 { least(x, AT_ONCE) } else { 0.0 };
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let (distance, start) = (finite(distance), finite(velocity));
        let (speed, a) = (usable(limits.velocity), usable(limits.acceleration));
        let d = match (usable(limits.deceleration), a) {
            (d, _) if d > 0.0 => d,
            (_, a) if a > 0.0 => a,
            _ => AT_ONCE,
        };

        let stopping = start * start / (2.0 * d);
        let passes = start != 0.0 && (start * distance <= 0.0 || stopping > distance.abs());
        let (brake, remaining, v0) = if passes {
            let brake = Phase {
                acceleration: -sign(start) * d,
                duration_s: start.abs() / d,
            };
            (brake, distance - sign(start) * stopping, 0.0)
        } else {
            (Phase::default(), distance, start.abs())
        };

        let (s, length) = (sign(remaining), remaining.abs());
        // From here on in the direction of the target: v0 ≥ 0 and it can stop in time.
        let peak = if a > 0.0 {
            let triangle = square_root((2.0 * a * length + v0 * v0) * (d / (a + d)));
            least(speed, greatest(triangle, v0))
        } else {
            least(speed, v0)
        };
        let change = if v0 > peak { -d } else { a };
        let first = Phase {
            acceleration: s * change,
            duration_s: if change == 0.0 {
                0.0
            } else {
                (peak - v0) / change
            },
        };
        let last = Phase {
            acceleration: -s * d,
            duration_s: peak / d,
        };
        let cruised = length - 0.5 * (v0 + peak) * first.duration_s - 0.5 * peak * last.duration_s;
        let arrives = length == 0.0 || peak > 0.0;
        // Below the limit and able to accelerate, the peak is a triangle's: what is left over is
        // rounding.
        let cruises = peak > 0.0 && cruised > 0.0 && (peak == speed || a == 0.0);
        let cruise = Phase {
            acceleration: 0.0,
            duration_s: if cruises { cruised / peak } else { 0.0 },
        };
        Profile {
            start_velocity: start,
            phases: [brake, first, cruise, last],
            distance,
            arrives,
        }
    }

    /// Coming to rest from `velocity` counts/s at `deceleration` counts/s², wherever that is.
    pub fn stop(velocity: f64, deceleration: f64) -> Profile {
        let limits = ProfileLimits {
            velocity: 0.0,
            acceleration: 0.0,
            deceleration,
        };
        let mut profile = Profile::new(0.0, velocity, limits);
        profile.arrives = false;
        profile
    }

    /// Time from start to rest, s.
    pub fn duration_s(&self) -> f64 {
        self.phases.iter().map(|phase| phase.duration_s).sum()
    }

    /// Whether the end is at the distance asked for.
    pub fn arrives(&self) -> bool {
        self.arrives
    }

    /// Position (counts from the start) and velocity (counts/s) at time `t` s after the start.
    pub fn at(&self, t: f64) -> (f64, f64) {
        // Rounding must not leave a remainder at the end.
        let ended = t >= self.duration_s();
        if ended && self.arrives {
            return (self.distance, 0.0);
        }
        let mut left = greatest(0.0, t);
        let (mut p, mut v) = (0.0, self.start_velocity);
        for phase in self.phases {
            let a = phase.acceleration;
            let t = least(left, phase.duration_s);
            p += (v + 0.5 * a * t) * t;
            v += a * t;
            if left < phase.duration_s {
                break;
            }
            left -= phase.duration_s;
        }
        (p, if ended { 0.0 } else { v })
    }

    /// Least and greatest velocity between two times.
    pub(crate) fn velocities(&self, from: f64, to: f64) -> (f64, f64) {
        let (a, b) = (self.at(from).1, self.at(to).1);
        let (mut low, mut high) = (least(a, b), greatest(a, b));
        let (mut t, mut v) = (0.0, self.start_velocity);
        for phase in self.phases {
            t += phase.duration_s;
            v += phase.acceleration * phase.duration_s;
            if from < t && t < to {
                (low, high) = (least(low, v), greatest(high, v));
            }
        }
        (low, high)
    }
}
