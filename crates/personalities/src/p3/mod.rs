//! Barrett P3, as "P3 CANopen Manual" revision AV of 2019-10-22 describes it.
//!
//! Where the manual is silent or contradicts itself, the rows say in a comment what is built; the
//! numbers P1 to P61 name the decisions, which the drive's page in the documentation lists.

pub(crate) mod axis;
pub(crate) mod communication;
pub(crate) mod faults;
pub(crate) mod motor;

use can::BitRate;
use canopen::{
    AcknowledgeData, Address, Dictionary, RangeAbort, Row, RpdoSync, SdoTransfers, UploadReply,
};
use canopen::{Device, dictionary};

use crate::commissioning::Commissioning;
use crate::operation::{self, Machine, Operation};
use crate::own::OwnKind;
use crate::{
    AxisPersonality, ErrorRules, FaultRow, NodeIdObject, Personality, Scaled, SupplyRules, Words,
};

const ROWS: &[&[Row]] = &[
    communication::ROWS,
    communication::PDO_ROWS,
    communication::NODE_ID_ROWS,
    motor::MOTOR_ROWS,
    motor::AMPLIFIER_ROWS,
    motor::GAIN_ROWS,
    axis::ROWS,
    axis::P3_ROWS,
    faults::OBJECT_ROWS,
];

/// The object dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Bytes of a P3's image.
pub const IMAGE_BYTES: usize = OBJECTS_CONST.image_bytes();

/// The same dictionary as a constant, to resolve handles in.
const OBJECTS_CONST: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// The P3's CANopen.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    short_requests: true, // P1, P55
    zero_padded_writes: false,
    upload_reply: UploadReply::Unsized,       // P2
    acknowledge_data: AcknowledgeData::Zeros, // J1
    sdo: SdoTransfers::Expedited,             // l.166, l.167
    range_abort: RangeAbort::Invalid,         // P27
    reconfigure_while_valid: true,            // P49
    short_mapping: false,                     // J4
    rpdo_sync: RpdoSync::Nth,                 // P50
    tpdo_type_0_is_cyclic: true,              // P13
    pdo_events: false,                        // P51
    type_254_by_timer: false,
    emergencies: true,
    emcy_inhibit: false,    // stored without effect
    produces_sync: false,   // 0x1006 is read only
    remote_requests: false, // l.174
    tpdo_forbids_remote: false,
    extended_identifiers: false,   // l.178
    lss: false,                    // not mentioned
    tpdo_in_pre_operational: true, // P14
    boot_up: true,                 // l.379
    boots_to_operational: true,    // l.346, P33
    history_clearable: false,      // P40
};

/// The P3's CiA 402.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    reset_and_command_in_one_write: true, // P8
    modes_only_when_enabled: true,        // P10
    mode_display_cleared_on_enable: true, // P10
    ramps_on_stop: false,                 // P12, l.185
    halt_bit: false,                      // P42
    set_points_at_once: false,
    resting_modes: cia402::ModeSet::EMPTY,
    remote_bit: false, // P42
    modes: axis::MODES,
};

/// An object in internal units.
pub(crate) const fn plain<const N: usize>(objects: &Dictionary<N>, index: u16, sub: u8) -> Scaled {
    Scaled::plain(objects.need(index, sub))
}

/// An object whose unit is `scale` internal units.
pub(crate) const fn scaled<const N: usize>(
    objects: &Dictionary<N>,
    index: u16,
    sub: u8,
    scale: f32,
) -> Scaled {
    Scaled::new(objects.need(index, sub), scale)
}

/// "Faults and Warnings".
const FAULTS: &[FaultRow] = &faults::table(&OBJECTS_CONST, faults::UNNAMED);

/// Motor supply.
pub(crate) const SUPPLY: SupplyRules = SupplyRules {
    // The drive works from 12 V (l.56).
    present_v: 9.0,
    limit_time_ms: 450, // l.1043
};

/// Reset and command in one write (l.324).
pub(crate) const OPERATION: Operation = Operation {
    prepare: operation::P3_PROFILE,
    machine: Machine::Short,
    ways: operation::P3_WAYS,
};

/// The bits of the two registers of errors.
pub(crate) const WORDS: Words = Words {
    bits: &BITS,
    ..Words::STANDARD
};

/// 0x1001 tells of motion in its last bit (P15), 0x1002 has a bit for each row of the fault table.
#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
const BITS: [(Address, u8, &str); faults::COUNT + 1] = {
    let mut bits = [(Address::new(0x1001, 0), 7, "motion"); faults::COUNT + 1];
    let mut n = 0;
    while n < faults::COUNT {
        let row = &FAULTS[n];
        if let Some(name) = row.cause.name() {
            bits[n + 1] = (Address::new(0x1002, 0), row.status_bit, name);
        }
        n += 1;
    }
    bits
};

/// The drive.
pub static P3: Personality = Personality {
    name: "p3",
    title: "Barrett P3 (manual of 2019)",
    device: Device::new(&OBJECTS, CANOPEN),
    bit_rates: &[BitRate::Mbit1], // l.184
    cia402: CIA402,
    axes: &[AxisPersonality {
        objects: axis::axis(&OBJECTS_CONST),
        motor: motor::motor(&OBJECTS_CONST),
        amplifier: motor::amplifier(&OBJECTS_CONST),
        presets_position: Some(Address::new(0x6064, 0)), // P25
        inputs: None,
    }],
    faults: FAULTS,
    own_causes: &[],
    errors: ErrorRules {
        bus_off_leaves_state: false,
        keeps_last_code: true,   // P17
        names_ended_error: true, // P16
    },
    supply: SUPPLY,
    error_code: OBJECTS_CONST.optional(0x603F, 0),
    status_register: OBJECTS_CONST.optional(0x1002, 0),
    serial_number: OBJECTS_CONST.optional(0x1018, 4),
    // P5
    node_id: Some(NodeIdObject {
        address: Address::new(0x21B0, 0),
        field: OBJECTS_CONST.need(0x21B0, 0),
        at_once: true,
    }),
    stores_single_entry: Some(Address::new(0x1010, 4)), // P4
    termination: None,
    words: WORDS,
    operation: OPERATION,
    commissioning: Commissioning::BY_MASTER,
    own: OwnKind::Nothing,
    serial: None,
    commissioned: &[],
    host: None,
};
