//! Profiles whose acceleration has no steps: the jerk is limited (0x6086 = 3, 0x60A4).

use crate::arithmetic::{AT_ONCE, greatest, least, sign, square_root};
use crate::profile::ProfileLimits;
use crate::ramp::Velocity;

/// A change of velocity: three phases of constant jerk, the second without. Durations in s; that of
/// a phase with negative jerk is negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Change([f64; 3]);

/// Position (counts), velocity (counts/s) and acceleration (counts/s²).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    position: f64,
    velocity: f64,
    acceleration: f64,
}

impl Motion {
    /// `t` seconds later at `jerk`.
    fn after(self, jerk: f64, t: f64) -> Motion {
        let (v, a) = (self.velocity, self.acceleration);
        Motion {
            position: self.position + (v + (0.5 * a + jerk * t / 6.0) * t) * t,
            velocity: v + (a + 0.5 * jerk * t) * t,
            acceleration: a + jerk * t,
        }
    }
}

/// The velocity that is left when `acceleration` has run to zero as fast as `jerk` allows.
fn coasted(velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    velocity + acceleration * acceleration.abs() / (2.0 * jerk)
}

impl Change {
    /// The quickest change from `velocity` and `acceleration` to `target` and none, with `rate`
    /// counts/s² at most. An acceleration beyond `rate` comes back to it first. `rate` and `jerk`
    /// are above 0.
    fn new(velocity: f64, acceleration: f64, target: f64, rate: f64, jerk: f64) -> Change {
        let s = sign(target - coasted(velocity, acceleration, jerk));
        if s == 0.0 {
            return Change([-acceleration / jerk, 0.0, 0.0]);
        }
        // In the direction of the change.
        let (a, change) = (s * acceleration, s * (target - velocity));
        if a > rate {
            let held = change - a * a / (2.0 * jerk);
            return Change([
                -s * (a - rate) / jerk,
                greatest(0.0, held) / rate,
                -s * rate / jerk,
            ]);
        }
        let peak = square_root(0.5 * (2.0 * jerk * change + a * a));
        let (peak, held) = if peak > rate {
            let held = change - (rate * rate - 0.5 * a * a) / jerk;
            (rate, greatest(0.0, held))
        } else {
            (greatest(peak, greatest(a, 0.0)), 0.0)
        };
        Change([s * (peak - a) / jerk, held / rate, -s * peak / jerk])
    }

    fn duration_s(&self) -> f64 {
        self.0.iter().map(|duration| duration.abs()).sum()
    }

    /// The phases: jerk and duration.
    fn phases(&self, jerk: f64) -> [(f64, f64); 3] {
        let [first, middle, last] = self.0;
        [
            (jerk.copysign(first), first.abs()),
            (0.0, middle.abs()),
            (jerk.copysign(last), last.abs()),
        ]
    }

    /// The counts that it covers.
    fn distance(&self, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
        let start = Motion {
            position: 0.0,
            velocity,
            acceleration,
        };
        self.phases(jerk)
            .into_iter()
            .fold(start, |motion, (jerk, t)| motion.after(jerk, t))
            .position
    }
}

impl Velocity {
    /// `dt` seconds later on the way to `target` with limited jerk. `up` is the rate away from
    /// zero, `down` the rate towards zero, `jerk` counts/s³, above 0. Through zero it is the lesser
    /// of both.
    pub(crate) fn softly_towards(
        self,
        target: f64,
        up: f64,
        down: f64,
        jerk: f64,
        dt: f64,
    ) -> Velocity {
        let coasted = coasted(self.velocity, self.acceleration, jerk);
        let crosses = coasted * target < 0.0 || self.velocity * target < 0.0;
        let (goal, rate) = if crosses && up > 0.0 {
            (target, least(up, down))
        } else if crosses {
            (0.0, down)
        } else if target.abs() <= coasted.abs() {
            (target, down)
        } else if up > 0.0 {
            (target, up)
        } else {
            // It may not speed up: what acceleration there is ends.
            (coasted, down)
        };
        let change = Change::new(self.velocity, self.acceleration, goal, rate, jerk);
        if change.duration_s() <= dt {
            return Velocity {
                velocity: goal,
                acceleration: 0.0,
            };
        }
        let mut motion = Motion {
            position: 0.0,
            velocity: self.velocity,
            acceleration: self.acceleration,
        };
        let mut left = dt;
        for (jerk, duration) in change.phases(jerk) {
            let t = least(left, duration);
            motion = motion.after(jerk, t);
            left -= t;
        }
        Velocity {
            velocity: motion.velocity,
            acceleration: motion.acceleration,
        }
    }
}

