//! What is wrong, and what is at a limit: the status words of 0x2004.

use canopen::Image;
use cia402::{Mode, State};
use control::io::Magnet;

use super::FIELDS;
use super::bridge::Bridge;
use super::output::{OutputEncoder, is_calibratable};
use crate::board::Board;
use crate::md80::axis::SERVICE;
use crate::md80::internal::COUNTS_PER_TURN;
use crate::md80::status::{Effect, STATUS_BITS, WORDS, cause, place};
use crate::own::AxisView;

/// A set of [`STATUS_BITS`], by their places there.
pub(super) type Bits = u64;

pub(super) const fn one(sub: u8, bit: u8) -> Bits {
    1 << place(sub, bit)
}

/// Set when it is so, cleared when it is not.
const LEVELS: Bits = one(1, 2) | one(1, 30) | one(2, 2) | one(2, 30) | one(3, 4);
/// The errors of a calibration.
const CALIBRATION: Bits =
    one(1, 3) | one(1, 4) | one(2, 3) | one(2, 4) | one(3, 0) | one(3, 1) | one(3, 2) | one(3, 3);

const SET_UP: Bits = one(3, 4);
const SILENCE: Bits = one(8, 30);

/// Bits that only a reset of the drive ends.
const CRITICAL: Bits = {
    let mut bits = 0;
    let mut n = 0;
    while n < STATUS_BITS.len() {
        #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
        if let Effect::Critical(_) = STATUS_BITS[n].effect {
            bits |= 1 << n;
        }
        n += 1;
    }
    bits
};

/// Errors.
const ERRORS: Bits = {
    let mut bits = 0;
    let mut n = 0;
    while n < STATUS_BITS.len() {
        #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
        if STATUS_BITS[n].bit < 16 {
            bits |= 1 << n;
        }
        n += 1;
    }
    bits
};

/// Statusword: state, target reached, internal limit. The page names no others, and the maker's guide
/// expects exactly 0x27 of operation enabled (M4).
const STATUSWORD_BITS: u16 = 0x0C6F;
const INTERNAL_LIMIT: u16 = 1 << 11;

/// Above it the current is no reading of a sound board, A: a fifth beyond what the board gives.
const OVERCURRENT_A: f32 = 96.0;
const OVERVOLTAGE_V: f32 = 56.0;
const UNDERVOLTAGE_V: f32 = 10.0;
const MOSFET_C: f32 = 100.0;
/// Of half the converter's range.
const ADC_OFFSET_PART: f32 = 0.05;
/// 10 degrees of the output, in its counts.
const POSITION_MARGIN: i64 = COUNTS_PER_TURN as i64 / 36;

const ENCODER_TICKS: u16 = 5;
const UNDERVOLTAGE_TICKS: u16 = 10;

/// Where a start is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// The bridge is open, and the converters settle.
    Begun,
    /// Their zeros are known with this tick.
    Ends,
    /// It is over.
    Over,
}

/// The status words, and what makes them.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// Bits that are set.
    set: Bits,
    /// A mode of motion needed what was not set up.
    set_up_missed: bool,
    /// A limit was at work since the start (M22).
    limited: bool,
    /// Ticks in a row.
    encoder_silent: u16,
    magnet_bad: u16,
    output_magnet_bad: u16,
    bridge: Bridge,
    /// What the board said last.
    board: Option<Board>,
    undervoltage: u16,
    /// The encoder has answered once.
    encoder_seen: bool,
    output_seen: bool,
    /// Ticks since the last frame for the drive.
    silent_ms: u32,
    /// The watchdog has just run out.
    silence: bool,
}

impl Watch {
    pub(super) fn new() -> Watch {
        Watch {
            set: 0,
            set_up_missed: false,
            limited: false,
            encoder_silent: 0,
            magnet_bad: 0,
            output_magnet_bad: 0,
            bridge: Bridge::default(),
            board: None,
            undervoltage: 0,
            encoder_seen: false,
            output_seen: false,
            silent_ms: 0,
            silence: false,
        }
    }

    /// A frame for the drive.
    pub(super) fn fed(&mut self) {
        self.silent_ms = 0;
    }

    /// What the board says.
    pub(super) fn look_at(&mut self, board: &Board) {
        self.board = Some(*board);
    }

    /// Whether there is an error, not a warning.
    pub(super) fn has_error(&self) -> bool {
        self.set & ERRORS != 0
    }

