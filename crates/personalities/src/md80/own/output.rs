//! The encoder on the output of the gear: 0x2005.

use canopen::Image;

use super::FIELDS;
use super::calibration::{FAULTY_DEGREES, LOW_ACCURACY_DEGREES, Progress};
use super::correction::{self, Means, Table, rounded};
use super::turning::{Field, Harmonic, TURN};
use super::watch::one;
use crate::md80::internal::{COUNTS_PER_TURN, PLACES};
use crate::own::AxisView;

/// Part of the way that the shown velocity goes to a new one each millisecond: 8 Hz.
const VELOCITY_PART: f32 = 0.05;
/// Turns of the output after which its encoder is compared with the motor's.
const COMPARED_TURNS: f32 = 0.02;
const TURN_RAD: f32 = core::f32::consts::TAU;

/// The output encoder, as far as it is configured.
#[derive(Clone, Debug)]
pub(super) struct OutputEncoder {
    /// Type and mode are set.
    configured: bool,
    /// By how much it is off.
    table: Table,
    /// The reading, turns from 0 to 1: corrected, unless it is being calibrated.
    reading: Option<f32>,
    /// Whole turns beside it.
    whole: i32,
    /// Turns per second.
    velocity: f32,
    /// How far motor and encoder have come since they were last compared.
    compared: Compared,
}

/// Ways of the output, turns.
#[derive(Clone, Copy, Debug, Default)]
struct Compared {
    /// The motor's encoder at the last tick.
    motor_reading: Option<i32>,
    by_motor: f32,
    by_encoder: f32,
}

impl OutputEncoder {
    pub(super) fn new(image: &Image<'_>) -> OutputEncoder {
        OutputEncoder {
            configured: is_configured(image),
            table: Table::stored(image, &FIELDS.output_correction),
            reading: None,
            whole: 0,
            velocity: 0.0,
            compared: Compared::default(),
        }
    }

    /// Whether there is to be one: 0x2005,1 and 3 are not 0.
    pub(super) fn is_configured(&self) -> bool {
        self.configured
    }

    /// Its reading with the direction of the output not yet applied, over many turns.
    pub(super) fn turns(&self) -> Option<f32> {
        self.reading.map(|reading| self.whole as f32 + reading)
    }

    /// What a raw reading, turns, is taken for.
    fn right(&self, image: &Image<'_>, raw: f32, calibrating: bool) -> f32 {
        match is_in_use(image) && !calibrating {
            true => self.table.right_turns(raw),
            false => raw,
        }
    }

    /// A millisecond more. While it is being `calibrating`, it is taken as it reads.
    pub(super) fn tick(&mut self, image: &Image<'_>, view: &AxisView, calibrating: bool) {
        self.configured = is_configured(image);
        let Some(raw) = view.output_encoder.filter(|_| self.configured) else {
            self.reading = None;
            self.velocity = 0.0;
            return;
        };
        let reading = self.right(image, raw, calibrating);
        match self.reading {
            Some(before) => {
                let moved = half_turn(reading - before);
                self.compared.by_encoder += moved;
                self.velocity += VELOCITY_PART * (moved * 1000.0 - self.velocity);
                let jump = reading - before;
                if jump > 0.5 {
                    self.whole = self.whole.wrapping_sub(1);
                } else if jump < -0.5 {
                    self.whole = self.whole.wrapping_add(1);
                }
            }
            // The turn that the position of a start means, too.
            None if is_in_use(image) => {
                let from_zero = reading - image.real(FIELDS.output_zero);
                self.whole = rounded(half_turn(from_zero) - from_zero) as i32;
            }
            None => self.whole = 0,
        }
        self.reading = Some(reading);
    }

    /// Whether it has gone the other way than the motor and its calibration say; to be asked each
    /// millisecond, after the tick. It `looks` if a difference would mean just that.
    pub(super) fn is_turned(&mut self, image: &Image<'_>, view: &AxisView, looks: bool) -> bool {
        let gear = image.real(FIELDS.gear);
        let before = self.compared.motor_reading.replace(view.encoder);
        let (true, Some(before)) = (
            looks && is_in_use(image) && self.reading.is_some() && gear > 0.0,
            before,
        ) else {
            self.compared = Compared {
                motor_reading: Some(view.encoder),
                ..Compared::default()
            };
            return false;
        };
        let compared = &mut self.compared;
        let step = half_turn((view.encoder - before) as f32 / COUNTS_PER_TURN as f32);
        compared.by_motor += step * gear;
        let (by_motor, by_encoder) = (compared.by_motor, compared.by_encoder);
        if -COMPARED_TURNS < by_motor && by_motor < COMPARED_TURNS {
            return false;
        }
        (compared.by_motor, compared.by_encoder) = (0.0, 0.0);
        let direction = image.number(FIELDS.output_direction) as f32;
        // Half as far the other way, so that no play of the gear can be meant.
        direction * by_encoder / by_motor < -0.5
    }

