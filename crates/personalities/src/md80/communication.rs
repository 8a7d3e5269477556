//! "Communication Area". The page lists a device type, an error register, a name, a save command, a
//! heartbeat and the mappings of eight PDOs. What CANopen needs besides has the values of the maker's
//! own data sheet of that time ("EDS").

use canopen::Group::Communication;
use canopen::Row;
use canopen::row::{text, u8, u16, u32};

/// A communication parameter that is stored.
const fn parameter(row: Row) -> Row {
    row.rw().store(Communication)
}

/// The page's own objects.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // M6: the EDS has 0x192. Tools of the maker look at the byte 0x92.
    u32(0x1000, 0, "Device type").constant().default(0x0002_0192),
    u8(0x1001, 0, "Error Register").tpdo(),
    text(0x1008, 0, "Manufacturer Device Name", "MD80"),
    // M20: in "switch on disabled" only. Reading 1 says "stores on command" (CiA 301 7.5.2.13).
    u32(0x1010, 1, "Store Parameters").rw().asks().default(1),
    // M18: the page has no default, the EDS 1000.
    parameter(u16(0x1017, 0, "Producer Heartbeat Time").unit("ms").default(1000)),
];

/// What the page does not list and every CANopen device has, as the EDS has it.
#[rustfmt::skip]
pub(super) const MORE_ROWS: &[Row] = &[
    parameter(u32(0x1005, 0, "COB-ID SYNC message").default(0x80)),
    parameter(u32(0x1014, 0, "COB-ID EMCY").default_plus_node(0x80)),
    parameter(u16(0x1015, 0, "Inhibit time EMCY").unit("100us")),
    // All of the identity is 0 in the EDS.
    u32(0x1018, 1, "Vendor-ID").constant(),
    u32(0x1018, 2, "Product code").constant(),
    u32(0x1018, 3, "Revision number").constant(),
    u32(0x1018, 4, "Serial number").constant(),
    u32(0x1200, 1, "COB-ID client to server").default_plus_node(0x600),
    u32(0x1200, 2, "COB-ID server to client").default_plus_node(0x580),
];

const RPDO: &str = "Receive PDO parameter";
const TPDO: &str = "Transmit PDO parameter";

/// M8: the EDS leaves the node ID out of the COB-IDs, with which all drives of a bus would share
/// theirs.
const fn cob_id(index: u16, base: u32, name: &'static str) -> Row {
    parameter(u32(index, 1, name).default_plus_node(base))
}

const fn transmission_type(index: u16, name: &'static str) -> Row {
    parameter(u8(index, 2, name).default(254))
}

const fn inhibit(index: u16) -> Row {
    parameter(u16(index, 3, "Transmit PDO inhibit time").unit("100us"))
}

const fn event_timer(index: u16) -> Row {
    parameter(u16(index, 5, "Transmit PDO event timer").unit("ms"))
}

const fn count(index: u16, name: &'static str, objects: i64) -> Row {
    parameter(u8(index, 0, name).default(objects))
}

const fn mapped(index: u16, sub: u8, name: &'static str, object: i64) -> Row {
    parameter(u32(index, sub, name).default(object))
}

const CONTROL_WORD: i64 = 0x6040_0010;
const STATUS_WORD: i64 = 0x6041_0010;

/// The PDOs. M7: mapped as the page says; the EDS has 0x60FF alone in the first RPDO and 0x6041 alone
/// in the first TPDO.
#[rustfmt::skip]
pub(super) const PDO_ROWS: &[Row] = &[
    cob_id(0x1400, 0x200, RPDO),
    transmission_type(0x1400, RPDO),
    cob_id(0x1401, 0x300, RPDO),
    transmission_type(0x1401, RPDO),
    cob_id(0x1402, 0x400, RPDO),
    transmission_type(0x1402, RPDO),
    cob_id(0x1403, 0x500, RPDO),
    transmission_type(0x1403, RPDO),
    count(0x1600, "Receive PDO1 mapping", 1),
    mapped(0x1600, 1, "Receive PDO1 mapping", CONTROL_WORD),
    mapped(0x1600, 2, "Receive PDO1 mapping", 0).subs(7),
    count(0x1601, "Receive PDO2 mapping", 2),
    mapped(0x1601, 1, "Receive PDO2 mapping", CONTROL_WORD),
    mapped(0x1601, 2, "Receive PDO2 mapping", 0x6060_0008),
    mapped(0x1601, 3, "Receive PDO2 mapping", 0).subs(6),
    count(0x1602, "Receive PDO3 mapping", 2),
    mapped(0x1602, 1, "Receive PDO3 mapping", CONTROL_WORD),
    mapped(0x1602, 2, "Receive PDO3 mapping", 0x607A_0020),
    mapped(0x1602, 3, "Receive PDO3 mapping", 0).subs(6),
    count(0x1603, "Receive PDO4 mapping", 2),
    mapped(0x1603, 1, "Receive PDO4 mapping", CONTROL_WORD),
    mapped(0x1603, 2, "Receive PDO4 mapping", 0x60FF_0020),
    mapped(0x1603, 3, "Receive PDO4 mapping", 0).subs(6),
    cob_id(0x1800, 0x180, TPDO),
    transmission_type(0x1800, TPDO),
    inhibit(0x1800),
    event_timer(0x1800),
    cob_id(0x1801, 0x280, TPDO),
    transmission_type(0x1801, TPDO),
    inhibit(0x1801),
    event_timer(0x1801),
    cob_id(0x1802, 0x380, TPDO),
    transmission_type(0x1802, TPDO),
    inhibit(0x1802),
    event_timer(0x1802),
    cob_id(0x1803, 0x480, TPDO),
    transmission_type(0x1803, TPDO),
    inhibit(0x1803),
    event_timer(0x1803),
    count(0x1A00, "Transmit PDO1 mapping", 2),
    mapped(0x1A00, 1, "Transmit PDO1 mapping", STATUS_WORD),
    mapped(0x1A00, 2, "Transmit PDO1 mapping", 0x6061_0008),
    mapped(0x1A00, 3, "Transmit PDO1 mapping", 0).subs(6),
    count(0x1A01, "Transmit PDO2 mapping", 2),
    mapped(0x1A01, 1, "Transmit PDO2 mapping", STATUS_WORD),
    mapped(0x1A01, 2, "Transmit PDO2 mapping", 0x6064_0020),
    mapped(0x1A01, 3, "Transmit PDO2 mapping", 0).subs(6),
    count(0x1A02, "Transmit PDO3 mapping", 2),
    mapped(0x1A02, 1, "Transmit PDO3 mapping", STATUS_WORD),
    mapped(0x1A02, 2, "Transmit PDO3 mapping", 0x606C_0020),
    mapped(0x1A02, 3, "Transmit PDO3 mapping", 0).subs(6),
    count(0x1A03, "Transmit PDO4 mapping", 2),
    mapped(0x1A03, 1, "Transmit PDO4 mapping", STATUS_WORD),
    mapped(0x1A03, 2, "Transmit PDO4 mapping", 0x6077_0010),
    mapped(0x1A03, 3, "Transmit PDO4 mapping", 0).subs(6),
];
