//! MAB MD80, as its CANopen object dictionary page of firmware 1.x ("MD 1.0") describes it. Later
//! firmware numbers the objects from 0x2000 on anew; it is another drive.
//!
//! The page's defaults are those of a drive out of the box, without a motor: zeros, which say "not
//! configured" where they lie outside the range. [`SAMPLE_MOTOR`] is what a drive with the sample motor
//! has stored. Where the page is silent or contradicts itself, the rows say in a comment what is
//! built; the numbers M1 to M32 name the decisions, which the drive's page in the documentation lists.

mod axis;
mod commissioning;
mod communication;
mod internal;
mod motor;
mod operation;
mod own;
mod sample;
mod settings;
mod status;

use can::BitRate;
use canopen::{Address, Device, Dictionary, Row, dictionary};
use cia402::ModeSet;

pub use internal::BOARD_CURRENT_A;
pub use own::Behaviour;
pub use sample::SAMPLE_MOTOR;
pub use settings::{REAL_RANGES, RealRange};
pub use status::{Effect, STATUS_BITS, StatusBit};

use crate::own::OwnKind;
use crate::{AxisPersonality, ErrorRules, NodeIdObject, Personality, SupplyRules, Words};

const ROWS: &[&[Row]] = &[
    internal::ROWS,
    communication::ROWS,
    communication::MORE_ROWS,
    communication::PDO_ROWS,
    settings::ROWS,
    axis::ROWS,
    axis::MORE_ROWS,
];

/// The object dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// The same dictionary as a constant, to resolve handles in.
const OBJECTS_CONST: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Names of modes that are not CiA 402's (M3), and those of the status words.
const WORDS: Words = Words {
    modes: &[(-2, "service"), (-1, "service")],
    bits: &status::BIT_NAMES,
    errors: &[
        (0x7305, "main encoder"),
        (0x7306, "output encoder"),
        (0x6320, "not set up or not calibrated"),
        (0x2310, "overcurrent"),
        (0x5210, "current sensors off"),
        (0x5410, "gate driver fault"),
        (0x7510, "gate driver does not answer"),
        (0x8130, "CAN watchdog"),
    ],
    ..Words::STANDARD
};

/// Whether a master may write this mode: those of the page, and −2, by which the guide and the maker's tool
/// mean service (M3).
pub const fn offers(mode: i8) -> bool {
    mode == -2 || CIA402.modes().contains(cia402::Mode(mode))
}

/// The MD80's CANopen: plain CiA 301 but for these.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    zero_padded_writes: true,   // M19
    type_254_by_timer: true,    // M26
    boots_to_operational: true, // X9
    lss: false,
    ..canopen::Dialect::STANDARD
};

/// The MD80's CiA 402: plain but for these.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    set_points_at_once: true, // M25
    resting_modes: ModeSet::EMPTY.with(axis::SERVICE),
    remote_bit: false, // M4: the guide's 39 is 0x27
    modes: axis::MODES,
    ..cia402::Dialect::STANDARD
};

/// The drive.
pub static MD80: Personality = Personality {
    name: "md80",
    title: "MAB MD80 (MD 1.0)",
    device: Device::new(&OBJECTS, CANOPEN),
    bit_rates: &[BitRate::Mbit1],
    cia402: CIA402,
    axes: &[AxisPersonality {
        objects: axis::axis(&OBJECTS_CONST),
        motor: motor::motor(&OBJECTS_CONST),
        amplifier: motor::amplifier(&OBJECTS_CONST),
        presets_position: None,
        inputs: None,
    }],
    faults: &status::FAULTS,
    own_causes: &status::CAUSE_NAMES,
    errors: ErrorRules {
        bus_off_leaves_state: false,
        keeps_last_code: false,
        names_ended_error: false,
    },
    supply: SupplyRules {
        present_v: 10.0,
        limit_time_ms: 10,
    },
    error_code: None,
    status_register: None,
    // All of its identity is 0.
    serial_number: None,
    node_id: Some(NodeIdObject {
        address: Address::new(settings::MOTOR_SETTINGS, 10),
        field: OBJECTS_CONST.need(settings::MOTOR_SETTINGS, 10),
        at_once: false,
    }),
    stores_single_entry: None,
    termination: None,
    words: WORDS,
    operation: operation::OPERATION,
    commissioning: commissioning::COMMISSIONING,
    own: OwnKind::Md80,
    serial: None,
    commissioned: SAMPLE_MOTOR,
    host: None,
};
