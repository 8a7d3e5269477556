//! The comparison itself, made of the personalities' tables.

use std::collections::BTreeSet;

use canopen::{
    Access, AcknowledgeData, Default, RangeAbort, Row as Object, RpdoSync, SdoTransfers,
    UploadReply,
};
use cia402::Mode;
use personalities::{Cause, FaultRow, Kind, Personality};
use serde::Serialize;

/// Rows that belong together.
#[derive(Debug, Serialize)]
pub(super) struct Part {
    pub(super) title: &'static str,
    pub(super) rows: Vec<Row>,
}

/// One thing, and what each drive has of it.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    /// In the order of the drives.
    pub(super) drives: Vec<String>,
}

/// What a drive does not have.
const NONE: &str = "-";

type Drives<'a> = &'a [&'static Personality];

/// Everything about these drives.
pub(super) fn compare(drives: Drives<'_>) -> Vec<Part> {
    vec![
        general(drives),
        modes(drives),
        services(drives),
        units(drives),
        errors(drives),
        limits(drives),
    ]
}

fn row(name: impl Into<String>, drives: Drives<'_>, cell: impl Fn(&Personality) -> String) -> Row {
    Row {
        name: name.into(),
        drives: drives.iter().map(|drive| cell(drive)).collect(),
    }
}

fn yes(has: bool) -> String {
    if has { "yes" } else { NONE }.to_owned()
}

/// The row that declares an object; a run of sub-indices is one row.
fn object(drive: &Personality, index: u16, sub: u8) -> Option<&'static Object> {
    drive.device.table.rows().iter().find(|row| {
        let first = row.address.sub;
        row.address.index == index && (first..first.saturating_add(row.count)).contains(&sub)
    })
}

fn has(drive: &Personality, index: u16, sub: u8) -> bool {
    object(drive, index, sub).is_some()
}

/// How many of the objects from `first` on the drive has, one index each.
fn run(drive: &Personality, first: u16, most: u16, sub: u8) -> String {
    let count = (first..first + most)
        .filter(|index| has(drive, *index, sub))
        .count();
    if count == 0 {
        NONE.to_owned()
    } else {
        count.to_string()
    }
}

fn general(drives: Drives<'_>) -> Part {
    let rates = |drive: &Personality| {
        let rates: Vec<String> = drive
            .bit_rates
            .iter()
            .map(|rate| rate.to_string())
            .collect();
        match rates.as_slice() {
            [] => NONE.to_owned(),
            [only] => only.clone(),
            [first, .., last] => format!("{first} to {last}"),
        }
    };
    let objects = |drive: &Personality| {
        let rows = drive.device.table.rows().iter();
        let seen = rows.filter(|row| row.access != Access::Internal);
        let count: u32 = seen.map(|row| u32::from(row.count)).sum();
        count.to_string()
    };
    Part {
        title: "drive",
        rows: vec![
            row("motor channels", drives, |drive| {
                drive.axes.len().to_string()
            }),
            row("bit rates", drives, rates),
            row("objects", drives, objects),
            row("device type 0x1000", drives, |drive| {
                default(drive, 0x1000, 0, |value| format!("0x{value:08X}"))
            }),
        ],
    }
}

fn modes(drives: Drives<'_>) -> Part {
    let offered = |drive: &Personality, number| drive.offers(number);
    let rows = (-16..16)
        .filter(|number| drives.iter().any(|drive| offered(drive, *number)))
        .map(|number| {
            let name = match Mode(number).name() {
                Some(name) => format!("{number} {name}"),
                None => format!("{number} the maker's own"),
            };
            row(name, drives, |drive| {
                let mut own = drive.words.modes.iter();
                match own.find(|(own, _)| *own == number) {
                    Some((_, name)) if offered(drive, number) => (*name).to_owned(),
                    _ => yes(offered(drive, number)),
                }
            })
        });
    let mut rows: Vec<Row> = rows.collect();
    rows.push(row("0x6502", drives, |drive| {
        default(drive, 0x6502, 0, |value| format!("0x{value:04X}"))
    }));
    Part {
        title: "modes of operation",
        rows,
    }
}

