//! Rows of the communication area, 0x0001 to 0x1FFF: everything that CiA 301 describes, and the
//! objects of CiA 302 for program download.

use canopen::Group::Communication;
use canopen::Row;
use canopen::row::{bool, domain, i8, i16, i32, string, text, u8, u16, u32};

use crate::pdo_rows::{cob_id, event_timer, inhibit_time, transmission_type};

/// A COB-ID that is switched off.
const OFF: i64 = 1 << 31;

/// Services.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // A BOOLEAN is one bit in a PDO: with it any number of bits can be left out.
    bool(0x0001, 0, "Dummy BOOLEAN").rw().rpdo().tpdo(),
    i8(0x0002, 0, "Dummy INTEGER8").rw().rpdo().tpdo(),
    i16(0x0003, 0, "Dummy INTEGER16").rw().rpdo().tpdo(),
    i32(0x0004, 0, "Dummy INTEGER32").rw().rpdo().tpdo(),
    u8(0x0005, 0, "Dummy UNSIGNED8").rw().rpdo().tpdo(),
    u16(0x0006, 0, "Dummy UNSIGNED16").rw().rpdo().tpdo(),
    u32(0x0007, 0, "Dummy UNSIGNED32").rw().rpdo().tpdo(),
    u32(0x1000, 0, "Device type").constant().default(0x0002_0192),
    u8(0x1001, 0, "Error register").tpdo(),
    u32(0x1002, 0, "Manufacturer status register").tpdo(),
    u8(0x1003, 0, "Number of errors").rw(),
    u32(0x1003, 1, "Standard error field").subs(8),
    u32(0x1005, 0, "COB-ID SYNC message").rw().default(0x80).store(Communication),
    u32(0x1006, 0, "Communication cycle period").rw().unit("us").store(Communication),
    u32(0x1007, 0, "Synchronous window length").rw().unit("us").store(Communication),
    text(0x1008, 0, "Manufacturer device name", "P3 extended"),
    text(0x1009, 0, "Manufacturer hardware version", "simulated"),
    // That of the program that runs (0x1F50).
    string(0x100A, 0, "Manufacturer software version", 32).live(),
    u16(0x100C, 0, "Guard time").rw().unit("ms").store(Communication),
    u8(0x100D, 0, "Life time factor").rw().store(Communication),
    // Reading 1 says "stores on command", and "restores" (CiA 301 7.5.2.13, 7.5.2.14).
    u32(0x1010, 1, "Save all parameters").rw().asks().default(1),
    u32(0x1010, 2, "Save communication parameters").rw().asks().default(1),
    u32(0x1010, 3, "Save application parameters").rw().asks().default(1),
    u32(0x1010, 4, "Save single entry").rw().asks().default(1),
    u32(0x1011, 1, "Restore all default parameters").rw().asks().default(1),
    u32(0x1011, 2, "Restore communication default parameters").rw().asks().default(1),
    u32(0x1011, 3, "Restore application default parameters").rw().asks().default(1),
    u32(0x1012, 0, "COB-ID TIME").rw().default(0x100).store(Communication),
    u32(0x1014, 0, "COB-ID EMCY").rw().default_plus_node(0x80).store(Communication),
    u16(0x1015, 0, "Inhibit time EMCY").rw().unit("100us").store(Communication),
    u32(0x1016, 1, "Consumer heartbeat time").subs(8).rw().store(Communication),
    u16(0x1017, 0, "Producer heartbeat time").rw().unit("ms").store(Communication),
    u32(0x1018, 1, "Vendor ID").constant().default(0x408),
    u32(0x1018, 2, "Product code").constant().default(0x5033),
    u32(0x1018, 3, "Revision number").constant().default(0x0002_0000),
    u32(0x1018, 4, "Serial number"),
    u8(0x1019, 0, "Synchronous counter overflow value").rw().store(Communication),
    u32(0x1020, 1, "Configuration date").rw().store(Communication),
    u32(0x1020, 2, "Configuration time").rw().store(Communication),
    domain(0x1021, 0, "Store EDS"),
    // 0: the EDS as it is, not compressed (CiA 301 7.5.2.25).
    u8(0x1022, 0, "Store format").constant(),
    // Sub-index n is for node n; all off at first.
    u32(0x1028, 1, "Emergency consumer").subs(127).rw().default(OFF).store(Communication),
    u8(0x1029, 1, "Communication error").rw().range(0, 2).store(Communication),
    u32(0x1200, 1, "COB-ID client to server").default_plus_node(0x600),
    u32(0x1200, 2, "COB-ID server to client").default_plus_node(0x580),
    sdo_cob_id(0x1201, 1, "COB-ID client to server"),
    sdo_cob_id(0x1201, 2, "COB-ID server to client"),
    sdo_client(0x1201),
    sdo_cob_id(0x1202, 1, "COB-ID client to server"),
    sdo_cob_id(0x1202, 2, "COB-ID server to client"),
    sdo_client(0x1202),
    // CiA 302-3: program 1 is the drive's.
    domain(0x1F50, 1, "Program data").wo(),
    u8(0x1F51, 1, "Program control").rw().asks().live(),
    u32(0x1F56, 1, "Program software identification").live(),
    u32(0x1F57, 1, "Flash status identification").live(),
    // Beyond the standard, for masters under test: up to 1 MiB that are read back as written.
    domain(0x2420, 0, "Transfer test memory").rw(),
    // 0: boot to operational, 4: to pre-operational (CiA 302-2; P3 l.346), where CiA 301 devices
    // wait for their master.
    u32(0x1F80, 0, "NMT startup").rw().default(4).store(Communication),
];

