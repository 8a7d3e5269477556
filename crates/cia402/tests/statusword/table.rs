//! The table of the statusword's bits.

use cia402::Mode;

use crate::{common, cyclic, homing, interpolated, position, speed, torque};

/// A bit that does something.
pub(crate) struct Row {
    pub(crate) bit: u32,
    /// What the standard calls it.
    pub(crate) name: &'static str,
    pub(crate) set: &'static str,
    pub(crate) cleared: &'static str,
    /// Panics if the bit does otherwise.
    pub(crate) check: fn(Mode),
}

/// The bits that do the same in every mode and state.
pub(crate) const COMMON: [Row; 4] = [
    Row {
        bit: 4,
        name: "voltage enabled",
        set: "the motor supply is there",
        cleared: "it is not",
        check: common::voltage,
    },
    Row {
        bit: 7,
        name: "warning",
        set: "a warning is there",
        cleared: "there is none",
        check: common::warning,
    },
    Row {
        bit: 9,
        name: "remote",
        set: "always",
        cleared: "never; the P3 has no such bit, 0",
        check: common::remote,
    },
    Row {
        bit: 11,
        name: "internal limit",
        set: "under power, the controllers are at a limit of torque, current, voltage or speed; in \
              some modes something else, too, see there",
        cleared: "they are not",
        check: common::controllers,
    },
];

/// A mode, and the bits that it uses in operation enabled. All others are 0.
pub(crate) struct Uses {
    pub(crate) mode: Mode,
    pub(crate) rows: &'static [Row],
}

pub(crate) const HALTED: &str = "; halted: the axis stands";

pub(crate) const TABLE: [Uses; 12] = [
    Uses {
        mode: Mode::IDLE,
        rows: &[],
    },
    Uses {
        mode: Mode::PROFILE_POSITION,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the profile has ended and the position has been within 0x6067 for 0x6068; halted: the axis stands",
                cleared: "a set-point comes into process; the position leaves the window; a halt begins or ends",
                check: position::position_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target lies beyond 0x607D; on the way, the speed or a rate was cut to a limit",
                cleared: "the next set-point comes into process, or the way has ended",
                check: position::position_limited,
            },
            Row {
                bit: 12,
                name: "set-point acknowledge",
                set: "controlword bit 4 rises and the set-point is taken",
                cleared: "bit 4 is 0 and the buffer has room for one more",
                check: position::acknowledge,
            },
            Row {
                bit: 13,
                name: "following error",
                set: "the following error has exceeded 0x6065 for longer than 0x6066, or the fault window for its time",
                cleared: "it is back within",
                check: position::following,
            },
        ],
    },
    Uses {
        mode: Mode::VELOCITY,
        rows: &[
            Row {
                bit: 10,
                name: "target reached (reserved in the standard)",
                set: "the ramp has come to the target, or to zero if bits 4 or 6 say so, and the velocity is within 10 rpm and 2 % of it; halted: the axis stands",
                cleared: "the target or one of the bits 4, 5, 6 changes; the velocity leaves the window; a halt begins or ends",
                check: speed::vl_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x607F or 0x6080; on the ramp, a rate was cut to 0x60C5 or 0x60C6",
                cleared: "it does not; the ramp has ended",
                check: speed::vl_limited,
            },
        ],
    },
    Uses {
        mode: Mode::PROFILE_VELOCITY,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the ramp has come to the target and the velocity is within 10 rpm and 2 % of it; halted: the axis stands",
                cleared: "the target changes; the velocity leaves the window; a halt begins or ends",
                check: speed::velocity_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x607F or 0x6080; on the ramp, a rate was cut to 0x60C5 or 0x60C6",
                cleared: "it does not; the ramp has ended",
                check: speed::velocity_limited,
            },
            Row {
                bit: 12,
                name: "speed is zero",
                set: "the speed is at most 10 rpm",
                cleared: "it is greater",
                check: speed::speed_is_zero,
            },
        ],
    },
    Uses {
        mode: Mode::PROFILE_TORQUE,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the torque demand has come to the target on its slope; halted: the axis stands",
                cleared: "the target changes; a halt begins or ends",
                check: torque::torque_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x6072",
                cleared: "it does not",
                check: torque::torque_limited,
            },
        ],
    },
    Uses {
        mode: Mode::HOMING,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "homing was not started or was interrupted; it has ended and the axis holds; halted: the axis stands",
                cleared: "homing starts",
                check: homing::homing_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the speed was cut to 0x607F or 0x6080",
                cleared: "it was not",
                check: homing::homing_limited,
            },
            Row {
                bit: 12,
                name: "homing attained",
                set: "home is found",
                cleared: "homing starts",
                check: homing::homing_attained,
            },
            Row {
                bit: 13,
                name: "homing error",
                set: "homing has failed",
                cleared: "homing starts",
                check: homing::homing_error,
            },
        ],
    },
    Uses {
        mode: Mode::INTERPOLATED_POSITION,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the buffer has run empty and the position has been within 0x6067 of the last set-point for 0x6068; halted: the axis stands",
                cleared: "the next set-point comes into process; a halt begins or ends",
                check: interpolated::interpolated_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point in process lies beyond 0x607D, or is too far for 0x607F or 0x6080",
                cleared: "the next one does not; it is reached",
                check: interpolated::interpolated_limited,
            },
            Row {
                bit: 12,
                name: "interpolation active",
                set: "controlword bit 4 is 1 and a set-point is in process",
                cleared: "bit 4 is 0; the buffer has run empty",
                check: interpolated::interpolation_active,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_POSITION,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point lies beyond 0x607D, or is too far for 0x607F or 0x6080",
                cleared: "the next one does not; it is reached",
                check: cyclic::cyclic_position_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: cyclic::follows,
            },
            Row {
                bit: 13,
                name: "following error",
                set: "the following error has exceeded 0x6065 for longer than 0x6066, or the fault window for its time",
                cleared: "it is back within",
                check: position::following,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_VELOCITY,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x607F or 0x6080, or is too far for 0x60C5 or 0x60C6",
                cleared: "the next one does not; it is reached",
                check: cyclic::cyclic_velocity_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: cyclic::follows,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_TORQUE,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x6072",
                cleared: "the next one does not",
                check: cyclic::cyclic_torque_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: cyclic::follows,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_TORQUE_WITH_ANGLE,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x6072",
                cleared: "the next one does not",
                check: cyclic::cyclic_torque_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: cyclic::follows,
            },
        ],
    },
    Uses {
        mode: Mode::PHASE_VOLTAGE_WITH_ANGLE,
        rows: &[],
    },
];
