//! What the drive knows and its page has no object for. No master sees these rows.

use canopen::Group::Application;
use canopen::Row;
use canopen::row::{f32, i8, i32, u8, u32};

/// A fixed figure.
const fn figure(index: u16, name: &'static str, value: f32) -> Row {
    f32(index, 0, name)
        .default_value(canopen::Default::Real(value))
        .internal()
}

/// What a calibration has found, kept with the parameters.
const fn found(row: Row) -> Row {
    row.store(Application).internal()
}

/// Counts of the encoder, a 14-bit AS5047, on the motor's shaft.
pub(super) const COUNTS_PER_TURN: u32 = 1 << 14;
/// PWM and loops, Hz.
pub(super) const LOOP_HZ: i64 = 40_000;
/// Greatest current of the board, A of phase amplitude.
pub const BOARD_CURRENT_A: f32 = 80.0;

pub(super) const ENCODER_RESOLUTION: u16 = 0x0020;
pub(super) const LOOP_FREQUENCY: u16 = 0x0021;
/// Reading of the encoder with the rotor under phase A.
pub(super) const ELECTRICAL_ZERO: u16 = 0x0022;
/// Order of the phases against the encoder's direction.
pub(super) const ELECTRICAL_POLARITY: u16 = 0x0023;
/// 1 once a calibration has found both.
pub(super) const IS_CALIBRATED: u16 = 0x0024;
pub(super) const CURRENT_ZERO_A: u16 = 0x0025;
pub(super) const CURRENT_ZERO_B: u16 = 0x0026;
pub(super) const BOARD_CURRENT: u16 = 0x0027;
pub(super) const LONGEST_VOLTAGE: u16 = 0x0028;
/// Age of a reading of the encoder, s.
pub(super) const ENCODER_LAG: u16 = 0x0029;
/// A figure of 0, for limits that this drive has not.
pub(super) const NONE: u16 = 0x002A;
/// Reading of the encoder that is position 0.
pub(super) const ZERO: u16 = 0x002B;
/// Position of the output encoder, rad, where the output's position is 0.
pub(super) const OUTPUT_OFFSET: u16 = 0x002C;
/// Direction of the output encoder against the output's.
pub(super) const OUTPUT_DIRECTION: u16 = 0x002D;
/// 1 once the output encoder's calibration has found both.
pub(super) const OUTPUT_IS_CALIBRATED: u16 = 0x002E;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    u32(ENCODER_RESOLUTION, 0, "Encoder resolution").default(COUNTS_PER_TURN as i64).internal(),
    u32(LOOP_FREQUENCY, 0, "PWM frequency").default(LOOP_HZ).internal(),
    found(i32(ELECTRICAL_ZERO, 0, "Electrical zero")),
    found(i8(ELECTRICAL_POLARITY, 0, "Electrical polarity").default(1)),
    found(u8(IS_CALIBRATED, 0, "Calibrated")),
    // Measured at each start.
    figure(CURRENT_ZERO_A, "Current zero, phase A", 2048.0),
    figure(CURRENT_ZERO_B, "Current zero, phase B", 2048.0),
    figure(BOARD_CURRENT, "Greatest current", BOARD_CURRENT_A),
    figure(LONGEST_VOLTAGE, "Longest voltage vector", 100.0),
    figure(ENCODER_LAG, "Encoder lag", 0.0),
    figure(NONE, "No limit", 0.0),
    found(i32(ZERO, 0, "Zero of position")),
    found(f32(OUTPUT_OFFSET, 0, "Output encoder offset")),
    found(i8(OUTPUT_DIRECTION, 0, "Output encoder direction").default(1)),
    found(u8(OUTPUT_IS_CALIBRATED, 0, "Output encoder calibrated")),
];
