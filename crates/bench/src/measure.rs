//! Counting instructions: a program under valgrind's callgrind.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The two run lengths, in iterations. They have as many digits as each other, so that reading
/// them from the command line costs the same; their difference is a multiple of every cycle of
/// requests and values in the cases.
pub const ITERATIONS: [u64; 2] = [1_000, 9_000];

/// Why there is no figure.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// valgrind is not there or not executable.
    #[error("valgrind does not start ({0}): install it (Debian, Ubuntu: apt-get install valgrind)")]
    Valgrind(io::Error),
    /// The program failed under valgrind.
    #[error("`{program} {arguments}` failed under valgrind ({status}):\n{stderr}")]
    Program {
        /// The program.
        program: PathBuf,
        /// Its arguments.
        arguments: String,
        /// How it ended.
        status: std::process::ExitStatus,
        /// What it and valgrind wrote to standard error.
        stderr: String,
    },
    /// The file of counts cannot be written or read.
    #[error("file of counts: {0}")]
    Counts(#[from] io::Error),
    /// The file of counts holds no total.
    #[error("callgrind's file of counts has no `totals:` line")]
    NoTotal,
    /// The longer run took fewer instructions than the shorter one.
    #[error("{long} instructions in {} iterations, {short} in {}", ITERATIONS[1], ITERATIONS[0])]
    Backwards {
        /// Instructions of the shorter run.
        short: u64,
        /// Instructions of the longer run.
        long: u64,
    },
}

/// Instructions of one iteration: runs `program` with `arguments` and then each of the
/// [`ITERATIONS`] as last argument, and divides the differences, rounding to the nearest
/// instruction. `program` must be a release build.
///
/// # Errors
/// If valgrind or the program fails, or the counts make no sense.
pub fn instructions_per_iteration(program: &Path, arguments: &[&str]) -> Result<u64, MeasureError> {
    let [few, many] = ITERATIONS;
    let short = instructions(program, arguments, few)?;
    let long = instructions(program, arguments, many)?;
    difference(short, long)
}

fn difference(short: u64, long: u64) -> Result<u64, MeasureError> {
    let iterations = ITERATIONS[1] - ITERATIONS[0];
    let instructions = long
        .checked_sub(short)
        .ok_or(MeasureError::Backwards { short, long })?;
    Ok((instructions + iterations / 2) / iterations)
}

/// Instructions of one whole run.
fn instructions(program: &Path, arguments: &[&str], iterations: u64) -> Result<u64, MeasureError> {
    let directory = tempfile::tempdir()?;
    let counts = directory.path().join("callgrind.out");
    let mut out_file = OsStr::new("--callgrind-out-file=").to_owned();
    out_file.push(&counts);
    let iterations = iterations.to_string();

    let output = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg(out_file)
        .arg(program)
        .args(arguments)
        .arg(&iterations)
        .output()
        .map_err(MeasureError::Valgrind)?;
    if !output.status.success() {
        return Err(MeasureError::Program {
            program: program.to_owned(),
            arguments: [arguments, &[&iterations]].concat().join(" "),
            status: output.status,
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        });
    }
    total(&std::fs::read_to_string(&counts)?).ok_or(MeasureError::NoTotal)
}

/// The total of callgrind's file of counts, whose only event is `Ir`, instructions executed.
fn total(counts: &str) -> Option<u64> {
    counts
        .lines()
        .find_map(|line| line.strip_prefix("totals:"))
        .and_then(|total| total.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_total_and_nothing_else() {
        let counts =
            "version: 1\nevents: Ir\nsummary: 7\n\nfn=(1) main\n12 4711\n\ntotals: 1234567\n";
        assert_eq!(total(counts), Some(1_234_567));
        assert_eq!(total("summary: 7\n"), None);
        assert_eq!(total("totals: many\n"), None);
    }

    #[test]
    fn set_up_cancels_and_noise_is_rounded_away() {
        // 50,000 of set-up, 123 each: 50,000 + 1,000 × 123 and 50,000 + 9,000 × 123.
        assert_eq!(difference(173_000, 1_157_000).ok(), Some(123));
        assert_eq!(difference(173_000, 1_157_000 + 3_999).ok(), Some(123));
        assert_eq!(difference(173_000, 1_157_000 + 4_000).ok(), Some(124));
        assert!(matches!(
            difference(2, 1),
            Err(MeasureError::Backwards { short: 2, long: 1 })
        ));
    }

    #[test]
    fn a_failing_program_is_not_a_figure() {
        let error = instructions_per_iteration(Path::new("/bin/false"), &["x"]);
        assert!(error.is_err(), "{error:?}");
    }
}
