//! Steps, what becomes of them, and the table at the end.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::workspace::Workspace;

/// Why a step did not reach its end.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// It ran and something is wrong.
    Failed(String),
    /// This machine lacks something that xtask may not or cannot install.
    Impossible {
        /// What is missing.
        why: String,
        /// What the reader can do about it.
        remedy: String,
    },
}

impl Trouble {
    pub(crate) fn failed(what: impl Into<String>) -> Trouble {
        Trouble::Failed(what.into())
    }

    pub(crate) fn impossible(why: impl Into<String>, remedy: impl Into<String>) -> Trouble {
        Trouble::Impossible {
            why: why.into(),
            remedy: remedy.into(),
        }
    }
}

/// A step's end: one line on what was done, or the trouble.
pub(crate) type StepResult = Result<String, Trouble>;

/// One step of `cargo xtask test`.
#[derive(Debug)]
pub(crate) struct Step {
    /// As in `--only`.
    pub(crate) name: &'static str,
    /// What it shows, in a few words.
    pub(crate) what: &'static str,
    /// Does it.
    pub(crate) run: fn(&Workspace) -> StepResult,
}

/// What became of a step.
#[derive(Debug)]
pub(crate) enum Outcome {
    Done(String),
    Failed(String),
    Impossible { why: String, remedy: String },
}

impl From<StepResult> for Outcome {
    fn from(result: StepResult) -> Outcome {
        match result {
            Ok(what) => Outcome::Done(what),
            Err(Trouble::Failed(what)) => Outcome::Failed(what),
            Err(Trouble::Impossible { why, remedy }) => Outcome::Impossible { why, remedy },
        }
    }
}

impl Outcome {
    /// A step that is not possible counts as failed where all must be possible.
    fn fails(&self, strict: bool) -> bool {
        match self {
            Outcome::Done(_) => false,
            Outcome::Failed(_) => true,
            Outcome::Impossible { .. } => strict,
        }
    }

    fn word(&self) -> &'static str {
        match self {
            Outcome::Done(_) => "done",
            Outcome::Failed(_) => "FAILED",
            Outcome::Impossible { .. } => "not possible here",
        }
    }

    fn detail(&self) -> String {
        match self {
            Outcome::Done(what) | Outcome::Failed(what) => what.clone(),
            Outcome::Impossible { why, remedy } => format!("{why}; {remedy}"),
        }
    }
}

/// Runs all steps, whatever becomes of each, so that one run shows everything that is wrong.
pub(crate) fn run_all(steps: &[&Step], workspace: &Workspace, strict: bool) -> ExitCode {
    let begin = Instant::now();
    let mut ended: Vec<(&Step, Outcome, Duration)> = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        println!(
            "\n== {}/{} {}: {}",
            number + 1,
            steps.len(),
            step.name,
            step.what
        );
        let start = Instant::now();
        let outcome = Outcome::from((step.run)(workspace));
        let took = start.elapsed();
        let going_on = if outcome.fails(strict) && number + 1 < steps.len() {
            " (going on with the other steps)"
        } else {
            ""
        };
        println!(
            "== {}: {} after {}: {}{going_on}",
            step.name,
            outcome.word(),
            seconds(took),
            outcome.detail()
        );
        ended.push((step, outcome, took));
    }
    let failed = ended.iter().filter(|(_, outcome, _)| outcome.fails(strict));
    let failed: Vec<&str> = failed.map(|(step, _, _)| step.name).collect();
    println!("\n{}", table(&ended));
    let details: Vec<String> = ended
        .iter()
        .filter_map(|(step, outcome, _)| match outcome {
            Outcome::Done(what) if what.contains("passed") => {
                Some(format!("{}: {what}", step.name))
            }
            _ => None,
        })
        .collect();
    let counts = details.join("; ");
    let took = seconds(begin.elapsed());
    if failed.is_empty() {
        let lacking = ended
            .iter()
            .filter(|(_, outcome, _)| matches!(outcome, Outcome::Impossible { .. }))
            .map(|(step, _, _)| step.name);
        let lacking: Vec<&str> = lacking.collect();
        match lacking.as_slice() {
            [] => println!("Passed in {took}. {counts}"),
            _ => println!(
                "Passed in {took}, without {}, not possible here. {counts}",
                lacking.join(", ")
            ),
        }
        ExitCode::SUCCESS
    } else {
        println!("FAILED: {} (in {took}). {counts}", failed.join(", "));
        ExitCode::FAILURE
    }
}

fn table(ended: &[(&Step, Outcome, Duration)]) -> String {
    let mut lines = Vec::new();
    for (step, outcome, took) in ended {
        lines.push(format!(
            "{:<12} {:<18} {:>8}  {}",
            step.name,
            outcome.word(),
            seconds(*took),
            outcome.detail()
        ));
    }
    lines.join("\n")
}

fn seconds(duration: Duration) -> String {
    format!("{:.1} s", duration.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_possible_fails_only_where_all_must_be() {
        let lack = Outcome::from(Err(Trouble::impossible(
            "no tshark",
            "apt-get install tshark",
        )));
        assert!(!lack.fails(false));
        assert!(lack.fails(true));
        assert_eq!(lack.detail(), "no tshark; apt-get install tshark");
        let wrong = Outcome::from(Err(Trouble::failed("2 of 3 tests failed")));
        assert!(wrong.fails(false));
        assert!(!Outcome::from(Ok("3 passed".into())).fails(true));
    }
}