    /// Whether the main encoder is known to count the other way round.
    pub(super) fn is_turned(&self) -> bool {
        self.set & one(1, 1) != 0
    }

    /// Whether the watchdog has run out since the last call.
    pub(super) fn take_silence(&mut self) -> bool {
        core::mem::take(&mut self.silence)
    }

    /// A fault reset: warnings and errors that are not critical end.
    pub(super) fn reset(&mut self) {
        self.set &= CRITICAL;
        self.set_up_missed = false;
    }

    /// A calibration begins.
    pub(super) fn forget_calibration(&mut self) {
        self.set &= !CALIBRATION;
    }

    /// A calibration has failed.
    pub(super) fn raise(&mut self, bits: Bits) {
        self.set |= bits;
    }

    /// A millisecond more; `offset` makes the motor's position the output's, counts of the motor.
    pub(super) fn tick(
        &mut self,
        image: &Image<'_>,
        view: &AxisView,
        output: &OutputEncoder,
        offset: i32,
        start: Start,
    ) {
        let moves = moves(view);
        let levels = self.levels(image);
        self.set = self.set & !LEVELS | levels;
        self.set |= self.of_hardware(image, view, output, start);
        if moves {
            self.set |= of_motion(image, view, offset);
            self.set_up_missed |= levels & (SET_UP | one(1, 2)) != 0;
        }
        self.limited |= view.conditions.limited();
        self.watch_bus(image, moves);
    }

    /// What holds as long as it is so.
    fn levels(&self, image: &Image<'_>) -> Bits {
        let needed = [
            FIELDS.pole_pairs,
            FIELDS.torque_constant,
            FIELDS.inductance,
            FIELDS.resistance,
            FIELDS.bandwidth,
        ];
        let mut bits = 0;
        let mut when = |bit: Bits, is: bool| {
            if is {
                bits |= bit;
            }
        };
        let is = |field| image.number(field) != 0;
        when(SET_UP, needed.iter().any(|field| image.raw(*field) == 0));
        when(one(1, 2), !is(FIELDS.is_calibrated));
        when(one(1, 30), is(FIELDS.low_accuracy));
        let used = is_calibratable(image);
        when(one(2, 2), used && !is(FIELDS.output_is_calibrated));
        when(one(2, 30), used && is(FIELDS.output_low_accuracy));
        bits
    }

    fn of_hardware(
        &mut self,
        image: &Image<'_>,
        view: &AxisView,
        output: &OutputEncoder,
        start: Start,
    ) -> Bits {
        let mut bits = 0;
        let mut when = |bit: Bits, is: bool| {
            if is {
                bits |= bit;
            }
        };
        let started = start != Start::Begun;
        self.encoder_seen |= view.encoder_valid;
        self.encoder_silent = in_a_row(self.encoder_silent, !view.encoder_valid);
        self.magnet_bad = in_a_row(self.magnet_bad, !view.magnet_is_good);
        when(one(1, 0), self.encoder_silent >= ENCODER_TICKS);
        when(one(1, 5), self.magnet_bad >= ENCODER_TICKS);
        when(one(1, 6), started && !self.encoder_seen);
        let answers = view.output_encoder.is_some();
        self.output_seen |= answers;
        when(one(2, 0), output.is_configured() && !answers);
        let never = output.is_configured() && !self.output_seen;
        when(one(2, 6), started && never);

        let magnet = self.board.and_then(|board| board.output_magnet);
        let is_bad = magnet.is_some_and(|magnet| magnet != Magnet::Good);
        self.output_magnet_bad = in_a_row(self.output_magnet_bad, is_bad);
        let too_long = self.output_magnet_bad >= ENCODER_TICKS;
        when(one(2, 5), output.is_configured() && too_long);

        when(one(4, 1), view.overcurrent);
        let [d, q] = view.current_a;
        when(one(5, 0), d * d + q * q > OVERCURRENT_A * OVERCURRENT_A);
        when(one(5, 1), view.bus_voltage_v > OVERVOLTAGE_V);
        self.undervoltage = in_a_row(
            self.undervoltage,
            started && view.bus_voltage_v < UNDERVOLTAGE_V,
        );
        when(one(5, 2), self.undervoltage >= UNDERVOLTAGE_TICKS);
        let shutdown = image.number(FIELDS.shutdown_temperature) as f32;
        when(
            one(5, 3),
            shutdown > 0.0 && view.motor_temperature_c > shutdown,
        );
        when(one(5, 4), view.amplifier_temperature_c > MOSFET_C);
        let [a, b] = view.phase_adc.map(|adc| {
            let off = adc - view.phase_adc_zero;
            if off < 0.0 { -off } else { off }
        });
        let most = ADC_OFFSET_PART * view.phase_adc_zero;
        when(one(5, 5), start == Start::Ends && (a > most || b > most));
        match &self.board {
            Some(board) => bits | self.bridge.tick(&board.gate_driver, view.overcurrent),
            None => bits,
        }
    }