/// A planned move with limited jerk: seven phases of constant jerk, evaluated at any time, so
/// nothing accumulates and the end is exact. Positions are relative to the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JerkProfile {
    velocity: f64,
    acceleration: f64,
    /// To the peak velocity.
    rise: Change,
    cruise_s: f64,
    /// To rest at the target.
    fall: Change,
    distance: f64,
    jerk: f32,
    arrives: bool,
}

/// How often the peak velocity is improved; it takes a dozen steps.
const ITERATIONS: u32 = 80;

/// Above 0, and as much as a profile can use.
fn usable(x: f64) -> Option<f64> {
    (x > 0.0).then(|| least(x, AT_ONCE))
}

/// What a profile can begin with.
fn held(x: f64) -> f64 {
    if x.is_finite() {
        greatest(-AT_ONCE, least(x, AT_ONCE))
    } else {
        0.0
    }
}

impl JerkProfile {
    /// A profile over `distance` counts that ends at rest, without acceleration. It starts with
    /// `velocity` counts/s and `acceleration` counts/s² of any sign and size; what of these exceeds
    /// the limits is brought back within them first.
    ///
    /// From rest it is the quickest there is. If the target lies before the place where the axis
    /// can stop, the axis turns round, with the lesser of both rates.
    ///
    /// `None` if a limit or the jerk (counts/s³) is not above 0: then there is no such profile.
    pub fn new(
        distance: f64,
        velocity: f64,
        acceleration: f64,
        limits: ProfileLimits,
        jerk: f32,
    ) -> Option<JerkProfile> {
        let limits = ProfileLimits {
            velocity: usable(limits.velocity)?,
            acceleration: usable(limits.acceleration)?,
            deceleration: usable(limits.deceleration)?,
        };
        let j = usable(f64::from(jerk))?;
        let distance = if distance.is_finite() { distance } else { 0.0 };
        let (v0, a0) = (held(velocity), held(acceleration));

        let stop = Change::new(v0, a0, 0.0, limits.deceleration, j);
        let s = sign(distance - stop.distance(v0, a0, j));
        let (rise, cruise_s, fall) = if s == 0.0 {
            (stop, 0.0, Change::default())
        } else {
            Way {
                start: (s * v0, s * a0),
                length: s * distance,
                limits,
                jerk: j,
            }
            .plan()
        };
        let turned = |Change(durations): Change| {
            // The second has no jerk and no sign.
            let [first, middle, last] = durations;
            if s < 0.0 {
                Change([-first, middle, -last])
            } else {
                Change(durations)
            }
        };
        Some(JerkProfile {
            velocity: v0,
            acceleration: a0,
            rise: turned(rise),
            cruise_s,
            fall: turned(fall),
            distance,
            jerk: j as f32,
            arrives: true,
        })
    }

    /// Coming to rest as `deceleration` (counts/s²) and `jerk` (counts/s³) allow, wherever that is.
    /// `None` if one of them is not above 0.
    pub fn stop(
        velocity: f64,
        acceleration: f64,
        deceleration: f64,
        jerk: f32,
    ) -> Option<JerkProfile> {
        let j = usable(f64::from(jerk))?;
        let (v0, a0) = (held(velocity), held(acceleration));
        Some(JerkProfile {
            velocity: v0,
            acceleration: a0,
            rise: Change::new(v0, a0, 0.0, usable(deceleration)?, j),
            cruise_s: 0.0,
            fall: Change::default(),
            distance: 0.0,
            jerk: j as f32,
            arrives: false,
        })
    }

    /// Time from start to rest, s.
    pub fn duration_s(&self) -> f64 {
        self.rise.duration_s() + self.cruise_s + self.fall.duration_s()
    }

    /// Whether the end is at the distance asked for.
    pub fn arrives(&self) -> bool {
        self.arrives
    }

    /// All phases: jerk and duration.
    fn phases(&self) -> impl Iterator<Item = (f64, f64)> {
        let jerk = f64::from(self.jerk);
        let cruise = core::iter::once((0.0, self.cruise_s));
        let rise = self.rise.phases(jerk).into_iter();
        rise.chain(cruise).chain(self.fall.phases(jerk))
    }

    fn start(&self) -> Motion {
        Motion {
            position: 0.0,
            velocity: self.velocity,
            acceleration: self.acceleration,
        }
    }

    /// Position (counts from the start), velocity (counts/s) and acceleration (counts/s²) at time
    /// `t` s after the start.
    pub fn at(&self, t: f64) -> (f64, f64, f64) {
        // Rounding must not leave a remainder at the end.
        let ended = t >= self.duration_s();
        if ended && self.arrives {
            return (self.distance, 0.0, 0.0);
        }
        let mut left = greatest(0.0, t);
        let mut motion = self.start();
        for (number, (jerk, duration)) in (0u8..).zip(self.phases()) {
            motion = motion.after(jerk, least(left, duration));
            if left < duration {
                break;
            }
            left -= duration;
            // The rise ends without acceleration; what rounding leaves of it would add up in a
            // long cruise.
            if number == 2 {
                motion.acceleration = 0.0;
            }
        }
        if ended {
            (motion.position, 0.0, 0.0)
        } else {
            (motion.position, motion.velocity, motion.acceleration)
        }
    }

