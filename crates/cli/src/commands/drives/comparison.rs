//! The comparison itself, made of the personalities' tables.

mod errors;
mod limits;
mod services;
mod start;
mod state_machine;
mod units;

use canopen::{Access, Default, Row as Object};
use cia402::Mode;
use personalities::Personality;
use serde::Serialize;

use start::Start;

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
    let starts: Vec<Start> = drives.iter().map(|drive| Start::of(drive)).collect();
    vec![
        general(drives),
        modes(drives),
        state_machine::state_machine(drives),
        services::services(drives),
        units::units(drives),
        errors::errors(drives),
        errors::thresholds(drives, &starts),
        limits::limits(drives, &starts),
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

/// As an object is named on the command line.
fn address(index: u16, sub: u8) -> String {
    match sub {
        0 => format!("0x{index:04X}"),
        _ => format!("0x{index:04X},{sub}"),
    }
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
            cells(&parts, "bus over-voltage"),
            ["0x3210 fault", "0x3210 fault"]
        );
    }

    /// Nothing of a drive is left out because nobody has thought of it.
    #[test]
    fn every_mode_and_every_error_of_every_drive_is_there() {
        let parts = compare(personalities::ALL);
        let part = |title| parts.iter().find(|part| part.title == title).unwrap();
        for (n, drive) in personalities::ALL.iter().enumerate() {
            let modes = (-16..16).filter(|mode| drive.offers(*mode)).count();
            let says = usize::from(has(drive, 0x6502, 0));
            let rows = &part("modes of operation").rows;
            let count = rows.iter().filter(|row| row.drives[n] != NONE).count();
            assert_eq!(count, modes + says, "{}: and 0x6502", drive.name);

            let rows = &part("errors").rows;
            for fault in drive.faults {
                let name = drive
                    .cause_name(fault.cause)
                    .expect("every cause has a name");
                let row = rows.iter().find(|row| row.name == name).expect(name);
                let says = match drive.device.dialect.emergencies {
                    true => format!("0x{:04X} ", fault.code),
                    false => format!("bit {} ", fault.register_bit),
                };
                assert!(row.drives[n].contains(&says), "{}: {name}", drive.name);
            }
            // And nothing that it does not announce.
            for row in rows.iter().filter(|row| row.drives[n] != NONE) {
                let mut faults = drive.faults.iter();
                let code = row.drives[n].split(' ').next().unwrap();
                let is_there = faults.any(|fault| format!("0x{:04X}", fault.code) == code);
                let is_there = is_there || !drive.device.dialect.emergencies;
                assert!(is_there, "{}: {}", drive.name, row.name);
            }
        }
    }

    /// An integrator finds what a drive of its own kind has beside what others have, in both rows.
    #[test]
    fn own_errors_stand_with_their_names_and_with_their_codes() {
        let drives =
            ["p3", "roboteq", "md80"].map(|name| personalities::by_name(name).expect(name));
        let parts = compare(&drives);
        for (row, expected) in [
            (
                "bus over-voltage",
                ["0x3210 fault", "0x3210 fault", "0x3210 fault"],
            ),
            (
                "encoder feedback",
                [
                    "0x7320 fault",
                    "0x7305 fault",
                    "0x7305 critical fault, 0x7305 fault",
                ],
            ),
            ("hardware: over-voltage", ["-", "-", "0x3210 fault"]),
            (
                "main encoder: position invalid",
                ["-", "-", "0x7305 critical fault"],
            ),
            ("closed loop error", ["-", "0x8400 fault", "-"]),
            ("hardware: ADC offsets", ["-", "-", "0x5210 critical fault"]),
        ] {
            assert_eq!(cells(&parts, row), expected, "{row}");
        }
    }

    /// A limit is where the drive looks for it, and what a virtual drive has there.
    #[test]
    fn limits_are_those_that_the_axis_looks_at() {
        let drives = ["p3", "p3-jpl", "roboteq-2", "md80"];
        let drives = drives.map(|name| personalities::by_name(name).expect(name));
        let parts = compare(&drives);
        let limits = &parts.last().unwrap().rows;
        let row = |name: &str| {
            let row = limits.iter().find(|row| row.name == name).expect(name);
            row.drives.clone()
        };
        assert_eq!(
            row("torque"),
            [
                "0x6072 1000 permille",
                "0x3F00,43 2000 permille",
                "0x302A,1 30 0.1A",
                "0x6072 1000 permille"
            ]
        );
        assert_eq!(
            row("current of the amplifier"),
            [
                "0x3001,8 3500 mA",
                "3.5 A",
                "4 A",
                "80 A, 0x6073 20000 permille, 0x6075 1000 mA"
            ]
        );
        assert_eq!(row("velocity")[1], "0x3F00,45 900 cts/ms");
        let thresholds = parts
            .iter()
            .find(|part| part.title == "thresholds of errors");
        let rows = &thresholds.unwrap().rows;
        let over_voltage = rows
            .iter()
            .find(|row| row.name == "bus over-voltage")
            .unwrap();
        assert_eq!(
            over_voltage.drives,
            ["0x2384,6 520 0.1V", "-", "0x30F4,1 500 0.1V", "always"]
        );
    }
}
