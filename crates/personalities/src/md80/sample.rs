//! The sample motor: what a commissioned drive has stored.

use canopen::Address;

use super::internal;
use crate::Setting;

const fn setting(index: u16, sub: u8, bytes: &'static [u8]) -> Setting {
    Setting {
        object: Address::new(index, sub),
        bytes,
    }
}

macro_rules! real {
    ($index:expr, $sub:expr, $value:expr) => {
        setting($index, $sub, &f32::to_le_bytes($value))
    };
}

/// A T-Motor AK80-9 with a gear of 9:1, as the maker's own configuration file has it, and what a
/// calibration finds of it: 85 mΩ and 28.5 µH of a phase, half of what the motor's data sheet says
/// between two terminals, and the place of the encoder's magnet.
///
/// The maker's file limits the torque to 1 Nm and the current to 20 A; the profile's velocity of
/// 20 rad/s is 191 RPM. Its limit of velocity, 50 rad/s, and the accelerations are no objects that
/// this page keeps.
pub const SAMPLE_MOTOR: &[Setting] = &[
    setting(0x2000, 1, &21u32.to_le_bytes()),
    real!(0x2000, 2, 0.091),
    real!(0x2000, 3, 28.5e-6),
    real!(0x2000, 4, 0.085),
    setting(0x2000, 5, &500u16.to_le_bytes()),
    setting(0x2000, 6, b"AK80_9"),
    setting(0x2000, 7, &[80]),
    real!(0x2000, 8, 0.111_11),
    real!(0x2001, 1, 2.0),
    real!(0x2001, 2, 0.5),
    real!(0x2001, 4, 0.1),
    real!(0x2002, 1, 30.0),
    real!(0x2002, 2, 0.5),
    real!(0x2002, 4, 1.0),
    setting(0x6072, 0, &1000u16.to_le_bytes()),
    setting(0x6073, 0, &20_000u16.to_le_bytes()),
    setting(0x6075, 0, &1000i32.to_le_bytes()),
    setting(0x6076, 0, &1000i32.to_le_bytes()),
    setting(0x6081, 0, &191u32.to_le_bytes()),
    setting(internal::ELECTRICAL_ZERO, 0, &SAMPLE_ZERO.to_le_bytes()),
    setting(internal::IS_CALIBRATED, 0, &[1]),
];

/// Reading of the sample motor's encoder with the rotor under phase A, counts.
const SAMPLE_ZERO: i32 = 5000;
