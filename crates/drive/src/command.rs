//! From the axis's demand to the loops' command: per mille become amperes, nanoseconds periods.

use cia402::{Configuration, Demand, Mode};
use control::{Command, FrameSource, Limits};

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
    let is_torque = matches!(demand, Demand::Torque { .. }) || mode == Mode::IDLE;
    let velocity = if is_torque {
        max_motor_velocity
    } else {
        configuration.max_velocity
    };
    Limits {
        current_a: configuration.max_torque_pm * loops.amperes_per_pm,
        velocity: velocity.unwrap_or(f32::MAX),
    }
}

/// The command for a demand, under the [`limits`] of the same arguments.
pub(crate) fn command(
    demand: &Demand,
    mode: Mode,
    configuration: &Configuration,
    max_motor_velocity: Option<f32>,
    loops: &LoopParameters,
) -> Command<f32> {
    let limits = limits(demand, mode, configuration, max_motor_velocity, loops);
    let base = Command {
        enabled: !matches!(demand, Demand::Off),
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
