//! What the user sets, what the master wants, what the motor does.
//!
//! Speeds and rates are `f32`: their rounding, 6e-8 of the value, is far below what any motor
//! shows, and positions, which must be exact, are integers. The generators compute in `f64`.

use crate::Mode;
use crate::arithmetic::{AT_ONCE, magnitude};
use crate::homing::{HomingConfiguration, HomingInputs};
use crate::modes::BUFFER_SIZE;
use crate::profile::ProfileLimits;

/// A window and how long a value must be beyond it (monitors) or within it (targets).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Counts or counts/s; the border belongs to the inside.
    pub size: u32,
    /// Milliseconds.
    pub time_ms: u16,
}

/// Unit and ramps of velocity mode. Rates as in [`Configuration`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VlConfiguration {
    /// Counts/s of one unit of the target (0x604B, 0x604C and the encoder's resolution).
    pub counts_per_s: f32,
    /// Rate of speeding up, counts/s² (0x6048).
    pub acceleration: f32,
    /// Rate of slowing down, counts/s² (0x6049).
    pub deceleration: f32,
    /// Rate of the quick stop, counts/s² (0x604A); unusable: the deceleration.
    pub quick_stop_deceleration: f32,
}

/// How a moving axis is brought to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slowing {
    /// Counts/s², above 0.
    pub(crate) rate: f32,
    /// Counts/s³; 0: a linear ramp.
    pub(crate) jerk: f32,
}

/// Limits and profile parameters in internal units. It changes when objects change, not with time.
///
/// No value is refused. A rate (counts/s²) that is 0, negative or NaN means: an acceleration, that
/// the axis does not speed up; a deceleration, that the acceleration is used in its place, or, if
/// that is unusable too, that it stops at once. Infinity means at once. A speed that is 0, negative
/// or NaN allows no motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// Speed of profile position moves, counts/s (0x6081).
    pub profile_velocity: f32,
    /// Rate of speeding up, counts/s² (0x6083).
    pub acceleration: f32,
    /// Rate of slowing down, counts/s² (0x6084).
    pub deceleration: f32,
    /// Rate of the quick stop, counts/s² (0x6085); unusable: the deceleration.
    pub quick_stop_deceleration: f32,
    /// Greatest speed, counts/s, the least of 0x607F, 0x6080 and what else the drive knows.
    pub max_velocity: Option<f32>,
    /// Greatest rate of speeding up, counts/s² (0x60C5).
    pub max_acceleration: Option<f32>,
    /// Greatest rate of slowing down, counts/s² (0x60C6).
    pub max_deceleration: Option<f32>,
    /// Least and greatest position, counts (0x607D); ignored if the first exceeds the second.
    pub position_limits: Option<(i32, i32)>,
    /// Greatest torque, per mille of rated torque (0x6072); negative or NaN: 0.
    pub max_torque_pm: f32,
    /// Jerk of profile position and profile velocity, counts/s³ (0x60A4, if 0x6086 is 3); 0 or
    /// unusable: linear ramps.
    pub jerk: f32,
    /// Unit and ramps of velocity mode (2).
    pub vl: VlConfiguration,
    /// Torque slope, per mille of rated torque per second (0x6087); `None` or unusable: at once.
    pub torque_slope_pm_per_s: Option<f32>,
    /// Time that one cyclic set-point lasts, ns (0x60C2); 0 counts as 1 ms.
    pub interpolation_period_ns: u32,
    /// Set-points that the buffer of interpolated position takes (0x60C4,2), 16 at most.
    pub interpolation_buffer: u8,
    /// Quick stop option code (0x605A), 0 to 8; others count as 2.
    pub quick_stop_option: i8,
    /// Shutdown option code (0x605B): 1 slows down on the slow-down ramp first; others free the
    /// motor at once.
    pub shutdown_option: i8,
    /// Disable operation option code (0x605C): 0 frees the motor at once; others slow down first.
    pub disable_option: i8,
    /// Halt option code (0x605D), 1 to 4; others count as 1.
    pub halt_option: i8,
    /// Fault reaction option code (0x605E), 0 to 4; others count as 2.
    pub fault_reaction_option: i8,
    /// Abort connection option code (0x6007): 1 fault, 2 disable voltage, 3 quick stop; others:
    /// nothing happens.
    pub abort_connection_option: i8,
    /// Following error that warns and sets statusword bit 13, counts (0x6065, 0x6066).
    pub following_warning: Option<Window>,
    /// Following error that is a fault, counts (P3: 0x2120, 0x2121).
    pub following_fault: Option<Window>,
    /// Velocity error that warns, counts/s (P3: 0x606D, 0x606E).
    pub velocity_warning: Option<Window>,
    /// Velocity error that is a fault, counts/s (P3: 0x2104, 0x2105).
    pub velocity_fault: Option<Window>,
    /// When a position counts as reached, counts (0x6067, 0x6068); `None`: when the profile ends.
    pub position_window: Option<Window>,
    /// When a velocity counts as reached, counts/s (0x606D, 0x606E in the standard); `None`: when
    /// the ramp ends.
    pub velocity_window: Option<Window>,
    /// The window is wider by this part of the target, percent: what a measured velocity trembles by
    /// grows with the speed.
    pub velocity_window_percent: u8,
    /// Speed that counts as standstill, counts/s (0x606F).
    pub velocity_threshold: f32,
    /// How long the speed must exceed the threshold to count as motion, ms (0x6070).
    pub velocity_threshold_time_ms: u16,
    /// Parameters of mode 6.
    pub homing: HomingConfiguration,
}

