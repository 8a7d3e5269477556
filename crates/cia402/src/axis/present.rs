//! Where the axis stands.

use crate::arithmetic::{measured, within};
use crate::path::Present;
use crate::{Actual, Axis, Configuration, Demand};

impl Axis {
    /// Where the axis stands: the demand where there is one, else the motor.
    pub(super) fn present(&self, configuration: &Configuration, actual: &Actual) -> Present {
        let velocity = measured(actual.velocity);
        let motor = Present {
            position: actual.position,
            fraction: 0.0,
            velocity: if configuration.stands(velocity) {
                0.0
            } else {
                velocity
            },
            acceleration: 0.0,
            torque_pm: measured(actual.torque_pm),
            torque_is_demand: false,
            angle: actual.electrical_angle,
            left_ns: 0,
        };
        // A demand not yet taken is not yet in the control half's answers.
        let start = self.demand.at(0);
        let either = |own: f32, told: f32| measured(if self.fresh { own } else { told });
        let slope = |rate: f32, duration_ns: u32| {
            if duration_ns > 0 { measured(rate) } else { 0.0 }
        };
        let demand_velocity = either(start.velocity, actual.demand_velocity);
        match self.demand {
            Demand::Off => Present {
                velocity: 0.0,
                torque_pm: 0.0,
                ..motor
            },
            // The axis itself never demands the other three.
            Demand::Idle
            | Demand::Shorted
            | Demand::TurningVoltage { .. }
            | Demand::RotorVoltage { .. } => Present {
                torque_pm: 0.0,
                ..motor
            },
            Demand::Torque { .. } => Present {
                torque_pm: either(start.torque_pm, actual.demand_torque_pm),
                torque_is_demand: true,
                ..motor
            },
            Demand::TorqueWithAngle { angle, .. } => Present {
                torque_pm: either(start.torque_pm, actual.demand_torque_pm),
                angle,
                left_ns: match (self.fresh, self.demand) {
                    (true, Demand::TorqueWithAngle { duration_ns, .. }) => duration_ns,
                    _ => actual.demand_left_ns,
                },
                ..motor
            },
            Demand::PhaseVoltage { angle, .. } => Present { angle, ..motor },
            Demand::Velocity {
                acceleration,
                duration_ns,
                ..
            } => Present {
                velocity: demand_velocity,
                acceleration: slope(acceleration, duration_ns),
                ..motor
            },
            Demand::Position {
                acceleration,
                duration_ns,
                ..
            } => Present {
                position: if self.fresh {
                    start.position
                } else {
                    actual.demand_position
                },
                fraction: within(either(start.fraction, actual.demand_fraction), 0.0, 1.0),
                velocity: demand_velocity,
                acceleration: slope(acceleration, duration_ns),
                left_ns: if self.fresh { 0 } else { actual.demand_left_ns },
                ..motor
            },
        }
    }
}
