//! Calibration: what is measured in which order, and where the results go.

use canopen::Image;
use cia402::Demand;

use super::FIELDS;
use super::electrical::{self, Electrical};
use super::output::OutputTurning;
use super::turning::{self, Turning};
use super::watch::{Bits, one};
use crate::md80::internal::COUNTS_PER_TURN;
use crate::own::AxisView;

/// The main encoder's calibration did not end well.
pub(super) const FAILED: Bits = one(1, 4);
const OUTPUT_FAILED: Bits = one(2, 4);

/// The current to measure with, A, unless the motor bears less.
const TEST_CURRENT_A: f32 = 10.0;
/// 0x2000,9 and 0x2005,2.
const FULL: i64 = 0;

/// Degrees of a turn by which readings may be off.
pub(super) const LOW_ACCURACY_DEGREES: f32 = 1.0;
pub(super) const FAULTY_DEGREES: f32 = 5.0;

/// What a millisecond of calibration brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Progress {
    /// The bridge's next demand.
    Demands(Demand),
    /// It has failed: these bits of the status words.
    Failed(Bits),
    /// The results are in the image.
    Done {
        /// They are to be stored, and the drive then starts over.
        keeps: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// 0x2003,3.
    Full,
    /// 0x2003,6.
    Electrical,
    /// 0x2003,4.
    Output,
}

#[derive(Clone, Debug)]
enum Stage {
    /// Nothing looked at yet.
    Start,
    Electrical(Electrical),
    Turning(Turning),
    Output(OutputTurning),
}

/// A calibration at work.
#[derive(Clone, Debug)]
pub(super) struct Calibration {
    kind: Kind,
    stage: Stage,
    current_a: f32,
    /// Of one phase, Ω and H.
    resistance: f32,
    inductance: f32,
}

impl Calibration {
    const fn new(kind: Kind) -> Calibration {
        Calibration {
            kind,
            stage: Stage::Start,
            current_a: TEST_CURRENT_A,
            resistance: 0.0,
            inductance: 0.0,
        }
    }

    /// Everything of the motor: resistance and inductance, pole pairs, the encoder's zero and how far
    /// its magnet is off.
    pub(super) const fn full() -> Calibration {
        Calibration::new(Kind::Full)
    }

    /// Resistance and inductance, of which the current controllers' gains follow.
    pub(super) const fn electrical() -> Calibration {
        Calibration::new(Kind::Electrical)
    }

    /// The output encoder.
    pub(super) const fn output() -> Calibration {
        Calibration::new(Kind::Output)
    }

    /// The greatest current, A.
    pub(super) fn current_limit_a(&self) -> f32 {
        1.5 * self.current_a
    }

    /// Whether it wants the main encoder's readings as they are.
    pub(super) fn is_of_main_encoder(&self) -> bool {
        self.kind == Kind::Full
    }

    /// Whether it wants the output encoder's.
    pub(super) fn is_of_output(&self) -> bool {
        self.kind == Kind::Output
    }

    /// The bits of one that was stopped: the master left the service mode, or there is a fault.
    pub(super) fn stopped(&self) -> Bits {
        match self.kind {
            Kind::Output => OUTPUT_FAILED,
            _ => FAILED,
        }
    }