    /// Least and greatest velocity between two times.
    pub(crate) fn velocities(&self, from: f64, to: f64) -> (f64, f64) {
        let (a, b) = (self.at(from).1, self.at(to).1);
        let (mut low, mut high) = (least(a, b), greatest(a, b));
        let mut note = |t: f64, velocity: f64| {
            if from < t && t < to {
                (low, high) = (least(low, velocity), greatest(high, velocity));
            }
        };
        let mut motion = self.start();
        let mut t = 0.0;
        for (jerk, duration) in self.phases() {
            // Where the acceleration goes through zero the velocity is extreme.
            let turn = if jerk == 0.0 {
                0.0
            } else {
                -motion.acceleration / jerk
            };
            if 0.0 < turn && turn < duration {
                note(t + turn, motion.after(jerk, turn).velocity);
            }
            motion = motion.after(jerk, duration);
            t += duration;
            note(t, motion.velocity);
        }
        (low, high)
    }
}

/// What lies before the axis, in the direction of its way, which ends behind the place where it can
/// stop.
struct Way {
    /// Velocity and acceleration.
    start: (f64, f64),
    length: f64,
    limits: ProfileLimits,
    jerk: f64,
}

impl Way {
    /// To the velocity `peak`, and from there to rest.
    fn over(&self, peak: f64) -> (Change, Change) {
        let (v, a) = self.start;
        let (up, down) = (self.limits.acceleration, self.limits.deceleration);
        let coasted = coasted(v, a, self.jerk);
        let rate = if coasted < 0.0 {
            // First towards zero, then away from it.
            least(up, down)
        } else if peak >= coasted {
            up
        } else {
            down
        };
        (
            Change::new(v, a, peak, rate, self.jerk),
            Change::new(peak, 0.0, 0.0, self.limits.deceleration, self.jerk),
        )
    }

    /// How much of the way is left if the axis goes up to `peak` and down again at once.
    fn left(&self, peak: f64) -> f64 {
        let (v, a) = self.start;
        let (rise, fall) = self.over(peak);
        self.length - rise.distance(v, a, self.jerk) - fall.distance(peak, 0.0, self.jerk)
    }

    /// What is left of the way by rounding, counts: the end is exact without it.
    fn rounding(&self) -> f64 {
        1e-6 + 1e-12 * self.length
    }

    /// The rise, how long the peak velocity lasts, and the fall.
    fn plan(&self) -> (Change, f64, Change) {
        let (v, a) = self.start;
        let speed = self.limits.velocity;
        let natural = greatest(0.0, coasted(v, a, self.jerk));
        let peak = if self.left(0.0) <= self.rounding() {
            // Braking exactly in time: the rest would be a creep.
            0.0
        } else if natural >= speed {
            self.between(0.0, speed)
        } else if self.left(natural) < 0.0 {
            // Already braking, though not enough to stop before the target.
            self.between(0.0, natural)
        } else {
            let mut high = least(speed, greatest(2.0 * natural, 1.0));
            while high < speed && self.left(high) > 0.0 {
                high = least(speed, 2.0 * high);
            }
            self.between(natural, high)
        };
        let (rise, fall) = self.over(peak);
        let left = self.left(peak);
        let cruise = if peak > 0.0 && left > self.rounding() {
            left / peak
        } else {
            0.0
        };
        (rise, cruise, fall)
    }

    /// The peak velocity from `low`, which leaves some of the way, to `high` that leaves the least,
    /// and never less than none.
    fn between(&self, low: f64, high: f64) -> f64 {
        let (mut low, mut high) = (low, high);
        let mut left = self.left(low);
        let mut weights = (left, self.left(high));
        if weights.1 >= 0.0 {
            return high;
        }
        // Regula falsi with the weights of Illinois; each third step halves, so that it ends.
        let mut was_low = None;
        for step in 0..ITERATIONS {
            if left <= 1e-9 || high - low <= 1e-14 * high {
                break;
            }
            let secant = low + (high - low) * weights.0 / (weights.0 - weights.1);
            let halves = step % 3 == 2 || !(low < secant && secant < high);
            let next = if halves { 0.5 * (low + high) } else { secant };
            let seen = self.left(next);
            let is_low = seen >= 0.0;
            let again = was_low == Some(is_low);
            if is_low {
                (low, left) = (next, seen);
                weights = (seen, if again { 0.5 * weights.1 } else { weights.1 });
            } else {
                high = next;
                weights = (if again { 0.5 * weights.0 } else { weights.0 }, seen);
            }
            was_low = Some(is_low);
        }
        low
    }
}
