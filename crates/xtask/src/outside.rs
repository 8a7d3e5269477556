//! The outside test: software that we did not write drives the virtual drives.

use std::path::Path;
use std::process::Command;

use crate::command::{run as run_command, succeed};
use crate::python;
use crate::rust_tests::number_before;
use crate::step::{StepResult, Trouble};
use crate::transcripts::build_servobus;
use crate::workspace::Workspace;

/// The drives' own side of the recording.
const RECORDING: &str = "python/outside/test_recording.py";
/// Wireshark's side of the recording, which [`crate::dissect`] runs.
pub(crate) const DISSECT: &str = "python/outside/test_dissect.py";

/// python-can and python-canopen, over socketcand and over slcan; then the recording of all that,
/// which is complete when the drives have been switched off.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let python = python::environment(workspace, python::OUTSIDE)?;
    build_servobus(workspace)?;
    // The cycles of test_bus_load.py.
    let mut cyclic = workspace.cargo();
    cyclic.args(["build", "--locked", "--package", "servobus-bench"]);
    succeed(cyclic.args(["--bin", "servobus-cyclic"]))?;
    let mut drives = workspace.command(&python);
    drives.args(["-m", "pytest", "python/outside"]);
    drives.args(["--ignore", RECORDING, "--ignore", DISSECT]);
    let drives = pytest_counts(workspace, &mut drives)?;
    let mut recording = workspace.command(python);
    let recording = pytest_counts(workspace, recording.args(["-m", "pytest", RECORDING]))?;
    Ok(format!("{drives}; its recording: {recording}"))
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
    judge_pytest(&ended.output, ended.status.success(), &kept)
}

/// What pytest's last line says: `12 passed in 3.45s`. A test that was skipped is no success.
///
/// # Errors
/// [`Trouble::Failed`], with where to look.
pub(crate) fn judge_pytest(output: &str, success: bool, kept: &Path) -> StepResult {
    let summary = output.lines().rev().find(|line| line.contains(" in "));
    let summary = summary
        .unwrap_or_default()
        .trim_matches(['=', ' '])
        .to_owned();
    let all = number_before(&summary, " passed") > 0 && number_before(&summary, " skipped") == 0;
    if success && all {
        // The table tells the time itself.
        let counts = summary
            .split_once(" in ")
            .map_or(&*summary, |(counts, _)| counts);
        Ok(counts.to_owned())
    } else {
        Err(Trouble::Failed(format!(
            "{summary}; logs and recordings in {}",
            kept.display()
        )))
    }
}
