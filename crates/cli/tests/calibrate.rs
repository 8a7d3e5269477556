//! `servobus calibrate` and `servobus tune` against a running simulation.

mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use support::{Sim, printed, servobus};

fn read(bus: &str, object: &str) -> String {
    let words = ["sdo", "read", "--node", "1", "--bus", bus];
    printed(
        &[&words[..], &object.split(' ').collect::<Vec<_>>()].concat(),
        0,
    )
}

fn write(bus: &str, object: &str) {
    let words = ["sdo", "write", "--node", "1", "--bus", bus];
    printed(
        &[&words[..], &object.split(' ').collect::<Vec<_>>()].concat(),
        0,
    );
}

#[test]
fn the_current_sensors_are_calibrated_and_saved_only_if_wanted() {
    let sim = Sim::start(&["--nodes", "1"]);
    let bus = sim.bus();
    write(bus, "0x3009 1 2000");
    let words = ["calibrate", "current-sensor", "--node", "1", "--bus", bus];
    let text = printed(&[&words[..], &["--dry-run"]].concat(), 0);
    assert!(
        text.contains("not saved, the old values are back"),
        "{text}"
    );
    let row = text
        .lines()
        .find(|line| line.starts_with("0x3009,1"))
        .unwrap();
    let columns: Vec<&str> = row.split_whitespace().collect();
    // The zero of the manual's example, 0x0729.
    assert!(columns.ends_with(&["2000", "1833", "count"]), "{row}");
    assert!(read(bus, "0x3009 1").contains("= 2000"));

    let json = printed(&[&words[..], &["--yes", "--json"]].concat(), 0);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["saved"], true);
    assert_eq!(json["changes"][0]["index"], 0x3009);
    assert_eq!(json["changes"][0]["new"], 1833);
    // It is stored: a reset does not lose it.
    printed(&["nmt", "reset-node", "1", "--bus", bus], 0);
    assert!(read(bus, "0x3009 1").contains("= 1833"));
    sim.end();
}

#[test]
fn the_electrical_zero_is_found_over_a_door_in_real_time() {
    let sim = Sim::start(&["--nodes", "1"]);
    let bus = sim.bus();
    write(bus, "0x3011 1 100");
    let words = ["calibrate", "electrical-zero", "--node", "1", "--bus", bus];
    let json = printed(&[&words[..], &["--yes", "--json"]].concat(), 0);
    let json: Value = serde_json::from_str(&json).unwrap();
    let zero = json["result"]["zero_counts"].as_f64().unwrap();
    assert!((zero - f64::from(0x0DF8)).abs() < 3.0, "{json}");
    assert_eq!(json["result"]["polarity"], 1);
    assert!(read(bus, "0x6041").contains("switch on disabled"));
    sim.end();
}

#[test]
fn ctrl_c_leaves_the_motor_without_power_and_the_objects_as_they_were() {
    let sim = Sim::start(&["--nodes", "1"]);
    let bus = sim.bus();
    let before = read(bus, "0x3011 1");
    let mut child = servobus(&["calibrate", "all", "--node", "1", "--yes", "--bus", bus])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // In the middle of the turn under voltage.
    let mut pipe = BufReader::new(child.stderr.take().unwrap());
    let mut error = String::new();
    while !error.contains("leading the rotor one turn") {
        assert_ne!(pipe.read_line(&mut error).unwrap(), 0, "{error}");
    }
    std::thread::sleep(Duration::from_millis(300));
    let id = child.id().to_string();
    let signalled = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(signalled.success());
    pipe.read_to_string(&mut error).unwrap();
    let code = child.wait().unwrap().code();
    assert_eq!(code, Some(1), "{error}");
    assert!(
        error.contains("error: node 1: stopped (the motor is without power, nothing is changed)"),
        "{error}"
    );
    assert!(read(bus, "0x6041").contains("switch on disabled"));
    assert!(read(bus, "0x6061").contains("= 0"));
    assert_eq!(read(bus, "0x3011 1"), before);
    assert!(read(bus, "0x2406").contains("= 0"));
    sim.end();
}

#[test]
fn who_does_not_answer_is_named() {
    let sim = Sim::start(&["--nodes", "1"]);
    let words = [
        "calibrate",
        "all",
        "--node",
        "5",
        "--yes",
        "--bus",
        sim.bus(),
    ];
    let text = printed(&words, 1);
    assert!(text.contains("error: node 5: "), "{text}");
    assert!(
        text.contains("no answer within 500 ms (no power was applied)"),
        "{text}"
    );
    sim.end();
}
