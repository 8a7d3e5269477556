//! The straight line from the present demand to a set-point, for the modes that interpolate.

use crate::Demand;
use crate::arithmetic::{least, magnitude};

use super::Inputs;

/// A set-point that comes at most this part of its period before the last one is reached is early
/// by the jitter of SYNC, bus and processor.
pub(super) const JITTER_DIVISOR: u32 = 4;

/// What is added behind the position controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Offsets {
    /// Counts/s.
    pub(super) velocity: f32,
    /// Per mille of rated torque.
    pub(super) torque_pm: f32,
}

impl Offsets {
    /// Nothing.
    pub(super) const NONE: Offsets = Offsets {
        velocity: 0.0,
        torque_pm: 0.0,
    };
}

/// From the present demand to `target` within `period_ns`, or as fast as the velocity limit allows;
/// and whether that held it back.
pub(super) fn towards(
    target: i32,
    period_ns: u32,
    offsets: Offsets,
    inputs: &Inputs<'_>,
) -> (Demand, bool) {
    let present = &inputs.present;
    // With limits the way lies between them; without, positions wrap and the short way is it.
    let counts = if inputs.configuration.position_limits.is_some() {
        i64::from(target) - i64::from(present.position)
    } else {
        i64::from(target.wrapping_sub(present.position))
    };
    let distance = counts as f64 - present.fraction;
    let period = f64::from(period_ns) * 1e-9;
    let wanted = distance / period;
    let (velocity, duration, limited) = match inputs.configuration.max_velocity.map(magnitude) {
        Some(limit) if wanted.abs() > limit => {
            let time = if limit > 0.0 {
                least(distance.abs() / limit, 4.0)
            } else {
                0.0
            };
            (limit.copysign(distance), time, true)
        }
        _ => (wanted, period, false),
    };
    let demand = Demand::Position {
        start: present.position,
        fraction: present.fraction as f32,
        velocity: velocity as f32,
        acceleration: 0.0,
        velocity_offset: offsets.velocity,
        torque_offset_pm: offsets.torque_pm,
        duration_ns: (duration * 1e9) as u32,
    };
    (demand, limited)
}
