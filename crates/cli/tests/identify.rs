//! Which drive a node is, by what it answers: never another drive's names and units.

mod support;

use std::process::Stdio;
use std::time::Duration;

use can::Frame;
use support::{Sim, printed, run, servobus};

/// Each drive of a bus with all of them, and the words of `0x60FF` (target velocity) in its document.
const DRIVES: [(&str, &str, &str); 7] = [
    ("1", "p3", "Target velocity = 5 cts/s"),
    ("2", "p3-extended", "Target velocity = 5 cts/s"),
    ("3", "p3-jpl", "Velocity target = 5 rad/s/65536"),
    ("4", "roboteq", "Target velocity (S) = 5 RPM"),
    ("5", "roboteq-2", "Target velocity (S) = 5 RPM"),
    ("6", "roboteq-3", "Target velocity (S) = 5 RPM"),
    ("7", "md80", "Target Velocity = 5 RPM"),
];

/// All drives; the P3 of 2016 has ended its BarrettCAN.
fn all() -> Sim {
    let mut words = Vec::new();
    let named: Vec<String> = DRIVES
        .iter()
        .map(|(node, drive, _)| format!("{node}={drive}"))
        .collect();
    for drive in &named {
        words.extend(["--node", drive]);
    }
    let sim = Sim::start(&words);
    let words = ["nmt", "pre-operational", "all", "--bus", sim.bus()];
    printed(&words, 0);
    sim
}

#[test]
fn sdo_speaks_each_drives_own_words() {
    let sim = all();
    let bus = sim.bus();
    for (node, drive, words) in DRIVES {
        let write = ["sdo", "write", "--node", node, "0x60FF", "5", "--bus", bus];
        assert_eq!(
            printed(&write, 0),
            format!("node {node} has taken 0x60FF,0 {words}\n")
        );
        let read = ["sdo", "read", "--node", node, "0x60FF", "--bus", bus];
        assert_eq!(
            printed(&read, 0),
            format!("node {node} 0x60FF,0 {words}\n"),
            "{drive}"
        );
        let json = printed(&[&read[..], &["--json"]].concat(), 0);
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["drive"], drive);
    }
    // Bits by name, and objects of the second axis.
    let read = |node, object| {
        let words = ["sdo", "read", "--node", node, object, "--bus", bus];
        printed(&words, 0)
    };
    assert_eq!(
        read("4", "0x2111"),
        "node 4 0x2111,0 Status flags (FS) = 0x0009: serial commands, power stage off\n"
    );
    assert_eq!(
        read("5", "0x6861"),
        "node 5 0x6861,0 Modes of operation display (AOM) = 0x00: open loop\n"
    );
    assert!(read("7", "0x2004,1").ends_with(" = 0x00000000: none\n"));
    // What is said counts.
    let words = [
        "sdo", "read", "--node", "7", "0x60FF", "--drive", "p3", "--bus", bus,
    ];
    assert!(printed(&words, 0).ends_with("Target velocity = 5 cts/s\n"));
    // An object that the drive does not have has no type.
    let words = ["sdo", "write", "--node", "5", "0x7060", "1", "--bus", bus];
    let text = printed(&words, 2);
    assert!(
        text.contains("the dictionary of roboteq-2 has no such object"),
        "{text}"
    );
    sim.end();
}

/// Node 9 answers 0x1000, 0x3000 and 0x6064 and refuses all else, until the bus goes.
async fn stranger(bus: String) {
    let mut connection = bus::connect(&bus.parse().unwrap()).await.unwrap();
    while let Ok(received) = connection.receive().await {
        let frame = received.frame;
        if frame.key() != 0x609 {
            continue;
        }
        let &[_, low, high, sub, ..] = frame.data() else {
            continue;
        };
        let known = [0x1000, 0x3000, 0x6064].contains(&u16::from_le_bytes([low, high]));
        let bytes = match known {
            true => [0x43, low, high, sub, 0x92, 0x01, 0, 0],
            false => [0x80, low, high, sub, 0, 0, 0x02, 0x06],
        };
        connection
            .send(Frame::classic(0x589, bytes, 8))
            .await
            .unwrap();
    }
}

#[test]
fn a_stranger_has_the_standards_names_only() {
    let sim = Sim::start(&["--nodes", "1"]);
    let bus = sim.bus().to_owned();
    let at = bus.clone();
    let node = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        runtime.block_on(stranger(at));
    });
    let sdo = |words: &[&str], code| printed(&[&["sdo"], words, &["--bus", &bus]].concat(), code);
    // It may take its time to join.
    let mut scanned = run(&["scan", "--nodes", "9", "--bus", &bus]);
    for _ in 0..50 {
        if scanned.status.code() == Some(0) {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
        scanned = run(&["scan", "--nodes", "9", "--bus", &bus]);
    }
    assert_eq!(
        sdo(&["read", "--node", "9", "0x6064"], 0),
        "node 9 0x6064,0 Position actual value = 402\n"
    );
    assert_eq!(
        sdo(&["read", "--node", "9", "0x3000"], 0),
        "node 9 0x3000,0 = 92 01 00 00\n"
    );
    let text = sdo(&["write", "--node", "9", "0x3000", "1"], 2);
    assert!(
        text.contains(
            "node 9 is no drive that is known here, and 0x3000,0 no object of the standard"
        ),
        "{text}"
    );
    // Nobody there.
    let text = sdo(
        &["write", "--node", "8", "0x3000", "1", "--timeout", "50ms"],
        1,
    );
    assert!(
        text.contains("node 8 does not say which drive it is"),
        "{text}"
    );
    sim.end();
    node.join().unwrap();
}

#[test]
fn a_monitor_that_asks_knows_the_drives() {
    let sim = all();
    let bus = sim.bus();
    let monitor = |words: &[&str]| {
        servobus(&[&["monitor", "--bus", bus, "--for", "4s"], words].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let (asks, silent) = (monitor(&["--ask"]), monitor(&[]));
    std::thread::sleep(Duration::from_millis(2000));
    for (node, object) in [("7", "0x60FF"), ("6", "0x7060"), ("3", "0x6041")] {
        let words = ["sdo", "read", "--node", node, object, "--bus", bus];
        printed(&words, 0);
    }
    let text = |child: std::process::Child| {
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    let (asks, silent) = (text(asks), text(silent));
    for words in [
        "node 7 answers 0x60FF,0 Target Velocity = 0 RPM",
        "node 6 answers 0x7060,0 Modes of operation (ROM) = 0x00: open loop",
        "node 3 answers 0x6041,0 Status word (not implemented) = 0",
    ] {
        assert!(asks.contains(words), "{words}\n{asks}");
    }
    for words in [
        "node 7 answers 0x60FF,0 Target velocity = 0\n",
        "node 6 answers 0x7060,0 Modes of operation = 0x00: idle",
    ] {
        assert!(silent.contains(words), "{words}\n{silent}");
    }
    assert!(!silent.contains("cts"), "{silent}");
    sim.end();
}

#[test]
fn every_transcript_of_mixed_buses_passes() {
    support::play_all("mixed", 2);
}