    /// Where the output stands at a start, counts of the motor; `None` if this encoder does not say.
    pub(super) fn start_position(&mut self, image: &Image<'_>, view: &AxisView) -> Option<i32> {
        if !is_in_use(image) {
            return None;
        }
        let reading = self.right(image, view.output_encoder?, false);
        let gear = image.real(FIELDS.gear);
        if gear <= 0.0 {
            return None;
        }
        let output = half_turn(turns_from_zero(image, reading));
        Some((output / gear * COUNTS_PER_TURN as f32) as i32)
    }

    /// The present position of the output is 0.
    pub(super) fn set_zero(&mut self, image: &mut Image<'_>) {
        if let (true, Some(reading)) = (is_in_use(image), self.reading) {
            self.whole = 0;
            image.set_raw(FIELDS.output_zero, reading.to_bits());
        }
    }

    /// Position of the output from its zero, turns, if its calibration counts.
    pub(super) fn position(&self, image: &Image<'_>) -> Option<f64> {
        let reading = self.reading.filter(|_| is_in_use(image))?;
        let from_zero = f64::from(reading) - f64::from(image.real(FIELDS.output_zero));
        let direction = image.number(FIELDS.output_direction) as f64;
        Some(direction * (f64::from(self.whole) + from_zero))
    }

    /// Its velocity, turns per second, likewise.
    pub(super) fn velocity(&self, image: &Image<'_>) -> f32 {
        image.number(FIELDS.output_direction) as f32 * self.velocity
    }

    /// 0x2005,4 and 5.
    pub(super) fn publish(&self, image: &mut Image<'_>) {
        let (position, velocity) = match self.turns() {
            Some(turns) if is_in_use(image) => {
                let direction = image.number(FIELDS.output_direction) as f32;
                let position = turns_from_zero(image, turns);
                (position * TURN_RAD, direction * self.velocity * TURN_RAD)
            }
            Some(turns) => (turns * TURN_RAD, self.velocity * TURN_RAD),
            None => (0.0, 0.0),
        };
        image.set_raw(FIELDS.output_position, position.to_bits());
        image.set_raw(FIELDS.output_velocity, velocity.to_bits());
    }
}

/// 0x2005,3.
const REPORT: i64 = 3;

/// Whether it can be calibrated in its mode (M29).
pub(super) fn is_calibratable(image: &Image<'_>) -> bool {
    is_configured(image) && image.number(FIELDS.output_mode) != REPORT
}

/// Whether its calibration counts: there is one, and the mode is one that it is for.
pub(super) fn is_in_use(image: &Image<'_>) -> bool {
    is_calibratable(image) && image.number(FIELDS.output_is_calibrated) != 0
}

/// Turns of the output from its zero, as calibrated.
fn turns_from_zero(image: &Image<'_>, turns: f32) -> f32 {
    let direction = image.number(FIELDS.output_direction) as f32;
    direction * (turns - image.real(FIELDS.output_zero))
}

fn is_configured(image: &Image<'_>) -> bool {
    image.raw(FIELDS.output_type) != 0 && image.raw(FIELDS.output_mode) != 0
}

/// A difference of readings, half a turn on either side.
fn half_turn(turns: f32) -> f32 {
    // `as` saturates.
    let within = turns - turns as i32 as f32;
    if within >= 0.5 {
        within - 1.0
    } else if within < -0.5 {
        within + 1.0
    } else {
        within
    }
}

/// Electrical turns per tick of the output's calibration: 15 a second.
const RATE: i64 = TURN * 15 / 1000;
/// Turns of the output: more than one, or about a quarter.
const FULL_TURNS: f32 = 1.05;
const DIRECTION_TURNS: f32 = 0.26;
/// Turns by which the output may have gone another way than the gear says.
const MOST_DRIFT: f32 = 0.02;
/// 0x2005,1: an AS5047 beside the axis, whose direction alone says too little.
const OFF_AXIS: i64 = 2;

/// The output is turned by the motor's field, and its encoder looked at.
#[derive(Clone, Debug)]
pub(super) struct OutputTurning {
    field: Field,
    full: bool,
    gear: f32,
    /// Of the main encoder against the field, as calibrated, and counts of an electrical turn of it.
    polarity: i64,
    turned: i64,
    /// Where all began, turns of the output by the motor and of its encoder.
    start: (f32, f32),
    /// How far both have come since.
    by_motor: f32,
    by_encoder: f32,
    /// What the encoder is ahead of the motor, for either direction.
    ahead: [Harmonic; 2],
    places: [Means; 2],
    most_angle: i64,
}

