//! Mode 2, velocity (vl), as frequency converters have it: the target in revolutions per minute,
//! through a ramp function generator that the controlword opens, locks and fills.

use crate::arithmetic::measured;
use crate::path::TICK_S;
use crate::ramp::{ramp, velocity_segment};
use crate::windows::Arrival;
use crate::{Controlword, Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

/// What the controlword's bits make of the ramp function generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Switches {
    /// Bit 4: the ramp's output is the demand. If not, the demand runs to zero on the quick stop
    /// ramp, and the output with it.
    enabled: bool,
    /// Bit 5: the output follows the input. If not, it stays what it is.
    unlocked: bool,
    /// Bit 6: the input is the target. If not, it is zero.
    referenced: bool,
}

impl Switches {
    const fn of(word: Controlword) -> Switches {
        Switches {
            enabled: word.bit(4),
            unlocked: word.bit(5),
            referenced: word.bit(6),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Velocity {
    switches: Switches,
    /// Output of the ramp at the present tick, counts/s.
    velocity: f64,
    target: i16,
    arrival: Arrival,
    reached: bool,
    limited: Limited,
}

impl Velocity {
    pub(crate) fn new(word: Controlword, inputs: &Inputs<'_>) -> Velocity {
        Velocity {
            switches: Switches::of(word),
            velocity: inputs.present.velocity,
            target: inputs.targets.vl_velocity,
            arrival: Arrival::default(),
            reached: false,
            limited: Limited::default(),
        }
    }

    /// The target is another one, or the way to it.
    fn start_over(&mut self) {
        self.arrival = Arrival::default();
        self.reached = false;
    }

    fn take_target(&mut self, inputs: &Inputs<'_>) {
        if self.target != inputs.targets.vl_velocity {
            self.target = inputs.targets.vl_velocity;
            self.start_over();
        }
    }
}

impl Generator for Velocity {
    fn begin(&self) -> Demand {
        velocity_segment(self.velocity, self.velocity)
    }

    fn controlword(&mut self, _before: Controlword, now: Controlword, _inputs: &Inputs<'_>) {
        let switches = Switches::of(now);
        if self.switches != switches {
            self.switches = switches;
            self.start_over();
        }
    }

    /// The ramp moves with the ticks; only "target reached" falls at once.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        if target == Target::VlVelocity {
            self.take_target(inputs);
        }
        None
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let configuration = inputs.configuration;
        let vl = &configuration.vl;
        self.take_target(inputs);
        let Switches {
            enabled,
            unlocked,
            referenced,
        } = self.switches;
        let wanted = if enabled && referenced {
            f64::from(self.target) * measured(vl.counts_per_s)
        } else {
            0.0
        };
        let target = configuration.velocity(wanted);
        let up = configuration.acceleration(vl.acceleration);
        let down = if enabled {
            configuration.deceleration(vl.deceleration, vl.acceleration)
        } else {
            configuration.deceleration(vl.quick_stop_deceleration, vl.deceleration)
        };

        let locked = enabled && !unlocked;
        let ended = self.velocity == target.value;
        let error = configuration.velocity_error(target.value, inputs.actual.velocity.into());
        self.reached = self
            .arrival
            .tick(configuration.velocity_window, ended, error);

        let next = if locked {
            self.velocity
        } else {
            ramp(self.velocity, target.value, up.value, down.value, TICK_S)
        };
        let speeds_up = next.abs() > self.velocity.abs();
        self.limited = Limited {
            velocity: target.limited,
            acceleration: !ended && !locked && if speeds_up { up.limited } else { down.limited },
            ..Limited::default()
        };
        let demand = velocity_segment(self.velocity, next);
        self.velocity = next;
        Some(demand)
    }

    fn resume(&mut self, inputs: &Inputs<'_>) {
        self.velocity = inputs.present.velocity;
        self.target = inputs.targets.vl_velocity;
        self.start_over();
    }

    fn bits(&self) -> Bits {
        Bits {
            target_reached: self.reached,
            specific: false,
        }
    }

    fn limited(&self) -> Limited {
        self.limited
    }
}
