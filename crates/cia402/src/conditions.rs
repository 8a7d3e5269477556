//! What the axis notices of its errors and limits.

use crate::Demand;
use crate::arithmetic::measured;
use crate::modes::{Inputs, Limited};
use crate::windows::Monitor;

/// What the axis notices and the drive's fault manager judges. All are conditions of the present
/// moment; latching is the manager's business.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conditions {
    /// The following error exceeds its warning window (0x6065, 0x6066).
    pub following_warning: bool,
    /// The following error exceeds its fault window (P3: 0x2120, 0x2121).
    pub following_fault: bool,
    /// The velocity error exceeds its warning window (P3: 0x606D, 0x606E).
    pub velocity_warning: bool,
    /// The velocity error exceeds its fault window (P3: 0x2104, 0x2105).
    pub velocity_fault: bool,
    /// The target lies beyond the greatest position (0x607D,2).
    pub above_greatest_position: bool,
    /// The target lies beyond the least position (0x607D,1).
    pub below_least_position: bool,
    /// The demand is held back by the velocity limit.
    pub velocity_limited: bool,
    /// The demand is held back by the acceleration or deceleration limit.
    pub acceleration_limited: bool,
    /// The target torque exceeds the limit, or the controllers are at one of theirs.
    pub torque_limited: bool,
    /// Homing has failed; until it is started again or left.
    pub homing_failed: bool,
}

impl Conditions {
    /// The target is beyond the position limits, on either side.
    pub const fn position_limited(&self) -> bool {
        self.above_greatest_position || self.below_least_position
    }

    /// Any limit is at work: statusword bit 11.
    pub const fn limited(&self) -> bool {
        self.position_limited()
            || self.velocity_limited
            || self.acceleration_limited
            || self.torque_limited
    }
}

/// Following error and velocity error against their windows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watch {
    following_warning: Monitor,
    following_fault: Monitor,
    velocity_warning: Monitor,
    velocity_fault: Monitor,
    /// As found by the last tick.
    outside: Outside,
}

/// Which windows the errors have left for long enough.
#[derive(Clone, Copy, Debug)]
struct Outside {
    following_warning: bool,
    following_fault: bool,
    velocity_warning: bool,
    velocity_fault: bool,
}

impl Watch {
    /// Nothing seen yet.
    pub(crate) const NEW: Watch = Watch {
        following_warning: Monitor::NEW,
        following_fault: Monitor::NEW,
        velocity_warning: Monitor::NEW,
        velocity_fault: Monitor::NEW,
        outside: Outside {
            following_warning: false,
            following_fault: false,
            velocity_warning: false,
            velocity_fault: false,
        },
    };

    /// One millisecond more under `demand`.
    pub(crate) fn tick(&mut self, demand: &Demand, inputs: &Inputs<'_>) {
        let position_error = match demand {
            Demand::Position { .. } => {
                let error = inputs.present.position.wrapping_sub(inputs.actual.position);
                Some((f64::from(error) + inputs.present.fraction).abs())
            }
            _ => None,
        };
        let velocity_error = match demand {
            Demand::Velocity { .. } => {
                Some((inputs.present.velocity - measured(inputs.actual.velocity)).abs())
            }
            _ => None,
        };
        let configuration = inputs.configuration;
        self.outside = Outside {
            following_warning: self
                .following_warning
                .tick(configuration.following_warning, position_error),
            following_fault: self
                .following_fault
                .tick(configuration.following_fault, position_error),
            velocity_warning: self
                .velocity_warning
                .tick(configuration.velocity_warning, velocity_error),
            velocity_fault: self
                .velocity_fault
                .tick(configuration.velocity_fault, velocity_error),
        };
    }

    /// Whether the following error exceeds a window.
    pub(crate) fn following(&self) -> bool {
        self.outside.following_warning || self.outside.following_fault
    }

    /// Together with the limits at work.
    pub(crate) fn conditions(&self, limited: Limited) -> Conditions {
        Conditions {
            following_warning: self.outside.following_warning,
            following_fault: self.outside.following_fault,
            velocity_warning: self.outside.velocity_warning,
            velocity_fault: self.outside.velocity_fault,
            above_greatest_position: limited.above,
            below_least_position: limited.below,
            velocity_limited: limited.velocity,
            acceleration_limited: limited.acceleration,
            torque_limited: limited.torque,
            homing_failed: false,
        }
    }
}