impl Default for Configuration {
    /// Everything 0 or off: no motion; rated torque; a set-point each millisecond; the standard's
    /// option codes, but that a lost connection changes nothing.
    fn default() -> Configuration {
        Configuration {
            profile_velocity: 0.0,
            acceleration: 0.0,
            deceleration: 0.0,
            quick_stop_deceleration: 0.0,
            max_velocity: None,
            max_acceleration: None,
            max_deceleration: None,
            position_limits: None,
            max_torque_pm: 1000.0,
            jerk: 0.0,
            vl: VlConfiguration::default(),
            torque_slope_pm_per_s: None,
            interpolation_period_ns: 1_000_000,
            interpolation_buffer: BUFFER_SIZE,
            quick_stop_option: 2,
            shutdown_option: 0,
            disable_option: 1,
            halt_option: 1,
            fault_reaction_option: 2,
            abort_connection_option: 0,
            following_warning: None,
            following_fault: None,
            velocity_warning: None,
            velocity_fault: None,
            position_window: None,
            velocity_window: None,
            velocity_window_percent: 0,
            velocity_threshold: 0.0,
            velocity_threshold_time_ms: 0,
            homing: HomingConfiguration::DEFAULT,
        }
    }
}

/// A value cut to a limit, and whether it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cut<T> {
    pub(crate) value: T,
    pub(crate) limited: bool,
}

impl<T: PartialOrd> Cut<T> {
    /// Whether `wanted` was greater than what is allowed.
    pub(crate) fn above(&self, wanted: &T) -> bool {
        *wanted > self.value
    }

    /// Whether `wanted` was less than what is allowed.
    pub(crate) fn below(&self, wanted: &T) -> bool {
        *wanted < self.value
    }
}

impl Configuration {
    fn cut(value: f64, limit: Option<f32>) -> Cut<f64> {
        match limit.map(magnitude) {
            Some(limit) if value > limit => Cut {
                value: limit,
                limited: true,
            },
            _ => Cut {
                value,
                limited: false,
            },
        }
    }

    /// A speed within the limit, counts/s. `value` may have either sign.
    pub(crate) fn velocity(&self, value: f64) -> Cut<f64> {
        let cut = Configuration::cut(value.abs(), self.max_velocity);
        Cut {
            value: cut.value.copysign(value),
            limited: cut.limited,
        }
    }

    /// The rate of speeding up, counts/s².
    pub(crate) fn acceleration(&self, value: f32) -> Cut<f64> {
        Configuration::cut(magnitude(value), self.max_acceleration)
    }

    /// The rate of slowing down, counts/s²; never 0.
    pub(crate) fn deceleration(&self, value: f32, otherwise: f32) -> Cut<f64> {
        let rate = match (magnitude(value), magnitude(otherwise)) {
            (rate, _) if rate > 0.0 => rate,
            (_, rate) if rate > 0.0 => rate,
            _ => AT_ONCE,
        };
        let cut = Configuration::cut(rate, self.max_deceleration);
        // A limit of 0 would forbid stopping.
        if cut.value > 0.0 {
            cut
        } else {
            Cut {
                value: rate,
                limited: false,
            }
        }
    }

    /// The profile of a move, and whether its speed and its rates were cut.
    pub(crate) fn profile(
        &self,
        velocity: f32,
        acceleration: f32,
        deceleration: f32,
    ) -> (ProfileLimits, Cut<()>, Cut<()>) {
        let v = self.velocity(magnitude(velocity));
        let a = self.acceleration(acceleration);
        let d = self.deceleration(deceleration, acceleration);
        (
            ProfileLimits {
                velocity: v.value,
                acceleration: a.value,
                deceleration: d.value,
            },
            Cut {
                value: (),
                limited: v.limited,
            },
            Cut {
                value: (),
                limited: a.limited || d.limited,
            },
        )
    }

    /// The slow-down ramp, on which a moving axis is brought to rest without a target.
    pub(crate) fn slow_down(&self, mode: Mode) -> Slowing {
        let (down, up) = match mode {
            Mode::VELOCITY => (self.vl.deceleration, self.vl.acceleration),
            _ => (self.deceleration, self.acceleration),
        };
        Slowing {
            rate: self.deceleration(down, up).value as f32,
            jerk: match mode {
                Mode::PROFILE_POSITION | Mode::PROFILE_VELOCITY => self.jerk,
                _ => 0.0,
            },
        }
    }

