//! Where the drive core finds its values in a dictionary, and in which units they stand there.

use canopen::{Address, Field, Handle};

/// An object and its unit: internal value = object × `scale`.
///
/// Internal units: counts, counts/s, counts/s², per mille of rated torque, and SI units for
/// everything electrical and mechanical.
#[derive(Clone, Copy, Debug)]
pub struct Scaled {
    /// The object.
    pub field: Field,
    /// Internal units per unit of the object.
    pub scale: f32,
    /// Units of the object per internal unit, so that no division is needed to publish.
    pub per_unit: f32,
}

impl Scaled {
    /// An object whose unit is `scale` internal units.
    pub const fn new(field: Field, scale: f32) -> Scaled {
        Scaled {
            field,
            scale,
            per_unit: 1.0 / scale,
        }
    }

    /// An object in internal units.
    pub const fn plain(field: Field) -> Scaled {
        Scaled::new(field, 1.0)
    }
}

/// A figure that the drive needs, and that not every drive has an object for.
#[derive(Clone, Copy, Debug)]
pub enum Figure {
    /// The object that holds it.
    Object(Scaled),
    /// There is none: it is always this, in internal units.
    Fixed(f32),
}

impl Figure {
    /// An object in internal units.
    pub const fn plain(field: Field) -> Figure {
        Figure::Object(Scaled::plain(field))
    }
}

impl From<Scaled> for Figure {
    fn from(object: Scaled) -> Figure {
        Figure::Object(object)
    }
}

/// One axis: the objects of CiA 402, wherever the drive has them.
#[derive(Clone, Copy, Debug)]
pub struct AxisObjects {
    /// Index of the axis's objects: 0x6000 for the first, 0x800 more for each further one. Its
    /// controlword is 0x40 further, its mode 0x60.
    pub base: u16,
    /// 0x6041, if the drive has a state machine.
    pub statusword: Option<Handle<u16>>,
    /// 0x6061.
    pub mode_display: Field,
    /// What the master wants.
    pub targets: TargetObjects,
    /// What the drive shows.
    pub feedback: FeedbackObjects,
    /// Limits and profile parameters.
    pub configuration: ConfigurationObjects,
    /// Homing, if the axis can.
    pub homing: Option<HomingObjects>,
    /// 0x6076, rated torque, to which per mille refer, Nm.
    pub rated_torque_nm: Figure,
    /// 0x607E, direction of positive values, +1 or −1.
    pub polarity: Option<Field>,
    /// Turns of the output for one of the motor, a REAL32 (the MD80's 0x2000,8). Where there is one,
    /// all motion in the objects is the output's, and per mille are of the output's torque. 0 counts
    /// as 1.
    pub gear: Option<Field>,
}

/// Targets and offsets.
#[derive(Clone, Copy, Debug)]
pub struct TargetObjects {
    /// 0x607A, counts.
    pub position: Scaled,
    /// 0x60FF, counts/s.
    pub velocity: Scaled,
    /// 0x6071, per mille of rated torque.
    pub torque: Option<Scaled>,
    /// 0x6042, in units of velocity mode ([`VlObjects`]).
    pub vl_velocity: Option<Field>,
    /// 0x60C1,1, counts: what is written to it goes into the buffer of interpolated position mode.
    pub interpolation_data: Option<canopen::Address>,
    /// 0x60C4,6: empties that buffer.
    pub interpolation_clear: Option<canopen::Address>,
    /// 0x60B0, counts.
    pub position_offset: Option<Scaled>,
    /// 0x60B1, counts/s.
    pub velocity_offset: Option<Scaled>,
    /// 0x60B2, per mille of rated torque.
    pub torque_offset: Option<Scaled>,
    /// 0x60EA, electrical angle, 1/65,536 turn: given where a mode takes one, else shown.
    pub angle: Option<Field>,
    /// Voltage of the d axis, 1/32,768 of the longest vector: given where a mode takes one, else
    /// shown.
    pub voltage_d: Option<(Address, Field)>,
    /// Voltage of the q axis, likewise.
    pub voltage_q: Option<(Address, Field)>,
}

impl TargetObjects {
    /// These two; no other.
    pub const fn only(position: Scaled, velocity: Scaled) -> TargetObjects {
        TargetObjects {
            position,
            velocity,
            torque: None,
            vl_velocity: None,
            interpolation_data: None,
            interpolation_clear: None,
            position_offset: None,
            velocity_offset: None,
            torque_offset: None,
            angle: None,
            voltage_d: None,
            voltage_q: None,
        }
    }
}

