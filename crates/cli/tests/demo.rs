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

/// Each drive is brought into operation by its own document's way and reaches its targets; the recording is
/// that of a run that can be repeated.
#[test]
fn every_drive_has_its_demo() {
    for (drive, begin, said) in [
        (
            "p3-extended",
            "Three virtual p3-extended drives on a simulated CAN bus",
            "mode 4, profile torque: +500",
        ),
        (
            "p3-jpl",
            "Three virtual p3-jpl drives on a simulated CAN bus",
            "mode 7, Barrett trapezoid: +10 turns",
        ),
        (
            "md80",
            "Three virtual md80 drives on a simulated CAN bus",
            "mode 8, cyclic position: +0.5 turns",
        ),
        (
            "roboteq",
            "Three virtual roboteq drives on a simulated CAN bus",
            "0x30F1,0 State machine is active (^FSA) = 1",
        ),
        (
            "roboteq-2",
            "One virtual roboteq-2 with 2 axes on a simulated CAN bus",
            "Node 1, axis 2, mode 1, profile position: +10 turns",
        ),
        (
            "roboteq-3",
            "One virtual roboteq-3 with 3 axes on a simulated CAN bus",
            "0x70FF,0 Target velocity (S) = 1000 RPM",
        ),
    ] {
        let folder = folder(drive);
        let output = demo(&folder, &["--drive", drive, "--record", "run.log"]);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(text.starts_with(begin), "{text}");
        assert!(text.contains(said), "{said}\n{text}");
        let ways = personalities::by_name(drive).unwrap().axes.len();
        let acts = if ways == 2 { 2 } else { 3 };
        assert!(
            text.contains(&format!("{acts} of {acts} targets reached")),
            "{text}"
        );
        let svg = fs::read_to_string(folder.join("servobus-demo.svg")).unwrap();
        assert!(svg.contains(drive) && !svg.contains("P3"), "{drive}");
        let replay = Command::new(env!("CARGO_BIN_EXE_servobus"))
            .args(["replay", "run.log"])
            .current_dir(&folder)
            .output()
            .unwrap();
        let told = String::from_utf8(replay.stdout).unwrap();
        assert!(told.contains("identical"), "{told}");
    }
}

/// A target that is missed is told with what the drive says instead.
#[test]
fn another_drive_that_is_held_misses_its_target() {
    let folder = folder("held");
    let scenario = "personality = \"md80\"\n[[event]]\nwhen = { position = \"9 turns\" }\n\
                    do = \"block-shaft\"\ndrive = 1\n";
    fs::write(folder.join("held.toml"), scenario).unwrap();
    let words = ["--drive", "md80", "--scenario", "held.toml"];
    let output = demo(&folder, &words);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("node 1, +2 turns: not reached, at ") && text.contains(", operation enabled"),
        "{text}"
    );
    assert!(text.contains("2 of 3 targets reached"), "{text}");
    // It is another drive's scenario.
    let output = demo(&folder, &words[2..]);
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        told.contains("the demo's drives are p3, not md80 (--drive md80"),
        "{told}"
    );
}
