//! `scan`, `sdo`, `nmt`, `monitor` and `play` against a running simulation, and `play --virtual`.

mod support;

use std::path::PathBuf;
use std::process::Stdio;
use std::time::Duration;

use serde_json::Value;
use support::{Folder, Sim, printed, servobus};

#[test]
fn scan_finds_the_drives_and_what_they_are() {
    for door in ["socketcand://127.0.0.1:0", "slcan://127.0.0.1:0"] {
        let sim = Sim::with_doors(&[door], &["--nodes", "1,4", "--seed", "3"]);
        let bus = sim.bus();
        let text = printed(&["scan", "--bus", bus], 0);
        assert_eq!(text.lines().count(), 3, "{text}");
        let json = printed(&["scan", "--bus", bus, "--json", "--nodes", "1-2,4"], 0);
        let json: Value = serde_json::from_str(&json).unwrap();
        let nodes: Vec<&Value> = json
            .as_array()
            .unwrap()
            .iter()
            .map(|n| &n["node"])
            .collect();
        assert_eq!(nodes, [1, 4]);
        assert_eq!(json[1]["hardware"], "sim");
        assert_eq!(json[1]["vendor"], 0x408);
        assert_eq!(json[1]["serial"], 3004);
        let words = printed(&["scan", "--bus", bus, "--nodes", "2-3"], 1);
        assert_eq!(words, "no node was found\n");
    }
}

#[test]
fn scan_hears_the_state_of_nodes_with_a_heartbeat() {
    let sim = Sim::start(&[]);
    let bus = sim.bus();
    printed(
        &["sdo", "write", "--node", "1", "--bus", bus, "0x1017", "20"],
        0,
    );
    printed(&["nmt", "pre-operational", "1", "--bus", bus], 0);
    let text = printed(
        &["scan", "--bus", bus, "--nodes", "1", "--listen", "200ms"],
        0,
    );
    assert!(text.contains("pre-operational"), "{text}");
    // A stopped node answers no SDO, but it is there.
    printed(&["nmt", "stop", "1", "--bus", bus], 0);
    let text = printed(
        &["scan", "--bus", bus, "--nodes", "1-3", "--listen", "200ms"],
        0,
    );
    assert!(text.contains("stopped, no SDO answer"), "{text}");
}

#[test]
fn sdo_reads_and_writes_by_the_dictionary_and_by_type() {
    let sim = Sim::start(&[]);
    let bus = sim.bus();
    let read = |words: &[&str], code| {
        printed(
            &[&["sdo", "read", "--node", "1", "--bus", bus], words].concat(),
            code,
        )
    };
    let write = |words: &[&str], code| {
        printed(
            &[&["sdo", "write", "--node", "1", "--bus", bus], words].concat(),
            code,
        )
    };
    assert!(read(&["0x6041"], 0).contains("switch on disabled"));
    write(&["0x607A", "-2000"], 0);
    assert_eq!(
        read(&["0x607A", "0"], 0),
        "node 1 0x607A,0 Target position = -2000 cts\n"
    );
    assert_eq!(
        read(&["0x607A", "--type", "u32"], 0),
        "node 1 0x607A,0 Target position = 4294965296\n"
    );
    // 0xFFFFF830 is -2000.
    let json: Value = serde_json::from_str(&read(&["0x607A", "--json"], 0)).unwrap();
    assert_eq!(json["value"], -2000);
    assert_eq!(json["type"], "INTEGER32");
    assert_eq!(json["bytes"], serde_json::json!([0x30, 0xF8, 0xFF, 0xFF]));
    write(&["0x3009", "1", "0x0729"], 0);
    let json: Value = serde_json::from_str(&read(&["0x3009,1", "--json"], 0)).unwrap();
    assert_eq!(json["value"], 0x0729);
    assert_eq!(
        read(&["0x1018"], 0),
        "node 1 0x1018,0 highest sub-index = 4\n"
    );

    // The drive's own refusals, with exit code 1.
    let error = write(&["0x6060", "4"], 1);
    assert!(
        error.contains("node 1: writing 0x6060,0: refused, 0x08000022"),
        "{error}"
    );
    let error = read(&["0x7000"], 1);
    assert!(error.contains("0x06020000"), "{error}");
    let error = printed(
        &[
            "sdo",
            "read",
            "--node",
            "9",
            "--bus",
            bus,
            "0x6041",
            "--timeout",
            "100ms",
        ],
        1,
    );
    assert_eq!(
        error,
        "error: node 9: reading 0x6041,0: no answer within 100 ms\n"
    );
}

#[test]
fn nmt_resets_and_waits_for_the_boot_up() {
    let sim = Sim::start(&["--nodes", "1-2"]);
    let bus = sim.bus();
    let nmt = |words: &[&str], code| printed(&[&["nmt", "--bus", bus], words].concat(), code);
    let text = nmt(&["reset-node", "2"], 0);
    assert_eq!(text, "sent: reset node, node 2\nnode 2 has booted\n");
    let text = nmt(&["reset-communication", "all"], 0);
    assert!(
        text.contains("node 1 has booted") && text.contains("node 2 has booted"),
        "{text}"
    );
    let text = nmt(&["start"], 0);
    assert_eq!(text, "sent: start, all nodes\n");
    let text = nmt(&["reset-node", "9"], 1);
    assert!(text.contains("node 9: no boot-up within 2000 ms"), "{text}");
}