/// What the drive shows.
#[derive(Clone, Copy, Debug)]
pub struct FeedbackObjects {
    /// 0x6064, counts.
    pub position: Scaled,
    /// 0x606C, counts/s.
    pub velocity: Scaled,
    /// 0x6077, per mille of rated torque.
    pub torque: Option<Scaled>,
    /// 0x6078, A.
    pub current_a: Option<Scaled>,
    /// Position demand after limits (the P3's 0x60FC), counts.
    pub position_demand: Option<Scaled>,
    /// Velocity demand after limits (0x606B, the P3's 0x6043), counts/s.
    pub velocity_demand: [Option<Scaled>; 2],
    /// Torque demand after limits (0x6074, the P3's 0x3023,1), per mille of rated torque.
    pub torque_demand: [Option<Scaled>; 2],
    /// 0x6044, in units of velocity mode ([`VlObjects`]).
    pub vl_velocity: Option<Field>,
    /// 0x60C4,4: set-points in the buffer of interpolated position mode.
    pub interpolation_buffered: Option<Field>,
    /// 0x60F4, counts.
    pub following_error: Option<Scaled>,
    /// Velocity demand minus actual (the P3's 0x3023,2), counts/s.
    pub velocity_error: Option<Scaled>,
    /// Motor supply, V.
    pub bus_voltage_v: Option<Scaled>,
    /// Amplifier temperature, °C.
    pub temperature_c: Option<Scaled>,
    /// Raw encoder reading, counts.
    pub raw_encoder: Option<Scaled>,
    /// Filtered current sense of phases A and B, converter counts.
    pub current_sense: [Option<Scaled>; 2],
    /// Current of the d axis, A.
    pub current_d_a: Option<Scaled>,
    /// The motor's temperature sensor, converter counts.
    pub motor_thermistor: Option<Scaled>,
    /// Analog inputs, converter counts.
    pub auxiliary_adc: [Option<Scaled>; 2],
}

impl FeedbackObjects {
    /// These two; no other.
    pub const fn only(position: Scaled, velocity: Scaled) -> FeedbackObjects {
        FeedbackObjects {
            position,
            velocity,
            torque: None,
            current_a: None,
            position_demand: None,
            velocity_demand: [None, None],
            torque_demand: [None, None],
            vl_velocity: None,
            interpolation_buffered: None,
            following_error: None,
            velocity_error: None,
            bus_voltage_v: None,
            temperature_c: None,
            raw_encoder: None,
            current_sense: [None, None],
            current_d_a: None,
            motor_thermistor: None,
            auxiliary_adc: [None, None],
        }
    }
}

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

/// Homing.
#[derive(Clone, Copy, Debug)]
pub struct HomingObjects {
    /// 0x6098.
    pub method: Field,
    /// 0x607C, counts.
    pub offset: Scaled,
    /// Whether the axis is homed, 0 or 1 (the P3's 0x2402).
    pub is_homed: Handle<u8>,
    /// What the methods need in which the axis moves.
    pub search: Option<HomingSearchObjects>,
}

/// The parameters of homing methods in which the axis moves.
#[derive(Clone, Copy, Debug)]
pub struct HomingSearchObjects {
    /// 0x6099,1, counts/s.
    pub switch_velocity: Scaled,
    /// 0x6099,2, counts/s.
    pub zero_velocity: Scaled,
    /// 0x609A, counts/s².
    pub acceleration: Scaled,
    /// Greatest torque while looking for a hard stop, per mille of rated torque.
    pub stop_torque: Scaled,
    /// How long the axis must press and stand, ms.
    pub stop_time_ms: Field,
    /// How far the axis goes back from a hard stop, counts.
    pub back_off: Field,
    /// How long homing may last, ms; 0: for ever.
    pub timeout_ms: Field,
    /// How far homing may lead, counts; 0: anywhere.
    pub range: Field,
    /// How far a hard stop is away at least, counts.
    pub least_way: Field,
    /// Why homing has failed, a number of [`cia402::HomingError`]; 0: it has not.
    pub error: Handle<u8>,
}

/// Digital inputs.
#[derive(Clone, Copy, Debug)]
pub struct InputObjects {
    /// 0x60FD: the inputs that are active.
    pub active: Handle<u32>,
    /// The inputs that are active when their level is low, a bit each.
    pub inverted: Field,
    /// How long switches, and general inputs, must keep a new level, µs.
    pub filter_us: [Field; 2],
    /// What each general input does, an [`InputFunction`].
    pub functions: [Field; 4],
    /// 0x60FE,1 and 2: the outputs, and which of them are driven.
    pub outputs: (Field, Field),
    /// A target by voltage.
    pub analog: AnalogObjects,
    /// Whether safe torque off is active, 0 or 1.
    pub torque_off: Handle<u8>,
    /// Touch probes.
    pub probes: ProbeObjects,
}

/// What a general input does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFunction {
    /// Nothing but to be seen in 0x60FD.
    None,
    /// While active, bit 2 of the controlword is 0: quick stop.
    QuickStop,
    /// While not active, bit 3 of the controlword is 0: operation cannot be enabled.
    Enable,
    /// While active, bit 4 of the controlword is 1: the edge hands over a set-point.
    Start,
    /// While active, bit 8 of the controlword is 1: halt.
    Halt,
}

impl InputFunction {
    /// By its number, 0 to 4 in the order above; others are none.
    pub const fn of(number: u32) -> InputFunction {
        match number {
            1 => InputFunction::QuickStop,
            2 => InputFunction::Enable,
            3 => InputFunction::Start,
            4 => InputFunction::Halt,
            _ => InputFunction::None,
        }
    }
}

