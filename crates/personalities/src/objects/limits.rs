//! Limits, profile parameters, option codes and windows.

use canopen::Field;

use super::Scaled;

/// Limits and profile parameters. Where several objects limit the same thing, the least counts;
/// a limit of 0 counts as "none".
#[derive(Clone, Copy, Debug)]
pub struct ConfigurationObjects {
    /// 0x6081, counts/s.
    pub profile_velocity: Scaled,
    /// 0x6083, counts/s².
    pub acceleration: Scaled,
    /// 0x6084, counts/s².
    pub deceleration: Scaled,
    /// 0x6085, counts/s².
    pub quick_stop_deceleration: Option<Scaled>,
    /// 0x607F and whatever else limits the velocity demand, counts/s.
    pub max_velocity: [Option<Scaled>; 2],
    /// 0x6080, the greatest speed in torque modes, counts/s.
    pub max_motor_velocity: Option<Scaled>,
    /// 0x60C5, counts/s².
    pub max_acceleration: Option<Scaled>,
    /// 0x60C6, counts/s².
    pub max_deceleration: Option<Scaled>,
    /// 0x607D,1 and 2, counts; both 0: no limits.
    pub position_limits: Option<(Scaled, Scaled)>,
    /// 0x6072, per mille of rated torque.
    pub max_torque: Scaled,
    /// 0x6086 and 0x60A4,1, counts/s³: linear ramps (0), or limited jerk (3).
    pub jerk: Option<(Field, Scaled)>,
    /// Unit and ramps of velocity mode.
    pub vl: Option<VlObjects>,
    /// 0x6087, per mille of rated torque per second.
    pub torque_slope: Option<Scaled>,
    /// 0x60C2,1 and 2: value and power of ten of a second.
    pub interpolation_period: Option<(Field, Field)>,
    /// 0x60C4,2: set-points that the buffer takes.
    pub interpolation_buffer: Option<Field>,
    /// 0x605A.
    pub quick_stop_option: Option<Field>,
    /// 0x605B.
    pub shutdown_option: Option<Field>,
    /// 0x605C.
    pub disable_option: Option<Field>,
    /// 0x605D.
    pub halt_option: Option<Field>,
    /// 0x605E.
    pub fault_reaction_option: Option<Field>,
    /// 0x6007.
    pub abort_connection_option: Option<Field>,
    /// Following error that warns, counts.
    pub following_warning: Option<WindowObjects>,
    /// Following error that is a fault, counts.
    pub following_fault: Option<WindowObjects>,
    /// Velocity error that warns, counts/s.
    pub velocity_warning: Option<WindowObjects>,
    /// Velocity error that is a fault, counts/s.
    pub velocity_fault: Option<WindowObjects>,
    /// When a position counts as reached, counts.
    pub position_window: TargetWindow,
    /// When a velocity counts as reached, counts/s.
    pub velocity_window: TargetWindow,
    /// By how much of the target that window is wider, percent.
    pub velocity_window_percent: u8,
    /// Speed that counts as standstill, counts/s.
    pub velocity_threshold: f32,
}

impl ConfigurationObjects {
    /// These four; no other limit, no option code, and windows of 0.
    pub const fn only(
        profile_velocity: Scaled,
        acceleration: Scaled,
        deceleration: Scaled,
        max_torque: Scaled,
    ) -> ConfigurationObjects {
        ConfigurationObjects {
            profile_velocity,
            acceleration,
            deceleration,
            quick_stop_deceleration: None,
            max_velocity: [None, None],
            max_motor_velocity: None,
            max_acceleration: None,
            max_deceleration: None,
            position_limits: None,
            max_torque,
            jerk: None,
            vl: None,
            torque_slope: None,
            interpolation_period: None,
            interpolation_buffer: None,
            quick_stop_option: None,
            shutdown_option: None,
            disable_option: None,
            halt_option: None,
            fault_reaction_option: None,
            abort_connection_option: None,
            following_warning: None,
            following_fault: None,
            velocity_warning: None,
            velocity_fault: None,
            position_window: TargetWindow::Fixed {
                size: 0,
                time_ms: 0,
            },
            velocity_window: TargetWindow::Fixed {
                size: 0,
                time_ms: 0,
            },
            velocity_window_percent: 0,
            velocity_threshold: 0.0,
        }
    }
}

/// Velocity mode (2): its unit is rpm × dimension factor, its rates a speed in a time.
#[derive(Clone, Copy, Debug)]
pub struct VlObjects {
    /// Counts per turn.
    pub encoder_resolution: Field,
    /// 0x604C,1 and 2: numerator and denominator.
    pub dimension_factor: (Field, Field),
    /// 0x604B,1 and 2: numerator and denominator; for target and actual velocity only.
    pub set_point_factor: (Field, Field),
    /// 0x6048,1 and 2: speed and s.
    pub acceleration: (Field, Field),
    /// 0x6049,1 and 2: speed and s.
    pub deceleration: (Field, Field),
    /// 0x604A,1 and 2: speed and s.
    pub quick_stop: (Field, Field),
}

/// When a target counts as reached.
#[derive(Clone, Copy, Debug)]
pub enum TargetWindow {
    /// The drive has no object for it.
    Fixed {
        /// Counts or counts/s.
        size: u32,
        /// Milliseconds.
        time_ms: u16,
    },
    /// 0x6067 and 0x6068, or 0x606D and 0x606E. A window of 0 is none wide; 0xFFFFFFFF switches it
    /// off, so that the end of the profile counts (CiA 402, 0x6067).
    Objects(WindowObjects),
    /// An object without a time.
    Size(Scaled),
}

/// A window and its time; a window of 0 is off.
#[derive(Clone, Copy, Debug)]
pub struct WindowObjects {
    /// Counts or counts/s.
    pub size: Scaled,
    /// Milliseconds.
    pub time_ms: Field,
}
