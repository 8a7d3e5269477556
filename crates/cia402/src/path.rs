//! A position demand that follows profiles, millisecond by millisecond.

use crate::Demand;
use crate::arithmetic::{split, within};
use crate::configuration::Slowing;
use crate::demand::whole;
use crate::jerk::JerkProfile;
use crate::profile::{Profile, ProfileLimits};

/// Length of a tick, s and ns.
pub(crate) const TICK_S: f64 = 1e-3;
pub(crate) const TICK_NS: u32 = 1_000_000;

/// Where the axis stands when a generator takes over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Present {
    /// Whole counts.
    pub(crate) position: i32,
    /// Fraction of a count, 0 to below 1.
    pub(crate) fraction: f64,
    /// Counts/s.
    pub(crate) velocity: f64,
    /// Counts/s², of the demand.
    pub(crate) acceleration: f64,
    /// Per mille.
    pub(crate) torque_pm: f64,
    /// Whether the torque is a demand, not a measurement.
    pub(crate) torque_is_demand: bool,
    /// Where the electrical frame stands, 1/65,536 turn.
    pub(crate) angle: i16,
    /// How long the segment in force will still last, ns.
    pub(crate) left_ns: u32,
}

/// How a path gets to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Linear(Profile),
    JerkLimited(JerkProfile),
}

impl Course {
    /// From the present velocity and acceleration to rest.
    fn stop(present: &Present, slowing: Slowing) -> Course {
        let (v, a) = (present.velocity, present.acceleration);
        let rate = f64::from(slowing.rate);
        match JerkProfile::stop(v, a, rate, slowing.jerk) {
            Some(profile) => Course::JerkLimited(profile),
            None => Course::Linear(Profile::stop(v, rate)),
        }
    }

    /// Position, velocity and acceleration, where that is known.
    fn at(&self, t: f64) -> (f64, f64, f64) {
        match self {
            Course::Linear(profile) => {
                let (position, velocity) = profile.at(t);
                (position, velocity, 0.0)
            }
            Course::JerkLimited(profile) => profile.at(t),
        }
    }

    fn velocities(&self, from: f64, to: f64) -> (f64, f64) {
        match self {
            Course::Linear(profile) => profile.velocities(from, to),
            Course::JerkLimited(profile) => profile.velocities(from, to),
        }
    }

    fn duration_s(&self) -> f64 {
        match self {
            Course::Linear(profile) => profile.duration_s(),
            Course::JerkLimited(profile) => profile.duration_s(),
        }
    }

    fn arrives(&self) -> bool {
        match self {
            Course::Linear(profile) => profile.arrives(),
            Course::JerkLimited(profile) => profile.arrives(),
        }
    }
}

/// A position demand in counts that do not wrap, and the profile it follows. The profile is
/// evaluated from its start each time, so that no error accumulates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Path {
    origin: i64,
    origin_fraction: f64,
    course: Course,
    ticks: u32,
}

impl Path {
    /// From the present position and velocity to rest.
    pub(crate) fn stop(present: &Present, slowing: Slowing) -> Path {
        Path {
            origin: i64::from(present.position),
            origin_fraction: present.fraction,
            course: Course::stop(present, slowing),
            ticks: 0,
        }
    }

    /// At the first tick: a path that began in motion continues from where the demand has come to
    /// since.
    pub(crate) fn resume(&mut self, present: &Present, slowing: Slowing) {
        if !self.ended() {
            self.restart(present, slowing);
        }
    }

    /// From the present position and velocity to rest, in this path's counts.
    pub(crate) fn restart(&mut self, present: &Present, slowing: Slowing) {
        let position = self.position();
        let moved = present.position.wrapping_sub(position as i32);
        *self = Path {
            origin: position.saturating_add(i64::from(moved)),
            ..Path::stop(present, slowing)
        };
    }

    /// The same path in positions that are `offset` counts greater.
    pub(crate) fn shift(&mut self, offset: i32) {
        self.origin = self.origin.saturating_add(i64::from(offset));
    }

    fn time(&self) -> f64 {
        f64::from(self.ticks) * TICK_S
    }

    /// Whole counts and fraction at the present tick, and the velocity.
    fn now(&self) -> (i64, f64, f64) {
        let (relative, velocity, _) = self.course.at(self.time());
        let (counts, fraction) = split(self.origin_fraction + relative);
        (self.origin.saturating_add(counts), fraction, velocity)
    }

    /// Present position in whole counts, not wrapped.
    pub(crate) fn position(&self) -> i64 {
        self.now().0
    }

    /// From the present tick on: a profile to `target`, in this path's counts. Where there is none
    /// with limited jerk, it is linear.
    pub(crate) fn go(&mut self, target: i64, limits: ProfileLimits, jerk: f32) {
        let (position, fraction, velocity) = self.now();
        let (_, _, acceleration) = self.course.at(self.time());
        let distance = target.saturating_sub(position) as f64 - fraction;
        let limited = JerkProfile::new(distance, velocity, acceleration, limits, jerk)
            .map(Course::JerkLimited);
        let linear = || Course::Linear(Profile::new(distance, velocity, limits));
        *self = Path {
            origin: position,
            origin_fraction: fraction,
            course: limited.unwrap_or_else(linear),
            ticks: 0,
        };
    }

    /// Whether the profile has come to its end.
    pub(crate) fn ended(&self) -> bool {
        self.time() >= self.course.duration_s()
    }

    /// Whether it ended, or will end, where it was asked to.
    pub(crate) fn arrives(&self) -> bool {
        self.course.arrives()
    }

    /// The demand of the coming millisecond.
    ///
    /// One segment has one acceleration, the profile may have several within a millisecond. The
    /// segment therefore keeps both end positions exactly, starts with the profile's velocity and
    /// ends within the range of the profile's velocities; only if that is impossible, its start
    /// velocity gives way. Velocity and acceleration so never leave the profile's own range.
    pub(crate) fn tick(&mut self) -> Demand {
        let (position, fraction, velocity) = self.now();
        let from = self.time();
        if from >= self.course.duration_s() {
            return Path::hold(position, fraction);
        }
        let to = from + TICK_S;
        let mean = (self.course.at(to).0 - self.course.at(from).0) / TICK_S;
        let (low, high) = self.course.velocities(from, to);
        let end = within(2.0 * mean - velocity, low, high);
        let start = 2.0 * mean - end;
        self.ticks = self.ticks.saturating_add(1);
        let (start_counts, start_fraction) = whole(position, fraction);
        Demand::Position {
            start: start_counts,
            fraction: start_fraction,
            velocity: start as f32,
            acceleration: ((end - start) / TICK_S) as f32,
            velocity_offset: 0.0,
            torque_offset_pm: 0.0,
            duration_ns: TICK_NS,
        }
    }

    /// The demand until the first tick: on with the present velocity.
    pub(crate) fn begin(&self) -> Demand {
        let (position, fraction, speed) = self.now();
        let mut demand = Path::hold(position, fraction);
        if let Demand::Position {
            velocity,
            duration_ns,
            ..
        } = &mut demand
            && !self.ended()
        {
            *velocity = speed as f32;
            *duration_ns = TICK_NS;
        }
        demand
    }

    /// A demand that stays.
    pub(crate) fn hold(position: i64, fraction: f64) -> Demand {
        let (start, fraction) = whole(position, fraction);
        Demand::Position {
            start,
            fraction,
            velocity: 0.0,
            acceleration: 0.0,
            velocity_offset: 0.0,
            torque_offset_pm: 0.0,
            duration_ns: 0,
        }
    }
}
