//! A scenario's file, as an argument.

use std::fs;
use std::path::Path;

use ::sim::scenario::Scenario;

use crate::Failure;

/// Reads it and checks what can be checked without drives.
///
/// # Errors
/// What is wrong with it, by line and column.
pub(crate) fn read(path: &Path) -> Result<Scenario, Failure> {
    let name = path.display().to_string();
    let text = fs::read_to_string(path).map_err(|error| {
        Failure::input(format!(
            "{name}: cannot be read: {error}; give a scenario, a text file as docs/scenarios.md \
             describes it"
        ))
    })?;
    Scenario::read(&name, &text).map_err(|problems| refused(&problems))
}

/// A scenario that cannot be played, before anything has started.
pub(crate) fn refused(problems: &::sim::scenario::Problems) -> Failure {
    let count = match problems.list.len() {
        1 => "the scenario has a mistake".to_owned(),
        count => format!("the scenario has {count} mistakes"),
    };
    Failure::input(format!("{count}; nothing was started\n{problems}"))
}
