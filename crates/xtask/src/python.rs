//! Virtual environments of Python packages under `target/`, each at exactly the versions of a
//! `requirements.txt`.

use std::fs;
use std::path::PathBuf;

use crate::apt;
use crate::command::{ask, run as run_command, succeed};
use crate::step::Trouble;
use crate::workspace::Workspace;

/// A list of packages, and where they are kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packages {
    requirements: &'static str,
    directory: &'static str,
}

/// What the programs outside need: CANopen masters, readers of recordings, pytest.
pub(crate) const OUTSIDE: Packages = Packages {
    requirements: "python/outside/requirements.txt",
    directory: "outside-venv",
};

/// Another simulator of motor drives.
pub(crate) const REFERENCE: Packages = Packages {
    requirements: "python/reference/requirements.txt",
    directory: "reference-venv",
};

/// The interpreter of the environment, which is made or renewed if it does not hold what the
/// requirements say.
///
/// # Errors
/// [`Trouble::Impossible`] without Python 3 or where the packages cannot be fetched.
pub(crate) fn environment(workspace: &Workspace, packages: Packages) -> Result<PathBuf, Trouble> {
    let requirements = packages.requirements;
    let directory = workspace.target().join(packages.directory);
    let python = directory.join("bin/python");
    let installed = directory.join("installed.txt");
    let wrong = |error: std::io::Error| Trouble::Failed(format!("{requirements}: {error}"));
    let wanted = fs::read_to_string(workspace.root().join(requirements)).map_err(wrong)?;
    if fs::read_to_string(&installed).is_ok_and(|is| is == wanted) && starts(workspace, &python) {
        return Ok(python);
    }
    apt::need("python3", &["python3", "python3-venv"])?;
    if ask(workspace
        .command("python3")
        .args(["-c", "import ensurepip, venv"]))
    .is_none()
    {
        apt::install(
            &["python3-venv"],
            "python3 cannot make virtual environments",
        )?;
    }
    println!("making a virtual environment in {}", directory.display());
    let mut make = workspace.command("python3");
    succeed(make.args(["-m", "venv", "--clear"]).arg(&directory))?;
    let mut pip = workspace.command(&python);
    pip.args([
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "--no-deps",
        "-q",
    ]);
    if !run_command(pip.args(["-r", requirements]))?
        .status
        .success()
    {
        let remedy = "let pip reach PyPI or a mirror of it (PIP_INDEX_URL)";
        return Err(Trouble::impossible(
            format!("pip could not install {requirements}"),
            remedy,
        ));
    }
    let mut check = workspace.command(&python);
    succeed(check.args(["-m", "pip", "--disable-pip-version-check", "check"]))?;
    fs::write(installed, wanted).map_err(wrong)?;
    Ok(python)
}

/// An environment breaks when the interpreter that it was made with goes away.
fn starts(workspace: &Workspace, python: &PathBuf) -> bool {
    ask(workspace.command(python).args(["-c", ""])).is_some()
}
