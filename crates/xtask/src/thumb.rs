//! The `no_std` crates, built for a Cortex-M4F. That they are `no_std` can be seen only on a target
//! without `std`; that a node fits into its memory is asserted where pointers have 32 bits.

use std::path::PathBuf;

use clap::ValueEnum;

use crate::command::{ask, run as run_command, succeed};
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;
use crate::{apt, debian_rust};

pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// The crates that a microcontroller takes.
const CRATES: &[&str] = &[
    "servobus-can",
    "servobus-canopen",
    "servobus-cia402",
    "servobus-control",
    "servobus-personalities",
    "servobus-drive",
    "servobus-plant",
];

/// Where the target's core library comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Source {
    /// The toolchain's own, else rustup's, else Debian's
    Auto,
    /// rustup target add
    Rustup,
    /// Debian's compiler and library source, unpacked under target/ and built there
    Debian,
}

/// The step of `cargo xtask test`.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    build(workspace, Source::Auto)
}

/// Builds [`CRATES`] for [`TARGET`], optimised.
///
/// # Errors
/// [`Trouble::Impossible`] if there is no core library for the target.
pub(crate) fn build(workspace: &Workspace, source: Source) -> StepResult {
    let mut cargo = workspace.cargo();
    cargo.args(["build", "--locked", "--release", "--target", TARGET]);
    for name in CRATES {
        cargo.args(["--package", name]);
    }
    let with = match source {
        Source::Debian => None,
        Source::Auto | Source::Rustup => match with_rustup(workspace) {
            Ok(with) => Some(with),
            Err(why) if source == Source::Rustup => {
                return Err(Trouble::impossible(why, "try --source debian"));
            }
            Err(why) => {
                println!("{why}");
                None
            }
        },
    };
    let with = match with {
        Some(with) => with,
        None if apt::has("apt-get") && apt::has("dpkg-deb") => {
            debian_rust::drive(workspace, &mut cargo)?
        }
        None => {
            let remedy = format!("rustup target add {TARGET}");
            return Err(Trouble::impossible(
                format!("there is no core library for {TARGET}"),
                remedy,
            ));
        }
    };
    succeed(&mut cargo)?;
    Ok(format!("{} crates for {TARGET}, {with}", CRATES.len()))
}

/// Makes sure that the toolchain has the target, with rustup's help.
fn with_rustup(workspace: &Workspace) -> Result<String, String> {
    if has_target(workspace) {
        return Ok("core library of the toolchain".into());
    }
    if !apt::has("rustup") {
        return Err(format!("no {TARGET} in the toolchain, and no rustup"));
    }
    println!("the toolchain lacks {TARGET}: asking rustup for it");
    let mut add = workspace.command("rustup");
    match run_command(add.args(["target", "add", TARGET])) {
        Ok(ended) if ended.status.success() && has_target(workspace) => {
            Ok("core library by rustup".into())
        }
        _ => Err(format!("rustup brought no {TARGET}")),
    }
}

/// Whether the compiler that cargo uses has the target's libraries, whoever installed them.
fn has_target(workspace: &Workspace) -> bool {
    let mut rustc = workspace.command(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    let Some(directory) = ask(rustc.args(["--print", "target-libdir", "--target", TARGET])) else {
        return false;
    };
    let directory = PathBuf::from(directory.trim());
    let Ok(files) = directory.read_dir() else {
        return false;
    };
    let mut names = files.flatten().map(|file| file.file_name());
    names.any(|name| name.to_string_lossy().starts_with("libcore-"))
}
