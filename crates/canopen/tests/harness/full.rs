//! A device with every service and every kind of object, plain CiA 301.

use canopen::row::{
    bool, bytes, domain, f32, f64, i8, i16, i32, i64, string, text, u8, u16, u32, u64,
};
use canopen::{Device, Dialect, Dictionary, Group, Row, SdoTransfers, dictionary};

/// Class of change of 0x2010,1.
pub const TEXT: u8 = 4;
/// Class of change of 0x2020.
pub const STREAM: u8 = 5;
/// Class of change of 0x2000,9.
pub const WIDE: u8 = 6;

/// Characters of the constant text 0x2013,1: more than a block of 127 segments carries.
pub const LONG_TEXT: &str = {
    const TEN: &[u8; 10] = b"0123456789";
    const CHARACTERS: [u8; 1000] = {
        let mut characters = [0; 1000];
        let mut at = 0;
        while at < characters.len() {
            // So that no two blocks are alike.
            characters[at] = TEN[(at + at / 10 + at / 889) % 10];
            at += 1;
        }
        characters
    };
    match core::str::from_utf8(&CHARACTERS) {
        Ok(text) => text,
        Err(_) => panic!("digits"),
    }
};

const SERVICES: &[Row] = &[
    bool(0x0001, 0, "Dummy BOOLEAN").rpdo(),
    i8(0x0002, 0, "Dummy INTEGER8").rpdo(),
    i16(0x0003, 0, "Dummy INTEGER16").rpdo(),
    i32(0x0004, 0, "Dummy INTEGER32").rpdo(),
    u8(0x0005, 0, "Dummy UNSIGNED8").rpdo(),
    u16(0x0006, 0, "Dummy UNSIGNED16").rpdo(),
    u32(0x0007, 0, "Dummy UNSIGNED32").rpdo(),
    i64(0x0015, 0, "Dummy INTEGER64").rpdo(),
    u64(0x001B, 0, "Dummy UNSIGNED64").rpdo(),
    u32(0x1000, 0, "Device type")
        .constant()
        .default(0x0002_0192),
    u8(0x1001, 0, "Error register").tpdo(),
    u8(0x1003, 0, "Number of errors").rw(),
    u32(0x1003, 1, "Standard error field").subs(8),
    parameter(u32(0x1005, 0, "COB-ID SYNC").default(0x80)),
    parameter(u32(0x1006, 0, "Communication cycle period").unit("us")),
    parameter(u32(0x1007, 0, "Synchronous window length").unit("us")),
    text(0x1008, 0, "Device name", "Full device"),
    text(0x1009, 0, "Hardware version", ""),
    text(0x100A, 0, "Software version", "1.0"),
    parameter(u16(0x100C, 0, "Guard time").unit("ms")),
    parameter(u8(0x100D, 0, "Life time factor")),
    u32(0x1010, 1, "Store parameters")
        .subs(3)
        .rw()
        .asks()
        .default(1),
    u32(0x1011, 1, "Restore default parameters")
        .subs(3)
        .rw()
        .asks()
        .default(1),
    parameter(u32(0x1012, 0, "COB-ID TIME").default(0x100)),
    parameter(u32(0x1014, 0, "COB-ID EMCY").default_plus_node(0x80)),
    parameter(u16(0x1015, 0, "Inhibit time EMCY").unit("100us")),
    parameter(u32(0x1016, 1, "Consumer heartbeat time").subs(8)),
    parameter(u16(0x1017, 0, "Producer heartbeat time").unit("ms")),
    u32(0x1018, 1, "Vendor-ID").constant().default(0x0000_0408),
    u32(0x1018, 2, "Product code")
        .constant()
        .default(0x0050_3344),
    u32(0x1018, 3, "Revision number")
        .constant()
        .default(0x0001_0002),
    u32(0x1018, 4, "Serial number").default(0x1234_5678),
    parameter(u8(0x1019, 0, "Synchronous counter overflow value")),
    parameter(u32(0x1020, 1, "Configuration date")),
    parameter(u32(0x1020, 2, "Configuration time")),
    domain(0x1021, 0, "Store EDS"),
    u8(0x1022, 0, "Store format"),
    parameter(
        u32(0x1028, 1, "Emergency consumer")
            .subs(8)
            .default(0x8000_0000),
    ),
    parameter(u8(0x1029, 1, "Communication error")),
    parameter(u8(0x1029, 2, "Application error")),
    u32(0x1200, 1, "COB-ID client to server").default_plus_node(0x600),
    u32(0x1200, 2, "COB-ID server to client").default_plus_node(0x580),
    parameter(u32(0x1201, 1, "COB-ID client to server").default(0x8000_0000)),
    parameter(u32(0x1201, 2, "COB-ID server to client").default(0x8000_0000)),
    parameter(u8(0x1201, 3, "Node ID of the client")),
    parameter(u32(0x1202, 1, "COB-ID client to server").default(0x8000_0000)),
    parameter(u32(0x1202, 2, "COB-ID server to client").default(0x8000_0000)),
    parameter(u8(0x1202, 3, "Node ID of the client")),
    domain(0x1F50, 1, "Program data").rw(),
    parameter(u32(0x1F80, 0, "NMT startup")),
];

