//! The modes of operation, one file each, and what the axis asks of all of them.

mod cyclic_position;
mod cyclic_torque;
mod cyclic_velocity;
mod homing;
mod interpolated_position;
mod line;
mod phase_voltage;
mod profile_position;
mod profile_torque;
mod profile_velocity;
mod torque_with_angle;
mod velocity;

use crate::path::Present;
use crate::{Actual, Configuration, Controlword, Demand, Mode, Target, Targets};
use cyclic_position::CyclicPosition;
use cyclic_torque::CyclicTorque;
use cyclic_velocity::CyclicVelocity;
pub(crate) use homing::Homing;
pub(crate) use interpolated_position::BUFFER_SIZE;
use interpolated_position::InterpolatedPosition;
use phase_voltage::PhaseVoltage;
use profile_position::ProfilePosition;
use profile_torque::ProfileTorque;
use profile_velocity::ProfileVelocity;
use torque_with_angle::TorqueWithAngle;
use velocity::Velocity;

/// What a generator may look at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs<'a> {
    pub(crate) configuration: &'a Configuration,
    pub(crate) targets: &'a Targets,
    pub(crate) actual: &'a Actual,
    /// Where the axis stands: the demand if there is one, else the motor.
    pub(crate) present: Present,
    /// The mode in force.
    pub(crate) mode: Mode,
    /// [`crate::Dialect::set_points_at_once`].
    pub(crate) at_once: bool,
}

/// Which limits hold a demand back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Limited {
    /// The target lies beyond the greatest position.
    pub(crate) above: bool,
    /// The target lies beyond the least position.
    pub(crate) below: bool,
    pub(crate) velocity: bool,
    pub(crate) acceleration: bool,
    pub(crate) torque: bool,
}

/// The statusword bits that a mode owns. Bit 13, the following error or an error of homing, is the
/// axis's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits {
    /// Bit 10.
    pub(crate) target_reached: bool,
    /// Bit 12.
    pub(crate) specific: bool,
}

/// One mode at work in operation enabled.
pub(crate) trait Generator {
    /// The demand until the first tick.
    fn begin(&self) -> Demand;

    /// A controlword was written in operation enabled.
    fn controlword(&mut self, _before: Controlword, _now: Controlword, _inputs: &Inputs<'_>) {}

    /// A target object was received.
    fn set_point(&mut self, _target: Target, _inputs: &Inputs<'_>) -> Option<Demand> {
        None
    }

    /// A SYNC was received, and what came with it is in force.
    fn sync(&mut self, _inputs: &Inputs<'_>) -> Option<Demand> {
        None
    }

    /// A set-point for the buffer (0x60C1). Whether it was taken.
    fn push(&mut self, _record: i32, _inputs: &Inputs<'_>) -> bool {
        false
    }

    /// The buffer is emptied, and opened or closed (0x60C4,6).
    fn clear(&mut self, _open: bool) {}

    /// Set-points in the buffer.
    fn buffered(&self) -> u8 {
        0
    }

    /// One millisecond more; the demand of the next one, or `None` to go on with the present one.
    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand>;

    /// One millisecond more of a halt (controlword bit 8), which moves the axis in this mode's
    /// stead.
    fn halted(&mut self, _inputs: &Inputs<'_>) {}

    /// The halt is over: on to the target from where the axis stands.
    fn resume(&mut self, _inputs: &Inputs<'_>) {}

    /// Positions have become `offset` counts greater; the axis stays where it is.
    fn shift(&mut self, _offset: i32) {}

    /// The mode's statusword bits.
    fn bits(&self) -> Bits;

    /// The limits at work.
    fn limited(&self) -> Limited;
}

/// Mode 0: the bridge is on, without torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Idle;

impl Generator for Idle {
    fn begin(&self) -> Demand {
        Demand::Idle
    }

    fn tick(&mut self, _inputs: &Inputs<'_>) -> Option<Demand> {
        None
    }

    fn bits(&self) -> Bits {
        Bits::default()
    }

    fn limited(&self) -> Limited {
        Limited::default()
    }
}

/// The generator of the mode in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    Idle(Idle),
    ProfilePosition(ProfilePosition),
    Velocity(Velocity),
    ProfileVelocity(ProfileVelocity),
    ProfileTorque(ProfileTorque),
    Homing(Homing),
    InterpolatedPosition(InterpolatedPosition),
    CyclicPosition(CyclicPosition),
    CyclicVelocity(CyclicVelocity),
    CyclicTorque(CyclicTorque),
    TorqueWithAngle(TorqueWithAngle),
    PhaseVoltage(PhaseVoltage),
}

impl Motion {
    pub(crate) const IDLE: Motion = Motion::Idle(Idle);

    /// The generator of the mode in force, starting where the axis stands under `word`.
    pub(crate) fn start(word: Controlword, inputs: &Inputs<'_>) -> Motion {
        match inputs.mode {
            Mode::VELOCITY => Motion::Velocity(Velocity::new(word, inputs)),
            Mode::INTERPOLATED_POSITION => {
                Motion::InterpolatedPosition(InterpolatedPosition::new(word, inputs))
            }
            Mode::PROFILE_POSITION => Motion::ProfilePosition(ProfilePosition::new(inputs)),
            Mode::PROFILE_VELOCITY => Motion::ProfileVelocity(ProfileVelocity::new(inputs)),
            Mode::PROFILE_TORQUE => Motion::ProfileTorque(ProfileTorque::new(inputs)),
            Mode::HOMING => Motion::Homing(Homing::new(inputs)),
            Mode::CYCLIC_POSITION => Motion::CyclicPosition(CyclicPosition::new(inputs)),
            Mode::CYCLIC_VELOCITY => Motion::CyclicVelocity(CyclicVelocity::new(inputs)),
            Mode::CYCLIC_TORQUE => Motion::CyclicTorque(CyclicTorque::new(inputs)),
            Mode::CYCLIC_TORQUE_WITH_ANGLE => Motion::TorqueWithAngle(TorqueWithAngle::new(inputs)),
            Mode::PHASE_VOLTAGE_WITH_ANGLE => Motion::PhaseVoltage(PhaseVoltage::new(inputs)),
            _ => Motion::IDLE,
        }
    }

    pub(crate) fn generator(&self) -> &dyn Generator {
        match self {
            Motion::Idle(mode) => mode,
            Motion::ProfilePosition(mode) => mode,
            Motion::Velocity(mode) => mode,
            Motion::InterpolatedPosition(mode) => mode,
            Motion::ProfileVelocity(mode) => mode,
            Motion::ProfileTorque(mode) => mode,
            Motion::Homing(mode) => mode,
            Motion::CyclicPosition(mode) => mode,
            Motion::CyclicVelocity(mode) => mode,
            Motion::CyclicTorque(mode) => mode,
            Motion::TorqueWithAngle(mode) => mode,
            Motion::PhaseVoltage(mode) => mode,
        }
    }

    pub(crate) fn generator_mut(&mut self) -> &mut dyn Generator {
        match self {
            Motion::Idle(mode) => mode,
            Motion::ProfilePosition(mode) => mode,
            Motion::Velocity(mode) => mode,
            Motion::InterpolatedPosition(mode) => mode,
            Motion::ProfileVelocity(mode) => mode,
            Motion::ProfileTorque(mode) => mode,
            Motion::Homing(mode) => mode,
            Motion::CyclicPosition(mode) => mode,
            Motion::CyclicVelocity(mode) => mode,
            Motion::CyclicTorque(mode) => mode,
            Motion::TorqueWithAngle(mode) => mode,
            Motion::PhaseVoltage(mode) => mode,
        }
    }
}
