//! The outside test: software that we did not write drives the virtual drives.

use std::process::Command;

use crate::command::run as run_command;
use crate::python;
use crate::rust_tests::number_before;
use crate::step::{StepResult, Trouble};
use crate::transcripts::build_servobus;
use crate::workspace::Workspace;

/// The test of the recording, which [`crate::dissect`] runs.
pub(crate) const DISSECT: &str = "python/outside/test_dissect.py";

/// python-can and python-canopen, over socketcand and over slcan.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let python = python::environment(workspace)?;
    build_servobus(workspace)?;
    let mut pytest = workspace.command(python);
    pytest.args(["-m", "pytest", "python/outside", "--ignore", DISSECT]);
    pytest_counts(workspace, &mut pytest)
}

/// Runs pytest on what the command names; what the drives print and record is kept.
pub(crate) fn pytest_counts(workspace: &Workspace, pytest: &mut Command) -> StepResult {
    let kept = workspace.target().join("outside");
    pytest
        .args(["-p", "no:cacheprovider", "-ra"])
        .env("SERVOBUS", workspace.servobus())
        .env("SERVOBUS_OUTSIDE_DIR", &kept)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("PYTHONUNBUFFERED", "1");
    let ended = run_command(pytest)?;
    let summary = ended
        .output
        .lines()
        .rev()
        .find(|line| line.contains(" in "));
    let summary = summary
        .unwrap_or_default()
        .trim_matches(['=', ' '])
        .to_owned();
    if ended.status.success() && number_before(&summary, " passed") > 0 {
        Ok(summary)
    } else {
        Err(Trouble::Failed(format!(
            "{summary}; logs and recordings in {}",
            kept.display()
        )))
    }
}
