//! From the axis's demand to the loops' command: per mille become amperes, nanoseconds periods.

use cia402::{Configuration, Demand, Mode};
use control::modulation::LINEAR_RANGE;
use control::{Command, Feedback, FrameSource, Limits};

use crate::parameters::LoopParameters;

/// The limits under which a demand is followed. `max_motor_velocity` bounds the speed in torque
/// modes, counts/s.
pub(crate) fn limits(
    demand: &Demand,
    mode: Mode,
    configuration: &Configuration,
    max_motor_velocity: Option<f32>,
    loops: &LoopParameters,
) -> Limits<f32> {
    let velocity = match demand {
        // In a frame from outside the loops do not know which torque speeds the rotor up.
        Demand::TorqueWithAngle { .. }
        | Demand::PhaseVoltage { .. }
        | Demand::TurningVoltage { .. }
        | Demand::RotorVoltage { .. } => None,
        Demand::Torque { .. } => max_motor_velocity,
        _ if mode == Mode::IDLE => max_motor_velocity,
        _ => configuration.max_velocity,
    };
    let torque_a = configuration.max_torque_pm * loops.amperes_per_pm;
    Limits {
        current_a: match demand {
            // Nothing is controlled.
            Demand::Shorted => f32::MAX,
            _ if torque_a > loops.greatest_a => loops.greatest_a,
            _ => torque_a,
        },
        velocity: velocity.unwrap_or(f32::MAX),
    }
}

/// A demand lasts a millisecond.
const TICK_NS: u32 = 1_000_000;

/// 1/32,768 of the longest voltage vector at a supply of 1 V (P3 l.262).
const VOLTAGE_UNIT: f32 = LINEAR_RANGE / 32_768.0;

/// The command for a demand, under the [`limits`] of the same arguments. A phase voltage is made
/// of `bus_voltage_v`.
pub(crate) fn command(
    demand: &Demand,
    mode: Mode,
    configuration: &Configuration,
    max_motor_velocity: Option<f32>,
    loops: &LoopParameters,
    bus_voltage_v: f32,
) -> Command<f32> {
    let limits = limits(demand, mode, configuration, max_motor_velocity, loops);
    let base = Command {
        // Idle is no torque (P3 l.842), not torque control at 0: with a current loop closed the
        // converters could only ever read their old zeros (P3 l.238).
        enabled: !matches!(demand, Demand::Off | Demand::Idle),
        current_limit: limits.current_a,
        velocity_limit: limits.velocity,
        frame: FrameSource::rotor(),
        ..Command::idle()
    };
    match *demand {
        Demand::Off | Demand::Idle => base,
        Demand::Torque {
            start_pm,
            slope_pm_per_s,
            duration_ns,
        } => Command {
            current: start_pm * loops.amperes_per_pm,
            current_slope: slope_pm_per_s * loops.amperes_per_pm,
            periods: loops.timing.control_periods(duration_ns),
            ..base
        },
        Demand::TorqueWithAngle {
            angle,
            start_pm,
            slope_pm_per_s,
            duration_ns,
        } => Command {
            current: start_pm * loops.amperes_per_pm,
            current_slope: slope_pm_per_s * loops.amperes_per_pm,
            periods: loops.timing.control_periods(duration_ns),
            frame: FrameSource {
                angle_given: true,
                angle: turn(angle),
                ..FrameSource::rotor()
            },
            ..base
        },
        Demand::Shorted => Command {
            shorted: true,
            frame: FrameSource {
                angle_given: true,
                voltage_given: true,
                ..FrameSource::rotor()
            },
            ..base
        },
        Demand::TurningVoltage {
            turns_per_s,
            voltage,
        } => Command {
            frame: FrameSource {
                angle_given: true,
                turn: (turns_per_s * loops.timing.control_period_s() * TURN) as i32,
                voltage_given: true,
                voltage_d_v: f32::from(voltage) * VOLTAGE_UNIT * bus_voltage_v,
                ..FrameSource::rotor()
            },
            ..base
        },
        Demand::PhaseVoltage {
            angle,
            voltage_d,
            voltage_q,
        } => Command {
            frame: FrameSource {
                angle_given: true,
                angle: turn(angle),
                turn: 0,
                voltage_given: true,
                voltage_d_v: f32::from(voltage_d) * VOLTAGE_UNIT * bus_voltage_v,
                voltage_q_v: f32::from(voltage_q) * VOLTAGE_UNIT * bus_voltage_v,
            },
            ..base
        },
        Demand::RotorVoltage { voltage_q } => Command {
            frame: FrameSource {
                voltage_given: true,
                voltage_q_v: f32::from(voltage_q) * VOLTAGE_UNIT * bus_voltage_v,
                ..FrameSource::rotor()
            },
            ..base
        },
        Demand::Velocity {
            start,
            acceleration,
            torque_offset_pm,
            duration_ns,
        } => Command {
            velocity_loop: true,
            velocity: start,
            acceleration,
            current: torque_offset_pm * loops.amperes_per_pm,
            acceleration_current: acceleration * loops.amperes_per_acceleration,
            periods: loops.timing.control_periods(duration_ns),
            ..base
        },
        Demand::Position {
            start,
            fraction,
            velocity,
            acceleration,
            velocity_offset,
            torque_offset_pm,
            duration_ns,
        } => Command {
            position_loop: true,
            position: start,
            fraction,
            velocity,
            acceleration,
            velocity_offset,
            current: torque_offset_pm * loops.amperes_per_pm,
            acceleration_current: acceleration * loops.amperes_per_acceleration,
            periods: loops.timing.control_periods(duration_ns),
            ..base
        },
    }
}

/// A command for a velocity, followed by the position that it leads to from the demand of now on.
pub(crate) fn by_position(
    command: Command<f32>,
    feedback: &Feedback<f32>,
    loops: &LoopParameters,
) -> Command<f32> {
    if !command.velocity_loop {
        return command;
    }
    Command {
        velocity_loop: false,
        position_loop: true,
        position: feedback.next_position,
        fraction: feedback.next_fraction,
        // Until the next millisecond's comes.
        periods: command.periods.max(loops.timing.control_periods(TICK_NS)),
        ..command
    }
}

/// Units of a turn of an electrical angle.
const TURN: f32 = 4_294_967_296.0;

/// From 1/65,536 turn to 2⁻³² turn.
fn turn(angle: i16) -> i32 {
    i32::from(angle) << 16
}
