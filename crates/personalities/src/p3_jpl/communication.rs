//! Rows 0x1000 to 0x1FFF, but for the PDOs, whose rows are those of the P3 of 2019.

use canopen::Group::Communication;
use canopen::Row;
use canopen::row::{text, u8, u16, u32};

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // No additional information, profile 402.
    u32(0x1000, 0, "Device type").constant().default(0x0002_0192),
    u8(0x1001, 0, "Error").tpdo(),
    u32(0x1005, 0, "Sync COB ID").rw().default(0x80).store(Communication),
    u32(0x1006, 0, "Sync period").unit("us"),
    // CHAR[4]: four characters, which an expedited transfer holds.
    text(0x1008, 0, "Mfg device name", "Puck"),
    text(0x1009, 0, "Mfg hardware version", "sim1"),
    text(0x100A, 0, "Mfg software version", "0.10"),
    // Reading 1 says "manual write support" (J2).
    u32(0x1010, 1, "Save All").rw().asks().default(1),
    // Stored; there are no emergencies (J16).
    u32(0x1014, 0, "Emergency COB ID").rw().default_plus_node(0x80).store(Communication),
    u16(0x1015, 0, "Emergency inhibit time").rw().unit("100us").store(Communication),
    u16(0x1017, 0, "Heartbeat period").rw().unit("ms").store(Communication),
    // As of the P3 of 2019: Barrett's vendor ID; product code and revision are this project's.
    u32(0x1018, 1, "Vendor ID").constant().default(0x408),
    u32(0x1018, 2, "Product code").constant().default(0x5031),
    u32(0x1018, 3, "Revision number").constant().default(0x0001_0000),
    u32(0x1018, 4, "Serial number"),
    u32(0x1018, 5, "Machine code").rw().store(Communication),
    u32(0x1018, 6, "Role code").rw().store(Communication),
    u32(0x1200, 1, "SDO receive COB ID").default_plus_node(0x600),
    u32(0x1200, 2, "SDO transmit COB ID").default_plus_node(0x580),
    // Stored; the first NMT message says the state (J9).
    u32(0x1F80, 0, "NMT startup").rw().store(Communication),
];
