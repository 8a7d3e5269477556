//! One dictionary in two dialects: plain CiA 301, and every setting as the P3 has it.

use canopen::row::{bool, f32, i8, i16, i32, text, u8, u16, u32};
use canopen::{
    AcknowledgeData, Device, Dialect, Dictionary, Group, RangeAbort, Row, RpdoSync, SdoTransfers,
    UploadReply, dictionary,
};

/// Class of change of 0x2000,1.
pub const PLAIN: u8 = 1;
/// Class of change of 0x2005.
pub const COMMAND: u8 = 2;
/// Class of change of 0x2007.
pub const TARGET: u8 = 3;

const COMMUNICATION: &[Row] = &[
    i8(0x0002, 0, "Dummy INTEGER8").rpdo(),
    i16(0x0003, 0, "Dummy INTEGER16").rpdo(),
    i32(0x0004, 0, "Dummy INTEGER32").rpdo(),
    u8(0x0005, 0, "Dummy UNSIGNED8").rpdo(),
    u16(0x0006, 0, "Dummy UNSIGNED16").rpdo(),
    u32(0x0007, 0, "Dummy UNSIGNED32").rpdo(),
    u32(0x1000, 0, "Device type")
        .constant()
        .default(0x0002_0192),
    u8(0x1001, 0, "Error register").tpdo(),
    u8(0x1003, 0, "Number of errors").rw(),
    u32(0x1003, 1, "Standard error field").subs(8),
    u32(0x1005, 0, "COB-ID SYNC")
        .rw()
        .rpdo()
        .default(0x80)
        .store(Group::Communication),
    text(0x1008, 0, "Device name", "Test"),
    text(0x1009, 0, "Hardware version", "B2"),
    text(0x100A, 0, "Software version", ""),
    u32(0x1010, 1, "Store parameters")
        .subs(3)
        .rw()
        .asks()
        .default(1),
    u32(0x1014, 0, "COB-ID EMCY")
        .rw()
        .default_plus_node(0x80)
        .store(Group::Communication),
    u16(0x1017, 0, "Producer heartbeat time")
        .rw()
        .unit("ms")
        .store(Group::Communication),
    u32(0x1018, 1, "Identity").subs(4).constant().default(7),
    u32(0x1F80, 0, "NMT startup")
        .rw()
        .store(Group::Communication),
];

const fn pdo_cob_id(index: u16, base: u32) -> Row {
    u32(index, 1, "COB-ID used by PDO")
        .rw()
        .default_plus_node(base)
        .store(Group::Communication)
}

const fn pdo_type(index: u16) -> Row {
    u8(index, 2, "Transmission type")
        .rw()
        .default(255)
        .store(Group::Communication)
}

const fn map_count(index: u16) -> Row {
    u8(index, 0, "Number of mapped objects")
        .rw()
        .store(Group::Communication)
}

const fn map_entries(index: u16) -> Row {
    u32(index, 1, "Mapped object")
        .subs(8)
        .rw()
        .store(Group::Communication)
}

const PDOS: &[Row] = &[
    pdo_cob_id(0x1400, 0x200),
    pdo_type(0x1400),
    pdo_cob_id(0x1401, 0x300),
    pdo_type(0x1401),
    pdo_cob_id(0x1402, 0x400),
    pdo_type(0x1402),
    pdo_cob_id(0x1403, 0x500),
    pdo_type(0x1403),
    map_count(0x1600),
    map_entries(0x1600),
    map_count(0x1601),
    map_entries(0x1601),
    map_count(0x1602),
    map_entries(0x1602),
    map_count(0x1603),
    map_entries(0x1603),
    pdo_cob_id(0x1800, 0x180),
    pdo_type(0x1800),
    u16(0x1800, 3, "Inhibit time").rw().unit("100us"),
    u16(0x1800, 5, "Event timer").rw().unit("ms"),
    pdo_cob_id(0x1801, 0x280),
    pdo_type(0x1801),
    pdo_cob_id(0x1802, 0x380),
    pdo_type(0x1802),
    pdo_cob_id(0x1803, 0x480),
    pdo_type(0x1803),
    map_count(0x1A00),
    map_entries(0x1A00),
    map_count(0x1A01),
    map_entries(0x1A01),
    map_count(0x1A02),
    map_entries(0x1A02),
    map_count(0x1A03),
    map_entries(0x1A03),
];

