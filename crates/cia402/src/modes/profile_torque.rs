//! Mode 4, profile torque: the target torque through a slope.

use crate::arithmetic::magnitude;
use crate::path::{TICK_NS, TICK_S};
use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProfileTorque {
    /// Demand at the present tick, per mille.
    torque_pm: f64,
    reached: bool,
    limited: bool,
}

impl ProfileTorque {
    pub(crate) fn new(inputs: &Inputs<'_>) -> ProfileTorque {
        let start = inputs.configuration.torque(inputs.present.torque_pm);
        ProfileTorque {
            torque_pm: start.value,
            reached: false,
            limited: false,
        }
    }

    /// The slope in per mille per second, `None` for a step.
    fn slope(inputs: &Inputs<'_>) -> Option<f64> {
        inputs
            .configuration
            .torque_slope_pm_per_s
            .map(magnitude)
            .filter(|&slope| slope > 0.0)
    }
}

impl Generator for ProfileTorque {
    fn begin(&self) -> Demand {
        segment(self.torque_pm, self.torque_pm)
    }

    /// Without a slope the target acts at once; with one it waits for the tick.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target != Target::Torque {
            return None;
        }
        match ProfileTorque::slope(inputs) {
            None => self.tick(inputs),
            Some(_) => {
                self.reached &= self.torque_pm == f64::from(inputs.targets.torque_pm);
                None
            }
        }
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let target = inputs
            .configuration
            .torque(f64::from(inputs.targets.torque_pm));
        self.limited = target.limited;
        let missing = target.value - self.torque_pm;
        let demand = match ProfileTorque::slope(inputs) {
            Some(slope) if missing.abs() > slope * TICK_S => {
                let next = self.torque_pm + slope.copysign(missing) * TICK_S;
                let demand = segment(self.torque_pm, next);
                self.torque_pm = next;
                demand
            }
            Some(_) if missing != 0.0 => {
                let demand = segment(self.torque_pm, target.value);
                self.torque_pm = target.value;
                demand
            }
            _ => {
                self.torque_pm = target.value;
                segment(target.value, target.value)
            }
        };
        self.reached = !demand.moves();
        Some(demand)
    }

    fn bits(&self) -> Bits {
        Bits {
            target_reached: self.reached,
            specific: false,
        }
    }

    fn limited(&self) -> Limited {
        Limited {
            torque: self.limited,
            ..Limited::default()
        }
    }
}

fn segment(from: f64, to: f64) -> Demand {
    Demand::Torque {
        start_pm: from as f32,
        slope_pm_per_s: ((to - from) / TICK_S) as f32,
        duration_ns: if from == to { 0 } else { TICK_NS },
    }
}
