//! The commands of the serial line, and the objects that they mean.
//!
//! The document names the command of each object ("RoboCommand"); how a line is written is in Roboteq's
//! user manual. A value has the same unit by both ways.

use crate::serial::{Action, ByMode, Command, Kind, Object, Of, SerialPort};

/// The serial line: 115,200 bit/s, eight data bits, no parity, one stop bit.
pub static SERIAL: SerialPort = SerialPort {
    commands: COMMANDS,
    bits_per_s: 115_200,
};

/// `G`: the command of open loop, -1000 to 1000, a sub-index a channel.
pub const MOTOR_COMMAND: u16 = 0x2000;
// What is configured has no object in the document. As its commands are 0x2000 and their number, it
// is 0x3000 and its number; `FSA` and `EDEC`, whose numbers are not published, lie behind those that
// are.
/// `MMOD`: the mode after power on, a sub-index a channel.
pub const START_MODE: u16 = 0x3027;
/// `MAC`: acceleration after power on, 0.1 rpm/s, a sub-index a channel.
pub const ACCELERATION: u16 = 0x3033;
/// `MDEC`: deceleration after power on, 0.1 rpm/s, a sub-index a channel.
pub const DECELERATION: u16 = 0x3034;
/// `MVEL`: velocity of positioning after power on, rpm, a sub-index a channel.
pub const POSITION_VELOCITY: u16 = 0x3035;
/// `EDEC`: deceleration of halt, quick stop and faults, 0.1 rpm/s, a sub-index a channel.
pub const FAULT_DECELERATION: u16 = 0x30F0;
/// `FSA`: whether the state machine is in force; the drive has it once.
pub const STATE_MACHINE: u16 = 0x30F1;

/// Speeds that `S` takes, rpm.
const SPEEDS: (i32, i32) = (-500_000, 500_000);

const POSITION: Object = Object::profile(0x6064, 0);
const VELOCITY: Object = Object::profile(0x606C, 0);

/// What `F` tells: what the loop of the mode in force has for feedback. Velocity, rpm; position, counts,
/// or from -1000 to 1000 in the relative and tracking modes; the motor's current, 0.1 A. Without a loop,
/// velocity.
static FEEDBACK: ByMode = ByMode {
    mode: Object::profile(0x6061, 0),
    objects: &[
        (1, POSITION),
        (-1, POSITION),
        (-2, POSITION),
        (4, Object::profile(0x6077, 0)),
    ],
    otherwise: VELOCITY,
};

const fn command(name: &'static str, of: Of, object: Object) -> Command {
    Command {
        kind: Kind::Command,
        name,
        of,
        action: Action::Write(object),
    }
}

const fn query(name: &'static str, of: Of, object: Object) -> Command {
    Command {
        kind: Kind::Query,
        name,
        of,
        action: Action::Read(object),
    }
}

const fn set(name: &'static str, of: Of, object: Object) -> Command {
    Command {
        kind: Kind::Set,
        name,
        of,
        action: Action::Write(object),
    }
}

const fn get(name: &'static str, of: Of, object: Object) -> Command {
    Command {
        kind: Kind::Get,
        name,
        of,
        action: Action::Read(object),
    }
}

/// Every command of the line. What can be set by a command can be asked for by the query of the same
/// name, but for `S`, whose query tells the speed that there is, and `G`.
pub static COMMANDS: &[Command] = &[
    command("CW", Of::Channel, Object::profile(0x6040, 0)),
    query("CW", Of::Channel, Object::profile(0x6040, 0)),
    query("SW", Of::Channel, Object::profile(0x6041, 0)),
    // R10: 0x60FF and 0x6042 are one command, and the second has 16 bits only.
    Command {
        kind: Kind::Command,
        name: "S",
        of: Of::Channel,
        action: Action::WriteBoth {
            range: SPEEDS,
            wide: Object::profile(0x60FF, 0),
            narrow: Object::profile(0x6042, 0),
        },
    },
    query("S", Of::Channel, VELOCITY),
    command("G", Of::Channel, Object::channels(MOTOR_COMMAND)),
    command("ROM", Of::Channel, Object::profile(0x6060, 0)),
    query("ROM", Of::Channel, Object::profile(0x6060, 0)),
    query("AOM", Of::Channel, Object::profile(0x6061, 0)),
    command("POS", Of::Channel, Object::profile(0x607A, 0)),
    query("POS", Of::Channel, Object::profile(0x607A, 0)),
    command("PSP", Of::Channel, Object::profile(0x6081, 0)),
    query("PSP", Of::Channel, Object::profile(0x6081, 0)),
    command("PAC", Of::Channel, Object::profile(0x6083, 0)),
    query("PAC", Of::Channel, Object::profile(0x6083, 0)),
    command("PDC", Of::Channel, Object::profile(0x6084, 0)),
    query("PDC", Of::Channel, Object::profile(0x6084, 0)),
    // R25: elements, two for each channel.
    command("SPL", Of::Pair, Object::profile(0x6046, 1)),
    query("SPL", Of::Pair, Object::profile(0x6046, 1)),
    command("SAC", Of::Pair, Object::profile(0x6048, 1)),
    query("SAC", Of::Pair, Object::profile(0x6048, 1)),
    command("SDC", Of::Pair, Object::profile(0x6049, 1)),
    query("SDC", Of::Pair, Object::profile(0x6049, 1)),
    command("TC", Of::Channel, Object::profile(0x6071, 0)),
    query("TC", Of::Channel, Object::profile(0x6071, 0)),
    command("TSL", Of::Channel, Object::profile(0x6087, 0)),
    query("TSL", Of::Channel, Object::profile(0x6087, 0)),
    query("SDM", Of::Channel, Object::profile(0x6502, 0)),
    query("VNM", Of::Channel, Object::profile(0x67FE, 0)),
    Command {
        kind: Kind::Query,
        name: "F",
        of: Of::Channel,
        action: Action::ReadByMode(&FEEDBACK),
    },
    query("A", Of::Channel, Object::profile(0x6077, 0)),
    query("RMP", Of::Channel, Object::profile(0x6043, 0)),
    set("FSA", Of::Drive, Object::single(STATE_MACHINE, 0)),
    get("FSA", Of::Drive, Object::single(STATE_MACHINE, 0)),
    set("MMOD", Of::Channel, Object::channels(START_MODE)),
    get("MMOD", Of::Channel, Object::channels(START_MODE)),
    set("MAC", Of::Channel, Object::channels(ACCELERATION)),
    get("MAC", Of::Channel, Object::channels(ACCELERATION)),
    set("MDEC", Of::Channel, Object::channels(DECELERATION)),
    get("MDEC", Of::Channel, Object::channels(DECELERATION)),
    set("MVEL", Of::Channel, Object::channels(POSITION_VELOCITY)),
    get("MVEL", Of::Channel, Object::channels(POSITION_VELOCITY)),
    set("EDEC", Of::Channel, Object::channels(FAULT_DECELERATION)),
    get("EDEC", Of::Channel, Object::channels(FAULT_DECELERATION)),
    // Nearly every program begins by switching the echo off.
    Command {
        kind: Kind::Set,
        name: "ECHOF",
        of: Of::Drive,
        action: Action::Echo,
    },
    Command {
        kind: Kind::Get,
        name: "ECHOF",
        of: Of::Drive,
        action: Action::Echo,
    },
    Command {
        kind: Kind::Maintenance,
        name: "EESAV",
        of: Of::Drive,
        action: Action::Store,
    },
];