/// A target torque or velocity from analog input 1.
#[derive(Clone, Copy, Debug)]
pub struct AnalogObjects {
    /// 0: none, 1: the target torque of mode 4, 2: the target velocity of mode 3.
    pub target: Field,
    /// The reading at a target of 0, converter counts.
    pub offset: Field,
    /// The target at 2048 converter counts beyond offset and dead band, in the target's unit.
    pub scale: Field,
    /// The target is 0 up to this distance from the offset, converter counts.
    pub dead_band: Field,
    /// Both readings, converter counts.
    pub readings: [Handle<u16>; 2],
}

/// Touch probes 1 and 2.
#[derive(Clone, Copy, Debug)]
pub struct ProbeObjects {
    /// 0x60B8.
    pub function: Field,
    /// 0x60B9.
    pub status: Handle<u16>,
    /// Positive and negative edge of probe 1, then those of probe 2.
    pub edges: [ProbeEdgeObjects; 4],
}

/// What one edge of a touch probe shows.
#[derive(Clone, Copy, Debug)]
pub struct ProbeEdgeObjects {
    /// 0x60BA to 0x60BD, counts.
    pub position: Handle<i32>,
    /// 0x60D5 to 0x60D8.
    pub count: Handle<u16>,
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

/// The motor and its encoder.
#[derive(Clone, Copy, Debug)]
pub struct MotorObjects {
    /// Encoder reading with the rotor under phase A, counts.
    pub electrical_zero: Figure,
    /// +1 or −1: order of the phases against the encoder's direction.
    pub electrical_polarity: Figure,
    /// Its object, which takes no 0.
    pub electrical_polarity_at: Option<Address>,
    /// Number of poles (twice the pole pairs).
    pub poles: Figure,
    /// Nm per A of peak phase current.
    pub torque_constant: Figure,
    /// Terminal to terminal, Ω.
    pub terminal_resistance: Figure,
    /// Terminal to terminal, H.
    pub terminal_inductance: Figure,
    /// kg·m², where the drive knows it.
    pub rotor_inertia: Option<Figure>,
    /// A.
    pub continuous_current: Figure,
    /// A.
    pub peak_current: Figure,
    /// s.
    pub peak_time: Figure,
    /// The user's own, lower current limits: continuous A, peak A, time s; 0 is "none".
    pub user_continuous_current: Option<Scaled>,
    /// See [`MotorObjects::user_continuous_current`].
    pub user_peak_current: Option<Scaled>,
    /// See [`MotorObjects::user_continuous_current`].
    pub user_peak_time: Option<Scaled>,
    /// Counts per turn.
    pub encoder_resolution: Figure,
    /// Age of an encoder reading, s.
    pub encoder_lag: Figure,
    /// The object that is 0 where the excess of current is limited as the P3's manual prints it, and
    /// 1 where dimensionally right (P30). Without it: as printed.
    pub i2t_rule: Option<Field>,
    /// Figures of 0 are those of a drive that was not set up yet. It starts, with a bridge through
    /// which its controllers send no current. If not, they are a parameter error.
    pub may_be_unset: bool,
}

/// The amplifier and the controllers.
#[derive(Clone, Copy, Debug)]
pub struct AmplifierObjects {
    /// PWM frequency, Hz.
    pub pwm_frequency_hz: Figure,
    /// PWM periods per control period.
    pub pwm_per_control: u8,
    /// What switches and converters take their time for.
    pub times: BridgeTimeObjects,
    /// Greatest current, A.
    pub max_current: Figure,
    /// A lower one: 0x6073, a share of 0x6075, A.
    pub max_of_rated_current: Option<(Scaled, Scaled)>,
    /// Longest voltage vector, V of phase amplitude.
    pub max_phase_voltage: Figure,
    /// Calibrated readings at no current of phases A and B, converter counts.
    pub current_zero: [Figure; 2],
    /// The controllers.
    pub gains: GainObjects,
}

/// What the bridge's switches and the current converters take their time for, ns.
#[derive(Clone, Copy, Debug)]
pub struct BridgeTimeObjects {
    /// For how long after each switching both switches of a half bridge are open.
    pub dead_time: Figure,
    /// How much later than the timer a switch switches, at least.
    pub propagation: Figure,
    /// By how much later at most than that.
    pub propagation_spread: Figure,
    /// For how long after a switching the current sensors do not read a current.
    pub settling: Figure,
    /// For how long a converter looks.
    pub sampling: Figure,
    /// After what time beyond that its reading is there.
    pub conversion: Figure,
}

impl BridgeTimeObjects {
    /// Nothing takes a time that the drive knows of.
    pub const NONE: BridgeTimeObjects = BridgeTimeObjects {
        dead_time: Figure::Fixed(0.0),
        propagation: Figure::Fixed(0.0),
        propagation_spread: Figure::Fixed(0.0),
        settling: Figure::Fixed(0.0),
        sampling: Figure::Fixed(0.0),
        conversion: Figure::Fixed(0.0),
    };
}

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
