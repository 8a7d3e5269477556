//! Turning the rotor by a field: how many pole pairs a turn has, where the encoder reads zero, and how
//! far its magnet is off its centre.
//!
//! The rotor follows the field with a lag by friction, which has the other sign in the other direction;
//! the mean of both has none.

use cia402::Demand;
use control::Real as _;

use super::correction::{self, Means, Table};
use crate::md80::internal::COUNTS_PER_TURN;
use crate::own::AxisView;

/// Electrical turns per tick, and how much it grows in one: 10 turns/s after a fifth of a second.
const RATE: i64 = TURN / 100;
const RATE_STEP: i64 = RATE / 200;
/// A turn of an angle.
pub(super) const TURN: i64 = 1 << 32;
const ALIGN_TICKS: u32 = 300;
/// Electrical turns after which the rotor must have moved.
const FIRST_TURNS: i64 = 3;
/// More pole pairs no motor has.
const MOST_POLE_PAIRS: i64 = 255;
/// Electrical turns by which a direction's mean may differ from the other's: lag beyond a twelfth of a
/// turn either side is no following.
const MOST_LAG: f32 = 1.0 / 6.0;

/// Longest vector in the linear range of a supply, V.
pub(super) fn longest_v(bus_v: f32) -> f32 {
    control::modulation::LINEAR_RANGE * bus_v.greatest(1.0)
}

/// A voltage in the demand's unit.
pub(super) fn units(volts: f32, bus_v: f32) -> i16 {
    (volts / longest_v(bus_v) * 32_768.0 + 0.5) as i16
}

/// A voltage at an electrical angle, 2³² per turn.
pub(super) fn phase_voltage(angle: i64, volts: f32, bus_v: f32) -> Demand {
    Demand::PhaseVoltage {
        angle: (angle >> 16) as i16,
        voltage_d: units(volts, bus_v),
        voltage_q: 0,
    }
}

/// The bridge on, without voltage.
pub(super) const fn no_voltage() -> Demand {
    Demand::PhaseVoltage {
        angle: 0,
        voltage_d: 0,
        voltage_q: 0,
    }
}

/// A field that turns, and how far the encoder went with it.
#[derive(Clone, Debug)]
pub(super) struct Field {
    volts: f32,
    /// Electrical, 2³² per turn.
    pub(super) angle: i64,
    rate: i64,
    encoder: i32,
    /// Counts since the start.
    pub(super) moved: i64,
}

impl Field {
    pub(super) fn new(view: &AxisView, volts: f32) -> Field {
        Field {
            volts,
            angle: 0,
            rate: 0,
            encoder: view.encoder,
            moved: 0,
        }
    }

    /// A tick more, towards `rate`.
    pub(super) fn tick(&mut self, view: &AxisView, rate: i64) {
        let turn = COUNTS_PER_TURN as i32;
        let step = view.encoder.wrapping_sub(self.encoder);
        self.moved += i64::from((step + turn / 2).rem_euclid(turn) - turn / 2);
        self.encoder = view.encoder;
        self.rate += (rate - self.rate).clamp(-RATE_STEP, RATE_STEP);
        self.angle += self.rate;
    }

    pub(super) fn demand(&self, view: &AxisView) -> Demand {
        phase_voltage(self.angle, self.volts, view.bus_voltage_v)
    }
}

/// Sums of a quantity over a turn: mean and first harmonic.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Harmonic {
    sum: f32,
    cosine: f32,
    sine: f32,
    count: f32,
}

impl Harmonic {
    /// One more, at an angle of 2³² per turn.
    pub(super) fn add(&mut self, value: f32, angle: i32) {
        let (sine, cosine) = control::sin_cos::<f32>(angle);
        self.sum += value;
        self.cosine += value * cosine;
        self.sine += value * sine;
        self.count += 1.0;
    }

    pub(super) fn mean(&self) -> f32 {
        self.sum / self.count.greatest(1.0)
    }

    /// Amplitude of what repeats once a turn.
    pub(super) fn amplitude(&self) -> f32 {
        let square = self.cosine * self.cosine + self.sine * self.sine;
        2.0 * <f32 as control::Real>::sqrt(square) / self.count.greatest(1.0)
    }
}

/// What a millisecond of turning brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    Demands(Demand),
    /// A turn has another number of electrical turns, or the rotor does not follow.
    WrongPolePairs,
    /// The two directions do not agree on a zero.
    NoOffset,
    Done {
        /// Reading with the rotor under phase A.
        zero: i32,
        /// +1 if the reading rises with the field.
        polarity: i8,
        /// Amplitude of the readings' error, degrees of a turn.
        off_degrees: f32,
        /// That error at each place of a turn.
        table: Table,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Align,
    /// Counting pole pairs, or finding out the direction only.
    Pairs,
    Forward,
    TurnBack,
    Back,
}

/// The turns of a calibration.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    step: Step,
    ticks: u32,
    field: Field,
    pole_pairs: i64,
    counts_pairs: bool,
    polarity: i64,
    /// Where this step began, electrical.
    from: i64,
    /// The first difference of field and rotor, from which the others are told.
    first: Option<i32>,
    means: [Harmonic; 2],
    places: [Means; 2],
}

