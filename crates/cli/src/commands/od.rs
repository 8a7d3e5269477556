//! `servobus od`: the object dictionary of a drive.

use std::process::ExitCode;

use canopen::{Access, Address, DataType, Default, Group, Row, Table};
use personalities::Personality;
use serde::Serialize;

use crate::{Failure, drive_kind, output};

/// List the object dictionary of a drive.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus od p3
  servobus od p3 | grep -i velocity
  servobus od p3 --json > p3.json

Columns: access is ro, rw, wo or const; PDO is R (may be received) and T (may be transmitted); a
default of 0x180+id is that plus the node ID; store says which save command (0x1010) keeps it:
comm (sub-index 2), app (sub-index 3). A sub-index 0 in parentheses is not declared by the drive's
manual; it reads as the highest sub-index.")]
pub(crate) struct Arguments {
    /// Which drive.
    #[arg(value_name = "DRIVE", value_parser = drive_kind::parse)]
    drive: &'static Personality,
    /// Print JSON: an array of objects.
    #[arg(long)]
    json: bool,
}

/// One object as it is listed.
#[derive(Clone, Debug, Serialize)]
struct Entry {
    index: u16,
    sub: u8,
    /// Made by the drive core, not declared.
    generated: bool,
    name: &'static str,
    #[serde(rename = "type")]
    data_type: &'static str,
    access: &'static str,
    rpdo: bool,
    tpdo: bool,
    default: InitialValue,
    minimum: Option<i64>,
    maximum: Option<i64>,
    unit: &'static str,
    store: Option<&'static str>,
}

/// What an object holds when nothing was stored.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(untagged)]
enum InitialValue {
    Integer(i64),
    Real(f32),
    Text(&'static str),
    /// This plus the node ID.
    PlusNode {
        plus_node_id: u32,
    },
}

impl InitialValue {
    /// For the table. COB-IDs, mappings and identities are read in hexadecimal.
    fn words(self, is_communication: bool) -> String {
        match self {
            InitialValue::Integer(value) if is_communication && value > 9 => format!("0x{value:X}"),
            InitialValue::Integer(value) => value.to_string(),
            InitialValue::Real(value) => value.to_string(),
            InitialValue::Text(text) => format!("\"{}\"", text.escape_default()),
            InitialValue::PlusNode { plus_node_id } => format!("0x{plus_node_id:X}+id"),
        }
    }
}

impl Entry {
    /// The object that is `step` sub-indices after the row's first.
    fn of(row: &'static Row, step: u8) -> Entry {
        Entry {
            index: row.address.index,
            sub: row.address.sub.saturating_add(step),
            generated: false,
            name: row.name,
            data_type: row.data_type.name(),
            access: match row.access {
                Access::Constant => "const",
                Access::ReadOnly => "ro",
                Access::ReadWrite => "rw",
                Access::WriteOnly => "wo",
                Access::Internal => "internal",
            },
            rpdo: row.maps_rpdo,
            tpdo: row.maps_tpdo,
            default: match row.default {
                Default::Value(value) => InitialValue::Integer(value),
                Default::Real(value) => InitialValue::Real(value),
                Default::Text(text) => InitialValue::Text(text),
                Default::PlusNode(plus_node_id) => InitialValue::PlusNode { plus_node_id },
            },
            minimum: row.minimum,
            maximum: row.maximum,
            unit: row.unit,
            store: match row.group {
                Group::None => None,
                Group::Communication => Some("comm"),
                Group::Application => Some("app"),
            },
        }
    }

    /// Sub-index 0 of an object that declares only others (CiA 301 7.4.3).
    fn highest_sub_index(index: u16, highest: u8) -> Entry {
        Entry {
            index,
            sub: 0,
            generated: true,
            name: "highest sub-index",
            data_type: DataType::U8.name(),
            access: "const",
            rpdo: false,
            tpdo: false,
            default: InitialValue::Integer(highest.into()),
            minimum: None,
            maximum: None,
            unit: "",
            store: None,
        }
    }

    fn columns(&self) -> [String; 10] {
        let sub = match self.generated {
            true => "(0)".to_owned(),
            false => self.sub.to_string(),
        };
        let pdo = match (self.rpdo, self.tpdo) {
            (false, false) => "",
            (true, false) => "R",
            (false, true) => "T",
            (true, true) => "RT",
        };
        let limit = |limit: Option<i64>| limit.map_or_else(String::new, |limit| limit.to_string());
        let range = match (self.minimum, self.maximum) {
            (None, None) => String::new(),
            (minimum, maximum) => format!("{}..{}", limit(minimum), limit(maximum)),
        };
        let is_communication = Address::new(self.index, self.sub).is_communication();
        [
            format!("0x{:04X}", self.index),
            sub,
            self.data_type.to_owned(),
            self.access.to_owned(),
            pdo.to_owned(),
            self.default.words(is_communication && !self.generated),
            range,
            self.unit.to_owned(),
            self.store.unwrap_or("").to_owned(),
            self.name.to_owned(),
        ]
    }
}

/// All objects in the order of index and sub-index.
fn entries(table: &Table) -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut last_index = None;
    for row in table.rows() {
        if row.access == Access::Internal {
            continue;
        }
        let index = row.address.index;
        if last_index != Some(index) {
            last_index = Some(index);
            if row.address.sub > 0
                && let Some(highest) = table.highest_sub_index(index)
            {
                entries.push(Entry::highest_sub_index(index, highest));
            }
        }
        entries.extend((0..row.count).map(|step| Entry::of(row, step)));
    }
    entries
}

/// Runs it.
///
/// # Errors
/// None but those of standard output.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let entries = entries(&arguments.drive.device.table);
    if arguments.json {
        output::print_json(&entries)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut table = output::table(&[
        "index", "sub", "type", "access", "PDO", "default", "range", "unit", "store", "name",
    ]);
    for entry in &entries {
        table.add_row(entry.columns());
    }
    output::print(format!(
        "{}: {} objects",
        arguments.drive.title,
        entries.len()
    ))?;
    output::print(table.trim_fmt())?;
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the manual's table says (P3 l.346 and l.388; 0x1018 declares sub-indices 1 to 4).
    #[test]
    fn rows_of_the_p3() {
        let entries = entries(&personalities::p3::P3.device.table);
        let line = |index, sub| {
            let mut same = entries.iter().filter(|e| (e.index, e.sub) == (index, sub));
            let entry = same.next().unwrap_or_else(|| panic!("0x{index:04X},{sub}"));
            assert!(same.next().is_none());
            entry.columns().join("|")
        };
        assert_eq!(
            line(0x1018, 0),
            "0x1018|(0)|UNSIGNED8|const||4||||highest sub-index"
        );
        assert_eq!(
            line(0x1801, 1),
            "0x1801|1|UNSIGNED32|rw||0x280+id|||comm|TPDO COB ID"
        );
        assert_eq!(
            line(0x1A00, 4),
            "0x1A00|4|UNSIGNED32|rw||0|||comm|TPDO mapping"
        );
        assert_eq!(line(0x1A00, 0).split('|').nth(1), Some("0"));
        assert!(entries.is_sorted_by_key(|entry| (entry.index, entry.sub)));
    }
}
