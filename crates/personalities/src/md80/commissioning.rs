//! The calibrations of 0x2003 as a master gives and follows them.

use canopen::Address;

use super::axis::SERVICE;
use super::status::STATUS;
use crate::commissioning::{Commissioning, OwnCalibration, SetUp};

const fn command(sub: u8) -> Address {
    Address::new(0x2003, sub)
}

const fn status(sub: u8) -> Address {
    Address::new(STATUS, sub)
}

const fn needed(name: &'static str, index: u16, sub: u8) -> SetUp {
    SetUp {
        name,
        object: Address::new(index, sub),
        needed: true,
    }
}

const fn used(name: &'static str, index: u16, sub: u8) -> SetUp {
    SetUp {
        needed: false,
        ..needed(name, index, sub)
    }
}

const RESULTS: &[Address] = &[Address::new(0x2000, 4), Address::new(0x2000, 3)];

pub(super) const COMMISSIONING: Commissioning = Commissioning {
    calibrations: &[
        OwnCalibration {
            name: "motor",
            what: "resistance, inductance, pole pairs, and how the encoder sits on the rotor",
            command: command(3),
            mode: SERVICE.0,
            probe: command(1),
            // M12.
            set_up: &[
                needed("pole-pairs", 0x2000, 1),
                needed("torque-constant", 0x2000, 2),
                needed("bandwidth", 0x2000, 5),
                used("gear-ratio", 0x2000, 8),
                used("calibration-mode", 0x2000, 9),
                used("rated-current", 0x6075, 0),
                used("max-current", 0x6073, 0),
            ],
            results: RESULTS,
            status: &[status(1), status(3)],
            failed: Some((status(1), 4)),
            restarts: true,
            longest_s: 120,
        },
        OwnCalibration {
            name: "output-encoder",
            what: "how the encoder of the output sits on it",
            command: command(4),
            mode: SERVICE.0,
            probe: command(1),
            set_up: &[
                needed("type", 0x2005, 1),
                needed("mode", 0x2005, 3),
                used("calibration-mode", 0x2005, 2),
            ],
            results: &[],
            status: &[status(2)],
            failed: Some((status(2), 4)),
            restarts: true,
            longest_s: 120,
        },
        OwnCalibration {
            name: "current-gains",
            what: "resistance and inductance, of which the current controllers' gains follow",
            command: command(6),
            mode: SERVICE.0,
            probe: command(1),
            set_up: &[
                needed("bandwidth", 0x2000, 5),
                used("rated-current", 0x6075, 0),
                used("max-current", 0x6073, 0),
            ],
            results: RESULTS,
            status: &[status(1), status(3)],
            failed: Some((status(1), 4)),
            restarts: false,
            longest_s: 60,
        },
    ],
    calibrating: Some("it calibrates itself"),
    tuning: Some(
        "its controllers have gains and no bandwidth: 0x2001 is the velocity's, 0x2002 the position's; \
         servobus sdo write sets them",
    ),
};