impl Turning {
    /// With `volts`, for a motor of `pole_pairs`, which are counted unless that is not wanted.
    pub(super) fn new(view: &AxisView, pole_pairs: i32, counts_pairs: bool, volts: f32) -> Turning {
        Turning {
            step: Step::Align,
            ticks: 0,
            field: Field::new(view, volts),
            pole_pairs: i64::from(pole_pairs.max(1)),
            counts_pairs,
            polarity: 1,
            from: 0,
            first: None,
            means: [Harmonic::default(); 2],
            places: [Means::default(); 2],
        }
    }

    fn go(&mut self, step: Step) {
        self.step = step;
        self.from = self.field.angle;
    }

    /// A millisecond more.
    pub(super) fn tick(&mut self, view: &AxisView) -> Outcome {
        self.ticks += 1;
        let rate = match self.step {
            Step::Align => 0,
            Step::Pairs | Step::Forward => RATE,
            Step::TurnBack | Step::Back => -RATE,
        };
        self.field.tick(view, rate);
        let turned = self.field.angle - self.from;
        let a_turn = self.pole_pairs * TURN;
        match self.step {
            Step::Align => {
                if self.ticks == ALIGN_TICKS {
                    self.field.moved = 0;
                    self.go(Step::Pairs);
                }
            }
            Step::Pairs => {
                if let Some(failed) = self.pairs(turned) {
                    return failed;
                }
            }
            Step::Forward => {
                self.compare(view, 0);
                if turned >= a_turn {
                    self.go(Step::TurnBack);
                }
            }
            Step::TurnBack => {
                // Two ramps, and the play of what follows.
                if turned <= -TURN {
                    self.go(Step::Back);
                }
            }
            Step::Back => {
                self.compare(view, 1);
                if turned <= -a_turn {
                    return self.end();
                }
            }
        }
        Outcome::Demands(self.field.demand(view))
    }

    /// Follows the rotor until it has made a turn, or enough to know its direction.
    fn pairs(&mut self, turned: i64) -> Option<Outcome> {
        let counts = i64::from(COUNTS_PER_TURN);
        let moved = self.field.moved.abs();
        let not_followed = match self.counts_pairs {
            true => Outcome::WrongPolePairs,
            false => Outcome::NoOffset,
        };
        if turned >= FIRST_TURNS * TURN {
            // Half of what the most pole pairs would make.
            let least = counts * FIRST_TURNS / (2 * MOST_POLE_PAIRS);
            if moved < least {
                return Some(not_followed);
            }
            self.polarity = self.field.moved.signum();
            if !self.counts_pairs {
                self.go(Step::Forward);
                return None;
            }
        }
        if turned > (MOST_POLE_PAIRS + FIRST_TURNS) * TURN {
            return Some(Outcome::WrongPolePairs);
        }
        if moved >= counts && self.counts_pairs && turned >= FIRST_TURNS * TURN {
            let turns = turned as f32 / TURN as f32 * counts as f32 / moved as f32;
            let off = turns - self.pole_pairs as f32;
            if !(-0.5..0.5).contains(&off) {
                return Some(Outcome::WrongPolePairs);
            }
            self.go(Step::Forward);
        }
        None
    }

    /// The field's angle against the rotor's as the encoder tells it.
    fn compare(&mut self, view: &AxisView, direction: usize) {
        let mechanical = (i64::from(view.encoder) * (TURN / i64::from(COUNTS_PER_TURN))) as i32;
        let rotor = i64::from(mechanical) * self.pole_pairs * self.polarity;
        let difference = (self.field.angle - rotor) as i32;
        let first = *self.first.get_or_insert(difference);
        let turns = difference.wrapping_sub(first) as f32 / TURN as f32;
        if let Some(mean) = self.means.get_mut(direction) {
            mean.add(turns, mechanical);
        }
        if let Some(places) = self.places.get_mut(direction) {
            places.add(turns, mechanical);
        }
    }

    fn end(&self) -> Outcome {
        let [forward, back] = self.means;
        let lag = forward.mean() - back.mean();
        if !(-MOST_LAG..=MOST_LAG).contains(&lag) {
            return Outcome::NoOffset;
        }
        let Some(told) = correction::told(&self.places) else {
            return Outcome::NoOffset;
        };
        let first = self.first.unwrap_or(0);
        let difference = first.wrapping_add((told.mean * TURN as f32) as i32);
        // difference = −polarity · pole pairs · zero
        let per_count = self.pole_pairs as f32 * (TURN / i64::from(COUNTS_PER_TURN)) as f32;
        let zero = -(self.polarity as f32) * difference as f32 / per_count;
        // The field is ahead by as much less as the reading is too great.
        let per_turn = (self.pole_pairs * self.polarity) as f32;
        let amplitude = 0.5 * (forward.amplitude() + back.amplitude());
        Outcome::Done {
            zero: if zero < 0.0 {
                (zero - 0.5) as i32
            } else {
                (zero + 0.5) as i32
            },
            polarity: self.polarity as i8,
            off_degrees: amplitude / self.pole_pairs as f32 * 360.0,
            table: Table::of_turns(told.deviations.map(|deviation| -deviation / per_turn)),
        }
    }
}