    /// The quick stop ramp, which is linear always.
    pub(crate) fn quick_stop(&self, mode: Mode) -> Slowing {
        let rate = match mode {
            Mode::VELOCITY => self.vl.quick_stop_deceleration,
            _ => self.quick_stop_deceleration,
        };
        let rate = if rate > 0.0 {
            self.deceleration(rate, rate).value as f32
        } else {
            self.slow_down(mode).rate
        };
        Slowing { rate, jerk: 0.0 }
    }

    /// A position within the limits.
    pub(crate) fn position(&self, value: i64) -> Cut<i64> {
        let (low, high) = match self.position_limits {
            Some((low, high)) if low <= high => (i64::from(low), i64::from(high)),
            _ => (i64::MIN, i64::MAX),
        };
        let cut = value.clamp(low, high);
        Cut {
            value: cut,
            limited: cut != value,
        }
    }

    /// A torque within the limit, per mille.
    pub(crate) fn torque(&self, value: f64) -> Cut<f64> {
        let limit = magnitude(self.max_torque_pm);
        if value.abs() > limit {
            Cut {
                value: limit.copysign(value),
                limited: true,
            }
        } else {
            Cut {
                value,
                limited: false,
            }
        }
    }

    /// The interpolation period, ns.
    pub(crate) fn interpolation_ns(&self) -> u32 {
        if self.interpolation_period_ns == 0 {
            1_000_000
        } else {
            self.interpolation_period_ns
        }
    }

    /// How far an actual velocity is beyond the part of `target` that counts as reached anyway.
    pub(crate) fn velocity_error(&self, target: f64, actual: f64) -> f64 {
        let part = f64::from(self.velocity_window_percent) * 0.01;
        (target - actual).abs() - part * target.abs()
    }

    /// Whether a measured speed counts as standstill.
    pub(crate) fn stands(&self, velocity: f64) -> bool {
        velocity.abs() <= magnitude(self.velocity_threshold)
    }
}

/// What the master wants: the target and offset objects, read when they are needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Targets {
    /// Target position, counts (0x607A).
    pub position: i32,
    /// Target velocity, counts/s (0x60FF).
    pub velocity: i32,
    /// Target velocity of mode 2 in units of [`VlConfiguration::counts_per_s`] (0x6042).
    pub vl_velocity: i16,
    /// Target torque, per mille of rated torque (0x6071).
    pub torque_pm: i16,
    /// Position offset, counts (0x60B0); cyclic position mode.
    pub position_offset: i32,
    /// Velocity offset, counts/s (0x60B1); cyclic position and velocity modes.
    pub velocity_offset: i32,
    /// Torque offset, per mille of rated torque (0x60B2); cyclic modes.
    pub torque_offset_pm: i16,
    /// Electrical angle, 1/65,536 turn (0x60EA); modes 11 and 12.
    pub angle: i16,
    /// Voltage of the d axis, 1/32,768 of the longest vector (P3: 0x3010,4); mode 12.
    pub voltage_d: i16,
    /// Voltage of the q axis, in the same unit (P3: 0x3010,5); mode 12.
    pub voltage_q: i16,
}

/// Which target object has been received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// 0x607A
    Position,
    /// 0x60FF
    Velocity,
    /// 0x6042
    VlVelocity,
    /// 0x6071
    Torque,
    /// 0x60EA
    Angle,
    /// P3: 0x3010,4 or 0x3010,5
    PhaseVoltage,
}

/// What the control half knows. The demand values are those that the next control boundary would
/// use if no new demand came, without offsets ([`crate::Demand::at`]): a new segment begins there,
/// so that neither position nor velocity jumps. At its very end a segment still has its slope.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actual {
    /// Actual position, counts (0x6064).
    pub position: i32,
    /// Actual velocity, counts/s (0x606C).
    pub velocity: f32,
    /// Actual torque, per mille of rated torque (0x6077).
    pub torque_pm: f32,
    /// Position demand, counts (0x6062); looked at while the demand is a position.
    pub demand_position: i32,
    /// Its fraction, 0 to below 1.
    pub demand_fraction: f32,
    /// Velocity demand, counts/s: the slope of a position demand, or the velocity demand.
    pub demand_velocity: f32,
    /// Torque demand, per mille; looked at while the demand is a torque.
    pub demand_torque_pm: f32,
    /// Electrical angle of the frame in which the voltage is made, 1/65,536 turn.
    pub electrical_angle: i16,
    /// How long the demand's segment will still last, ns; 0 if it has ended.
    pub demand_left_ns: u32,
    /// The controllers are at a limit of torque, current, voltage or speed.
    pub limited: bool,
    /// The motor supply is present.
    pub voltage: bool,
    /// The drive has a warning.
    pub warning: bool,
    /// Switches and what was captured at them.
    pub homing: HomingInputs,
}
