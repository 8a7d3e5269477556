//! Different drives on one bus: `servobus sim --node 1=p3 --node 2=p3-jpl`, and who scans it.

mod support;

use std::fs;

use support::{Folder, Sim, printed};

/// Node IDs, names, and the drives' names of the commands, that a scan finds.
fn found(bus: &str) -> Vec<(u64, String)> {
    let text = printed(&["scan", "--json", "--nodes", "1-9", "--bus", bus], 0);
    let nodes: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let name = |node: &serde_json::Value| {
        let text = |key: &str| node[key].as_str().unwrap();
        format!("{}: {}", text("drive"), text("name"))
    };
    let nodes = nodes.iter();
    nodes
        .map(|node| (node["node"].as_u64().unwrap(), name(node)))
        .collect()
}

#[test]
fn a_scan_names_each_drive_and_a_replay_has_them_again() {
    let folder = Folder::new();
    let log = folder.file("mixed.log");
    let words = [
        "--node",
        "7=p3-jpl",
        "--node",
        "8=md80",
        "--node",
        "9=roboteq-3",
        "--node",
        "3=p3-extended",
        "--node",
        "1-2=p3",
    ];
    let sim = Sim::start(&[&words[..], &["--record", &log]].concat());
    assert_eq!(
        sim.ready,
        "ready: 6 virtual drives, nodes 1-3,7-9: 1-2 p3, 3 p3-extended, 7 p3-jpl, 8 md80, \
         9 roboteq-3"
    );
    let bus = sim.bus().to_owned();
    let mut expected = vec![
        (1, "p3: P3".to_owned()),
        (2, "p3: P3".to_owned()),
        (3, "p3-extended: P3 extended".to_owned()),
        (8, "md80: MD80".to_owned()),
        (9, "roboteq-3: RoboMC".to_owned()),
    ];
    assert_eq!(found(&bus), expected, "the P3 of 2016 waits in BarrettCAN");
    printed(&["nmt", "start", "7", "--bus", &bus], 0);
    expected.insert(3, (7, "p3-jpl: Puck".to_owned()));
    assert_eq!(found(&bus), expected);
    // Each is spoken to with its own dictionary, here under the name that its document has.
    for (node, drive) in [
        ("2", "p3"),
        ("3", "p3-extended"),
        ("7", "p3-jpl"),
        ("8", "md80"),
        ("9", "roboteq-3"),
    ] {
        let words = [
            "sdo", "read", "--node", node, "--drive", drive, "0x6060", "--bus", &bus,
        ];
        let text = printed(&words, 0);
        let kind = personalities::by_name(drive).unwrap();
        let table = kind.device.table;
        let row = table.row(&table.find(0x6060, 0).unwrap()).unwrap();
        let read = format!("node {node} 0x6060,0 {}", row.name);
        assert!(text.starts_with(&read), "{text}");
    }
    sim.end();
    let causes = fs::read_to_string(format!("{log}.run")).unwrap();
    let drives: Vec<&str> = causes
        .lines()
        .filter_map(|line| line.strip_prefix("drive "))
        .collect();
    assert_eq!(
        drives,
        [
            "1 p3",
            "2 p3",
            "3 p3-extended",
            "7 p3-jpl",
            "8 md80",
            "9 roboteq-3"
        ]
    );
    let again = printed(&["replay", &log], 0);
    assert!(again.contains("identical"), "{again}");
}

