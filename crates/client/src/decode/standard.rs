//! Names and types of the objects that CiA 301 and 402 define, for nodes without a dictionary.

use canopen::{Address, DataType};

use super::modes::axis;

use DataType::{I8, I16, I32, Text, U8, U16, U32};

/// Index, sub-index, name, type.
const OBJECTS: &[(u16, u8, &str, DataType)] = &[
    (0x1000, 0, "Device type", U32),
    (0x1001, 0, "Error register", U8),
    (0x1002, 0, "Manufacturer status register", U32),
    (0x1005, 0, "COB-ID SYNC", U32),
    (0x1006, 0, "Communication cycle period", U32),
    (0x1008, 0, "Manufacturer device name", Text),
    (0x1009, 0, "Manufacturer hardware version", Text),
    (0x100A, 0, "Manufacturer software version", Text),
    (0x1014, 0, "COB-ID EMCY", U32),
    (0x1015, 0, "Inhibit time EMCY", U16),
    (0x1017, 0, "Producer heartbeat time", U16),
    (0x1018, 1, "Vendor ID", U32),
    (0x1018, 2, "Product code", U32),
    (0x1018, 3, "Revision number", U32),
    (0x1018, 4, "Serial number", U32),
    (0x1F80, 0, "NMT startup", U32),
    (0x603F, 0, "Error code", U16),
    (0x6040, 0, "Controlword", U16),
    (0x6041, 0, "Statusword", U16),
    (0x6042, 0, "vl target velocity", I16),
    (0x605A, 0, "Quick stop option code", I16),
    (0x6060, 0, "Modes of operation", I8),
    (0x6061, 0, "Modes of operation display", I8),
    (0x6062, 0, "Position demand value", I32),
    (0x6063, 0, "Position actual internal value", I32),
    (0x6064, 0, "Position actual value", I32),
    (0x6065, 0, "Following error window", U32),
    (0x6066, 0, "Following error time out", U16),
    (0x606B, 0, "Velocity demand value", I32),
    (0x606C, 0, "Velocity actual value", I32),
    (0x6071, 0, "Target torque", I16),
    (0x6072, 0, "Max torque", U16),
    (0x6074, 0, "Torque demand", I16),
    (0x6075, 0, "Motor rated current", U32),
    (0x6076, 0, "Motor rated torque", U32),
    (0x6077, 0, "Torque actual value", I16),
    (0x6078, 0, "Current actual value", I16),
    (0x6079, 0, "DC link circuit voltage", U32),
    (0x607A, 0, "Target position", I32),
    (0x607C, 0, "Home offset", I32),
    (0x607D, 1, "Min position limit", I32),
    (0x607D, 2, "Max position limit", I32),
    (0x607F, 0, "Max profile velocity", U32),
    (0x6080, 0, "Max motor speed", U32),
    (0x6081, 0, "Profile velocity", U32),
    (0x6083, 0, "Profile acceleration", U32),
    (0x6084, 0, "Profile deceleration", U32),
    (0x6085, 0, "Quick stop deceleration", U32),
    (0x6087, 0, "Torque slope", U32),
    (0x6098, 0, "Homing method", I8),
    (0x60B0, 0, "Position offset", I32),
    (0x60B1, 0, "Velocity offset", I32),
    (0x60B2, 0, "Torque offset", I16),
    (0x60C2, 1, "Interpolation time period value", U8),
    (0x60C2, 2, "Interpolation time index", I8),
    (0x60F4, 0, "Following error actual value", I32),
    (0x60FC, 0, "Position demand internal value", I32),
    (0x60FD, 0, "Digital inputs", U32),
    (0x60FF, 0, "Target velocity", I32),
    (0x6502, 0, "Supported drive modes", U32),
];

/// Index ranges whose sub-indices are alike: first and last index, first and last sub-index, name,
/// type.
const RUNS: &[(u16, u16, u8, u8, &str, DataType)] = &[
    // The dummy entries for PDO mapping (CiA 301 7.4.8).
    (0x0002, 0x0002, 0, 0, "Dummy INTEGER8", I8),
    (0x0003, 0x0003, 0, 0, "Dummy INTEGER16", I16),
    (0x0004, 0x0004, 0, 0, "Dummy INTEGER32", I32),
    (0x0005, 0x0005, 0, 0, "Dummy UNSIGNED8", U8),
    (0x0006, 0x0006, 0, 0, "Dummy UNSIGNED16", U16),
    (0x0007, 0x0007, 0, 0, "Dummy UNSIGNED32", U32),
    (0x1003, 0x1003, 0, 0, "Number of errors", U8),
    (0x1003, 0x1003, 1, 254, "Standard error field", U32),
    (0x1010, 0x1010, 1, 127, "Store parameters", U32),
    (0x1011, 0x1011, 1, 127, "Restore default parameters", U32),
    (0x1200, 0x127F, 1, 2, "SDO server COB-ID", U32),
    (0x1400, 0x15FF, 1, 1, "RPDO COB-ID", U32),
    (0x1400, 0x15FF, 2, 2, "RPDO transmission type", U8),
    (0x1400, 0x15FF, 3, 3, "RPDO inhibit time", U16),
    (0x1400, 0x15FF, 5, 5, "RPDO event timer", U16),
    (0x1600, 0x17FF, 0, 0, "RPDO number of mapped objects", U8),
    (0x1600, 0x17FF, 1, 64, "RPDO mapped object", U32),
    (0x1800, 0x19FF, 1, 1, "TPDO COB-ID", U32),
    (0x1800, 0x19FF, 2, 2, "TPDO transmission type", U8),
    (0x1800, 0x19FF, 3, 3, "TPDO inhibit time", U16),
    (0x1800, 0x19FF, 5, 5, "TPDO event timer", U16),
    (0x1A00, 0x1BFF, 0, 0, "TPDO number of mapped objects", U8),
    (0x1A00, 0x1BFF, 1, 64, "TPDO mapped object", U32),
];

/// The type of an object that CiA 301 or 402 defines; of the latter for each of the axes that a device can
/// have.
pub fn standard_type(address: Address) -> Option<DataType> {
    find(axis(address).1).map(|(_, data_type)| data_type)
}

/// Name and type of a standard object.
pub(super) fn find(address: Address) -> Option<(&'static str, DataType)> {
    let (index, sub) = (address.index, address.sub);
    let single = OBJECTS.iter().find(|row| (row.0, row.1) == (index, sub));
    let single = single.map(|&(_, _, name, data_type)| (name, data_type));
    single.or_else(|| {
        let run = RUNS.iter().find(|&&(first, last, low, high, _, _)| {
            (first..=last).contains(&index) && (low..=high).contains(&sub)
        });
        run.map(|&(_, _, _, _, name, data_type)| (name, data_type))
    })
}
