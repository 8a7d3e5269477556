//! What things cost.

use std::path::{self, Path};

use crate::apt;
use crate::command::succeed;
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;

/// The benchmark program, which counts instructions under valgrind.
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
        "--",
    ]);
    if let Some(json) = json {
        // Relative to where the reader typed it.
        let file = path::absolute(json)
            .map_err(|error| Trouble::Failed(format!("{}: {error}", json.display())))?;
        bench.arg("--json").arg(file);
    }
    succeed(&mut bench)?;
    Ok("measured".into())
}
