//! Formatting.

use crate::command::succeed;
use crate::step::StepResult;
use crate::workspace::Workspace;

/// rustfmt finds nothing to change, in the workspace and in the fuzz targets.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    succeed(workspace.cargo().args(["fmt", "--all", "--check"]))?;
    let mut fuzz = workspace.cargo();
    fuzz.args(["fmt", "--manifest-path", "fuzz/Cargo.toml", "--check"]);
    succeed(&mut fuzz)?;
    Ok("nothing to change".into())
}