/// A communication parameter that can be written and stored.
const fn parameter(row: Row) -> Row {
    row.rw().store(Group::Communication)
}

const fn rpdo(index: u16, base: u32) -> [Row; 5] {
    [
        parameter(u32(index, 1, "COB-ID used by RPDO").default_plus_node(base)),
        parameter(u8(index, 2, "Transmission type").default(255)),
        parameter(u16(index, 5, "Event timer").unit("ms")),
        parameter(u8(index + 0x200, 0, "Number of mapped objects")),
        parameter(u32(index + 0x200, 1, "Mapped object").subs(64)),
    ]
}

const fn tpdo(index: u16, base: u32) -> [Row; 7] {
    [
        parameter(u32(index, 1, "COB-ID used by TPDO").default_plus_node(base)),
        parameter(u8(index, 2, "Transmission type").default(255)),
        parameter(u16(index, 3, "Inhibit time").unit("100us")),
        parameter(u16(index, 5, "Event timer").unit("ms")),
        parameter(u8(index, 6, "SYNC start value")),
        parameter(u8(index + 0x200, 0, "Number of mapped objects")),
        parameter(u32(index + 0x200, 1, "Mapped object").subs(64)),
    ]
}

/// An object that can be written, mapped and stored.
const fn value(row: Row) -> Row {
    row.rw().rpdo().tpdo().store(Group::Application)
}

