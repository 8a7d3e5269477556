//! The errors that a drive announces.

use crate::Scaled;

/// Whether an error stops the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Ends by itself when its cause ends.
    Warning,
    /// Latched; leads to the fault state; ends with a fault reset.
    Fault,
    /// A fault that only a reset of the drive ends.
    Critical,
}

/// In which states an error is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum States {
    /// Always.
    All,
    /// While the drive function is enabled.
    OperationEnabled,
}

/// What makes an error possible.
#[derive(Clone, Copy, Debug)]
pub enum Switch {
    /// It cannot be switched off.
    Always,
    /// Off unless this object is other than 0; the object is the threshold, too, in V, °C, s,
    /// counts or counts/s.
    Object(Scaled),
    /// Off unless one of these objects is other than 0: the upper and the lower threshold.
    Either(Scaled, Scaled),
    /// No object enables it, and it is off.
    Off,
}

/// What an error tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The reset was the watchdog's.
    WatchdogReset,
    /// A parameter is out of range, or the stored ones are damaged.
    ParameterError,
    /// The encoder's reading is invalid.
    EncoderFeedback,
    /// The encoder's magnet is too near or too far.
    MagnetDistance,
    /// I²t limits the current.
    CurrentLimit,
    /// A short circuit.
    ShortCircuit,
    /// Motor supply above its limit.
    BusOverVoltage,
    /// Motor supply below its limit.
    BusUnderVoltage,
    /// Amplifier too hot.
    AmplifierTemperature,
    /// Motor too hot.
    MotorTemperature,
    /// Received frames were lost.
    CanOverrun,
    /// No SYNC within the time-out.
    SyncLoss,
    /// The CAN controller was bus-off.
    BusOffRecovered,
    /// The rotor does not follow the field.
    MotorPhasing,
    /// Positive limit switch.
    PositiveLimitSwitch,
    /// Negative limit switch.
    NegativeLimitSwitch,
    /// Home switch.
    HomeSwitch,
    /// The target lies beyond the greatest position.
    PositiveSoftStop,
    /// The target lies beyond the least position.
    NegativeSoftStop,
    /// The position left the 32-bit range.
    PositionWrapped,
    /// Velocity error beyond the warning window.
    VelocityTrackingWarning,
    /// Velocity error beyond the fault window.
    VelocityTrackingFault,
    /// The speed is outside its limits.
    VelocityLimit,
    /// An acceleration was limited.
    AccelerationLimit,
    /// Following error beyond the warning window.
    PositionTrackingWarning,
    /// Homing failed.
    Homing,
    /// Following error beyond the fault window.
    PositionTrackingFault,
    /// The CAN controller is error passive.
    ErrorPassive,
    /// A monitored node's heartbeat is missing, or the master's guarding.
    HeartbeatLost,
    /// A received PDO was shorter than its mapping.
    PdoTooShort,
    /// A received PDO was longer than its mapping.
    PdoTooLong,
    /// A SYNC had another length than expected.
    SyncLength,
    /// A PDO did not come within its time.
    RpdoTimeout,
    /// Safe torque off has taken the torque away.
    TorqueOff,
    /// One of the drive's own: a bit of [`crate::own::OwnBehaviour::causes`], 0 to 31, and a place in
    /// [`crate::Personality::own_causes`].
    Own(u8),
}

impl Cause {
    /// What it is called. A drive's own have their names in [`crate::Personality::own_causes`].
    pub const fn name(self) -> Option<&'static str> {
        Some(match self {
            Cause::WatchdogReset => "watchdog reset",
            Cause::ParameterError => "parameter error",
            Cause::EncoderFeedback => "encoder feedback",
            Cause::MagnetDistance => "magnet distance",
            Cause::CurrentLimit => "current limit",
            Cause::ShortCircuit => "short circuit",
            Cause::BusOverVoltage => "bus over-voltage",
            Cause::BusUnderVoltage => "bus under-voltage",
            Cause::AmplifierTemperature => "amplifier temperature",
            Cause::MotorTemperature => "motor temperature",
            Cause::CanOverrun => "CAN overrun",
            Cause::SyncLoss => "SYNC loss",
            Cause::BusOffRecovered => "bus-off recovered",
            Cause::MotorPhasing => "motor phasing",
            Cause::PositiveLimitSwitch => "positive limit switch",
            Cause::NegativeLimitSwitch => "negative limit switch",
            Cause::HomeSwitch => "home switch",
            Cause::PositiveSoftStop => "positive soft stop",
            Cause::NegativeSoftStop => "negative soft stop",
            Cause::PositionWrapped => "position wrapped",
            Cause::VelocityTrackingWarning => "velocity tracking warning",
            Cause::VelocityTrackingFault => "velocity tracking fault",
            Cause::VelocityLimit => "velocity limit",
            Cause::AccelerationLimit => "acceleration limit",
            Cause::PositionTrackingWarning => "position tracking warning",
            Cause::Homing => "homing",
            Cause::PositionTrackingFault => "position tracking fault",
            Cause::ErrorPassive => "error passive",
            Cause::HeartbeatLost => "heartbeat lost",
            Cause::PdoTooShort => "PDO too short",
            Cause::PdoTooLong => "PDO too long",
            Cause::SyncLength => "SYNC length",
            Cause::RpdoTimeout => "RPDO time-out",
            Cause::TorqueOff => "safe torque off",
            Cause::Own(_) => return None,
        })
    }

    /// Whether the motor can still be controlled: only then is there a reaction to a fault other
    /// than to free the motor (0x605E). With an unknown rotor, a bridge or winding that is broken
    /// or a supply into which nothing more can be fed back there is none.
    pub const fn leaves_control(self) -> bool {
        !matches!(
            self,
            Cause::WatchdogReset
                | Cause::ParameterError
                | Cause::EncoderFeedback
                | Cause::MagnetDistance
                | Cause::ShortCircuit
                | Cause::BusOverVoltage
                | Cause::MotorPhasing
                | Cause::TorqueOff
        )
    }

    /// Whether it tells that the connection to the master is lost (0x6007).
    pub const fn is_lost_connection(self) -> bool {
        matches!(self, Cause::HeartbeatLost | Cause::BusOffRecovered)
    }
}

/// How many rows a fault table may have: the fault manager keeps a bit for each.
pub const MOST_FAULTS: usize = 64;

/// How a drive shows its errors, beside the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorRules {
    /// 0x603F keeps the code of the last error (P17). If not, it shows an error that is there, and
    /// 0 when there is none.
    pub keeps_last_code: bool,
    /// A bus-off changes the NMT state as 0x1029 says (CiA 301 7.5.2.29).
    pub bus_off_leaves_state: bool,
    /// The emergency that tells of an error's end has its code in bytes 6 and 7 (P16).
    pub names_ended_error: bool,
}

/// What a drive expects of its motor supply.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupplyRules {
    /// It counts as present above this, V: statusword bit 4.
    pub present_v: f32,
    /// How long it must be beyond one of its limits, ms.
    pub limit_time_ms: u32,
}

/// One row of a fault table.
#[derive(Clone, Copy, Debug)]
pub struct FaultRow {
    /// What it tells of.
    pub cause: Cause,
    /// Emergency error code.
    pub code: u16,
    /// Warning or fault.
    pub kind: Kind,
    /// Its bit in the error register 0x1001.
    pub register_bit: u8,
    /// Its bit in the manufacturer status register 0x1002; 32: it has none.
    pub status_bit: u8,
    /// When it is looked for.
    pub states: States,
    /// What makes it possible.
    pub switch: Switch,
}
