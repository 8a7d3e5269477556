//! `servobus sim` with bit rates, drives without a node ID, and disturbances; `servobus lss` there.

mod support;

use support::{Folder, Sim, printed};

/// What `servobus lss` prints on the bus of `sim`.
fn lss(sim: &Sim, words: &[&str]) -> String {
    let (service, rest) = words.split_first().unwrap();
    printed(&[&["lss", service, "--bus", sim.bus()], rest].concat(), 0)
}

/// The node IDs that a scan finds.
fn nodes(sim: &Sim) -> Vec<String> {
    let text = printed(&["scan", "--bus", sim.bus()], 0);
    let rows = text.lines().skip(1);
    rows.map(|row| row.split(' ').next().unwrap().to_owned())
        .collect()
}

#[test]
fn drives_get_node_ids_that_are_there_in_the_next_run() {
    let folder = Folder::new();
    let (store, log) = (folder.file("store"), folder.file("run.log"));
    let words = [
        "--drive",
        "p3-extended",
        "--nodes",
        "2,unconfigured:2",
        "--store",
        &store,
        "--record",
        &log,
    ];
    let sim = Sim::start(&words);
    assert_eq!(
        sim.ready,
        "ready: 3 virtual p3-extended drives, node 2, 2 without a node ID"
    );
    let serials = ["1129", "1130"];
    let found = lss(&sim, &["scan"]);
    assert!(
        serials.iter().all(|serial| found.contains(serial)),
        "{found}"
    );
    let given = lss(&sim, &["assign", "--ids", "8,9"]);
    assert!(
        given.contains("node 8: ") && given.contains("node 9: "),
        "{given}"
    );
    assert_eq!(nodes(&sim), ["2", "8", "9"]);
    // The one that is set up as 2 becomes 30.
    let identity = "0x408:0x5033:0x20000:1002";
    lss(&sim, &["set-id", "--identity", identity, "30", "--store"]);
    // It boots as another node than the one that was told to.
    printed(&["nmt", "--bus", sim.bus(), "reset-communication", "2"], 1);
    sim.end();
    let replayed = printed(&["replay", &log], 0);
    assert!(replayed.contains("identical"), "{replayed}");

    let sim = Sim::start(&words[..6]);
    assert_eq!(
        sim.ready,
        "ready: 3 virtual p3-extended drives, nodes 8-9,30; stored by LSS: drive 2 is node 30, \
         drive u1 is node 8, drive u2 is node 9"
    );
    assert_eq!(nodes(&sim), ["8", "9", "30"]);
    sim.end();
    assert!(folder.path().join("store/p3-extended-u2.flash").is_file());
    assert!(
        folder
            .path()
            .join("store/p3-extended-node2.flash")
            .is_file()
    );
}

#[test]
fn an_activated_bit_rate_is_followed_and_told() {
    let folder = Folder::new();
    let store = folder.file("store");
    let words = [
        "--drive",
        "p3-extended",
        "--nodes",
        "1",
        "--store",
        &store,
        "--bit-rate",
        "500k",
    ];
    let sim = Sim::start(&words);
    let identity = "0x408:0x5033:0x20000:1001";
    lss(
        &sim,
        &[
            "bit-rate",
            "125",
            "--identity",
            identity,
            "--store",
            "--activate",
            "20",
        ],
    );
    std::thread::sleep(std::time::Duration::from_millis(100));
    lss(&sim, &["waiting"]);
    assert_eq!(nodes(&sim), ["1"]);
    let told = sim.end().stderr;
    let follows = "the bus has 125 kbit/s now, as an LSS master said; outside programs follow";
    assert!(told.contains(follows), "{told}");

    let sim = Sim::start(&words);
    let told = sim.end().stderr;
    let deaf = "node 1: it starts with 125 kbit/s, and the bus has 500 kbit/s: it hears nobody";
    assert!(told.contains(deaf), "{told}");
}

#[test]
fn what_a_drive_cannot_be_is_refused_with_one_that_can() {
    for (words, why) in [
        (
            &["--bit-rate", "125k"][..],
            "error: p3 has 1 Mbit/s only; for --bit-rate 125k use --drive p3-extended or --drive roboteq\n",
        ),
        (
            &["--bit-rate", "33k"],
            "write one of 10k, 20k, 50k, 100k, 125k",
        ),
        (
            &["--nodes", "1,unconfigured:2"],
            "error: p3 has no LSS, so a drive without a node ID could never get one; for --nodes \
             unconfigured use --drive p3-extended\n",
        ),
        (
            &["--node", "40=md80"],
            "error: node 40 cannot be md80: its node IDs are 1 to 31; give it one of these, or make \
             node 40 another drive\n",
        ),
        (
            &["--drive", "md80", "--nodes", "31-32"],
            "node 32 cannot be",
        ),
        (&["--nodes", "unconfigured:0"], "a number from 1 to 127"),
        (&["--lose", "1"], "as in 1% or 0.5%"),
        (&["--duplicate", "-1%"], "from 0% to 100%"),
    ] {
        let text = printed(
            &[&["sim", "--bus", "none", "--for", "1s"], words].concat(),
            2,
        );
        assert!(text.contains(why), "{words:?}: {text}");
    }
}

#[test]
fn each_bit_rate_keeps_the_pace() {
    for rate in ["10k", "100k", "800k", "1000000"] {
        let sim = Sim::with_doors(
            &["none"],
            &[
                "--drive",
                "p3-extended",
                "--nodes",
                "1",
                "--bit-rate",
                rate,
                "--for",
                "200ms",
            ],
        );
        let ended = sim.wait();
        assert_eq!(ended.status.code(), Some(0));
        assert!(ended.stdout.starts_with("simulated 0.200 s"), "{ended:?}");
        assert!(ended.stdout.contains("; 1 frames, "), "{ended:?}");
    }
}

#[test]
fn a_disturbed_bus_says_what_it_did_and_is_repeated() {
    let folder = Folder::new();
    let log = folder.file("lossy.log");
    let sim = Sim::start(&[
        "--nodes",
        "1",
        "--lose",
        "20%",
        "--duplicate",
        "20%",
        "--seed",
        "4",
        "--record",
        &log,
    ]);
    for _ in 0..20 {
        let words = ["sdo", "read", "--bus", sim.bus(), "--node", "1", "0x1000"];
        let output =
            support::run(&[&words[..], &["--retries", "20", "--timeout", "50ms"]].concat());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    let told = sim.end().stderr;
    let line = told
        .lines()
        .find(|line| line.starts_with("disturbed on purpose: "));
    let line = line.unwrap_or_else(|| panic!("{told}"));
    assert!(
        !line.contains(": 0 lost") && line.contains(" frames to the bus, "),
        "{line}"
    );
    let replayed = printed(&["replay", &log], 0);
    assert!(replayed.contains("identical"), "{replayed}");
}
