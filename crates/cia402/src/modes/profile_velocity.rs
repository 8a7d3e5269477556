//! Mode 3, profile velocity: the target velocity through the profile's ramps.

use crate::path::TICK_S;
use crate::ramp::{Velocity, velocity_segment};
use crate::windows::{Arrival, Standstill};
use crate::{Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProfileVelocity {
    /// Demand at the present tick.
    demand: Velocity,
    target: i32,
    arrival: Arrival,
    standstill: Standstill,
    bits: Bits,
    limited: Limited,
}

impl ProfileVelocity {
    pub(crate) fn new(inputs: &Inputs<'_>) -> ProfileVelocity {
        ProfileVelocity {
            demand: Velocity {
                velocity: inputs.present.velocity,
                acceleration: inputs.present.acceleration,
            },
            target: inputs.targets.velocity,
            arrival: Arrival::default(),
            standstill: Standstill::default(),
            bits: Bits::default(),
            limited: Limited::default(),
        }
    }

    /// A new target is not reached yet; the same target again changes nothing.
    fn take_target(&mut self, inputs: &Inputs<'_>) {
        if self.target != inputs.targets.velocity {
            self.target = inputs.targets.velocity;
            self.arrival = Arrival::default();
            self.bits.target_reached = false;
        }
    }

    /// One millisecond more of watching for standstill.
    fn stands(&mut self, inputs: &Inputs<'_>) -> bool {
        let configuration = inputs.configuration;
        self.standstill.tick(
            configuration.stands(f64::from(inputs.actual.velocity)),
            configuration.velocity_threshold_time_ms,
        )
    }
}

impl Generator for ProfileVelocity {
    fn begin(&self) -> Demand {
        velocity_segment(self.demand.velocity, self.demand.velocity)
    }

    /// The ramp moves with the ticks; only "target reached" falls at once.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target == Target::Velocity {
            self.take_target(inputs);
        }
        None
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let configuration = inputs.configuration;
        let target = configuration.velocity(f64::from(inputs.targets.velocity));
        let up = configuration.acceleration(configuration.acceleration);
        let down =
            configuration.deceleration(configuration.deceleration, configuration.acceleration);

        let from = self.demand.velocity;
        let ended = from == target.value && self.demand.acceleration == 0.0;
        let error = configuration.velocity_error(target.value, inputs.actual.velocity.into());
        self.take_target(inputs);
        self.bits = Bits {
            target_reached: self
                .arrival
                .tick(configuration.velocity_window, ended, error),
            specific: self.stands(inputs),
        };

        self.demand = self.demand.towards(
            target.value,
            up.value,
            down.value,
            configuration.jerk,
            TICK_S,
        );
        let to = self.demand.velocity;
        let speeds_up = to.abs() > from.abs();
        self.limited = Limited {
            velocity: target.limited,
            acceleration: !ended && if speeds_up { up.limited } else { down.limited },
            ..Limited::default()
        };
        Some(velocity_segment(from, to))
    }

    fn halted(&mut self, inputs: &Inputs<'_>) {
        self.bits.specific = self.stands(inputs);
    }

    fn resume(&mut self, inputs: &Inputs<'_>) {
        self.demand = Velocity {
            velocity: inputs.present.velocity,
            acceleration: inputs.present.acceleration,
        };
        self.target = inputs.targets.velocity;
        self.arrival = Arrival::default();
        self.bits.target_reached = false;
    }

    fn bits(&self) -> Bits {
        self.bits
    }

    fn limited(&self) -> Limited {
        self.limited
    }
}
