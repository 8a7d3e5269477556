//! The objects of CiA 402 of one axis: targets and feedback.

use canopen::{Address, Field, Handle};

use super::{ConfigurationObjects, Figure, HomingObjects, Scaled};

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
    /// 0x6042, in units of velocity mode ([`crate::VlObjects`]).
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
    /// 0x6044, in units of velocity mode ([`crate::VlObjects`]).
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
