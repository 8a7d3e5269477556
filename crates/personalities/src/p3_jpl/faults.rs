//! What sets bits of 0x1001: bit 0 with any other, bit 1 for current, bit 3 for temperature. There are
//! no emergencies, and no error codes in the manual (J19: "See Table ?"): those here are never sent.
//! Nothing resets a fault but NMT "reset node" or the power (J17).

use super::OBJECTS_CONST;
use super::properties::{OVER_TEMPERATURE, object};
use crate::p3::faults::row;
use crate::{Cause, FaultRow, Kind, States, Switch};

use Kind::{Fault, Warning};
use States::All;
use Switch::Always;

/// The temperature at which amplifier and motor are switched off.
const TOO_HOT: Switch = Switch::Object(object(&OBJECTS_CONST, OVER_TEMPERATURE, 1.0 / 256.0));

pub(super) static TABLE: [FaultRow; 6] = [
    row(Cause::ParameterError, 0x6320, Fault, 0, 32, All, Always),
    row(Cause::EncoderFeedback, 0x7320, Fault, 0, 32, All, Always),
    // The current is held back (I²t): the bit ends with it.
    row(Cause::CurrentLimit, 0x2310, Warning, 1, 32, All, Always),
    row(Cause::ShortCircuit, 0x2320, Fault, 1, 32, All, Always),
    row(
        Cause::AmplifierTemperature,
        0x4210,
        Fault,
        3,
        32,
        All,
        TOO_HOT,
    ),
    row(Cause::MotorTemperature, 0x4310, Fault, 3, 32, All, TOO_HOT),
];
