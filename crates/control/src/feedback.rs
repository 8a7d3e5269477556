//! What the loops tell the axis.

use crate::{Mask as _, Real};

/// The state of the loops after the last control period. In the user's direction, where it has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedback<R: Real> {
    /// Position over many turns, counts, wrapping.
    pub position: R::Count,
    /// Velocity as the loops use it, counts/s: quick and noisy.
    pub velocity: R,
    /// Velocity to report, counts/s: smooth.
    pub velocity_reported: R,
    /// Measured q-axis current, A of phase amplitude.
    pub current_q_a: R,
    /// Measured d-axis current, A of phase amplitude.
    pub current_d_a: R,
    /// Position demand of the last period, whole counts. The position itself while the position
    /// loop is open.
    pub demand_position: R::Count,
    /// Position demand beyond the whole counts, 0 to 1.
    pub demand_fraction: R,
    /// Position demand of the next period if no other segment is loaded, whole counts.
    pub next_position: R::Count,
    /// The same beyond the whole counts, 0 to below 1.
    pub next_fraction: R,
    /// Slope of the position demand, or the velocity demand, of the next period, counts/s; without
    /// offset, and before any limit. At the very end of a segment still its slope.
    pub next_velocity: R,
    /// Current demand or feed-forward of the next period, before any limit, A.
    pub next_current_a: R,
    /// Periods for which the segment in force will still move, 0 if it has ended.
    pub next_periods_left: R::Count,
    /// Demand − actual, counts.
    pub following_error: R,
    /// Velocity demand after its limit, counts/s; the velocity itself while no loop is closed.
    pub demand_velocity: R,
    /// q-axis current demand after its limits, A.
    pub demand_current_a: R,
    /// Voltage applied along d and q, V of phase amplitude, after its limit.
    pub voltage_v: [R; 2],
    /// Electrical angle at which the last voltage was applied; 2³² are one turn.
    pub electrical_angle: R::Count,
    /// Motor supply, V, smoothed.
    pub bus_voltage_v: R,
    /// Amplifier temperature, °C, smoothed.
    pub temperature_c: R,
    /// The encoder's reading within one turn, counts.
    pub encoder: R::Count,
    /// Current converters of phases A and B, counts, smoothed: what calibrating their zeros needs.
    pub phase_adc: [R; 2],
    /// The current demand was cut by any current limit.
    pub current_limited: R::Mask,
    /// The velocity demand, or in torque mode the torque, was cut by the velocity limit.
    pub velocity_limited: R::Mask,
    /// The voltage was cut by the supply.
    pub voltage_limited: R::Mask,
    /// The I²t limit now allows no more than the continuous current.
    pub i2t_active: R::Mask,
    /// A short circuit has opened the bridge; until the command switches it off.
    pub overcurrent: R::Mask,
    /// The last reading of the encoder was valid.
    pub encoder_valid: R::Mask,
}

impl<R: Real> Feedback<R> {
    /// Before the first control period: everything 0.
    pub fn silent() -> Self {
        let (zero, none, no) = (R::splat(0.0), R::count(0), R::Mask::splat(false));
        Self {
            position: none,
            velocity: zero,
            velocity_reported: zero,
            current_q_a: zero,
            current_d_a: zero,
            demand_position: none,
            demand_fraction: zero,
            next_position: none,
            next_fraction: zero,
            next_velocity: zero,
            next_current_a: zero,
            next_periods_left: none,
            following_error: zero,
            demand_velocity: zero,
            demand_current_a: zero,
            voltage_v: [zero; 2],
            electrical_angle: none,
            bus_voltage_v: zero,
            temperature_c: zero,
            encoder: none,
            phase_adc: [zero; 2],
            current_limited: no,
            velocity_limited: no,
            voltage_limited: no,
            i2t_active: no,
            overcurrent: no,
            encoder_valid: R::Mask::splat(true),
        }
    }
}
