//! A torque demand that runs to its target on the torque slope (0x6087).

use crate::Demand;
use crate::arithmetic::magnitude;
use crate::modes::Inputs;
use crate::path::{TICK_NS, TICK_S};

/// The demand of profile torque mode and of its halt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TorqueRamp {
    /// Demand at the present tick, per mille.
    torque_pm: f64,
}

impl TorqueRamp {
    /// From the present torque, within the limit.
    pub(crate) fn new(inputs: &Inputs<'_>) -> TorqueRamp {
        TorqueRamp {
            torque_pm: inputs.configuration.torque(inputs.present.torque_pm).value,
        }
    }

    /// Per mille.
    pub(crate) fn torque_pm(&self) -> f64 {
        self.torque_pm
    }

    /// The slope in per mille per second, `None` for a step.
    pub(crate) fn slope(inputs: &Inputs<'_>) -> Option<f64> {
        inputs
            .configuration
            .torque_slope_pm_per_s
            .map(magnitude)
            .filter(|&slope| slope > 0.0)
    }

    /// The demand until the first tick.
    pub(crate) fn begin(&self) -> Demand {
        segment(self.torque_pm, self.torque_pm)
    }

    /// One millisecond nearer to `target_pm`.
    pub(crate) fn tick(&mut self, target_pm: f64, inputs: &Inputs<'_>) -> Demand {
        let missing = target_pm - self.torque_pm;
        let from = self.torque_pm;
        match TorqueRamp::slope(inputs) {
            Some(slope) if missing.abs() > slope * TICK_S => {
                self.torque_pm = from + slope.copysign(missing) * TICK_S;
                segment(from, self.torque_pm)
            }
            Some(_) if missing != 0.0 => {
                self.torque_pm = target_pm;
                segment(from, target_pm)
            }
            _ => {
                self.torque_pm = target_pm;
                segment(target_pm, target_pm)
            }
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
