//! The errors that drives announce, and what makes each possible.

use personalities::{Cause, FaultRow, Kind, Personality, Switch};

use super::start::Start;
use super::{Drives, NONE, Part, Row, row};

/// A row of the table: what several drives may announce, or one drive's own.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Subject {
    /// A cause that any drive may have.
    Common(Cause),
    /// One that a drive's document has under this name.
    Own(&'static str),
}

impl Subject {
    fn of(drive: &Personality, fault: &FaultRow) -> Option<Subject> {
        Some(match fault.cause {
            Cause::Own(_) => Subject::Own(drive.cause_name(fault.cause)?),
            cause => Subject::Common(cause),
        })
    }

    fn name(self) -> &'static str {
        match self {
            Subject::Common(cause) => cause.name().unwrap_or_default(),
            Subject::Own(name) => name,
        }
    }

    /// The rows of a drive's table that belong here: those of the cause, and its own with the same
    /// code as another drive's.
    fn rows(self, drive: &Personality) -> Vec<&'static FaultRow> {
        let faults = drive.faults.iter();
        let belongs = |fault: &FaultRow| {
            Subject::of(drive, fault) == Some(self)
                || matches!(fault.cause, Cause::Own(_)) && common(fault.code) == Some(self)
        };
        faults.filter(|fault| belongs(fault)).collect()
    }
}

/// The first cause that any documented drive announces with this code and that is not its own.
fn common(code: u16) -> Option<Subject> {
    let faults = personalities::ALL.iter().flat_map(|drive| drive.faults);
    let mut known = faults.filter(|fault| !matches!(fault.cause, Cause::Own(_)));
    let same = known.find(|fault| fault.code == code)?;
    Some(Subject::Common(same.cause))
}

/// What any of the drives announces: what is common in the order of the first table that has it, then the
/// drives' own.
pub(super) fn subjects(drives: Drives<'_>) -> Vec<Subject> {
    let (mut all, mut own) = (Vec::new(), Vec::new());
    for drive in drives {
        for fault in drive.faults {
            let subject = Subject::of(drive, fault);
            let common = match fault.cause {
                Cause::Own(_) => common(fault.code),
                _ => subject,
            };
            all.extend(common.filter(|common| !all.contains(common)));
            own.extend(subject.filter(|own| matches!(own, Subject::Own(_)) && !all.contains(own)));
        }
    }
    all.extend(own);
    all
}

/// Each error's code and kind. A drive's own have a row each; in the row of what has the same code in
/// other drives the code stands once more.
pub(super) fn errors(drives: Drives<'_>) -> Part {
    let rows = subjects(drives).into_iter().map(|subject| {
        row(subject.name(), drives, |drive| {
            list(subject.rows(drive).iter().map(|fault| code(drive, fault)))
        })
    });
    Part {
        title: "errors",
        rows: rows.collect(),
    }
}

/// What makes an error possible, where not every drive has it always: its threshold, or its switch.
pub(super) fn thresholds(drives: Drives<'_>, starts: &[Start]) -> Part {
    let mut rows: Vec<Row> = Vec::new();
    for subject in subjects(drives) {
        let faults = drives.iter().flat_map(|drive| subject.rows(drive));
        let mut switches = faults.map(|fault| fault.switch);
        if switches.all(|switch| matches!(switch, Switch::Always)) {
            continue;
        }
        let cells = drives.iter().zip(starts).map(|(drive, start)| {
            let faults = subject.rows(drive);
            list(faults.iter().map(|fault| switch(start, fault.switch)))
        });
        rows.push(Row {
            name: subject.name().to_owned(),
            drives: cells.collect(),
        });
    }
    Part {
        title: "thresholds of errors",
        rows,
    }
}

/// Each once.
fn list(cells: impl Iterator<Item = String>) -> String {
    let mut all: Vec<String> = Vec::new();
    for cell in cells {
        if !all.contains(&cell) {
            all.push(cell);
        }
    }
    match all.as_slice() {
        [] => NONE.to_owned(),
        all => all.join(", "),
    }
}

/// Its code, or its bit in 0x1001 where no emergency tells a code.
fn code(drive: &Personality, row: &FaultRow) -> String {
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

fn switch(start: &Start, switch: Switch) -> String {
    match switch {
        Switch::Always => "always".to_owned(),
        Switch::Off => "never".to_owned(),
        Switch::Object(object) => start.object(object.field),
        Switch::Either(upper, lower) => list(
            [upper, lower]
                .map(|object| start.object(object.field))
                .into_iter(),
        ),
    }
}
