//! A position demand that follows profiles, millisecond by millisecond.

use crate::Demand;
use crate::arithmetic::{split, within};
use crate::demand::whole;
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
    /// Per mille.
    pub(crate) torque_pm: f64,
    /// Whether the torque is a demand, not a measurement.
    pub(crate) torque_is_demand: bool,
    /// Where the electrical frame stands, 1/65,536 turn.
    pub(crate) angle: i16,
    /// How long the segment in force will still last, ns.
    pub(crate) left_ns: u32,
}

/// A position demand in counts that do not wrap, and the profile it follows. The profile is
/// evaluated from its start each time, so that no error accumulates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Path {
    origin: i64,
    origin_fraction: f64,
    profile: Profile,
    ticks: u64,
}

impl Path {
    /// From the present position and velocity to rest, as fast as `deceleration` (counts/s²)
    /// allows.
    pub(crate) fn stop(present: &Present, deceleration: f64) -> Path {
        Path {
            origin: i64::from(present.position),
            origin_fraction: present.fraction,
            profile: Profile::stop(present.velocity, deceleration),
            ticks: 0,
        }
    }

    /// At the first tick: a path that began in motion continues from where the demand has come to
    /// since.
    pub(crate) fn resume(&mut self, present: &Present, deceleration: f64) {
        if !self.ended() {
            self.restart(present, deceleration);
        }
    }

    /// From the present position and velocity to rest, in this path's counts.
    pub(crate) fn restart(&mut self, present: &Present, deceleration: f64) {
        let position = self.position();
        let moved = present.position.wrapping_sub(position as i32);
        *self = Path {
            origin: position.saturating_add(i64::from(moved)),
            ..Path::stop(present, deceleration)
        };
    }

    /// The same path in positions that are `offset` counts greater.
    pub(crate) fn shift(&mut self, offset: i32) {
        self.origin = self.origin.saturating_add(i64::from(offset));
    }

    fn time(&self) -> f64 {
        self.ticks as f64 * TICK_S
    }

    /// Whole counts and fraction at the present tick, and the velocity.
    fn now(&self) -> (i64, f64, f64) {
        let (relative, velocity) = self.profile.at(self.time());
        let (counts, fraction) = split(self.origin_fraction + relative);
        (self.origin.saturating_add(counts), fraction, velocity)
    }

    /// Present position in whole counts, not wrapped.
    pub(crate) fn position(&self) -> i64 {
        self.now().0
    }

    /// From the present tick on: a profile to `target`, in this path's counts.
    pub(crate) fn go(&mut self, target: i64, limits: ProfileLimits) {
        let (position, fraction, velocity) = self.now();
        let distance = target.saturating_sub(position) as f64 - fraction;
        *self = Path {
            origin: position,
            origin_fraction: fraction,
            profile: Profile::new(distance, velocity, limits),
            ticks: 0,
        };
    }

    /// Whether the profile has come to its end.
    pub(crate) fn ended(&self) -> bool {
        self.time() >= self.profile.duration_s()
    }

    /// Whether it ended, or will end, where it was asked to.
    pub(crate) fn arrives(&self) -> bool {
        self.profile.arrives()
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
        if from >= self.profile.duration_s() {
            return Path::hold(position, fraction);
        }
        let to = from + TICK_S;
        let mean = (self.profile.at(to).0 - self.profile.at(from).0) / TICK_S;
        let (low, high) = self.profile.velocities(from, to);
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
