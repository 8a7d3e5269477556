//! Fuzzing with libFuzzer on the stable toolchain; `fuzz/.cargo/config.toml` holds the flags.

use std::fs;

use crate::apt;
use crate::command::succeed;
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;

/// Runs a target: its committed corpus first, then what libFuzzer makes of it.
///
/// # Errors
/// A finding, or [`Trouble::Impossible`] without a C++ compiler, which libFuzzer needs.
pub(crate) fn run(workspace: &Workspace, target: &str, runs: u64) -> StepResult {
    let directory = workspace.root().join("fuzz");
    let targets = targets(workspace)?;
    if !targets.iter().any(|name| name == target) {
        let targets = targets.join(", ");
        return Err(Trouble::Failed(format!(
            "there is no fuzz target {target}; there are: {targets}"
        )));
    }
    apt::need("c++", &["g++"])?;
    // Inputs of one target mean nothing to another.
    let findings = format!("findings/{target}");
    let wrong = |error| Trouble::Failed(format!("fuzz/{findings}: {error}"));
    fs::create_dir_all(directory.join(&findings)).map_err(wrong)?;
    let mut cargo = workspace.cargo();
    // Cargo reads the flags from the directory that it starts in.
    cargo.current_dir(&directory);
    cargo.args(["run", "--locked", "--release", "--bin", target, "--"]);
    cargo.arg(findings);
    cargo.arg(format!("corpus/{target}"));
    cargo.args(["-max_len=512", "-print_final_stats=1"]);
    // Words that the target's inputs are made of, where random bytes would never hit them.
    let words = format!("dictionaries/{target}.txt");
    if directory.join(&words).is_file() {
        cargo.arg(format!("-dict={words}"));
    }
    if runs > 0 {
        cargo.arg(format!("-runs={runs}"));
    }
    succeed(&mut cargo)?;
    Ok(match runs {
        0 => format!("{target}: ended, no finding"),
        runs => format!("{target}: {runs} executions, no finding"),
    })
}

fn targets(workspace: &Workspace) -> Result<Vec<String>, Trouble> {
    let directory = workspace.root().join("fuzz/fuzz_targets");
    let wrong = |error| Trouble::Failed(format!("{}: {error}", directory.display()));
    let mut names = Vec::new();
    for entry in directory.read_dir().map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.extension().is_some_and(|extension| extension == "rs")
            && let Some(name) = path.file_stem()
        {
            names.push(name.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}
