//! Rows 0x0002 to 0x1FFF of the manual ("Communication", "PDO Configuration").

use canopen::Group::Communication;
use canopen::Row;
use canopen::row::{i8, i16, i32, text, u8, u16, u32};

/// "Communication".
#[rustfmt::skip]
pub(crate) const ROWS: &[Row] = &[
    i8(0x0002, 0, "Dummy entry").rw().rpdo().tpdo(),
    i16(0x0003, 0, "Dummy entry").rw().rpdo().tpdo(),
    i32(0x0004, 0, "Dummy entry").rw().rpdo().tpdo(),
    u8(0x0005, 0, "Dummy entry").rw().rpdo().tpdo(),
    u16(0x0006, 0, "Dummy entry").rw().rpdo().tpdo(),
    u32(0x0007, 0, "Dummy entry").rw().rpdo().tpdo(),
    // No additional information, profile 402 (CiA 301 7.5.2.1; 3.1 "Device type").
    u32(0x1000, 0, "Device type").constant().default(0x0002_0192),
    u8(0x1001, 0, "Error bitfield").tpdo(),
    u32(0x1002, 0, "Manufacturer status register").tpdo(),
    u8(0x1003, 0, "Error history, record count"),
    u32(0x1003, 1, "Error history").subs(8),
    u32(0x1005, 0, "Sync COB ID").rw().default(0x80).store(Communication),
    u32(0x1006, 0, "Sync period").unit("us"),
    text(0x1008, 0, "Manufacturer device name", "P3"),
    text(0x1009, 0, "Manufacturer hardware version", "sim"),
    text(0x100A, 0, "Manufacturer software version", "0.1"),
    // Reading 1 says "stores on command" (CiA 301 7.5.2.13).
    u32(0x1010, 1, "Save all").rw().asks().default(1),
    u32(0x1010, 2, "Save communication parameters").rw().asks().default(1),
    u32(0x1010, 3, "Save application parameters").rw().asks().default(1),
    u32(0x1010, 4, "Save single entry").rw().asks().default(1),
    u32(0x1014, 0, "Emergency COB ID").rw().default_plus_node(0x80).store(Communication),
    // Stored; emergencies are not delayed.
    u16(0x1015, 0, "Emergency inhibit time").rw().unit("100us").store(Communication),
    u16(0x1017, 0, "Heartbeat period").rw().unit("ms").store(Communication),
    // Barrett's vendor ID; the other three are this project's, a device's own serial number
    // replaces the last.
    u32(0x1018, 1, "Vendor ID").constant().default(0x408),
    u32(0x1018, 2, "Product code").constant().default(0x5033),
    u32(0x1018, 3, "Revision number").constant().default(0x0001_0000),
    u32(0x1018, 4, "Serial number"),
    u32(0x1200, 1, "SDO receive COB ID").default_plus_node(0x600),
    u32(0x1200, 2, "SDO transmit COB ID").default_plus_node(0x580),
    // 0: boot to operational, 4: boot to pre-operational (l.346); the default is P33.
    u32(0x1F80, 0, "NMT startup").rw().store(Communication),
];

/// The node ID (l.225, P5, P6), as the examples write it: two bytes. Set to the drive's own at start.
pub(super) const NODE_ID_ROWS: &[Row] = &[u16(0x21B0, 0, "Network configuration: node ID")
    .rw()
    .range(1, 127)
    .default(1)
    .asks()
    .store(Communication)];

const fn rpdo_cob_id(index: u16, base: u32) -> Row {
    u32(index, 1, "RPDO COB ID")
        .rw()
        .default_plus_node(base)
        .store(Communication)
}

const fn rpdo_type(index: u16) -> Row {
    u8(index, 2, "RPDO Rx type")
        .rw()
        .default(255)
        .store(Communication)
}

const fn tpdo_cob_id(index: u16, base: u32) -> Row {
    u32(index, 1, "TPDO COB ID")
        .rw()
        .default_plus_node(base)
        .store(Communication)
}

const fn tpdo_type(index: u16) -> Row {
    u8(index, 2, "TPDO Tx type")
        .rw()
        .default(1)
        .store(Communication)
}

const fn tpdo_inhibit(index: u16) -> Row {
    u16(index, 3, "TPDO inhibit time (not implemented)")
        .rw()
        .unit("100us")
        .store(Communication)
}

const fn tpdo_unused(index: u16) -> Row {
    u8(index, 4, "Unused")
}

const fn tpdo_timer(index: u16) -> Row {
    u16(index, 5, "TPDO event timer (not implemented)")
        .rw()
        .unit("ms")
        .store(Communication)
}

const fn map_count(index: u16, name: &'static str) -> Row {
    u8(index, 0, name).rw().store(Communication)
}

const fn map_entries(index: u16, name: &'static str) -> Row {
    u32(index, 1, name).subs(4).rw().store(Communication)
}

const RPDO_COUNT: &str = "RPDO mapping, number of mapped objects";
const TPDO_COUNT: &str = "TPDO mapping, number of mapped objects";

/// "PDO Configuration". The COB-IDs are the predefined ones; no PDO maps anything at first.
#[rustfmt::skip]
pub(crate) const PDO_ROWS: &[Row] = &[
    rpdo_cob_id(0x1400, 0x200),
    rpdo_type(0x1400),
    rpdo_cob_id(0x1401, 0x300),
    rpdo_type(0x1401),
    rpdo_cob_id(0x1402, 0x400),
    rpdo_type(0x1402),
    rpdo_cob_id(0x1403, 0x500),
    rpdo_type(0x1403),
    map_count(0x1600, RPDO_COUNT),
    map_entries(0x1600, "RPDO mapping"),
    map_count(0x1601, RPDO_COUNT),
    map_entries(0x1601, "RPDO mapping"),
    map_count(0x1602, RPDO_COUNT),
    map_entries(0x1602, "RPDO mapping"),
    map_count(0x1603, RPDO_COUNT),
    map_entries(0x1603, "RPDO mapping"),
    tpdo_cob_id(0x1800, 0x180),
    tpdo_type(0x1800),
    tpdo_inhibit(0x1800),
    tpdo_unused(0x1800),
    tpdo_timer(0x1800),
    tpdo_cob_id(0x1801, 0x280),
    tpdo_type(0x1801),
    tpdo_inhibit(0x1801),
    tpdo_unused(0x1801),
    tpdo_timer(0x1801),
    tpdo_cob_id(0x1802, 0x380),
    tpdo_type(0x1802),
    tpdo_inhibit(0x1802),
    tpdo_unused(0x1802),
    tpdo_timer(0x1802),
    tpdo_cob_id(0x1803, 0x480),
    tpdo_type(0x1803),
    tpdo_inhibit(0x1803),
    tpdo_unused(0x1803),
    tpdo_timer(0x1803),
    map_count(0x1A00, TPDO_COUNT),
    map_entries(0x1A00, "TPDO mapping"),
    map_count(0x1A01, TPDO_COUNT),
    map_entries(0x1A01, "TPDO mapping"),
    map_count(0x1A02, TPDO_COUNT),
    map_entries(0x1A02, "TPDO mapping"),
    map_count(0x1A03, TPDO_COUNT),
    map_entries(0x1A03, "TPDO mapping"),
];
