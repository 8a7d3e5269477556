//! Barrett P3 of 2016, as "P3 CANopen JPL Manual" revision AM of 2016-09-01 describes it.
//!
//! Where the manual is silent or contradicts itself, the rows say in a comment what is built; the
//! numbers J1 to J21 name the decisions, which the drive's page in the documentation lists. Motor and
//! amplifier are those of the P3 of 2019.

mod axis;
mod barrett_can;
mod behaviour;
mod communication;
mod faults;
mod motor;
mod operation;
pub mod properties;

pub use behaviour::{Behaviour, offers};

use can::BitRate;
use canopen::{
    AcknowledgeData, Address, Device, Dictionary, RangeAbort, Row, RpdoSync, SdoTransfers,
    UploadReply, dictionary,
};

use crate::commissioning::Commissioning;
use crate::own::OwnKind;
use crate::p3;
use crate::{AxisPersonality, ErrorRules, Personality, Words};

const ROWS: &[&[Row]] = &[
    communication::ROWS,
    p3::communication::PDO_ROWS,
    motor::ROWS,
    properties::ROWS,
    axis::ROWS,
];

/// The object dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// The same dictionary as a constant, to resolve handles in.
pub(crate) const OBJECTS_CONST: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Names of modes that are not CiA 402's (l.154, J15).
const WORDS: Words = Words {
    modes: &[(1, "position"), (4, "torque"), (7, "Barrett trapezoid")],
    ..Words::STANDARD
};

/// The manual has neither calibration nor gains.
const COMMISSIONING: Commissioning = Commissioning {
    calibrations: &[],
    calibrating: Some(
        "its manual has no calibration; 0x3F00,61 (MOFST), 62 and 74 (IOFST, IOFF) show what it works with",
    ),
    tuning: Some("its manual has no gains; 0x6083, 0x6084 and the targets are all there is to set"),
};

/// Its CANopen.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    short_requests: true, // J10
    zero_padded_writes: false,
    upload_reply: UploadReply::Unsized,      // l.44
    acknowledge_data: AcknowledgeData::Echo, // J1, J2, J3
    sdo: SdoTransfers::Expedited,            // l.42, l.43
    range_abort: RangeAbort::TooHighTooLow,
    reconfigure_while_valid: true, // l.210
    short_mapping: true,           // J4
    rpdo_sync: RpdoSync::Nth,      // l.123
    tpdo_type_0_is_cyclic: true,   // l.230
    pdo_events: false,             // J16
    type_254_by_timer: false,
    emergencies: false,     // J16
    emcy_inhibit: false,    // J16
    produces_sync: false,   // 0x1006 is read only
    remote_requests: false, // l.46
    tpdo_forbids_remote: false,
    extended_identifiers: false,    // l.51
    lss: false,                     // not mentioned
    tpdo_in_pre_operational: false, // J20
    boot_up: false,                 // J9
    boots_to_operational: false,    // J9
    history_clearable: false,       // it has none
};

/// Its CiA 402: there is no state machine on 0x6040 (J14), so nobody asks for what is left out.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    reset_and_command_in_one_write: false,
    modes_only_when_enabled: false,
    mode_display_cleared_on_enable: false,
    ramps_on_stop: false,
    halt_bit: false,
    set_points_at_once: false,
    resting_modes: cia402::ModeSet::EMPTY,
    remote_bit: false,
    modes: axis::MODES,
};

/// The drive.
pub static P3_JPL: Personality = Personality {
    name: "p3-jpl",
    title: "Barrett P3 (JPL manual of 2016)",
    device: Device::new(&OBJECTS, CANOPEN),
    bit_rates: &[BitRate::Mbit1], // as the P3 of 2019
    cia402: CIA402,
    axes: &[AxisPersonality {
        objects: axis::axis(&OBJECTS_CONST),
        motor: motor::motor(&OBJECTS_CONST),
        amplifier: motor::amplifier(),
        presets_position: Some(Address::new(0x3F63, 0)), // J11
        inputs: None,
    }],
    faults: &faults::TABLE,
    own_causes: &[],
    errors: ErrorRules {
        bus_off_leaves_state: false,
        keeps_last_code: true,
        names_ended_error: true,
    },
    supply: p3::SUPPLY,
    error_code: None, // J14
    status_register: None,
    serial_number: OBJECTS_CONST.optional(0x1018, 4),
    node_id: None,
    stores_single_entry: None,
    termination: None,
    words: WORDS,
    operation: operation::OPERATION,
    commissioning: COMMISSIONING,
    own: OwnKind::P3Jpl,
    serial: None,
    commissioned: &[],
    host: None,
};
