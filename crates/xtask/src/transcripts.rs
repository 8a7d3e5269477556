//! The transcripts: bus dialogues of the manuals, each played against a fresh virtual drive.

use std::path::{Path, PathBuf};

use crate::command::{run as run_command, succeed};
use crate::rust_tests::number_before;
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;

/// `servobus play` on every file under `transcripts/`.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    build_servobus(workspace)?;
    let mut files = Vec::new();
    collect(&workspace.root().join("transcripts"), &mut files)?;
    files.sort();
    if files.is_empty() {
        return Err(Trouble::failed("there is no transcript"));
    }
    let mut play = workspace.command(workspace.servobus());
    play.args(["play", "--virtual"]);
    for file in &files {
        play.arg(file.strip_prefix(workspace.root()).unwrap_or(file));
    }
    let ended = run_command(&mut play)?;
    // `15 transcripts: 15 passed, 0 failed`
    let summary = ended.output.lines().last().unwrap_or_default();
    if ended.status.success() && number_before(summary, " passed") == files.len() {
        Ok(format!("{} passed", files.len()))
    } else if summary.contains(" failed") {
        Err(Trouble::failed(summary))
    } else {
        Err(Trouble::Failed(format!(
            "servobus play ended with {}",
            ended.status
        )))
    }
}

/// Builds the program in the dev profile, whose dependencies the tests have built already.
///
/// # Errors
/// That of the build.
pub(crate) fn build_servobus(workspace: &Workspace) -> Result<(), Trouble> {
    let mut build = workspace.cargo();
    build.args(["build", "--locked", "--package", "servobus"]);
    succeed(&mut build).map(|_| ())
}

fn collect(directory: &Path, files: &mut Vec<PathBuf>) -> Result<(), Trouble> {
    let wrong = |error| Trouble::Failed(format!("{}: {error}", directory.display()));
    for entry in directory.read_dir().map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "txt") {
            files.push(path);
        }
    }
    Ok(())
}
