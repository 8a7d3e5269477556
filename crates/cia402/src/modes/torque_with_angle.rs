//! Mode 11, cyclic synchronous torque with commutation angle: torque as in mode 10, in an
//! electrical frame that the master turns.

use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TorqueWithAngle {
    angle: i16,
    /// Where the segment in force leads, per mille.
    target_pm: f64,
    follows: bool,
    limited: bool,
}

impl TorqueWithAngle {
    /// Without torque, at the angle at which the frame stands: a torque of the mode before had
    /// another direction.
    pub(crate) fn new(inputs: &Inputs<'_>) -> TorqueWithAngle {
        TorqueWithAngle {
            angle: inputs.present.angle,
            target_pm: 0.0,
            follows: false,
            limited: false,
        }
    }

    fn segment(&self, from_pm: f64, ns: u32) -> Demand {
        let slope = (self.target_pm - from_pm) / (f64::from(ns) * 1e-9);
        Demand::TorqueWithAngle {
            angle: self.angle,
            start_pm: if ns == 0 { self.target_pm } else { from_pm } as f32,
            slope_pm_per_s: if ns == 0 { 0.0 } else { slope as f32 },
            duration_ns: ns,
        }
    }
}

impl Generator for TorqueWithAngle {
    fn begin(&self) -> Demand {
        self.segment(self.target_pm, 0)
    }

    /// A torque is interpolated over its period as in mode 10. An angle counts at once, and what is
    /// left of the torque's segment goes on in it.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        let present = &inputs.present;
        match target {
            Target::Torque => {
                self.follows = true;
                let targets = inputs.targets;
                let sum = f64::from(targets.torque_pm) + f64::from(targets.torque_offset_pm);
                let target = inputs.configuration.torque(sum);
                self.limited = target.limited;
                self.target_pm = target.value;
                let period_ns = inputs.configuration.interpolation_ns();
                Some(self.segment(present.torque_pm, period_ns))
            }
            Target::Angle => {
                self.angle = inputs.targets.angle;
                Some(self.segment(present.torque_pm, present.left_ns))
            }
            _ => None,
        }
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
