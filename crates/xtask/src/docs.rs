//! The API documentation.

use crate::command::succeed;
use crate::step::StepResult;
use crate::workspace::Workspace;

/// rustdoc without a warning: no broken link, no malformed example.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let mut doc = workspace.cargo();
    doc.args(["doc", "--locked", "--workspace", "--no-deps", "--quiet"]);
    succeed(doc.env("RUSTDOCFLAGS", "-D warnings"))?;
    let index = workspace.target().join("doc");
    Ok(format!("no warning; in {}", index.display()))
}
