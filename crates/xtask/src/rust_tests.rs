//! All Rust tests: unit, integration and documentation tests.

use crate::command::run as run_command;
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;

/// Where random tests begin, unless the environment says otherwise: what passed once passes again.
/// Set it to another number, or run `cargo test` alone, to look further.
const SEED: (&str, &str) = ("PROPTEST_RNG_SEED", "402");

/// `cargo test` over the workspace, with the tests counted.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let mut test = workspace.cargo();
    test.args(["test", "--locked", "--workspace", "--no-fail-fast"]);
    if std::env::var_os(SEED.0).is_none() {
        test.env(SEED.0, SEED.1);
    }
    let ended = run_command(&mut test)?;
    let counts = Counts::read(&ended.output);
    if ended.status.success() && counts.passed > 0 {
        Ok(format!(
            "{} passed, {} ignored",
            counts.passed, counts.ignored
        ))
    } else if counts.failed.is_empty() {
        Err(Trouble::Failed(format!(
            "cargo test ended with {} after {} passed tests",
            ended.status, counts.passed
        )))
    } else {
        let names = counts.failed.join(", ");
        let total = counts.passed + counts.failed.len();
        Err(Trouble::Failed(format!(
            "{} of {total} tests failed: {names}",
            counts.failed.len()
        )))
    }
}

/// What the test harness's lines add up to.
#[derive(Debug, Default, PartialEq, Eq)]
struct Counts {
    passed: usize,
    ignored: usize,
    failed: Vec<String>,
}

impl Counts {
    fn read(output: &str) -> Counts {
        let mut counts = Counts::default();
        for line in output.lines() {
            if let Some(summary) = line.strip_prefix("test result: ") {
                counts.passed += number_before(summary, " passed");
                counts.ignored += number_before(summary, " ignored");
            } else if let Some(name) = line
                .strip_prefix("test ")
                .and_then(|rest| rest.strip_suffix(" ... FAILED"))
            {
                counts.failed.push(name.to_owned());
            }
        }
        counts
    }
}

/// The number that stands before `word`, 0 if there is none.
pub(crate) fn number_before(text: &str, word: &str) -> usize {
    let Some(end) = text.find(word) else {
        return 0;
    };
    let digits = text.get(..end).unwrap_or_default();
    let digits = digits.rsplit(|c: char| !c.is_ascii_digit()).next();
    digits.and_then(|digits| digits.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_all_test_programs_add_up() {
        let output = "\
running 3 tests
test a::b ... ok
test a::c ... FAILED
test a::d ... ignored

test result: FAILED. 1 passed; 1 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s

running 12 tests
test result: ok. 12 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s
";
        let counts = Counts::read(output);
        let expected = Counts {
            passed: 13,
            ignored: 1,
            failed: vec!["a::c".into()],
        };
        assert_eq!(counts, expected);
        assert_eq!(number_before("no number passed", " passed"), 0);
        assert_eq!(number_before("nothing", " passed"), 0);
    }
}
