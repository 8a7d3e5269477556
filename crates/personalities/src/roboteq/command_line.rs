//! The commands of the serial line, and the objects that they mean.
//!
//! The document names the command of each object ("RoboCommand"); how a line is written is in Roboteq's
//! user manual. A value has the same unit by both ways.

use super::communication::VARIABLES;
use crate::serial::{Action, Command, Kind, Object, Of, SerialPort};

/// The serial line: 115,200 bit/s, eight data bits, no parity, one stop bit.
pub static SERIAL: SerialPort = SerialPort {
    commands: COMMANDS,
    bits_per_s: 115_200,
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

/// Every command of the line: those of the document, and of the maker's others those that its CANopen
/// has too. What is set by a command is asked for by the query of the same name, but for `S`, whose query
/// tells the speed that there is, and those that are not kept.
#[rustfmt::skip]
pub static COMMANDS: &[Command] = &[
    command("CW", Of::Channel, Object::profile(0x6040, 0)),
    query("CW", Of::Channel, Object::profile(0x6040, 0)),
    query("SW", Of::Channel, Object::profile(0x6041, 0)),
    // R10: behind 0x2002 are 0x60FF and, as far as its 16 bits go, 0x6042.
    command("S", Of::Channel, Object::channels(0x2002)),
    query("S", Of::Channel, Object::channels(0x2103)),
    command("G", Of::Channel, Object::channels(0x2000)),
    query("M", Of::Channel, Object::channels(0x2101)),
    command("P", Of::Channel, Object::channels(0x2001)),
    query("P", Of::Channel, Object::channels(0x2102)),
    command("AC", Of::Channel, Object::channels(0x2006)),
    command("DC", Of::Channel, Object::channels(0x2007)),
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
    query("F", Of::Channel, Object::channels(0x2110)),
    query("A", Of::Channel, Object::channels(0x2100)),
    query("RMP", Of::Channel, Object::profile(0x6043, 0)),
    query("C", Of::Channel, Object::channels(0x2104)),
    query("E", Of::Channel, Object::channels(0x2114)),
    query("BA", Of::Channel, Object::channels(0x210C)),
    query("SR", Of::Channel, Object::channels(0x2107)),
    query("T", Of::Elements(2), Object::single(0x210F, 1)),
    command("VAR", Of::Elements(VARIABLES), Object::single(0x2005, 1)),
    query("VAR", Of::Elements(VARIABLES), Object::single(0x2106, 1)),
    query("V", Of::Elements(3), Object::single(0x210D, 1)),
    query("FS", Of::Drive, Object::single(0x2111, 0)),
    query("FF", Of::Drive, Object::single(0x2112, 0)),
    query("FM", Of::Channel, Object::channels(0x2122)),
    command("EX", Of::Order, Object::single(0x200C, 0)),
    command("MG", Of::Order, Object::single(0x200D, 0)),
    command("EES", Of::Order, Object::single(0x2017, 0)),
    command("MS", Of::Drive, Object::single(0x200E, 0)),
    set("FSA", Of::Drive, STATE_MACHINE),
    get("FSA", Of::Drive, STATE_MACHINE),
    set("RWD", Of::Drive, Object::single(0x3008, 0)),
    get("RWD", Of::Drive, Object::single(0x3008, 0)),
    set("OVL", Of::Drive, Object::single(0x30F4, 1)),
    get("OVL", Of::Drive, Object::single(0x30F4, 1)),
    set("UVL", Of::Drive, Object::single(0x30F4, 2)),
    get("UVL", Of::Drive, Object::single(0x30F4, 2)),
    set("OTL", Of::Drive, Object::single(0x30F4, 3)),
    get("OTL", Of::Drive, Object::single(0x30F4, 3)),
    set("MMOD", Of::Channel, Object::channels(0x3027)),
    get("MMOD", Of::Channel, Object::channels(0x3027)),
    set("MAC", Of::Channel, Object::channels(0x3033)),
    get("MAC", Of::Channel, Object::channels(0x3033)),
    set("MDEC", Of::Channel, Object::channels(0x3034)),
    get("MDEC", Of::Channel, Object::channels(0x3034)),
    set("MVEL", Of::Channel, Object::channels(0x3035)),
    get("MVEL", Of::Channel, Object::channels(0x3035)),
    set("EDEC", Of::Channel, Object::channels(0x30F0)),
    get("EDEC", Of::Channel, Object::channels(0x30F0)),
    set("MXRPM", Of::Channel, Object::channels(0x3036)),
    get("MXRPM", Of::Channel, Object::channels(0x3036)),
    set("ALIM", Of::Channel, Object::channels(0x302A)),
    get("ALIM", Of::Channel, Object::channels(0x302A)),
    set("ELL", Of::Channel, Object::channels(0x30F2)),
    get("ELL", Of::Channel, Object::channels(0x30F2)),
    set("EHL", Of::Channel, Object::channels(0x30F3)),
    get("EHL", Of::Channel, Object::channels(0x30F3)),
    set("CLERD", Of::Channel, Object::channels(0x3038)),
    get("CLERD", Of::Channel, Object::channels(0x3038)),
    // Nearly every program begins by switching the echo off.
    Command { kind: Kind::Set, name: "ECHOF", of: Of::Drive, action: Action::Echo },
    Command { kind: Kind::Get, name: "ECHOF", of: Of::Drive, action: Action::Echo },
    Command { kind: Kind::Maintenance, name: "EESAV", of: Of::Drive, action: Action::Store },
];

/// `FSA`: whether the state machine is in force.
const STATE_MACHINE: Object = Object::single(0x30F1, 0);