#[test]
fn monitor_puts_frames_into_words() {
    let sim = Sim::start(&[]);
    let bus = sim.bus();
    let monitor = |words: &[&str]| {
        servobus(&[&["monitor", "--bus", bus, "--for", "2s"], words].concat())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let (plain, json) = (
        monitor(&["--drive", "p3"]),
        monitor(&["--drive", "p3", "--json"]),
    );
    std::thread::sleep(Duration::from_millis(500));
    for (words, code) in [
        (&["sdo", "write", "--node", "1", "0x6060", "4"][..], 1),
        (&["sdo", "write", "--node", "1", "0x6040", "0x86"], 0),
        (&["sdo", "write", "--node", "1", "0x6040", "0x0F"], 0),
        (&["sdo", "read", "--node", "1", "0x6041"], 0),
        (&["nmt", "reset-node", "1"], 0),
    ] {
        printed(&[words, &["--bus", bus]].concat(), code);
    }
    let text = |child: std::process::Child| {
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    let (plain, json) = (text(plain), text(json));
    for words in [
        "node 1 refuses 0x6060,0 Set mode of operation: 0x08000022 data cannot be",
        "enable operation",
        "operation enabled",
        "NMT: reset node, node 1",
        "node 1 boot-up",
    ] {
        assert!(plain.contains(words), "{words}\n{plain}");
    }
    let json: Vec<Value> = json
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(json.len(), plain.lines().count());
    let abort = json.iter().find(|line| line["kind"] == "abort").unwrap();
    assert_eq!(
        (&abort["node"], &abort["code"]),
        (&1.into(), &0x0800_0022.into())
    );
    assert_eq!(abort["frame"], "581#8060600022000008");
    // The clock of the bus: virtual time, which goes forward.
    let times: Vec<u64> = json
        .iter()
        .map(|line| line["time_ns"].as_u64().unwrap())
        .collect();
    assert!(times.is_sorted());
}

#[test]
fn monitor_ends_with_code_1_when_the_bus_goes() {
    let sim = Sim::start(&["--for", "600ms"]);
    let text = printed(&["monitor", "--bus", sim.bus()], 1);
    assert!(text.contains("closed the connection"), "{text}");
}

fn transcripts() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/p3");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    files
}

#[test]
fn every_transcript_passes_against_virtual_drives_with_their_motors() {
    let files = transcripts();
    let mut words = vec!["play", "--virtual"];
    words.extend(files.iter().map(|file| file.to_str().unwrap()));
    let text = printed(&words, 0);
    let count = files.len();
    assert!(count >= 15);
    assert!(
        text.ends_with(&format!("{count} transcripts: {count} passed, 0 failed\n")),
        "{text}"
    );
    assert!(!text.contains("NOT CHECKED"), "{text}");
    words.extend(["--json", "--seed", "99"]);
    let reports: Value = serde_json::from_str(&printed(&words, 0)).unwrap();
    let reports = reports.as_array().unwrap();
    assert_eq!(reports.len(), count);
    assert!(
        reports
            .iter()
            .any(|report| report["assertions"].as_u64() > Some(0))
    );
    assert!(reports.iter().all(|report| report["failure"].is_null()));
}

#[test]
fn a_transcript_that_the_drive_departs_from_ends_with_1_and_says_where() {
    let folder = Folder::new();
    let file = folder.file("wrong.txt");
    let head = "drive p3\nnodes 1\n\n0x601 8 40 00 10 00 00 00 00 00\n";
    std::fs::write(&file, format!("{head}0x581 8 42 00 10 00 92 01 00 00\n")).unwrap();
    let text = printed(&["play", "--virtual", &file], 1);
    assert!(
        text.contains(&format!("{file}:5: another frame came")),
        "{text}"
    );
    assert!(text.contains("byte 6: 00 expected, 02 received"), "{text}");

    // The motor can be looked at, in its own units only.
    for (line, message) in [
        (
            "assert node 1 bus_voltage = 24 +- 0.5 V",
            "measured  node 1 bus_voltage 48 V",
        ),
        (
            "assert node 1 current = 0 +- 1 mA",
            "current is in A, not in mA",
        ),
        (
            "assert node 1 colour > 1 nm",
            "there are position, speed, current, torque, bus_voltage",
        ),
        (
            "assert node 2 speed = 0 +- 1 counts/s",
            "there is no node 2",
        ),
    ] {
        std::fs::write(&file, format!("drive p3\nnodes 1\n\n{line}\n")).unwrap();
        let text = printed(&["play", "--virtual", &file], 1);
        assert!(text.contains(message), "{line}\n{text}");
    }
}

#[test]
fn transcripts_play_against_a_bus_in_real_time() {
    let sim = Sim::start(&["--nodes", "1-2"]);
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/p3");
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let files = [
        file("enumerate.txt"),
        file("state-machine.txt"),
        file("sdo-torque.txt"),
    ];
    let mut words = vec!["play", "--bus", sim.bus()];
    words.extend(files.iter().map(String::as_str));
    let text = printed(&words, 0);
    assert!(text.contains("3 transcripts: 3 passed, 0 failed"), "{text}");
    // A motor that cannot be looked at is no motor that does right.
    assert!(text.contains("NOT CHECKED"), "{text}");
}