impl OutputTurning {
    /// `None` if there is nothing to calibrate, or not in this way.
    pub(super) fn new(
        image: &Image<'_>,
        view: &AxisView,
        reading: Option<f32>,
        current_a: f32,
    ) -> Option<OutputTurning> {
        let full = image.number(FIELDS.output_calibration_mode) == 0;
        let gear = image.real(FIELDS.gear);
        let off_axis = image.number(FIELDS.output_type) == OFF_AXIS;
        if gear <= 0.0 || (off_axis && !full) {
            return None;
        }
        let turns = if full { FULL_TURNS } else { DIRECTION_TURNS };
        let pole_pairs = image.real(FIELDS.pole_pairs);
        let volts = current_a * image.real(FIELDS.resistance);
        Some(OutputTurning {
            field: Field::new(view, volts),
            full,
            gear,
            polarity: image.number(FIELDS.electrical_polarity),
            turned: i64::from(COUNTS_PER_TURN) / image.number(FIELDS.pole_pairs).max(1),
            start: (motor_turns(view) * gear, reading?),
            by_motor: 0.0,
            by_encoder: 0.0,
            ahead: [Harmonic::default(); 2],
            places: [Means::default(); 2],
            // Two electrical turns more than it takes, a tenth of them for what slips.
            most_angle: ((turns / gear * pole_pairs * 1.1 + 2.0) * TURN as f32) as i64,
        })
    }

    /// A millisecond more; `None` at the end.
    pub(super) fn tick(&mut self, view: &AxisView, reading: Option<f32>) -> Option<Progress> {
        self.field.tick(view, RATE);
        if self.field.moved * self.polarity <= -self.turned {
            // The main encoder counts against the field.
            return Some(Progress::Failed(one(2, 4) | one(1, 1)));
        }
        let Some(reading) = reading else {
            return Some(Progress::Failed(one(2, 4)));
        };
        self.by_motor = motor_turns(view) * self.gear - self.start.0;
        self.by_encoder = reading - self.start.1;
        let angle = ((reading - reading as i32 as f32) * TURN as f32) as i64 as i32;
        let [along, against] = &mut self.ahead;
        along.add(self.by_encoder - self.by_motor, angle);
        against.add(self.by_encoder + self.by_motor, angle);
        let [along, against] = &mut self.places;
        along.add(self.by_encoder - self.by_motor, angle);
        against.add(self.by_encoder + self.by_motor, angle);
        let turns = if self.full {
            FULL_TURNS
        } else {
            DIRECTION_TURNS
        };
        if self.by_motor >= turns || -self.by_motor >= turns {
            return None;
        }
        if self.field.angle > self.most_angle {
            // The output does not turn as it should.
            return Some(Progress::Failed(one(2, 4)));
        }
        Some(Progress::Demands(self.field.demand(view)))
    }

    /// Writes what was found.
    pub(super) fn finish(&self, image: &mut Image<'_>) -> Option<Progress> {
        let along = self.by_encoder - self.by_motor;
        let against = self.by_encoder + self.by_motor;
        let [with, opposite] = self.ahead;
        let [places_with, places_opposite] = self.places;
        let (direction, drift, ahead, places) = if along * along <= against * against {
            (1.0, along, with, places_with)
        } else {
            (-1.0, against, opposite, places_opposite)
        };
        if !(-MOST_DRIFT..=MOST_DRIFT).contains(&drift) {
            return None;
        }
        let off_degrees = if self.full {
            ahead.amplitude() * 360.0
        } else {
            0.0
        };
        if off_degrees > FAULTY_DEGREES {
            return Some(Progress::Failed(one(2, 4) | one(2, 3)));
        }
        // A quarter turn tells a direction, and nothing of the table.
        let (mean, table) = match correction::told(&[places; 2]).filter(|_| self.full) {
            Some(told) => (told.mean, Table::of_turns(told.deviations)),
            None => (ahead.mean(), Table::of_turns([0.0; PLACES])),
        };
        table.keep(image, &FIELDS.output_correction);
        let zero = self.start.1 - direction * self.start.0 + mean;
        image.set_raw(FIELDS.output_zero, half_turn(zero).to_bits());
        image.set_number(FIELDS.output_direction, direction as i64);
        let low = off_degrees > LOW_ACCURACY_DEGREES;
        image.set_number(FIELDS.output_low_accuracy, i64::from(low));
        image.set_number(FIELDS.output_is_calibrated, 1);
        Some(Progress::Done { keeps: true })
    }
}

fn motor_turns(view: &AxisView) -> f32 {
    view.position as f32 / COUNTS_PER_TURN as f32
}