const fn sdo_cob_id(index: u16, sub: u8, name: &'static str) -> Row {
    u32(index, sub, name).rw().default(OFF).store(Communication)
}

const fn sdo_client(index: u16) -> Row {
    u8(index, 3, "Node ID of the SDO client")
        .rw()
        .store(Communication)
}

const fn sync_start(index: u16) -> Row {
    u8(index, 6, "SYNC start value").rw().store(Communication)
}

const fn map_count(index: u16) -> Row {
    u8(index, 0, "Number of mapped objects")
        .rw()
        .store(Communication)
}

/// As many as a frame has bits.
const fn map_entries(index: u16) -> Row {
    u32(index, 1, "Mapped object")
        .subs(64)
        .rw()
        .store(Communication)
}

/// PDOs. No PDO maps anything at first, as in the P3.
#[rustfmt::skip]
pub(super) const PDO_ROWS: &[Row] = &[
    cob_id(0x1400, 0x200), transmission_type(0x1400), event_timer(0x1400),
    cob_id(0x1401, 0x300), transmission_type(0x1401), event_timer(0x1401),
    cob_id(0x1402, 0x400), transmission_type(0x1402), event_timer(0x1402),
    cob_id(0x1403, 0x500), transmission_type(0x1403), event_timer(0x1403),
    map_count(0x1600), map_entries(0x1600),
    map_count(0x1601), map_entries(0x1601),
    map_count(0x1602), map_entries(0x1602),
    map_count(0x1603), map_entries(0x1603),
    cob_id(0x1800, 0x180), transmission_type(0x1800), inhibit_time(0x1800), event_timer(0x1800), sync_start(0x1800),
    cob_id(0x1801, 0x280), transmission_type(0x1801), inhibit_time(0x1801), event_timer(0x1801), sync_start(0x1801),
    cob_id(0x1802, 0x380), transmission_type(0x1802), inhibit_time(0x1802), event_timer(0x1802), sync_start(0x1802),
    cob_id(0x1803, 0x480), transmission_type(0x1803), inhibit_time(0x1803), event_timer(0x1803), sync_start(0x1803),
    map_count(0x1A00), map_entries(0x1A00),
    map_count(0x1A01), map_entries(0x1A01),
    map_count(0x1A02), map_entries(0x1A02),
    map_count(0x1A03), map_entries(0x1A03),
];
