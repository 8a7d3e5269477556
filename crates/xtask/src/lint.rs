//! Lints.

use crate::command::succeed;
use crate::step::StepResult;
use crate::workspace::Workspace;

/// clippy over all targets of all crates; `--locked`, so that Cargo.lock is complete as committed.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let mut clippy = workspace.cargo();
    clippy.args(["clippy", "--locked", "--workspace", "--all-targets"]);
    succeed(clippy.args(["--", "-D", "warnings"]))?;
    Ok("no warning".into())
}