/// An object of every type, then one of every kind.
const APPLICATION: &[Row] = &[
    u8(0x2000, 1, "Any UNSIGNED8")
        .rw()
        .rpdo()
        .tpdo()
        .tells(PLAIN)
        .store(Group::Application),
    u16(0x2000, 2, "Any UNSIGNED16")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    u32(0x2000, 3, "Any UNSIGNED32")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    i8(0x2000, 4, "Any INTEGER8")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    i16(0x2000, 5, "Any INTEGER16")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    i32(0x2000, 6, "Any INTEGER32")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    f32(0x2000, 7, "Any REAL32")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    bool(0x2000, 8, "Any BOOLEAN")
        .rw()
        .rpdo()
        .tpdo()
        .store(Group::Application),
    u16(0x2001, 0, "Read only").default(0x1234).tpdo(),
    u16(0x2002, 0, "Write only").wo().rpdo(),
    u32(0x2003, 0, "Constant").constant().default(0xCAFE_F00D),
    i16(0x2004, 1, "INTEGER16 with a range")
        .rw()
        .rpdo()
        .range(-10, 10)
        .store(Group::Application),
    u16(0x2004, 2, "UNSIGNED16 with a range")
        .rw()
        .rpdo()
        .default(5)
        .range(5, 100),
    f32(0x2004, 3, "REAL32 with a range")
        .rw()
        .rpdo()
        .range(-1, 1),
    u16(0x2005, 0, "Command")
        .rw()
        .rpdo()
        .tpdo()
        .asks()
        .tells(COMMAND),
    u8(0x2006, 0, "Mode").rw().rpdo().tpdo().asks(),
    u32(0x2007, 0, "Target").rw().rpdo().tpdo().tells(TARGET),
    i32(0x2008, 0, "Live position").tpdo().live(),
    i32(0x2009, 0, "Live velocity").tpdo().live(),
    u8(0x200A, 1, "A long run").subs(100).rw().rpdo().tpdo(),
    u8(0x200B, 0, "Not mappable").rw(),
    u8(0x200C, 1, "Before a gap").rw(),
    u8(0x200C, 3, "After a gap").rw(),
];

const PARTS: &[&[Row]] = &[APPLICATION, COMMUNICATION, PDOS];

/// The dictionary of both devices.
pub static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = OBJECTS_CONST;

/// The same as a constant, to resolve handles in.
pub const OBJECTS_CONST: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);

/// Bytes of an image.
pub const IMAGE_BYTES: usize = OBJECTS_CONST.image_bytes();

/// Plain CiA 301.
pub static STANDARD: Device = Device::new(&OBJECTS, Dialect::STANDARD);

/// CiA 301 with the least of everything: expedited SDO, PDOs by SYNC or at once, 11 bits.
pub static BASIC: Device = Device::new(
    &OBJECTS,
    Dialect {
        sdo: SdoTransfers::Expedited,
        pdo_events: false,
        type_254_by_timer: false,
        emcy_inhibit: false,
        produces_sync: false,
        remote_requests: false,
        extended_identifiers: false,
        lss: false,
        ..Dialect::STANDARD
    },
);

/// Every setting as the P3 has it.
pub static P3_LIKE: Device = Device::new(
    &OBJECTS,
    Dialect {
        short_requests: true,
        zero_padded_writes: false,
        upload_reply: UploadReply::Unsized,
        acknowledge_data: AcknowledgeData::Zeros,
        sdo: SdoTransfers::Expedited,
        range_abort: RangeAbort::Invalid,
        reconfigure_while_valid: true,
        short_mapping: false,
        rpdo_sync: RpdoSync::Nth,
        tpdo_type_0_is_cyclic: true,
        pdo_events: false,
        type_254_by_timer: false,
        emergencies: true,
        emcy_inhibit: false,
        produces_sync: false,
        remote_requests: false,
        tpdo_forbids_remote: false,
        extended_identifiers: false,
        lss: false,
        tpdo_in_pre_operational: true,
        boot_up: true,
        boots_to_operational: true,
        history_clearable: false,
    },
);

/// Acknowledges downloads with the data, otherwise plain.
pub static ECHOING: Device = Device::new(
    &OBJECTS,
    Dialect {
        acknowledge_data: AcknowledgeData::Echo,
        ..Dialect::STANDARD
    },
);

/// What neither the standard nor the P3 does: parts of objects in PDOs, no emergencies, no boot-up.
pub static LENIENT: Device = Device::new(
    &OBJECTS,
    Dialect {
        acknowledge_data: AcknowledgeData::Echo,
        reconfigure_while_valid: true,
        short_mapping: true,
        emergencies: false,
        boot_up: false,
        ..Dialect::STANDARD
    },
);
