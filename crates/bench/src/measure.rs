//! Counting instructions: a program under valgrind's callgrind.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a number of iterations costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Instructions of all of them.
    pub instructions: u64,
    /// How many they are; never 0.
    pub iterations: u64,
}

impl Cost {
    /// Instructions of one iteration, rounded to the nearest.
    pub fn per_iteration(self) -> u64 {
        (self.instructions + self.iterations / 2) / self.iterations
    }

    /// Instructions for each byte, if an iteration moves so many.
    pub fn per_byte(self, bytes: usize) -> f64 {
        self.instructions as f64 / self.iterations as f64 / bytes as f64
    }
}

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
    /// The longer run is not longer, or took fewer instructions than the shorter one.
    #[error("{long} instructions in {many} iterations, {short} in {few}")]
    Backwards {
        /// Iterations of the shorter run.
        few: u64,
        /// Iterations of the longer run.
        many: u64,
        /// Instructions of the shorter run.
        short: u64,
        /// Instructions of the longer run.
        long: u64,
    },
}

/// What the iterations cost by which the second of `run_lengths` is longer than the first: runs
/// `program` with `arguments` and then each of them as last argument, and takes the difference.
/// `program` must be a release build.
///
/// # Errors
/// If valgrind or the program fails, or the counts make no sense.
pub fn cost(
    program: &Path,
    arguments: &[&str],
    run_lengths: [u64; 2],
) -> Result<Cost, MeasureError> {
    let [few, many] = run_lengths;
    let short = instructions(program, arguments, few)?;
    let long = instructions(program, arguments, many)?;
    difference([few, many], [short, long])
}

fn difference([few, many]: [u64; 2], [short, long]: [u64; 2]) -> Result<Cost, MeasureError> {
    let iterations = many.checked_sub(few).filter(|iterations| *iterations > 0);
    match (iterations, long.checked_sub(short)) {
        (Some(iterations), Some(instructions)) => Ok(Cost {
            instructions,
            iterations,
        }),
        _ => Err(MeasureError::Backwards {
            few,
            many,
            short,
            long,
        }),
    }
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
        let iterations = [1_000, 9_000];
        let each = |long| difference(iterations, [173_000, long]).map(Cost::per_iteration);
        assert_eq!(each(1_157_000).ok(), Some(123));
        assert_eq!(each(1_157_000 + 3_999).ok(), Some(123));
        assert_eq!(each(1_157_000 + 4_000).ok(), Some(124));
        assert!(difference(iterations, [2, 1]).is_err());
        assert!(difference([1, 1], [1, 2]).is_err());
    }

    #[test]
    fn the_cost_of_a_byte_is_not_rounded() {
        let cost = difference([1, 3], [50_000, 50_000 + 2 * 1_234]);
        assert_eq!(cost.ok().map(|cost| cost.per_byte(100)), Some(12.34));
    }

    #[test]
    fn a_failing_program_is_not_a_figure() {
        let error = cost(Path::new("/bin/false"), &["x"], [1, 3]);
        assert!(error.is_err(), "{error:?}");
    }
}