/// What a scenario says of drives that are there holds; which there are says `--node`.
#[test]
fn named_drives_come_before_those_of_a_scenario() {
    let folder = Folder::new();
    let (file, log) = (folder.file("scenario.toml"), folder.file("run.log"));
    let scenario = "nodes = [1, 2]\npersonality = \"p3\"\nseed = 4\nlength = \"100 ms\"\n\
                    [drive.2]\npersonality = \"p3\"\nload.inertia = \"20 g cm2\"\n";
    fs::write(&file, scenario).unwrap();
    let run = [
        "sim",
        "--bus",
        "none",
        "--speed",
        "max",
        "--scenario",
        &file,
    ];
    let run = |words: &[&str], code| printed(&[&run[..], words].concat(), code);
    let text = run(
        &[
            "--node",
            "2=p3-extended",
            "--node",
            "4=p3",
            "--record",
            &log,
        ],
        0,
    );
    let ready = "ready: 2 virtual drives, nodes 2,4: 2 p3-extended, 4 p3\n";
    assert!(text.starts_with(ready), "{text}");
    let causes = fs::read_to_string(format!("{log}.run")).unwrap();
    let begin =
        "servobus run 1\nseed 4\nbit-rate 1M\ndrive 2 p3-extended\ndrive 4 p3\nscenario-file ";
    assert!(causes.starts_with(begin), "{causes}");
    let again = printed(&["replay", &log], 0);
    assert!(again.contains("identical"), "{again}");
    // The scenario speaks of a drive that is not there.
    let text = run(&["--node", "1=p3"], 2);
    assert!(text.contains("scenario.toml:5:"), "{text}");
}

/// A mixed bus by a scenario alone; and what each drive stored is its own.
#[test]
fn stores_are_kept_by_kind_and_node() {
    let folder = Folder::new();
    let store = folder.file("store");
    let sim = Sim::start(&[
        "--node",
        "1=p3",
        "--node",
        "2=p3-extended",
        "--store",
        &store,
    ]);
    let bus = sim.bus().to_owned();
    for (node, value) in [("1", "111"), ("2", "222")] {
        let write = |object, value| {
            let words = ["sdo", "write", "--node", node, object, value, "--bus", &bus];
            printed(&words, 0);
        };
        write("0x6065", value);
        write("0x1010,1", "save");
    }
    sim.end();
    let sim = Sim::start(&[
        "--node",
        "1=p3",
        "--node",
        "2=p3-extended",
        "--store",
        &store,
    ]);
    for (node, value) in [("1", " = 111 "), ("2", " = 222 ")] {
        let words = ["sdo", "read", "--node", node, "0x6065", "--bus", sim.bus()];
        let text = printed(&words, 0);
        assert!(text.contains(value), "{text}");
    }
    sim.end();
}

/// Every axis of a drive has its signals.
#[test]
fn each_axis_is_recorded() {
    let folder = Folder::new();
    let path = folder.file("run.mcap");
    let words = [
        "sim", "--bus", "none", "--speed", "max", "--for", "100ms", "--record", &path,
    ];
    printed(
        &[&words[..], &["--node", "1=p3", "--node", "2=roboteq-3"]].concat(),
        0,
    );
    let bytes = fs::read(&path).unwrap();
    let topics: std::collections::BTreeSet<String> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(|message| message.unwrap().channel.topic.clone())
        .collect();
    let topics: Vec<&str> = topics.iter().map(String::as_str).collect();
    assert_eq!(
        topics,
        ["can0", "drive/1", "drive/2", "drive/2/2", "drive/2/3"]
    );
}

/// A drive with another drive's dictionary: what is not there is told, and what it may be.
#[test]
fn another_drives_dictionary_is_noticed() {
    let folder = Folder::new();
    let sim = Sim::start(&["--node", "1=md80"]);
    let bus = sim.bus().to_owned();
    let path = folder.file("1.dcf");
    let words = [
        "eds", "dcf", "--node", "1", "--bus", &bus, "--output", &path,
    ];
    let hint = "if it is another drive, name it with --drive";
    let told = |drive: &str| {
        let output = support::run(&[&words[..], &["--drive", drive]].concat());
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(told("p3").contains(hint));
    assert!(!told("md80").contains(hint));
    let words = [
        "sdo", "write", "--node", "1", "0x2000,1", "21", "--drive", "p3", "--bus", &bus,
    ];
    let text = printed(&words, 2);
    assert!(text.contains("say which drive it is (--drive)"), "{text}");
    sim.end();
}
