//! Mode 9, cyclic synchronous velocity: set-points interpolated linearly over their period.

use crate::arithmetic::{least, sign};
use crate::path::{TICK_NS, TICK_S};
use crate::ramp::ramp;
use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

/// Before the first set-point the axis slows down to rest; then it follows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Waiting {
        velocity: f64,
    },
    Following,
    /// The acceleration limit keeps the demand from its target within one period.
    Limited {
        target: f64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CyclicVelocity {
    stage: Stage,
    torque_offset_pm: i16,
    velocity_limited: bool,
}

impl CyclicVelocity {
    pub(crate) fn new(inputs: &Inputs<'_>) -> CyclicVelocity {
        CyclicVelocity {
            stage: Stage::Waiting {
                velocity: inputs.present.velocity,
            },
            torque_offset_pm: 0,
            velocity_limited: false,
        }
    }

    /// From the present demand to `target` within `period_ns`, or as fast as the limits allow.
    fn towards(&mut self, target: f64, period_ns: u32, inputs: &Inputs<'_>) -> Demand {
        let start = inputs.present.velocity;
        let period = f64::from(period_ns) * 1e-9;
        let wanted = (target - start) / period;
        let limit = rate_limit(start, target, inputs);
        let (rate, duration) = match limit {
            Some(limit) if wanted.abs() > limit => {
                self.stage = Stage::Limited { target };
                // At least the period: the next set-point or tick comes before the end.
                (
                    sign(wanted) * limit,
                    least((target - start).abs() / limit, 4.0),
                )
            }
            _ => {
                self.stage = Stage::Following;
                (wanted, period)
            }
        };
        Demand::Velocity {
            start: start as f32,
            acceleration: rate as f32,
            torque_offset_pm: f32::from(self.torque_offset_pm),
            duration_ns: if rate == 0.0 {
                0
            } else {
                (duration * 1e9) as u32
            },
        }
    }
}

/// The rate allowed from one velocity to another, counts/s² above 0; through zero the lower one.
fn rate_limit(from: f64, to: f64, inputs: &Inputs<'_>) -> Option<f64> {
    let positive = |limit: Option<f32>| limit.map(crate::arithmetic::magnitude);
    let up = positive(inputs.configuration.max_acceleration);
    // A limit of 0 would forbid stopping.
    let down = positive(inputs.configuration.max_deceleration).filter(|&limit| limit > 0.0);
    let speeds_up = to.abs() > from.abs() || from * to < 0.0;
    let slows_down = to.abs() < from.abs() || from * to < 0.0;
    match (up.filter(|_| speeds_up), down.filter(|_| slows_down)) {
        (Some(up), Some(down)) => Some(least(up, down)),
        (up, down) => up.or(down),
    }
}

impl Generator for CyclicVelocity {
    fn begin(&self) -> Demand {
        let start = match self.stage {
            Stage::Waiting { velocity } => velocity,
            _ => 0.0,
        };
        Demand::Velocity {
            start: start as f32,
            acceleration: 0.0,
            torque_offset_pm: 0.0,
            duration_ns: 0,
        }
    }

    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target != Target::Velocity {
            return None;
        }
        self.torque_offset_pm = inputs.targets.torque_offset_pm;
        let sum = f64::from(inputs.targets.velocity) + f64::from(inputs.targets.velocity_offset);
        let cut = inputs.configuration.velocity(sum);
        self.velocity_limited = cut.limited;
        Some(self.towards(cut.value, inputs.configuration.interpolation_ns(), inputs))
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        match self.stage {
            Stage::Waiting { velocity } => {
                let down = f64::from(inputs.configuration.slow_down(inputs.mode).rate);
                let next = ramp(velocity, 0.0, down, down, TICK_S);
                self.stage = Stage::Waiting { velocity: next };
                Some(Demand::Velocity {
                    start: velocity as f32,
                    acceleration: ((next - velocity) / TICK_S) as f32,
                    torque_offset_pm: 0.0,
                    duration_ns: if next == velocity { 0 } else { TICK_NS },
                })
            }
            Stage::Following => None,
            Stage::Limited { target } => Some(self.towards(target, TICK_NS, inputs)),
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
            velocity: self.velocity_limited,
            acceleration: matches!(self.stage, Stage::Limited { .. }),
            ..Limited::default()
        }
    }
}
