//! What the drive knows and its page has no object for. No master sees these rows.

use canopen::Group::Application;
use canopen::Row;
use canopen::row::{f32, i8, i16, i32, u8};

/// A converter's reading at no current, counts.
const fn measured(index: u16, name: &'static str) -> Row {
    f32(index, 0, name)
        .default_value(canopen::Default::Real(2048.0))
        .internal()
}

/// What a calibration has found, kept with the parameters.
const fn found(row: Row) -> Row {
    row.store(Application).internal()
}

/// Counts of the encoder, a 14-bit AS5047, on the motor's shaft.
pub(super) const COUNTS_PER_TURN: u32 = 1 << 14;
/// PWM and loops, Hz.
pub(super) const LOOP_HZ: f32 = 40_000.0;
/// Greatest current of the board, A of phase amplitude.
pub const BOARD_CURRENT_A: f32 = 80.0;

/// Reading of the encoder with the rotor under phase A.
pub(super) const ELECTRICAL_ZERO: u16 = 0x0020;
/// Order of the phases against the encoder's direction.
pub(super) const ELECTRICAL_POLARITY: u16 = 0x0021;
/// 1 once a calibration has found both.
pub(super) const IS_CALIBRATED: u16 = 0x0022;
/// 1 if that found the encoder's accuracy low.
pub(super) const LOW_ACCURACY: u16 = 0x0023;
pub(super) const CURRENT_ZERO_A: u16 = 0x0024;
pub(super) const CURRENT_ZERO_B: u16 = 0x0025;
/// Reading of the encoder that is position 0.
pub(super) const ZERO: u16 = 0x0026;
/// Reading of the output encoder, turns, where the output's position is 0.
pub(super) const OUTPUT_ZERO: u16 = 0x0027;
/// Direction of the output encoder against the output's.
pub(super) const OUTPUT_DIRECTION: u16 = 0x0028;
/// 1 once the output encoder's calibration has found both.
pub(super) const OUTPUT_IS_CALIBRATED: u16 = 0x0029;
/// 1 if that found its accuracy low.
pub(super) const OUTPUT_LOW_ACCURACY: u16 = 0x002A;
/// How much the encoder reads too much at each place of a turn, sixteenths of a count,
pub(super) const CORRECTION: u16 = 0x0030;
/// and the output encoder.
pub(super) const OUTPUT_CORRECTION: u16 = 0x0031;
/// Places of a turn in these tables.
pub(super) const PLACES: usize = 32;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    found(i32(ELECTRICAL_ZERO, 0, "Electrical zero")),
    found(i8(ELECTRICAL_POLARITY, 0, "Electrical polarity").default(1)),
    found(u8(IS_CALIBRATED, 0, "Calibrated")),
    found(u8(LOW_ACCURACY, 0, "Low accuracy")),
    // Measured at each start.
    measured(CURRENT_ZERO_A, "Current zero, phase A"),
    measured(CURRENT_ZERO_B, "Current zero, phase B"),
    found(i32(ZERO, 0, "Zero of position")),
    found(f32(OUTPUT_ZERO, 0, "Output encoder zero")),
    found(i8(OUTPUT_DIRECTION, 0, "Output encoder direction").default(1)),
    found(u8(OUTPUT_IS_CALIBRATED, 0, "Output encoder calibrated")),
    found(u8(OUTPUT_LOW_ACCURACY, 0, "Output encoder low accuracy")),
    found(i16(CORRECTION, 1, "Encoder correction")).subs(PLACES as u8),
    found(i16(OUTPUT_CORRECTION, 1, "Output encoder correction")).subs(PLACES as u8),
];
