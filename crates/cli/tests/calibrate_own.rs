//! Drives that are not calibrated and tuned step by step: what they do by themselves, and what the others
//! are told.

mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use support::{Sim, printed, servobus};

/// An MD80 as out of the box.
fn fresh() -> Sim {
    Sim::start(&["--node", "2=md80", "--factory"])
}

fn own<'a>(bus: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let words = ["calibrate", "own", "--node", "2", "--bus", bus];
    [&words[..], more].concat()
}

const SET_UP: [&str; 7] = [
    "--yes",
    "--set",
    "pole-pairs=21",
    "--set",
    "torque-constant=0.091",
    "--set",
    "bandwidth=500",
];

fn read(bus: &str, object: &str) -> String {
    printed(&["sdo", "read", "--node", "2", object, "--bus", bus], 0)
}

/// A figure of a result, by its object.
fn figure(json: &Value, part: &str, index: u16, sub: u8) -> f64 {
    let entries = json[part].as_array().unwrap();
    let mut entries = entries.iter();
    let entry = entries.find(|entry| entry["index"] == index && entry["sub"] == sub);
    entry.unwrap()["value"].as_f64().unwrap()
}

#[test]
fn a_drive_out_of_the_box_is_set_up_and_calibrates_itself() {
    let sim = fresh();
    let bus = sim.bus();
    // What it needs, without anything done.
    let text = printed(&own(bus, &["--dry-run"]), 0);
    assert!(
        text.contains("node 2: nothing was done; it needs pole-pairs, torque-constant, bandwidth"),
        "{text}"
    );
    let text = printed(&own(bus, &["--yes"]), 1);
    assert!(
        text.contains(
            "not set: pole-pairs, torque-constant, bandwidth; add --set pole-pairs=VALUE"
        ),
        "{text}"
    );
    assert!(read(bus, "0x2004,1").contains("main encoder: empty table"));

    let json = printed(&own(bus, &[&SET_UP[..], &["--json"]].concat()), 0);
    let json: Value = serde_json::from_str(&json).unwrap();
    // The simulated motor's 85 mΩ and 28.5 µH.
    assert!((figure(&json, "results", 0x2000, 4) / 0.085 - 1.0).abs() < 0.03);
    assert!((figure(&json, "results", 0x2000, 3) / 28.5e-6 - 1.0).abs() < 0.05);
    assert_eq!(figure(&json, "set_up", 0x2000, 1), 21.0);
    assert_eq!(json["stored"], true);
    assert_eq!(json["status"], serde_json::json!([]));
    // It has stored that.
    printed(&["nmt", "reset-node", "2", "--bus", bus], 0);
    assert!(read(bus, "0x2000,4").contains("Phase Resistance = 0.08"));
    assert!(read(bus, "0x2004,1").ends_with("none\n"));

    // The current controllers' part alone is not stored.
    let text = printed(&own(bus, &["current-gains", "--yes"]), 0);
    assert!(
        text.ends_with("calibrated, until the next reset; servobus sdo write --node 2 0x1010,1 save stores it\n"),
        "{text}"
    );
    assert!(read(bus, "0x6061").contains("idle"));
    sim.end();
}

#[test]
fn a_failure_is_told_by_the_names_of_its_bits() {
    let sim = fresh();
    let bus = sim.bus();
    let mut words = own(bus, &SET_UP);
    words.extend(["--set", "pole-pairs=20"]);
    let text = printed(&words, 1);
    // Beside what a drive out of the box shows.
    for words in [
        "error: node 2: the calibration has failed: ",
        "main encoder: calibration failed, calibration: pole pairs",
        "; nothing is stored (it has left the mode, and the motor is without power)",
    ] {
        assert!(text.contains(words), "{text}");
    }
    assert!(read(bus, "0x6061").contains("idle"));
    sim.end();
}

#[test]
fn ctrl_c_ends_the_drives_own_calibration() {
    let sim = fresh();
    let bus = sim.bus();
    let mut child = servobus(&own(bus, &SET_UP))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = BufReader::new(child.stderr.take().unwrap());
    let mut error = String::new();
    while !error.contains("the drive calibrates itself") {
        assert_ne!(pipe.read_line(&mut error).unwrap(), 0, "{error}");
    }
    std::thread::sleep(Duration::from_millis(500));
    let id = child.id().to_string();
    let signalled = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(signalled.success());
    pipe.read_to_string(&mut error).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{error}");
    assert!(
        error.contains(
            "error: node 2: stopped (it has left the mode, and the motor is without power)"
        ),
        "{error}"
    );
    assert!(read(bus, "0x6061").contains("idle"));
    assert!(read(bus, "0x2004,1").contains("main encoder: calibration failed"));
    sim.end();
}

#[test]
fn words_that_the_drive_does_not_know_are_refused() {
    let sim = fresh();
    let bus = sim.bus();
    for (words, code, message) in [
        (
            &["gearbox"][..],
            2,
            "it has motor, output-encoder, current-gains",
        ),
        (
            &["--set", "poles=4"],
            2,
            "--set poles=4: there is no such parameter; there are: pole-pairs,",
        ),
        (
            &["--set", "pole-pairs"],
            2,
            "--set pole-pairs: write NAME=VALUE",
        ),
        (&["--set", "pole-pairs=many"], 2, "--set pole-pairs=many: "),
        (
            &["--set", "pole-pairs=300"],
            1,
            "writing 0x2000,1: refused, 0x06090031",
        ),
    ] {
        let text = printed(&[&own(bus, &["--yes"])[..], words].concat(), code);
        assert!(text.contains(message), "{text}");
    }
    let text = printed(&own(bus, &[]), 2);
    assert!(text.contains("nobody can be asked"), "{text}");
    sim.end();
}

/// Whoever has nothing of the kind says what there is, before anything is changed.
#[test]
fn each_drive_says_what_it_offers() {
    let words = [
        "--node",
        "1=p3",
        "--node",
        "2=md80",
        "--node",
        "3=roboteq-2",
        "--node",
        "4=p3-jpl",
    ];
    let sim = Sim::start(&words);
    let bus = sim.bus();
    printed(&["nmt", "pre-operational", "4", "--bus", bus], 0);
    for (words, message) in [
        (
            "calibrate own --node 1",
            "node 1 is a p3, which has no calibration of its own: servobus calibrate all --node 1",
        ),
        (
            "calibrate encoder-lag --node 2",
            "node 2 is a md80: it calibrates itself, with servobus calibrate own --node 2",
        ),
        (
            "calibrate all --node 3",
            "node 3 is a roboteq-2: its document has no calibration",
        ),
        (
            "calibrate own --node 3",
            "node 3 is a roboteq-2: its document has no calibration",
        ),
        (
            "calibrate all --node 4",
            "node 4 is a p3-jpl: its manual has no calibration",
        ),
        (
            "calibrate own --node 9 --timeout 50ms",
            "node 9 does not say that it is a drive that is known here",
        ),
        (
            "tune velocity --node 2",
            "node 2 is a md80: its controllers have gains and no bandwidth: 0x2001",
        ),
        (
            "tune position --node 3",
            "node 3 is a roboteq-2: its document has no gains",
        ),
        (
            "tune velocity --node 4",
            "node 4 is a p3-jpl: its manual has no gains",
        ),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let text = printed(&[&words[..], &["--yes", "--bus", bus]].concat(), 1);
        assert!(text.contains(message), "{text}");
    }
    sim.end();
}
