//! Help, and what is said about bad input: one message with the thing, the place and the remedy.

mod support;

use support::{Folder, printed, run};

#[test]
fn every_help_has_examples() {
    for command in [
        &["sim"][..],
        &["replay"],
        &["scan"],
        &["sdo"],
        &["sdo", "read"],
        &["sdo", "write"],
        &["nmt"],
        &["monitor"],
        &["od"],
        &["play"],
        &["program"],
        &["program", "make"],
        &["program", "check"],
        &["calibrate"],
        &["calibrate", "current-sensor"],
        &["calibrate", "electrical-zero"],
        &["calibrate", "phase-order"],
        &["calibrate", "encoder-lag"],
        &["calibrate", "all"],
        &["tune"],
        &["tune", "velocity"],
        &["tune", "position"],
    ] {
        let words = [command, &["--help"]].concat();
        let help = printed(&words, 0);
        let (_, examples) = help
            .split_once("\nExamples:\n")
            .unwrap_or_else(|| panic!("{help}"));
        let usage = format!("servobus {}", command.join(" "));
        assert!(examples.contains(&usage), "{help}");
        assert!(
            help.lines().all(|line| line.chars().count() <= 100),
            "{help}"
        );
    }
    let help = printed(&["--help"], 0);
    assert!(help.contains("Exit codes:\n  0"), "{help}");
}

#[test]
fn bad_input_is_named_and_ends_with_2() {
    let table: &[(&str, &str)] = &[
        ("fly", "unrecognized subcommand 'fly'"),
        (
            "sim --record run.txt",
            "run.txt: the ending tells the format of a recording: .log (candump), .pcapng",
        ),
        ("monitor --record run", "run: the ending tells the format"),
        (
            "demo --record run.pcap",
            "run.pcap: the ending tells the format",
        ),
        (
            "replay run.log --output again.txt",
            "again.txt: the ending tells the format",
        ),
        (
            "replay run.mcap",
            "run.mcap: a replay can be compared with a candump log only",
        ),
        (
            "scan --bus socketcan://eth0/can0",
            "write its name alone, as in socketcan://can0",
        ),
        ("sim --nodes 0", "there is no node 0; node IDs are 1 to 127"),
        ("sim --nodes 1-128", "there is no node 128"),
        ("sim --nodes 3-1", "the range 3-1 runs backwards; write 1-3"),
        ("sim --nodes 1,2,1", "node 1 is there twice"),
        (
            "sim --nodes one",
            "'one' is no node ID; write 5, 1-3 or 1,4",
        ),
        (
            "sim --node 1",
            "it does not say which drive that is; write 1=p3",
        ),
        (
            "sim --node 0=p3",
            "there is no node 0; node IDs are 1 to 127",
        ),
        ("sim --node 128=p3", "there is no node 128"),
        (
            "sim --node 1=p4",
            "no drive is called 'p4'; there are: p3, p3-extended, ",
        ),
        (
            "sim --node 1-3=p3 --node 2=p3-jpl",
            "--node names node 2 twice; name every node once",
        ),
        (
            "sim --node 1=p3 --nodes 2",
            "--node and --nodes both say what the drives are; leave --nodes out",
        ),
        (
            "sim --node 1=p3 --drive p3-jpl",
            "--node and --drive both say what the drives are; leave --drive out",
        ),
        (
            "sim --node 1=p3 --bit-rate 125k",
            "p3 has 1 Mbit/s only; for --bit-rate 125k use --node 1=p3-extended",
        ),
        ("sim --drive p4", "there is no such drive; there are: p3"),
        (
            "sim --bus can0",
            "'can0' is no bus address: write socketcand://",
        ),
        (
            "sim --bus tcp://127.0.0.1:1",
            "'tcp' in 'tcp://127.0.0.1:1' is not a known protocol",
        ),
        ("sim --bus slcan://127.0.0.1", "names no port"),
        ("sim --bus slcan://127.0.0.1:66000", "'66000'"),
        (
            "sim --bus none --bus slcan://127.0.0.1:0",
            "leave one of them out",
        ),
        ("sim --bus socketcand://0.0.0.0:0", "allow it by --expose"),
        ("sim --speed 0", "write a number from 0.001 to 1000, or max"),
        (
            "sim --speed -1",
            "write a number from 0.001 to 1000, or max",
        ),
        (
            "sim --speed NaN",
            "write a number from 0.001 to 1000, or max",
        ),
        ("sim --speed max", "add --bus none"),
        (
            "sim --speed max --bus slcan://127.0.0.1:0",
            "cannot outrun a program outside",
        ),
        (
            "sim --for 10",
            "the unit is missing; write a number and its unit, as in 10s",
        ),
        ("sim --for 0s", "it must be above 0"),
        ("sim --seed one", "'--seed <SEED>'"),
        (
            "sim --bus none --record /nowhere/run.log",
            "/nowhere/run.log: cannot record there",
        ),
        (
            "sim --bus none --store /dev/null/x",
            "/dev/null/x: cannot make this folder",
        ),
        (
            "replay /nowhere/run.log",
            "/nowhere/run.log: cannot be read",
        ),
        (
            "scan --bus socketcand://127.0.0.1:1",
            "nobody listens at socketcand://127.0.0.1:1/can0",
        ),
        (
            "monitor --node 4",
            "it does not say which drive that is; write 4=p3",
        ),
        (
            "monitor --node 1=p3 --node 1=md80",
            "--node names node 1 twice",
        ),
        ("scan --nodes 0-5", "there is no node 0"),
        ("sdo read 0x6041", "--node <NODE>"),
        ("sdo read --node 128 0x6041", "node IDs are 1 to 127"),
        (
            "sdo read --node 1 6041",
            "'6041' is no index; write the index in hexadecimal",
        ),
        (
            "sdo read --node 1 0x3008,1 1",
            "the sub-index of 0x3008 is there twice",
        ),
        (
            "sdo read --node 1 0x3008 --type word",
            "there is no such type; there are: bool, i8",
        ),
        (
            "sdo write --drive p3 --node 1 0x6060 300",
            "0x6060,0: 300 does not fit INTEGER8",
        ),
        (
            "sdo write --drive p3 --node 1 0x6060 fast",
            "\"fast\" is not a number of type INTEGER8",
        ),
        (
            "sdo write --node 1 0x6060,0 0 3",
            "the sub-index stands behind the comma already",
        ),
        (
            "sdo write --drive p3 --node 1 0x7777 4",
            "0x7777,0: the dictionary of p3 has no such object",
        ),
        ("calibrate all", "--node <NODE>"),
        (
            "calibrate all --node 1",
            "nobody can be asked whether to save; add --yes to save or --dry-run to look only",
        ),
        (
            "calibrate electrical-zero --node 1 --method spin",
            "there is no such method; there are: turn, approach, stall",
        ),
        (
            "calibrate all --node 1 --yes --dry-run",
            "cannot be used with",
        ),
        (
            "tune velocity --node 1 --yes --bandwidth 500",
            "write a number from 2 to 150",
        ),
        (
            "tune position --node 1 --yes --damping -1",
            "write a number from 0.4 to 2",
        ),
        ("nmt jump", "[possible values: start, stop, pre-operational"),
        ("nmt start 0", "write a node ID from 1 to 127, or all"),
        ("monitor --for ever", "as in 10s, 500ms or 2m"),
        ("od p9", "there is no such drive; there are: p3"),
        ("play /nowhere.txt", "<--bus <ENDPOINT>|--virtual>"),
        (
            "play --virtual --bus slcan://127.0.0.1:1 x",
            "cannot be used with",
        ),
        (
            "play --virtual /nowhere.txt",
            "/nowhere.txt: cannot be read",
        ),
    ];
    for (words, message) in table {
        let words: Vec<&str> = words.split(' ').collect();
        let output = run(&words);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}\n{error}");
        assert!(error.starts_with("error: "), "{words:?}\n{error}");
        assert!(error.contains(message), "{words:?}\n{error}");
        assert!(output.stdout.is_empty(), "{words:?}");
    }
}

