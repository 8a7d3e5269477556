//! Roboteq motor controllers with one, two or three channels, as "DS402 Implementation on Roboteq Motor
//! Controllers" V1.0 of 2018-02-24 describes them.
//!
//! Where the document is silent or contradicts itself, the rows say in a comment what is built; the
//! numbers R1 to R25 name the decisions, which the drive's page in the documentation lists. What the
//! document does not have of CiA 301, and of the controller's own commands by CAN, is as in the data
//! sheet that the maker gives to everybody.

mod axis;
pub mod command_line;
mod communication;
mod faults;
mod motor;
mod operation;
pub(crate) mod own;
mod words;

use can::BitRate;
use canopen::{Device, Dictionary, Row, dictionary};
use cia402::Mode;

use crate::commissioning::Commissioning;
use crate::own::OwnKind;
use crate::{ErrorRules, FaultRow, Personality, SupplyRules};

const CHANNEL_1: [Row; axis::ROWS] = axis::rows(0);
const CHANNEL_2: [Row; axis::ROWS] = axis::rows(1);
const CHANNEL_3: [Row; axis::ROWS] = axis::rows(2);

const ROWS_1: &[&[Row]] = &[communication::ROWS, communication::PDO_ROWS, &CHANNEL_1];
const ROWS_2: &[&[Row]] = &[
    communication::ROWS,
    communication::PDO_ROWS,
    &CHANNEL_1,
    &CHANNEL_2,
];
const ROWS_3: &[&[Row]] = &[
    communication::ROWS,
    communication::PDO_ROWS,
    &CHANNEL_1,
    &CHANNEL_2,
    &CHANNEL_3,
];

/// The object dictionary of one channel.
pub static OBJECTS_1: Dictionary<{ dictionary::count(ROWS_1) }> = dictionary::layout(ROWS_1);
/// The object dictionary of two channels.
pub static OBJECTS_2: Dictionary<{ dictionary::count(ROWS_2) }> = dictionary::layout(ROWS_2);
/// The object dictionary of three channels.
pub static OBJECTS_3: Dictionary<{ dictionary::count(ROWS_3) }> = dictionary::layout(ROWS_3);

const ONE: Dictionary<{ dictionary::count(ROWS_1) }> = dictionary::layout(ROWS_1);
const TWO: Dictionary<{ dictionary::count(ROWS_2) }> = dictionary::layout(ROWS_2);
const THREE: Dictionary<{ dictionary::count(ROWS_3) }> = dictionary::layout(ROWS_3);

/// The document has neither calibration nor gains.
const COMMISSIONING: Commissioning = Commissioning {
    calibrations: &[],
    calibrating: Some(
        "its document has no calibration, neither by CAN nor by the serial line; the motor is set up \
         with the maker's own tool",
    ),
    tuning: Some(
        "its document has no gains, neither by CAN nor by the serial line; they are set with the maker's \
         own tool",
    ),
};

/// Its CANopen.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    tpdo_forbids_remote: true,
    produces_sync: false,
    extended_identifiers: false,
    lss: false, // not mentioned
    ..canopen::Dialect::STANDARD
};

/// Its CiA 402.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    modes: axis::MODES,
    ..cia402::Dialect::STANDARD
};

/// The mode of CiA 402 that the axis is in for a number of 0x6060 (table 1); `None` for others.
pub const fn mode(number: i8) -> Option<Mode> {
    Some(match number {
        0 => Mode::IDLE, // open loop
        1 | -1 => Mode::PROFILE_POSITION,
        -2 => Mode::CYCLIC_POSITION, // without a profile
        2 | -4 => Mode::VELOCITY,
        3 | -3 => Mode::PROFILE_VELOCITY,
        4 => Mode::PROFILE_TORQUE,
        _ => return None,
    })
}

const BIT_RATES: &[BitRate] = &[
    BitRate::Kbit125,
    BitRate::Kbit250,
    BitRate::Kbit500,
    BitRate::Kbit800,
    BitRate::Mbit1,
];

const FAULTS_1: &[FaultRow] = &faults::table(&ONE);
const FAULTS_2: &[FaultRow] = &faults::table(&TWO);
const FAULTS_3: &[FaultRow] = &faults::table(&THREE);

/// What the channels share.
const COMMON: Personality = Personality {
    name: "roboteq",
    title: "Roboteq controller (DS402, 2018), one channel",
    device: Device::new(&OBJECTS_1, CANOPEN),
    bit_rates: BIT_RATES,
    cia402: CIA402,
    axes: &[axis::channel(&ONE, 0)],
    faults: FAULTS_1,
    own_causes: faults::OWN_CAUSES,
    errors: ErrorRules {
        bus_off_leaves_state: false,
        keeps_last_code: false,
        names_ended_error: true,
    },
    supply: SupplyRules {
        present_v: 0.0, // R5: bit 4 is always 1
        limit_time_ms: 10,
    },
    error_code: None,
    status_register: None,
    serial_number: ONE.optional(0x1018, 4),
    serial: Some(&command_line::SERIAL),
    node_id: None,
    stores_single_entry: None,
    termination: None,
    words: words::WORDS,
    operation: operation::OPERATION,
    commissioning: COMMISSIONING,
    own: OwnKind::Roboteq,
    commissioned: &[],
    host: None,
};

/// A controller with one channel.
pub static ROBOTEQ: Personality = COMMON;

/// A controller with two channels.
pub static ROBOTEQ_2: Personality = Personality {
    name: "roboteq-2",
    title: "Roboteq controller (DS402, 2018), two channels",
    device: Device::new(&OBJECTS_2, CANOPEN),
    axes: &[axis::channel(&TWO, 0), axis::channel(&TWO, 1)],
    faults: FAULTS_2,
    serial_number: TWO.optional(0x1018, 4),
    ..COMMON
};

/// A controller with three channels.
pub static ROBOTEQ_3: Personality = Personality {
    name: "roboteq-3",
    title: "Roboteq controller (DS402, 2018), three channels",
    device: Device::new(&OBJECTS_3, CANOPEN),
    axes: &[
        axis::channel(&THREE, 0),
        axis::channel(&THREE, 1),
        axis::channel(&THREE, 2),
    ],
    faults: FAULTS_3,
    serial_number: THREE.optional(0x1018, 4),
    ..COMMON
};

/// The controller with so many channels, 1 to 3.
pub fn with_channels(channels: u8) -> Option<&'static Personality> {
    match channels {
        1 => Some(&ROBOTEQ),
        2 => Some(&ROBOTEQ_2),
        3 => Some(&ROBOTEQ_3),
        _ => None,
    }
}
