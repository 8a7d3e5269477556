//! Mode 12 of the P3, phase voltage with angle: a voltage vector in a frame that the master turns,
//! and no controller. For calibration.

use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

/// It has no statusword bits of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PhaseVoltage {
    angle: i16,
    voltage_d: i16,
    voltage_q: i16,
}

impl PhaseVoltage {
    /// Without voltage, at the angle at which the frame stands.
    pub(crate) fn new(inputs: &Inputs<'_>) -> PhaseVoltage {
        PhaseVoltage {
            angle: inputs.present.angle,
            voltage_d: 0,
            voltage_q: 0,
        }
    }
}

impl Generator for PhaseVoltage {
    fn begin(&self) -> Demand {
        Demand::PhaseVoltage {
            angle: self.angle,
            voltage_d: self.voltage_d,
            voltage_q: self.voltage_q,
        }
    }

    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        match target {
            Target::Angle => self.angle = inputs.targets.angle,
            Target::PhaseVoltage => {
                self.voltage_d = inputs.targets.voltage_d;
                self.voltage_q = inputs.targets.voltage_q;
            }
            _ => return None,
        }
        Some(self.begin())
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
