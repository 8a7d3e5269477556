//! The quick stop (0x605A): how it slows down and what it does at rest.

use crate::arithmetic::measured;
use crate::modes::Inputs;
use crate::path::{Path, Present, TICK_NS, TICK_S};
use crate::ramp::ramp;
use crate::{Configuration, Demand, Dialect};

/// The option code as latched when the quick stop began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OptionCode(i16);

impl OptionCode {
    pub(crate) fn of(configuration: &Configuration) -> OptionCode {
        match configuration.quick_stop_option {
            code @ 0..=8 => OptionCode(code),
            _ => OptionCode(2),
        }
    }

    /// 5 to 8: the drive stays in quick stop active.
    pub(crate) fn stays(self) -> bool {
        self.0 >= 5
    }

    /// The motor is freed at once: code 0, or codes below 5 of a drive without ramps.
    pub(crate) fn frees(self, dialect: &Dialect) -> bool {
        self.0 == 0 || (!self.stays() && !dialect.ramps_on_stop)
    }

    /// The rate: 1, 5 slow-down ramp, 2, 6 quick stop ramp; 3, 7 current limit and 4, 8 voltage
    /// limit have none.
    fn rate(self, configuration: &Configuration) -> Option<f64> {
        match self.0 {
            1 | 5 => Some(configuration.slow_down()),
            2 | 6 => {
                let quick = configuration.quick_stop_deceleration;
                if quick > 0.0 {
                    Some(configuration.deceleration(quick, quick).value)
                } else {
                    Some(configuration.slow_down())
                }
            }
            _ => None,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// A position demand slows down and then holds.
    Path { path: Path, begun: bool, rate: f64 },
    /// A velocity demand slows down; `rate` 0 means that it dropped to zero, so that the
    /// controllers brake with all the current and voltage they may use.
    Velocity {
        velocity: f64,
        rate: f64,
        forwards: bool,
    },
}

/// A quick stop going on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuickStop {
    code: OptionCode,
    stage: Stage,
    stopped: bool,
}

impl QuickStop {
    /// `by_position` says that the present demand is a position.
    pub(crate) fn new(
        code: OptionCode,
        dialect: &Dialect,
        by_position: bool,
        inputs: &Inputs<'_>,
    ) -> QuickStop {
        let present = inputs.present;
        let rate = code.rate(inputs.configuration);
        let (stage, stopped) = match rate {
            _ if !dialect.ramps_on_stop => (QuickStop::hold(inputs), true),
            Some(rate) if by_position => {
                let path = Path::stop(&present, rate);
                (
                    Stage::Path {
                        path,
                        begun: false,
                        rate,
                    },
                    path.ended(),
                )
            }
            _ => {
                let forwards = present.velocity >= 0.0;
                let velocity = if rate.is_some() {
                    present.velocity
                } else {
                    0.0
                };
                (
                    Stage::Velocity {
                        velocity,
                        rate: rate.unwrap_or(0.0),
                        forwards,
                    },
                    false,
                )
            }
        };
        QuickStop {
            code,
            stage,
            stopped,
        }
    }

    /// Positions have become `offset` counts greater.
    pub(crate) fn shift(&mut self, offset: i32) {
        if let Stage::Path { path, .. } = &mut self.stage {
            path.shift(offset);
        }
    }

    pub(crate) fn code(&self) -> OptionCode {
        self.code
    }

    /// Whether the stop is over.
    pub(crate) fn stopped(&self) -> bool {
        self.stopped
    }

    /// Holding the motor's position of this moment.
    fn hold(inputs: &Inputs<'_>) -> Stage {
        let present = Present {
            position: inputs.actual.position,
            ..Present::default()
        };
        Stage::Path {
            path: Path::stop(&present, 0.0),
            begun: true,
            rate: 0.0,
        }
    }

    pub(crate) fn begin(&self) -> Demand {
        match &self.stage {
            Stage::Path { path, .. } => path.begin(),
            Stage::Velocity { velocity, .. } => Demand::Velocity {
                start: *velocity as f32,
                acceleration: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            },
        }
    }

    /// One millisecond more.
    pub(crate) fn tick(&mut self, inputs: &Inputs<'_>) -> Demand {
        if let Stage::Velocity {
            velocity, forwards, ..
        } = self.stage
            && velocity == 0.0
        {
            let speed = measured(inputs.actual.velocity);
            let along = if forwards { speed } else { -speed };
            if along <= 0.0 || inputs.configuration.stands(speed) {
                self.stage = QuickStop::hold(inputs);
            }
        }
        match &mut self.stage {
            Stage::Path { path, begun, rate } => {
                if !*begun {
                    path.resume(&inputs.present, *rate);
                    *begun = true;
                }
                self.stopped = path.ended();
                path.tick()
            }
            Stage::Velocity { velocity, rate, .. } => {
                let from = *velocity;
                *velocity = ramp(from, 0.0, *rate, *rate, TICK_S);
                Demand::Velocity {
                    start: from as f32,
                    acceleration: ((*velocity - from) / TICK_S) as f32,
                    torque_offset_pm: 0.0,
                    duration_ns: if *velocity == from { 0 } else { TICK_NS },
                }
            }
        }
    }
}
