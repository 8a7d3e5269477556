//! The transcripts: bus dialogues of the manuals, each played against a fresh virtual drive.

use std::path::{Path, PathBuf};

use crate::command::{run as run_command, succeed};
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
    let mut failed = Vec::new();
    for file in &files {
        let file = file.strip_prefix(workspace.root()).unwrap_or(file);
        let mut play = workspace.command(workspace.servobus());
        if !run_command(play.arg("play").arg(file))?.status.success() {
            failed.push(file.display().to_string());
        }
    }
    if failed.is_empty() {
        Ok(format!("{} passed", files.len()))
    } else {
        Err(Trouble::Failed(format!(
            "{} of {} failed: {}",
            failed.len(),
            files.len(),
            failed.join(", ")
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
