//! A look at the physical world at regular times, for plots and for assertions.

use canopen::Instant;

use crate::place::Place;

/// What a probe saw of one axis of a drive: the plant's truth, which the drive itself never sees, and the
/// drive's own demand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeSample {
    /// When.
    pub at: Instant,
    /// Whose.
    pub place: Place,
    /// Which axis of the drive, from 0.
    pub axis: usize,
    /// Position of the shaft since the start, turns.
    pub position_turns: f64,
    /// Speed of the shaft, rad/s.
    pub speed_rad_s: f32,
    /// Measured q-axis current, A.
    pub current_a: f32,
    /// Position demand, counts.
    pub demand_counts: i32,
    /// Actual position as the drive sees it, counts.
    pub position_counts: i32,
}
