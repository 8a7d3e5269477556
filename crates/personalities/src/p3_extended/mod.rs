//! The P3's objects, motor and faults under plain CiA 301 and CiA 402.
//!
//! It shares the rows of [`crate::p3`] and says here only what it adds or has otherwise. The drive's
//! page in the documentation lists every difference with its reason.

mod axis;
mod communication;
mod faults;
mod homing;
mod inputs;
mod modes;
mod motor;

use canopen::{Address, Device, Dictionary, Row, dictionary};

use crate::commissioning::Commissioning;
use crate::operation::{Machine, Operation};
use crate::own::OwnKind;
use crate::p3;
use crate::{AxisPersonality, ErrorRules, FaultRow, HostObjects, MOST_FAULTS, Personality};

const ROWS: &[&[Row]] = &[
    communication::ROWS,
    communication::PDO_ROWS,
    p3::motor::MOTOR_ROWS,
    p3::motor::AMPLIFIER_ROWS,
    p3::motor::GAIN_ROWS,
    p3::axis::ROWS,
    motor::ROWS,
    axis::ROWS,
    modes::ROWS,
    homing::ROWS,
    &homing::METHOD_ROWS,
    inputs::ROWS,
    p3::faults::OBJECT_ROWS,
    faults::ENABLE_ROWS,
];

/// The object dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Bytes of the drive's image.
pub const IMAGE_BYTES: usize = OBJECTS_CONST.image_bytes();

/// The same dictionary as a constant, to resolve handles in.
const OBJECTS_CONST: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Plain CiA 301, and 0x1F80 as the P3 has it: 0 boots to operational.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    boots_to_operational: true,
    ..canopen::Dialect::STANDARD
};

/// Plain CiA 402, with the P3's modes and more.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    modes: axis::MODES,
    ..cia402::Dialect::STANDARD
};

const FAULTS: &[FaultRow] = &faults::table(&OBJECTS_CONST);

const _: () = assert!(FAULTS.len() <= MOST_FAULTS);

/// The drive.
pub static P3_EXTENDED: Personality = Personality {
    name: "p3-extended",
    title: "Barrett P3 under plain CiA 301 and CiA 402",
    device: Device::new(&OBJECTS, CANOPEN),
    bit_rates: &can::BitRate::ALL,
    cia402: CIA402,
    axes: &[AxisPersonality {
        objects: axis::axis(&OBJECTS_CONST),
        motor: motor::motor(&OBJECTS_CONST),
        amplifier: p3::motor::amplifier(&OBJECTS_CONST),
        presets_position: Some(Address::new(0x6064, 0)),
        inputs: Some(inputs::objects(&OBJECTS_CONST)),
    }],
    faults: FAULTS,
    own_causes: &[],
    errors: ErrorRules {
        keeps_last_code: false,
        bus_off_leaves_state: true,
        names_ended_error: true,
    },
    supply: p3::SUPPLY,
    error_code: OBJECTS_CONST.optional(0x603F, 0),
    status_register: OBJECTS_CONST.optional(0x1002, 0),
    serial_number: OBJECTS_CONST.optional(0x1018, 4),
    node_id: None, // LSS gives it
    stores_single_entry: Some(Address::new(0x1010, 4)),
    termination: OBJECTS_CONST.optional(0x21B2, 0),
    words: p3::WORDS,
    operation: Operation {
        machine: Machine::Standard,
        ..p3::OPERATION
    },
    commissioning: Commissioning::BY_MASTER,
    own: OwnKind::Nothing,
    serial: None,
    commissioned: &[],
    host: Some(HostObjects {
        data_sheet: Address::new(0x1021, 0),
        scratch: Address::new(0x2420, 0),
        software_version: OBJECTS_CONST.need(0x100A, 0),
        program: Address::new(0x1F50, 1),
        program_control: Address::new(0x1F51, 1),
        program_state: OBJECTS_CONST.handle(0x1F51, 1),
        program_identification: OBJECTS_CONST.handle(0x1F56, 1),
        program_status: OBJECTS_CONST.handle(0x1F57, 1),
    }),
};
