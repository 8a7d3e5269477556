//! Types and units of what a master writes and reads.

use super::{Drives, NONE, Part, address, object, row};

pub(super) fn units(drives: Drives<'_>) -> Part {
    let unit = |name: &str, index: u16, sub: u8| {
        let name = format!("{name} {}", address(index, sub));
        row(name, drives, |drive| match object(drive, index, sub) {
            Some(object) if object.unit.is_empty() => object.data_type.name().to_owned(),
            Some(object) => format!("{} {}", object.data_type.name(), object.unit),
            None => NONE.to_owned(),
        })
    };
    Part {
        title: "types and units",
        rows: vec![
            unit("target position", 0x607A, 0),
            unit("actual position", 0x6064, 0),
            unit("target velocity", 0x60FF, 0),
            unit("velocity of mode 2", 0x6042, 0),
            unit("actual velocity", 0x606C, 0),
            unit("target torque", 0x6071, 0),
            unit("actual torque", 0x6077, 0),
            unit("actual current", 0x6078, 0),
            unit("profile velocity", 0x6081, 0),
            unit("profile acceleration", 0x6083, 0),
            unit("torque slope", 0x6087, 0),
            unit("electrical angle", 0x60EA, 0),
        ],
    }
}