    fn watch_bus(&mut self, image: &Image<'_>, moves: bool) {
        let limit = image.raw(FIELDS.watchdog_ms);
        if !moves || limit == 0 {
            self.silent_ms = 0;
            return;
        }
        self.silent_ms = self.silent_ms.saturating_add(1);
        if self.silent_ms >= limit {
            self.silent_ms = 0;
            self.set |= SILENCE;
            self.silence = true;
        }
    }

    /// The causes of errors that are announced.
    pub(super) fn causes(&self) -> u32 {
        let mut causes = 0;
        for n in 0..STATUS_BITS.len() {
            let is_set = match 1 << n {
                // Shown while it is so, and a fault once it mattered.
                SET_UP => self.set_up_missed,
                bit => self.set & bit != 0,
            };
            if let (true, Some(number)) = (is_set, cause(n)) {
                causes |= 1u32.checked_shl(number.into()).unwrap_or(0);
            }
        }
        causes
    }

    /// Status words and statusword.
    pub(super) fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        let mut words = [0u32; WORDS];
        for (n, bit) in STATUS_BITS.iter().enumerate() {
            let word = words.get_mut(usize::from(bit.sub).wrapping_sub(1));
            if let (true, Some(word)) = (self.set & (1 << n) != 0, word) {
                *word |= 1u32.checked_shl(bit.bit.into()).unwrap_or(0);
            }
        }
        for (field, word) in FIELDS.status.into_iter().zip(words) {
            image.set_raw(field, word);
        }
        let limited = self.limited || view.conditions.limited();
        let limit = if limited { INTERNAL_LIMIT } else { 0 };
        let statusword = view.statusword & STATUSWORD_BITS | limit;
        image.set_raw(FIELDS.statusword, u32::from(statusword));
    }
}

/// A mode of motion is at work.
pub(super) fn moves(view: &AxisView) -> bool {
    view.state == State::OperationEnabled && !matches!(view.mode, Mode::IDLE | SERVICE)
}

fn in_a_row(ticks: u16, is: bool) -> u16 {
    if is { ticks.saturating_add(1) } else { 0 }
}

/// Errors and warnings of a mode of motion.
fn of_motion(image: &Image<'_>, view: &AxisView, offset: i32) -> Bits {
    let mut bits = 0;
    let mut when = |bit: Bits, is: bool| {
        if is {
            bits |= bit;
        }
    };
    let ratio = image.real(FIELDS.gear);
    let gear = if ratio > 0.0 { ratio } else { 1.0 };
    let position = view.position.wrapping_add(offset);
    let position = (f64::from(position) * f64::from(gear)) as i64;
    let limits = (
        image.number(FIELDS.least_position),
        image.number(FIELDS.greatest_position),
    );
    let beyond = position < limits.0.saturating_sub(POSITION_MARGIN)
        || position > limits.1.saturating_add(POSITION_MARGIN);
    when(
        one(7, 0),
        limits != (0, 0) && limits.0 <= limits.1 && beyond,
    );
    let rpm = view.velocity * gear * 60.0 / COUNTS_PER_TURN as f32;
    let speed = if rpm < 0.0 { -rpm } else { rpm };
    let most = image.real(FIELDS.max_speed);
    when(one(7, 1), most > 0.0 && speed > most * 1.2 + 10.0);
    let seen = &view.conditions;
    let profile = matches!(view.mode, Mode::PROFILE_POSITION | Mode::PROFILE_VELOCITY);
    when(one(7, 24), profile && seen.acceleration_limited);
    when(one(7, 25), seen.torque_limited);
    when(one(7, 26), seen.velocity_limited || view.velocity_limited);
    when(one(7, 27), seen.position_limited());
    bits
}
