//! Coming to rest without a target: the quick stop and the halt.

use crate::Demand;
use crate::arithmetic::measured;
use crate::configuration::Slowing;
use crate::modes::Inputs;
use crate::option_code::Braking;
use crate::path::{Path, Present, TICK_NS, TICK_S};
use crate::ramp::Velocity;
use crate::torque::TorqueRamp;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// A position demand slows down and then holds.
    Path {
        path: Path,
        begun: bool,
        slowing: Slowing,
    },
    /// A velocity demand slows down; without a ramp it has dropped to zero, so that the
    /// controllers brake with all the current and voltage they may use.
    Velocity {
        demand: Velocity,
        slowing: Option<Slowing>,
        forwards: bool,
    },
    /// A torque demand runs to zero.
    Torque(TorqueRamp),
}

/// A stop going on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    stage: Stage,
    stopped: bool,
}

impl Stop {
    /// In position control; without a ramp the velocity demand drops to zero until the motor
    /// stands.
    pub(crate) fn by_position(braking: Braking, inputs: &Inputs<'_>) -> Stop {
        let Some(slowing) = braking.slowing(inputs.configuration, inputs.mode) else {
            return Stop::by_velocity(braking, inputs);
        };
        let path = Path::stop(&inputs.present, slowing);
        Stop {
            stage: Stage::Path {
                path,
                begun: false,
                slowing,
            },
            stopped: path.ended(),
        }
    }

    /// In velocity control until the motor stands, then holding its position.
    pub(crate) fn by_velocity(braking: Braking, inputs: &Inputs<'_>) -> Stop {
        let present = inputs.present;
        let slowing = braking.slowing(inputs.configuration, inputs.mode);
        let demand = Velocity {
            velocity: present.velocity,
            acceleration: present.acceleration,
        };
        Stop {
            stage: Stage::Velocity {
                demand: slowing.map_or(Velocity::default(), |_| demand),
                slowing,
                forwards: present.velocity >= 0.0,
            },
            stopped: false,
        }
    }

    /// The torque runs to zero on its slope (0x6087), whatever the motor does then.
    pub(crate) fn by_torque(inputs: &Inputs<'_>) -> Stop {
        let torque = TorqueRamp::new(inputs);
        Stop {
            stage: Stage::Torque(torque),
            stopped: false,
        }
    }

    /// At once, holding the motor's position of this moment.
    pub(crate) fn in_place(inputs: &Inputs<'_>) -> Stop {
        Stop {
            stage: Stop::hold(inputs),
            stopped: true,
        }
    }

    /// Positions have become `offset` counts greater.
    pub(crate) fn shift(&mut self, offset: i32) {
        if let Stage::Path { path, .. } = &mut self.stage {
            path.shift(offset);
        }
    }

    /// Whether the demand has come to its end.
    pub(crate) fn stopped(&self) -> bool {
        self.stopped
    }

    fn hold(inputs: &Inputs<'_>) -> Stage {
        let present = Present {
            position: inputs.actual.position,
            ..Present::default()
        };
        let slowing = Slowing {
            rate: 0.0,
            jerk: 0.0,
        };
        Stage::Path {
            path: Path::stop(&present, slowing),
            begun: true,
            slowing,
        }
    }

    /// The demand until the first tick.
    pub(crate) fn begin(&self) -> Demand {
        match &self.stage {
            Stage::Path { path, .. } => path.begin(),
            Stage::Velocity { demand, .. } => Demand::Velocity {
                start: demand.velocity as f32,
                acceleration: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            },
            Stage::Torque(torque) => torque.begin(),
        }
    }

    /// One millisecond more.
    pub(crate) fn tick(&mut self, inputs: &Inputs<'_>) -> Demand {
        if let Stage::Velocity {
            demand, forwards, ..
        } = self.stage
            && demand == Velocity::default()
        {
            let speed = measured(inputs.actual.velocity);
            let along = if forwards { speed } else { -speed };
            if along <= 0.0 || inputs.configuration.stands(speed) {
                self.stage = Stop::hold(inputs);
            }
        }
        match &mut self.stage {
            Stage::Path {
                path,
                begun,
                slowing,
            } => {
                if !*begun {
                    path.resume(&inputs.present, *slowing);
                    *begun = true;
                }
                self.stopped = path.ended();
                path.tick()
            }
            Stage::Velocity {
                demand, slowing, ..
            } => {
                let from = demand.velocity;
                if let Some(slowing) = slowing {
                    let rate = f64::from(slowing.rate);
                    *demand = demand.towards(0.0, rate, rate, slowing.jerk, TICK_S);
                }
                let to = demand.velocity;
                Demand::Velocity {
                    start: from as f32,
                    acceleration: ((to - from) / TICK_S) as f32,
                    torque_offset_pm: 0.0,
                    duration_ns: if to == from { 0 } else { TICK_NS },
                }
            }
            Stage::Torque(torque) => {
                let demand = torque.tick(0.0, inputs);
                self.stopped = !demand.moves();
                demand
            }
        }
    }
}
