//! Mode 8, cyclic synchronous position: set-points interpolated linearly over their period.

use crate::path::{Path, TICK_NS};
use crate::{Demand, Target};

use super::line::{JITTER_DIVISOR, Offsets, towards};
use super::{Bits, Generator, Inputs, Limited};

/// Before the first set-point the axis comes to rest and holds; then it follows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Waiting {
        path: Path,
        begun: bool,
    },
    Following,
    /// The velocity limit keeps the demand from its target within one period.
    Limited {
        target: i32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CyclicPosition {
    stage: Stage,
    velocity_offset: i32,
    torque_offset_pm: i16,
    limited: Limited,
}

impl CyclicPosition {
    pub(crate) fn new(inputs: &Inputs<'_>) -> CyclicPosition {
        let path = Path::stop(&inputs.present, inputs.configuration.slow_down(inputs.mode));
        CyclicPosition {
            stage: Stage::Waiting { path, begun: false },
            velocity_offset: 0,
            torque_offset_pm: 0,
            limited: Limited::default(),
        }
    }

    /// From the present demand to `target` within `period_ns`, or as fast as the limit allows.
    fn towards(&mut self, target: i32, period_ns: u32, inputs: &Inputs<'_>) -> Demand {
        let offsets = Offsets {
            velocity: self.velocity_offset as f32,
            torque_pm: f32::from(self.torque_offset_pm),
        };
        let (mut demand, limited) = towards(target, period_ns, offsets, inputs);
        self.stage = if limited {
            Stage::Limited { target }
        } else {
            Stage::Following
        };
        // Where nothing moves there is nothing to wait for.
        if let Demand::Position {
            velocity: 0.0,
            duration_ns,
            ..
        } = &mut demand
        {
            *duration_ns = 0;
        }
        demand
    }
}

impl Generator for CyclicPosition {
    fn begin(&self) -> Demand {
        match &self.stage {
            Stage::Waiting { path, .. } => path.begin(),
            _ => Demand::Idle,
        }
    }

    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target != Target::Position {
            return None;
        }
        self.velocity_offset = inputs.targets.velocity_offset;
        self.torque_offset_pm = inputs.targets.torque_offset_pm;
        let sum = inputs
            .targets
            .position
            .wrapping_add(inputs.targets.position_offset);
        let cut = inputs.configuration.position(i64::from(sum));
        self.limited = Limited {
            above: cut.above(&i64::from(sum)),
            below: cut.below(&i64::from(sum)),
            ..Limited::default()
        };
        let period_ns = inputs.configuration.interpolation_ns();
        // What an early set-point leaves of the last segment is added to its own, so that the
        // slope stays the master's. The beat thus settles at the latest arrival.
        let left_ns = match self.stage {
            Stage::Following if inputs.present.left_ns <= period_ns / JITTER_DIVISOR => {
                inputs.present.left_ns
            }
            _ => 0,
        };
        Some(self.towards(cut.value as i32, period_ns.saturating_add(left_ns), inputs))
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        match &mut self.stage {
            Stage::Waiting { path, begun } => {
                if !*begun {
                    path.resume(&inputs.present, inputs.configuration.slow_down(inputs.mode));
                    *begun = true;
                }
                Some(path.tick())
            }
            Stage::Following => None,
            Stage::Limited { target } => {
                let target = *target;
                Some(self.towards(target, TICK_NS, inputs))
            }
        }
    }

    fn shift(&mut self, offset: i32) {
        match &mut self.stage {
            Stage::Waiting { path, .. } => path.shift(offset),
            Stage::Following => {}
            Stage::Limited { target } => *target = target.wrapping_add(offset),
        }
    }

    fn bits(&self) -> Bits {
        let follows = !matches!(self.stage, Stage::Waiting { .. });
        Bits {
            target_reached: false,
            specific: follows,
        }
    }

    fn limited(&self) -> Limited {
        Limited {
            velocity: matches!(self.stage, Stage::Limited { .. }),
            ..self.limited
        }
    }
}
