//! The program itself: every case of every stack answers rightly, and counts repeat.

use std::path::Path;
use std::process::{Command, Output};

use bench::measure::{MeasureError, instructions_per_iteration};
use bench::subject::Case;

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
            if (subject, case) == ("canopen-rs", Case::IdlePoll) {
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
fn a_stack_without_a_clock_has_no_idle_poll() {
    let output = run("canopen-rs", Case::IdlePoll, "1");
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("canopen-rs has no clock"), "{message}");
}

#[test]
fn a_count_repeats_to_the_instruction() {
    let count = || {
        let arguments = "--subject canopen-rs --case sdo_upload --iterations";
        let arguments: Vec<&str> = arguments.split(' ').collect();
        instructions_per_iteration(Path::new(PROGRAM), &arguments)
    };
    match count() {
        Ok(first) => {
            // An upload cannot be done in less than its eight bytes in and out.
            assert!(first > 16, "{first}");
            assert_eq!(count().ok(), Some(first));
        }
        Err(error @ MeasureError::Valgrind(_)) => {
            assert!(error.to_string().contains("install"), "{error}");
        }
        Err(error) => panic!("{error}"),
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
