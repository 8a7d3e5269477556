//! Mode 10, cyclic synchronous torque: set-points interpolated linearly over their period.

use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CyclicTorque {
    /// Demand before the first set-point, per mille: what a torque mode before left, else 0.
    start_pm: f64,
    follows: bool,
    limited: bool,
}

impl CyclicTorque {
    pub(crate) fn new(inputs: &Inputs<'_>) -> CyclicTorque {
        let start = if inputs.present.torque_is_demand {
            inputs.present.torque_pm
        } else {
            0.0
        };
        let start = inputs.configuration.torque(start);
        CyclicTorque {
            start_pm: start.value,
            follows: false,
            limited: start.limited,
        }
    }
}

impl Generator for CyclicTorque {
    fn begin(&self) -> Demand {
        Demand::Torque {
            start_pm: self.start_pm as f32,
            slope_pm_per_s: 0.0,
            duration_ns: 0,
        }
    }

    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target != Target::Torque {
            return None;
        }
        self.follows = true;
        let sum = f64::from(inputs.targets.torque_pm) + f64::from(inputs.targets.torque_offset_pm);
        let target = inputs.configuration.torque(sum);
        self.limited = target.limited;
        let period_ns = inputs.configuration.interpolation_ns();
        let start = inputs.present.torque_pm;
        Some(Demand::Torque {
            start_pm: start as f32,
            slope_pm_per_s: ((target.value - start) / (f64::from(period_ns) * 1e-9)) as f32,
            duration_ns: period_ns,
        })
    }

    fn tick(&mut self, _inputs: &Inputs<'_>) -> Option<Demand> {
        None
    }

    fn bits(&self) -> Bits {
        Bits {
            target_reached: false,
            specific: self.follows,
        }
    }

    fn limited(&self) -> Limited {
        Limited {
            torque: self.limited,
            ..Limited::default()
        }
    }
}
