//! CiA 301: services, PDOs, and the controller's own commands and queries.

use canopen::Group::{Application, Communication};
use canopen::Row;
use canopen::row::{i16, i32, text, u8, u16, u32};

use crate::pdo_rows::{cob_id, event_timer, inhibit_time, transmission_type};

/// User variables: those that the PDOs of a new controller carry.
pub(super) const VARIABLES: u8 = 16;

/// The document says nothing of CiA 301; these are the objects of the maker's public data sheet.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    u32(0x1000, 0, "Device type").constant().default(0x192),
    u8(0x1001, 0, "Error register").tpdo(),
    u8(0x1003, 0, "Number of errors").rw(),
    u32(0x1003, 1, "Standard error field").subs(8),
    u32(0x1005, 0, "COB-ID SYNC message").rw().default(0x80).store(Communication),
    text(0x1008, 0, "Manufacturer device name", "RoboMC"),
    text(0x1009, 0, "Manufacturer hardware version", "simulated"),
    text(0x100A, 0, "Manufacturer software version", "1.9"), // the document's first page
    u16(0x100C, 0, "Guard time").rw().unit("ms").store(Communication),
    u8(0x100D, 0, "Life time factor").rw().store(Communication),
    u32(0x1010, 1, "Save all parameters").rw().asks().default(1),
    u32(0x1010, 2, "Save communication parameters").rw().asks().default(1),
    u32(0x1010, 3, "Save application parameters").rw().asks().default(1),
    u32(0x1011, 1, "Restore all default parameters").rw().asks().default(1),
    u32(0x1011, 2, "Restore communication default parameters").rw().asks().default(1),
    u32(0x1011, 3, "Restore application default parameters").rw().asks().default(1),
    u32(0x1014, 0, "COB-ID EMCY").rw().default_plus_node(0x80).store(Communication),
    u32(0x1016, 1, "Consumer heartbeat time").subs(4).rw().store(Communication),
    u16(0x1017, 0, "Producer heartbeat time").rw().unit("ms").store(Communication),
    u32(0x1018, 1, "Vendor ID").constant().default(0x469),
    u32(0x1018, 2, "Product code").constant(),
    u32(0x1018, 3, "Revision number").constant(),
    u32(0x1018, 4, "Serial number"),
    i32(0x2005, 1, "Set user variable (VAR)").subs(VARIABLES).wo().rpdo().asks(),
    i32(0x2106, 1, "Read user variable (VAR)").subs(VARIABLES).tpdo().live(),
    u8(0x200C, 0, "Emergency stop (EX)").wo().rpdo().asks(),
    u8(0x200D, 0, "Release emergency stop (MG)").wo().rpdo().asks(),
    u8(0x200E, 0, "Stop a channel (MS)").wo().rpdo().asks(),
    u8(0x2017, 0, "Save the configuration (EES)").wo().asks(),
    u16(0x210D, 1, "Internal voltage (V)").unit("0.1V").tpdo().default(120),
    u16(0x210D, 2, "Battery voltage (V)").unit("0.1V").tpdo().live(),
    u16(0x210D, 3, "Voltage of the 5 V output (V)").unit("mV").tpdo().default(5000),
    i16(0x210F, 1, "Temperature of the processor (T)").unit("degC").tpdo().live(),
    i16(0x210F, 2, "Temperature of the heat sink (T)").unit("degC").tpdo().live(),
    u16(0x2111, 0, "Status flags (FS)").tpdo().live(),
    u16(0x2112, 0, "Fault flags (FF)").tpdo().live(),
    // What a serial line sets with ^. The document has no access to it by CAN; these numbers are ours.
    // 0x3008 has the number that the maker's manual gives to ^RWD, as those of the channels have theirs.
    u16(0x3008, 0, "Watchdog of commands (^RWD)").rw().unit("ms").range(0, 65_000).default(1000).store(Application),
    u8(0x30F1, 0, "State machine is active (^FSA)").rw().range(0, 1).asks().store(Application),
    u16(0x30F4, 1, "Overvoltage limit (^OVL)").rw().unit("0.1V").range(100, 650).default(500).store(Application),
    u16(0x30F4, 2, "Undervoltage limit (^UVL)").rw().unit("0.1V").range(50, 650).default(100).store(Application),
    u16(0x30F4, 3, "Overtemperature limit (^OTL)").rw().unit("degC").range(40, 125).default(85).store(Application),
];

/// COB-IDs of TPDOs: bit 30, no remote requests, stays set.
const NO_REMOTE: u32 = 1 << 30;

const fn map_count(index: u16) -> Row {
    u8(index, 0, "Number of mapped objects")
        .rw()
        .default(2)
        .store(Communication)
}

/// The `first` and the next user variable; six entries more are empty.
const fn mapped(index: u16, sub: u8, object: u16, variable: u8) -> Row {
    u32(index, sub, "Mapped object")
        .rw()
        .default((object as i64) << 16 | (variable as i64) << 8 | 32)
        .store(Communication)
}

const fn rest(index: u16) -> Row {
    u32(index, 3, "Mapped object")
        .subs(6)
        .rw()
        .store(Communication)
}

/// Two user variables in each PDO: TPDOs carry 1 to 8, RPDOs 9 to 16.
#[rustfmt::skip]
pub(super) const PDO_ROWS: &[Row] = &[
    cob_id(0x1400, 0x200), transmission_type(0x1400), event_timer(0x1400),
    cob_id(0x1401, 0x300), transmission_type(0x1401), event_timer(0x1401),
    cob_id(0x1402, 0x400), transmission_type(0x1402), event_timer(0x1402),
    cob_id(0x1403, 0x500), transmission_type(0x1403), event_timer(0x1403),
    map_count(0x1600), mapped(0x1600, 1, 0x2005, 9), mapped(0x1600, 2, 0x2005, 10), rest(0x1600),
    map_count(0x1601), mapped(0x1601, 1, 0x2005, 11), mapped(0x1601, 2, 0x2005, 12), rest(0x1601),
    map_count(0x1602), mapped(0x1602, 1, 0x2005, 13), mapped(0x1602, 2, 0x2005, 14), rest(0x1602),
    map_count(0x1603), mapped(0x1603, 1, 0x2005, 15), mapped(0x1603, 2, 0x2005, 16), rest(0x1603),
    cob_id(0x1800, NO_REMOTE | 0x180), transmission_type(0x1800), inhibit_time(0x1800), event_timer(0x1800),
    cob_id(0x1801, NO_REMOTE | 0x280), transmission_type(0x1801), inhibit_time(0x1801), event_timer(0x1801),
    cob_id(0x1802, NO_REMOTE | 0x380), transmission_type(0x1802), inhibit_time(0x1802), event_timer(0x1802),
    cob_id(0x1803, NO_REMOTE | 0x480), transmission_type(0x1803), inhibit_time(0x1803), event_timer(0x1803),
    map_count(0x1A00), mapped(0x1A00, 1, 0x2106, 1), mapped(0x1A00, 2, 0x2106, 2), rest(0x1A00),
    map_count(0x1A01), mapped(0x1A01, 1, 0x2106, 3), mapped(0x1A01, 2, 0x2106, 4), rest(0x1A01),
    map_count(0x1A02), mapped(0x1A02, 1, 0x2106, 5), mapped(0x1A02, 2, 0x2106, 6), rest(0x1A02),
    map_count(0x1A03), mapped(0x1A03, 1, 0x2106, 7), mapped(0x1A03, 2, 0x2106, 8), rest(0x1A03),
];
