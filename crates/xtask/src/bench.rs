//! What things cost.

use std::fs;
use std::path::{self, Path, PathBuf};

use crate::command::succeed;
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;
use crate::{apt, python};

/// The benchmark program, which counts instructions under valgrind; before it, motulator, so that its
/// figures stand in the same table. Where motulator cannot be installed, that is said.
///
/// # Errors
/// [`Trouble::Impossible`] without valgrind.
pub(crate) fn run(workspace: &Workspace, json: Option<&Path>) -> StepResult {
    apt::need("valgrind", &["valgrind"])?;
    let mut bench = workspace.cargo();
    bench.args([
        "run",
        "--locked",
        "--release",
        "--package",
        "servobus-bench",
        "--bin",
        "servobus-bench",
        "--",
    ]);
    let skipped = match motulator(workspace) {
        Ok(figures) => {
            bench.arg("--motulator").arg(figures);
            None
        }
        Err(Trouble::Impossible { why, remedy }) => Some(format!("{why}; {remedy}")),
        Err(trouble) => return Err(trouble),
    };
    if let Some(json) = json {
        // Relative to where the reader typed it.
        let file = path::absolute(json)
            .map_err(|error| Trouble::Failed(format!("{}: {error}", json.display())))?;
        bench.arg("--json").arg(file);
    }
    succeed(&mut bench)?;
    Ok(match skipped {
        None => "measured, motulator too".into(),
        Some(why) => format!("measured, without motulator: {why}"),
    })
}

/// A file with what motulator takes for a control period.
fn motulator(workspace: &Workspace) -> Result<PathBuf, Trouble> {
    const SCRIPT: &str = "python/reference/motulator_bench.py";
    let python = python::environment(workspace, python::REFERENCE)?;
    let figures = succeed(workspace.command(python).arg(SCRIPT))?;
    let file = workspace.target().join("motulator.json");
    fs::write(&file, figures)
        .map_err(|error| Trouble::Failed(format!("{}: {error}", file.display())))?;
    Ok(file)
}
