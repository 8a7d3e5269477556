//! What the document and the controller's manual call modes, flags and errors.

use canopen::Address;
use cia402::Mode;

use crate::Words;

pub(super) const WORDS: Words = Words {
    // Table 1.
    modes: &[
        (-4, "velocity, by position"),
        (-3, "profile velocity, by position"),
        (-2, "position tracking"),
        (-1, "position relative"),
        (0, "open loop"),
    ],
    mode_bits: &[
        (-4, Mode::VELOCITY),
        (-3, Mode::PROFILE_VELOCITY),
        (-1, Mode::PROFILE_POSITION),
    ],
    bits: &BITS,
    errors: &[
        (0x5500, "stored parameters damaged"),
        (0x7305, "encoder"),
        (0x8400, "closed loop error"),
        (0x9000, "emergency stop"),
    ],
};

/// The bits of FS and FF, and of FM for each channel.
const BITS: [(Address, u8, &str); 36] = [
    status(0, "serial commands"),
    status(1, "pulse commands"),
    status(2, "analog commands"),
    status(3, "power stage off"),
    status(4, "stall detected"),
    status(5, "at limit"),
    status(7, "script running"),
    fault(0, "too hot"),
    fault(1, "over-voltage"),
    fault(2, "under-voltage"),
    fault(3, "short circuit"),
    fault(4, "emergency stop"),
    fault(5, "encoder"),
    fault(6, "MOSFET failure"),
    fault(7, "default configuration"),
    motor(1, 0, "current limit"),
    motor(1, 1, "stalled"),
    motor(1, 2, "loop error"),
    motor(1, 3, "safety stop"),
    motor(1, 4, "forward limit"),
    motor(1, 5, "reverse limit"),
    motor(1, 6, "current trigger"),
    motor(2, 0, "current limit"),
    motor(2, 1, "stalled"),
    motor(2, 2, "loop error"),
    motor(2, 3, "safety stop"),
    motor(2, 4, "forward limit"),
    motor(2, 5, "reverse limit"),
    motor(2, 6, "current trigger"),
    motor(3, 0, "current limit"),
    motor(3, 1, "stalled"),
    motor(3, 2, "loop error"),
    motor(3, 3, "safety stop"),
    motor(3, 4, "forward limit"),
    motor(3, 5, "reverse limit"),
    motor(3, 6, "current trigger"),
];

const fn status(bit: u8, name: &'static str) -> (Address, u8, &'static str) {
    (Address::new(0x2111, 0), bit, name)
}

const fn fault(bit: u8, name: &'static str) -> (Address, u8, &'static str) {
    (Address::new(0x2112, 0), bit, name)
}

const fn motor(channel: u8, bit: u8, name: &'static str) -> (Address, u8, &'static str) {
    (Address::new(0x2122, channel), bit, name)
}
