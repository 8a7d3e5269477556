//! The table of objects with their old and new values.

use client::session::Change;
use serde::Serialize;

use crate::output;

/// A change, for programs.
#[derive(Debug, Serialize)]
pub(crate) struct ChangeRow {
    index: u16,
    sub: u8,
    name: &'static str,
    unit: &'static str,
    old: i64,
    new: i64,
}

impl From<&Change> for ChangeRow {
    fn from(change: &Change) -> ChangeRow {
        ChangeRow {
            index: change.object.address.index,
            sub: change.object.address.sub,
            name: change.object.name,
            unit: change.object.unit,
            old: change.old,
            new: change.new,
        }
    }
}

/// The table for people.
pub(super) fn text(changes: &[Change]) -> String {
    let mut table = output::table(&["object", "name", "old", "new", "unit"]);
    for change in changes {
        table.add_row([
            change.object.address.to_string(),
            change.object.name.to_owned(),
            change.old.to_string(),
            change.new.to_string(),
            change.object.unit.to_owned(),
        ]);
    }
    table.trim_fmt()
}
