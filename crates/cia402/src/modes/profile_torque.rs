//! Mode 4, profile torque: the target torque through a slope.

use crate::torque::TorqueRamp;
use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProfileTorque {
    torque: TorqueRamp,
    reached: bool,
    limited: bool,
}

impl ProfileTorque {
    pub(crate) fn new(inputs: &Inputs<'_>) -> ProfileTorque {
        ProfileTorque {
            torque: TorqueRamp::new(inputs),
            reached: false,
            limited: false,
        }
    }
}

impl Generator for ProfileTorque {
    fn begin(&self) -> Demand {
        self.torque.begin()
    }

    /// Without a slope the target acts at once; with one it waits for the tick.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target != Target::Torque {
            return None;
        }
        match TorqueRamp::slope(inputs) {
            None => self.tick(inputs),
            Some(_) => {
                self.reached &= self.torque.torque_pm() == f64::from(inputs.targets.torque_pm);
                None
            }
        }
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let target = inputs
            .configuration
            .torque(f64::from(inputs.targets.torque_pm));
        self.limited = target.limited;
        let demand = self.torque.tick(target.value, inputs);
        self.reached = !demand.moves();
        Some(demand)
    }

    fn resume(&mut self, inputs: &Inputs<'_>) {
        *self = ProfileTorque::new(inputs);
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