fn services(drives: Drives<'_>) -> Part {
    let sdo = |drive: &Personality| {
        match drive.device.dialect.sdo {
            SdoTransfers::Expedited => "expedited",
            SdoTransfers::All { .. } => "expedited, segments, blocks",
        }
        .to_owned()
    };
    let reply = |drive: &Personality| {
        match drive.device.dialect.upload_reply {
            UploadReply::Sized => "says its size",
            UploadReply::Unsized => "0x42, no size",
        }
        .to_owned()
    };
    let acknowledge = |drive: &Personality| {
        match drive.device.dialect.acknowledge_data {
            AcknowledgeData::Zeros => "zeros",
            AcknowledgeData::Echo => "the data",
        }
        .to_owned()
    };
    let range = |drive: &Personality| {
        match drive.device.dialect.range_abort {
            RangeAbort::TooHighTooLow => "0x06090031, 0x06090032",
            RangeAbort::Invalid => "0x06090030",
        }
        .to_owned()
    };
    let rpdo_sync = |drive: &Personality| {
        match drive.device.dialect.rpdo_sync {
            RpdoSync::Next => "the next SYNC",
            RpdoSync::Nth => "the nth SYNC",
        }
        .to_owned()
    };
    let flag = |name: &str, is: fn(&canopen::Dialect) -> bool| {
        row(name, drives, |drive| yes(is(&drive.device.dialect)))
    };
    let object =
        |name: &str, index: u16, sub: u8| row(name, drives, |drive| yes(has(drive, index, sub)));
    Part {
        title: "services",
        rows: vec![
            row("SDO transfers", drives, sdo),
            flag("SDO requests of 4 to 7 bytes", |dialect| {
                dialect.short_requests
            }),
            row("upload answer", drives, reply),
            row("download acknowledge holds", drives, acknowledge),
            row("abort out of range", drives, range),
            row("RPDOs", drives, |drive| run(drive, 0x1400, 512, 1)),
            row("TPDOs", drives, |drive| run(drive, 0x1800, 512, 1)),
            row("objects in a PDO", drives, |drive| {
                let highest = drive.device.table.highest_sub_index(0x1A00);
                highest.map_or(NONE.to_owned(), |highest| highest.to_string())
            }),
            row("RPDO type n is applied with", drives, rpdo_sync),
            flag("TPDO type 0 on every SYNC", |dialect| {
                dialect.tpdo_type_0_is_cyclic
            }),
            flag("TPDOs by events", |dialect| dialect.pdo_events),
            flag("parts of objects in PDOs", |dialect| dialect.short_mapping),
            flag("PDOs mapped while valid", |dialect| {
                dialect.reconfigure_while_valid
            }),
            flag("TPDOs in pre-operational", |dialect| {
                dialect.tpdo_in_pre_operational
            }),
            flag("remote requests", |dialect| dialect.remote_requests),
            flag("SYNC producer", |dialect| dialect.produces_sync),
            object("heartbeat producer", 0x1017, 0),
            object("heartbeat consumer", 0x1016, 1),
            object("guarding", 0x100C, 0),
            row("emergencies", drives, |drive| {
                yes(has(drive, 0x1014, 0) && drive.device.dialect.emergencies)
            }),
            object("error history", 0x1003, 1),
            object("time stamp", 0x1012, 0),
            flag("LSS", |dialect| dialect.lss),
            flag("boot-up frame", |dialect| dialect.boot_up),
            flag("operational after boot-up", |dialect| {
                dialect.boots_to_operational
            }),
            object("store 0x1010", 0x1010, 1),
            object("restore 0x1011", 0x1011, 1),
            object("program download", 0x1F50, 1),
            row("serial command line", drives, |drive| match drive.serial {
                Some(port) => format!("{} bit/s", port.bits_per_s),
                None => NONE.to_owned(),
            }),
        ],
    }
}

