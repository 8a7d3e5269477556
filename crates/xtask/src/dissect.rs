//! Wireshark's dissector on the recording that the outside test left.

use crate::outside::{DISSECT, pytest_counts};
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;
use crate::{apt, python};

/// tshark finds no malformed frame, and every kind of CANopen message that was sent.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let recording = workspace.target().join("outside").join("bus.log");
    if !recording.is_file() {
        return Err(Trouble::failed(format!(
            "there is no {}: the step outside makes it",
            recording.display()
        )));
    }
    apt::need("tshark", &["tshark"])?;
    let python = python::environment(workspace, python::OUTSIDE)?;
    let mut pytest = workspace.command(python);
    pytest.args(["-m", "pytest", DISSECT]);
    pytest_counts(workspace, &mut pytest)
}