/// An object of every type, then one of every kind. What `devices.rs` has, too, is alike there.
const APPLICATION: &[Row] = &[
    value(u8(0x2000, 1, "Any UNSIGNED8")),
    value(u16(0x2000, 2, "Any UNSIGNED16")),
    value(u32(0x2000, 3, "Any UNSIGNED32")),
    value(i8(0x2000, 4, "Any INTEGER8")),
    value(i16(0x2000, 5, "Any INTEGER16")),
    value(i32(0x2000, 6, "Any INTEGER32")),
    value(f32(0x2000, 7, "Any REAL32")),
    value(bool(0x2000, 8, "Any BOOLEAN")),
    value(i64(0x2000, 9, "Any INTEGER64").tells(WIDE)),
    value(u64(0x2000, 10, "Any UNSIGNED64")),
    value(f64(0x2000, 11, "Any REAL64")),
    u16(0x2001, 0, "Read only").default(0x1234).tpdo(),
    u16(0x2002, 0, "Write only").wo().rpdo(),
    u32(0x2003, 0, "Constant").constant().default(0xCAFE_F00D),
    value(i16(0x2004, 1, "INTEGER16 with a range").range(-10, 10)),
    value(
        u16(0x2004, 2, "UNSIGNED16 with a range")
            .default(5)
            .range(5, 100),
    ),
    value(f32(0x2004, 3, "REAL32 with a range").range(-1, 1)),
    value(i8(0x2004, 4, "INTEGER8 with a range").range(-3, 3)),
    value(
        u8(0x2004, 5, "UNSIGNED8 with a range")
            .default(1)
            .range(1, 9),
    ),
    value(i32(0x2004, 6, "INTEGER32 with a range").range(-100_000, 100_000)),
    value(
        u32(0x2004, 7, "UNSIGNED32 with a range")
            .default(1)
            .range(1, 0x8000_0000),
    ),
    value(i64(0x2004, 8, "INTEGER64 with a range").range(-0x1_0000_0000, 0x1_0000_0000)),
    value(
        u64(0x2004, 9, "UNSIGNED64 with a range")
            .default(1)
            .range(1, 0x1_0000_0000),
    ),
    value(f64(0x2004, 10, "REAL64 with a range").range(-1, 1)),
    value(u16(0x2005, 0, "Command").asks()),
    value(u8(0x2006, 0, "Mode").asks()),
    value(u32(0x2007, 0, "Target")),
    i32(0x2008, 0, "Live position").tpdo().live(),
    i32(0x2009, 0, "Live velocity").tpdo().live(),
    u8(0x200A, 1, "A long run").subs(100).rw().rpdo().tpdo(),
    u8(0x200B, 0, "Not mappable").rw(),
    u8(0x200C, 1, "Before a gap").rw(),
    u8(0x200C, 3, "After a gap").rw(),
    string(0x2010, 1, "Text", 32)
        .rw()
        .tells(TEXT)
        .store(Group::Application),
    string(0x2010, 2, "Short text", 4)
        .rw()
        .store(Group::Application),
    string(0x2010, 3, "Text that asks", 255).rw().asks(),
    string(0x2010, 4, "Text that the device writes", 20).live(),
    string(0x2010, 5, "Text to write only", 20).wo(),
    bytes(0x2011, 1, "Octets", 20)
        .rw()
        .store(Group::Application),
    bytes(0x2011, 2, "Three octets", 3).rw(),
    bytes(0x2011, 3, "Octets that ask", 14).rw().asks(),
    bytes(0x2011, 4, "Octets that nobody writes", 8),
    text(0x2013, 1, "Long text", LONG_TEXT),
    text(0x2013, 2, "Four characters", "four"),
    text(0x2013, 3, "Five characters", "fives"),
    text(0x2013, 4, "Seven characters", "sevenup"),
    text(0x2013, 5, "Eight characters", "eight888"),
    u64(0x2015, 0, "UNSIGNED64 that asks")
        .rw()
        .rpdo()
        .tpdo()
        .asks(),
    i64(0x2016, 0, "Live INTEGER64").tpdo().live(),
    u64(0x2017, 0, "UNSIGNED64 to write only").wo().rpdo(),
    u64(0x2018, 0, "Constant UNSIGNED64")
        .constant()
        .default(0x0123_4567_89AB_CDEF),
    domain(0x2020, 0, "Stream").rw().tells(STREAM),
    domain(0x2021, 0, "Stream to read"),
    domain(0x2022, 0, "Stream to write").wo(),
    bool(0x2030, 1, "Switch").subs(64).rw().rpdo().tpdo(),
];

const RPDO: [[Row; 5]; 4] = [
    rpdo(0x1400, 0x200),
    rpdo(0x1401, 0x300),
    rpdo(0x1402, 0x400),
    rpdo(0x1403, 0x500),
];
const TPDO: [[Row; 7]; 4] = [
    tpdo(0x1800, 0x180),
    tpdo(0x1801, 0x280),
    tpdo(0x1802, 0x380),
    tpdo(0x1803, 0x480),
];

const PARTS: &[&[Row]] = &[
    SERVICES,
    &RPDO[0],
    &RPDO[1],
    &RPDO[2],
    &RPDO[3],
    &TPDO[0],
    &TPDO[1],
    &TPDO[2],
    &TPDO[3],
    APPLICATION,
];

/// The dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = OBJECTS_CONST;

/// The same as a constant, to resolve handles in.
pub const OBJECTS_CONST: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);

/// Bytes of an image.
pub const IMAGE_BYTES: usize = OBJECTS_CONST.image_bytes();

/// The device.
pub static FULL: Device = Device::new(&OBJECTS, Dialect::STANDARD);

/// The same with blocks of `N` segments in downloads.
pub const fn with_blocks_of(block_size: u8) -> Device {
    Device::new(
        &OBJECTS,
        Dialect {
            sdo: SdoTransfers::All {
                timeout_ms: 1000,
                block_size,
            },
            ..Dialect::STANDARD
        },
    )
}