#[test]
fn files_that_make_no_sense_are_refused_with_their_place() {
    let folder = Folder::new();
    let write = |name: &str, text: &str| {
        let path = folder.file(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let good = write(
        "good.txt",
        "drive p3\nnodes 1\n\n0x000 2 81 01\n0x701 1 00\n",
    );
    let short = write("short.txt", "drive p3\nnodes 1\n\n0x601 8 40 41 60 00\n");
    let error = printed(&["play", "--virtual", &good, &short], 2);
    assert!(
        error.starts_with(&format!("error: {short}:4:7: ")),
        "{error}"
    );

    let other = write("other.txt", "drive p4\nnodes 1\n\n0x000 2 81 01\n");
    let error = printed(&["play", "--virtual", &other], 2);
    assert!(
        error.contains(&format!("{other}: it is for a drive 'p4'")),
        "{error}"
    );
    let silent = write("silent.txt", "0x000 2 81 01\n");
    let error = printed(&["play", "--virtual", &silent], 2);
    assert!(
        error.contains("write \"drive p3\" and \"nodes 1\""),
        "{error}"
    );

    let log = write("run.log", "");
    let error = printed(&["replay", &log], 2);
    assert!(
        error.contains(&format!("{log}.run: ")) && error.contains("keep the two"),
        "{error}"
    );
    write(
        "run.log.run",
        "servobus run 1\nseed 1\ndrive 1 p3\nspeed 3\n",
    );
    let error = printed(&["replay", &log], 2);
    assert!(
        error.contains(&format!("{log}.run:4:1: 'speed' is no keyword")),
        "{error}"
    );
}

#[test]
fn a_reader_that_has_enough_is_no_error() {
    use std::io::Read;
    let mut child = support::servobus(&["od", "p3", "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut error = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut error)
        .unwrap();
    assert_eq!(
        (child.wait().unwrap().code(), error.as_str()),
        (Some(0), "")
    );
}

#[test]
fn the_dictionary_is_listed_in_both_forms() {
    let text = printed(&["od", "p3"], 0);
    let line = text
        .lines()
        .find(|line| line.starts_with("0x6041"))
        .unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(words[..5], ["0x6041", "0", "UNSIGNED16", "ro", "T"]);
    let json: serde_json::Value =
        serde_json::from_str(&printed(&["od", "p3", "--json"], 0)).unwrap();
    let objects = json.as_array().unwrap();
    // A title, a header, and a line for each object.
    assert_eq!(text.lines().count(), objects.len() + 2);
    let heartbeat = objects
        .iter()
        .find(|object| object["index"] == 0x1017)
        .unwrap();
    assert_eq!(heartbeat["type"], "UNSIGNED16");
    assert_eq!(heartbeat["unit"], "ms");
    assert_eq!(heartbeat["store"], "comm");
}
