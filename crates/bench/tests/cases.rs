//! The program itself: every case of every stack answers rightly, and counts repeat.

use std::path::Path;
use std::process::{Command, Output};

use bench::block::BYTES;
use bench::measure::{MeasureError, cost};
use bench::subject::{Case, Direction, Side};

const PROGRAM: &str = env!("CARGO_BIN_EXE_servobus-bench");

fn run(subject: &str, case: Case, iterations: &str) -> Output {
    Command::new(PROGRAM)
        .args(["--subject", subject, "--case", case.name()])
        .args(["--iterations", iterations])
        .output()
        .expect("the program starts")
}

#[test]
fn every_case_of_every_stack_answers_rightly() {
    for subject in ["servobus", "zencan-node", "canopen-rs"] {
        for case in Case::ALL {
            if (subject, case) == ("canopen-rs", Case::IdlePoll) || case.is_block() {
                continue;
            }
            // Neither a multiple of the eight requests nor of the two sets of values.
            for iterations in ["0", "1", "1001"] {
                let output = run(subject, case, iterations);
                assert!(output.status.success(), "{subject} {case:?}: {output:?}");
                assert!(output.stdout.is_empty(), "{output:?}");
            }
        }
    }
}

#[test]
fn every_block_transfer_of_our_own_pair_is_right() {
    let cases = Case::ALL.into_iter().filter(|case| case.is_block());
    let mut runs = 0;
    for case in cases {
        for transfers in ["0", "1", "3"] {
            let output = run("servobus", case, transfers);
            assert!(output.status.success(), "{case:?}: {output:?}");
            assert!(output.stdout.is_empty(), "{output:?}");
            runs += 1;
        }
    }
    assert_eq!(runs, 18);
}

#[test]
fn other_stacks_are_not_measured_in_blocks() {
    for subject in ["zencan-node", "canopen-rs"] {
        let output = run(subject, Case::Block(Direction::Upload, Side::Pair), "1");
        assert!(!output.status.success());
        let message = String::from_utf8_lossy(&output.stderr);
        let expected = format!("not for {subject}");
        assert!(message.contains(&expected), "{message}");
    }
}

#[test]
fn a_stack_without_a_clock_has_no_idle_poll() {
    let output = run("canopen-rs", Case::IdlePoll, "1");
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("canopen-rs has no clock"), "{message}");
}

#[test]
fn a_count_repeats_to_the_instruction() {
    for (subject, case, least) in [
        // An upload cannot be done in less than its eight bytes in and out.
        ("canopen-rs", Case::SdoUpload, 16.0),
        // Nor can a byte in a segment of seven without its share of the checksum.
        ("servobus", Case::Block(Direction::Upload, Side::Pair), 1.0),
    ] {
        let count = || {
            let arguments = ["--subject", subject, "--case", case.name(), "--iterations"];
            cost(Path::new(PROGRAM), &arguments, case.run_lengths())
        };
        match count() {
            Ok(first) => {
                let unit = if case.is_block() { BYTES } else { 1 };
                assert!(first.per_byte(unit) > least, "{first:?}");
                assert_eq!(count().ok(), Some(first));
            }
            Err(error @ MeasureError::Valgrind(_)) => {
                assert!(error.to_string().contains("install"), "{error}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
#[cfg(debug_assertions)]
fn a_debug_build_gives_no_figures() {
    let json = tempfile::tempdir().expect("a directory");
    let json = json.path().join("figures.json");
    let output = Command::new(PROGRAM).arg("--json").arg(&json).output();
    let output = output.expect("the program starts");
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("--release"), "{message}");
    assert!(!json.exists());
}