fn units(drives: Drives<'_>) -> Part {
    let unit = |name: &str, index: u16, sub: u8| {
        let name = match sub {
            0 => format!("{name} 0x{index:04X}"),
            _ => format!("{name} 0x{index:04X},{sub}"),
        };
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

/// The errors that any of the drives announces, in the order of the first table that has them. A drive's
/// own causes have a row for each.
fn errors(drives: Drives<'_>) -> Part {
    let mut rows: Vec<Row> = Vec::new();
    let mut seen = BTreeSet::new();
    for drive in drives {
        for fault in drive.faults {
            let (name, is_own) = words(drive, fault.cause);
            if !seen.insert(name.clone()) {
                continue;
            }
            let same = |other: &Personality| -> Vec<&FaultRow> {
                let faults = other.faults.iter();
                faults
                    .filter(|row| row.cause == fault.cause && (!is_own || other.name == drive.name))
                    .collect()
            };
            rows.push(row(name, drives, |other| {
                let faults = same(other);
                let faults: Vec<String> = faults.iter().map(|row| error(other, row)).collect();
                match faults.as_slice() {
                    [] => NONE.to_owned(),
                    faults => faults.join(", "),
                }
            }));
        }
    }
    Part {
        title: "errors",
        rows,
    }
}

/// Its code, or its bit in 0x1001 where no emergency tells a code.
fn error(drive: &Personality, row: &FaultRow) -> String {
    let kind = match row.kind {
        Kind::Warning => "warning",
        Kind::Fault => "fault",
        Kind::Critical => "critical fault",
    };
    match drive.device.dialect.emergencies {
        true => format!("0x{:04X} {kind}", row.code),
        false => format!("bit {} {kind}", row.register_bit),
    }
}

/// The name of a cause in words, and whether it is one drive's own.
fn words(drive: &Personality, cause: Cause) -> (String, bool) {
    if let Cause::Own(number) = cause {
        let name = drive.words.own_cause(number).unwrap_or("own");
        return (format!("{}: {name}", drive.name), true);
    }
    let mut words = String::new();
    for letter in format!("{cause:?}").chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    (words, false)
}

fn limits(drives: Drives<'_>) -> Part {
    let limit = |name: &str, index: u16, sub: u8| {
        let name = match sub {
            0 => format!("{name} 0x{index:04X}"),
            _ => format!("{name} 0x{index:04X},{sub}"),
        };
        row(name, drives, |drive| {
            let unit = object(drive, index, sub).map_or("", |object| object.unit);
            default(drive, index, sub, |value| {
                format!("{value} {unit}").trim_end().to_owned()
            })
        })
    };
    Part {
        title: "limits",
        rows: vec![
            limit("least position", 0x607D, 1),
            limit("greatest position", 0x607D, 2),
            limit("following error", 0x6065, 0),
            limit("profile velocity", 0x607F, 0),
            limit("motor speed", 0x6080, 0),
            limit("acceleration", 0x60C5, 0),
            limit("deceleration", 0x60C6, 0),
            limit("quick stop deceleration", 0x6085, 0),
            limit("torque", 0x6072, 0),
            limit("current", 0x6073, 0),
            limit("rated current", 0x6075, 0),
            limit("rated torque", 0x6076, 0),
            limit("position window", 0x6067, 0),
            limit("velocity window", 0x606D, 0),
        ],
    }
}

/// The default of an object in words; "yes" if it is no number.
fn default(drive: &Personality, index: u16, sub: u8, words: impl FnOnce(i64) -> String) -> String {
    match object(drive, index, sub).map(|object| object.default) {
        None => NONE.to_owned(),
        Some(Default::Value(value)) => words(value),
        Some(Default::Real(value)) => value.to_string(),
        Some(_) => yes(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(parts: &[Part], name: &str) -> Vec<String> {
        let mut rows = parts.iter().flat_map(|part| &part.rows);
        let row = rows.find(|row| row.name == name).expect(name);
        row.drives.clone()
    }

    /// Known from the manuals: P3 l.166, P54, P13, P24.
    #[test]
    fn what_is_known_of_the_two_p3s() {
        let drives = ["p3", "p3-extended"].map(|name| personalities::by_name(name).expect(name));
        let parts = compare(&drives);
        assert_eq!(
            cells(&parts, "SDO transfers"),
            ["expedited", "expedited, segments, blocks"]
        );
        assert_eq!(cells(&parts, "7 interpolated position"), ["-", "yes"]);
        assert_eq!(cells(&parts, "TPDO type 0 on every SYNC"), ["yes", "-"]);
        assert_eq!(
            cells(&parts, "actual current 0x6078"),
            ["INTEGER16 mA", "INTEGER16 mA"]
        );
        assert_eq!(
            cells(&parts, "bus over voltage"),
            ["0x3210 fault", "0x3210 fault"]
        );
    }

    /// Nothing of a drive is left out because nobody has thought of it.
    #[test]
    fn every_mode_and_every_error_of_every_drive_is_there() {
        let parts = compare(personalities::ALL);
        for (n, drive) in personalities::ALL.iter().enumerate() {
            let count = |part: &Part| part.rows.iter().filter(|row| row.drives[n] != NONE).count();
            let modes = (-16..16).filter(|mode| drive.offers(*mode));
            let says = usize::from(has(drive, 0x6502, 0));
            assert_eq!(
                count(&parts[1]),
                modes.count() + says,
                "{}: and 0x6502",
                drive.name
            );
            let causes: BTreeSet<String> = drive
                .faults
                .iter()
                .map(|row| words(drive, row.cause).0)
                .collect();
            assert_eq!(count(&parts[4]), causes.len(), "{}", drive.name);
        }
    }
}
