//! `servobus demo` as a user runs it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty folder of its own for each test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("demo")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn demo(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_servobus"))
        .arg("demo")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn it_ends_well_and_leaves_a_plot_and_a_recording() {
    let folder = folder("well");
    let output = demo(&folder, &["--seed", "5", "--record", "run.log"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
    assert!(text.contains("4 of 4 targets reached"), "{text}");
    assert!(text.contains("largest"), "{text}");
    let svg = fs::read_to_string(folder.join("servobus-demo.svg")).unwrap();
    assert!(svg.starts_with("<svg"));
    let log = fs::read_to_string(folder.join("run.log")).unwrap();
    assert!(log.lines().count() > 1_000);
    assert!(folder.join("run.log.run").is_file());
}

#[test]
fn two_runs_of_one_seed_are_alike_to_the_byte() {
    let run = |name| {
        let folder = folder(name);
        let output = demo(&folder, &["--record", "run.log"]);
        let file = |name| fs::read(folder.join(name)).unwrap();
        (
            output.stdout,
            file("run.log"),
            file("run.log.run"),
            file("servobus-demo.svg"),
        )
    };
    assert!(run("one") == run("other"));
}

#[test]
fn a_plot_that_cannot_be_written_is_told_before_the_run() {
    let folder = folder("occupied");
    fs::create_dir(folder.join("servobus-demo.svg")).unwrap();
    let output = demo(&folder, &[]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(output.stdout, b"");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(
        message.contains("servobus-demo.svg: cannot write the plot"),
        "{message}"
    );
}

#[test]
fn a_recording_that_cannot_be_written_is_told_before_the_run() {
    let folder = folder("no-folder");
    let output = demo(&folder, &["--record", "missing/run.log"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(output.stdout, b"");
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("missing/run.log: cannot write the recording"),
        "{message}"
    );
}
