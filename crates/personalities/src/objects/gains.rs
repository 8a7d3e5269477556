//! The controllers.

use canopen::Address;

use super::{Figure, Scaled};

/// The controllers' bandwidth and damping.
#[derive(Clone, Copy, Debug)]
pub struct GainObjects {
    /// D-axis current controller.
    pub current_d: LoopObjects,
    /// Q-axis current controller.
    pub current_q: LoopObjects,
    /// Velocity controller.
    pub velocity: MotionLoop,
    /// Position controller.
    pub position: MotionLoop,
    /// Share of the current for the demanded acceleration that is fed forward, 0 to 1.
    pub acceleration_feed_forward: f32,
}

/// How a drive's objects describe a velocity or position controller.
#[derive(Clone, Copy, Debug)]
pub enum MotionLoop {
    /// By bandwidth and damping, or by gains that can be given in their place.
    Tuned(LoopObjects),
    /// By gains alone.
    Gains(PidObjects),
}

/// A controller's gains at the output, in radians: of a position controller rad/s per rad, of a
/// velocity controller Nm per rad/s. Each is shown as it was written.
#[derive(Clone, Copy, Debug)]
pub struct PidObjects {
    /// Proportional part.
    pub proportional: Scaled,
    /// Integral part, per second.
    pub integral: Scaled,
    /// Derivative part, times a second.
    pub derivative: Scaled,
    /// Bound of the integral part, rad/s or Nm.
    pub integral_limit: Scaled,
}

/// One controller.
#[derive(Clone, Copy, Debug)]
pub struct LoopObjects {
    /// Hz.
    pub bandwidth: Figure,
    /// 1 is critical. Without one the current controller's zero cancels the winding's pole.
    pub damping: Option<Figure>,
    /// Gains that can be given in place of the two, if there are such objects.
    pub direct: Option<DirectGainObjects>,
}

/// A controller's gains: of a position controller counts/s per count, per count·s and per count/s;
/// of a velocity controller A per turn/s, per turn and per turn/s².
#[derive(Clone, Copy, Debug)]
pub struct DirectGainObjects {
    /// The object of the bandwidth; that of the damping and the three gains are the sub-indices
    /// behind it.
    pub first: Address,
    /// Proportional part; 0 where the gains are not given.
    pub proportional: Scaled,
    /// Integral part.
    pub integral: Scaled,
    /// Derivative part.
    pub derivative: Scaled,
}