    /// A millisecond more; `output` is the output encoder's reading, turns.
    pub(super) fn tick(
        &mut self,
        image: &mut Image<'_>,
        view: &AxisView,
        output: Option<f32>,
    ) -> Progress {
        match &mut self.stage {
            Stage::Start => self.begin(image, view, output),
            Stage::Electrical(measuring) => match measuring.tick(view, self.current_a) {
                electrical::Outcome::Demands(demand) => Progress::Demands(demand),
                electrical::Outcome::NoResistance => Progress::Failed(self.stopped() | one(3, 1)),
                electrical::Outcome::NoInductance => Progress::Failed(self.stopped() | one(3, 2)),
                electrical::Outcome::Done {
                    resistance,
                    inductance,
                } => {
                    self.resistance = resistance;
                    self.inductance = inductance;
                    self.measured(image, view)
                }
            },
            Stage::Turning(turning) => match turning.tick(view) {
                turning::Outcome::Demands(demand) => Progress::Demands(demand),
                turning::Outcome::WrongPolePairs => Progress::Failed(FAILED | one(3, 3)),
                turning::Outcome::NoOffset => Progress::Failed(FAILED | one(3, 0)),
                turning::Outcome::Done {
                    zero,
                    polarity,
                    off_degrees,
                    table,
                } => {
                    let progress = self.turned(image, zero, polarity, off_degrees);
                    if let Progress::Done { .. } = progress {
                        table.keep(image, &FIELDS.correction);
                    }
                    progress
                }
            },
            Stage::Output(turning) => match turning.tick(view, output) {
                Some(progress) => progress,
                None => turning
                    .finish(image)
                    .unwrap_or(Progress::Failed(OUTPUT_FAILED)),
            },
        }
    }

    fn begin(&mut self, image: &Image<'_>, view: &AxisView, output: Option<f32>) -> Progress {
        let most =
            image.real(FIELDS.max_current) * 1e-3 * (image.real(FIELDS.rated_current) * 1e-3);
        if most > 0.0 && 0.9 * most < self.current_a {
            self.current_a = 0.9 * most;
        }
        let is_set = |field| image.raw(field) != 0;
        let needed = match self.kind {
            Kind::Electrical => true,
            // M12.
            Kind::Full => {
                is_set(FIELDS.pole_pairs)
                    && is_set(FIELDS.torque_constant)
                    && is_set(FIELDS.bandwidth)
            }
            Kind::Output => is_set(FIELDS.is_calibrated) && is_set(FIELDS.resistance),
        };
        if !needed {
            return Progress::Failed(self.stopped());
        }
        if self.kind == Kind::Output {
            let turning = OutputTurning::new(image, view, output, self.current_a);
            let Some(turning) = turning else {
                return Progress::Failed(OUTPUT_FAILED);
            };
            self.stage = Stage::Output(turning);
        } else {
            self.stage = Stage::Electrical(Electrical::new());
        }
        Progress::Demands(turning::no_voltage())
    }

    /// Resistance and inductance are known.
    fn measured(&mut self, image: &mut Image<'_>, view: &AxisView) -> Progress {
        if self.kind == Kind::Electrical {
            self.write_electrical(image);
            return Progress::Done { keeps: false };
        }
        self.stage = Stage::Turning(Turning::new(
            view,
            image.number(FIELDS.pole_pairs) as i32,
            image.number(FIELDS.calibration_mode) == FULL,
            self.current_a * self.resistance,
        ));
        Progress::Demands(turning::no_voltage())
    }

    fn turned(
        &mut self,
        image: &mut Image<'_>,
        zero: i32,
        polarity: i8,
        off_degrees: f32,
    ) -> Progress {
        if off_degrees > FAULTY_DEGREES {
            return Progress::Failed(FAILED | one(1, 3));
        }
        self.write_electrical(image);
        let turn = COUNTS_PER_TURN as i32;
        image.set_number(FIELDS.electrical_zero, i64::from(zero.rem_euclid(turn)));
        image.set_number(FIELDS.electrical_polarity, i64::from(polarity));
        let low = off_degrees > LOW_ACCURACY_DEGREES;
        image.set_number(FIELDS.low_accuracy, i64::from(low));
        image.set_number(FIELDS.is_calibrated, 1);
        Progress::Done { keeps: true }
    }

    fn write_electrical(&self, image: &mut Image<'_>) {
        image.set_raw(FIELDS.resistance, self.resistance.to_bits());
        image.set_raw(FIELDS.inductance, self.inductance.to_bits());
    }
}
