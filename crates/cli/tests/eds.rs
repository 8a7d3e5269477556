//! `servobus eds`: export, check, read, and the DCF of a running drive.

mod support;

use std::path::Path;

use serde_json::Value;
use support::{Folder, Sim, printed, run};

fn fixture(name: &str) -> String {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../eds/tests/fixtures");
    fixtures.join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_drives_eds_to_standard_output_and_to_a_file() {
    let folder = Folder::new();
    let file = folder.file("p3.eds");
    let text = printed(&["eds", "p3"], 0);
    assert_eq!(printed(&["eds", "p3", "--output", &file], 0), "");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
    assert!(text.starts_with("[FileInfo]\nFileName=p3.eds\n"));
    assert!(text.ends_with("\n") && !text.ends_with("\n\n"));
    assert_eq!(
        printed(&["eds", "check", &file], 0),
        format!("{file}: no findings\n")
    );
    // As many objects as the dictionary lists, but for the dummies.
    let objects =
        |words: &[&str]| -> Vec<Value> { serde_json::from_str(&printed(words, 0)).unwrap() };
    let declared = objects(&["od", "p3", "--json"]);
    let declared = declared
        .iter()
        .filter(|entry| entry["index"].as_u64() >= Some(0x1000));
    let read = printed(&["eds", "read", &file], 0);
    assert_eq!(
        read.lines().next().unwrap(),
        format!("{} objects", declared.count())
    );
    let error = printed(&["eds", "p4"], 2);
    assert!(
        error.contains("there is no such drive; there are: p3"),
        "{error}"
    );
    let nowhere = folder.file("no/p3.eds");
    let error = printed(&["eds", "p3", "--output", &nowhere], 2);
    assert!(error.starts_with(&format!("error: {nowhere}: ")), "{error}");
}

#[test]
fn check_prints_findings_and_tells_by_its_exit_code() {
    // Tolerated only.
    let file = fixture("utf_8.eds");
    let text = printed(&["eds", "check", &file], 0);
    assert!(
        text.starts_with(&format!("{file}:168:20: tolerated: 'ä' is not ASCII;")),
        "{text}"
    );
    assert!(text.ends_with(&format!("{file}: 0 errors, 0 warnings, 1 tolerated\n")));
    // A warning.
    let text = printed(&["eds", "check", &fixture("missing_parent.eds")], 1);
    assert!(
        text.contains(":128:1: warning: [607Dsub0] belongs to [607D]"),
        "{text}"
    );
    // Errors.
    let json = printed(&["eds", "check", &fixture("lists.eds"), "--json"], 1);
    let json: Vec<Value> = serde_json::from_str(&json).unwrap();
    let error = json
        .iter()
        .find(|finding| finding["rule"] == "listed-missing")
        .unwrap();
    assert_eq!((&error["line"], &error["column"]), (&78.into(), &3.into()));
    assert_eq!(error["severity"], "error");
    let error = printed(&["eds", "check", "no such file"], 2);
    assert!(error.starts_with("error: no such file: "), "{error}");
}

#[test]
fn read_evaluates_for_a_node() {
    let file = fixture("dcf.dcf");
    let read = |words: &[&str]| -> Value {
        let words = [&["eds", "read", &file, "--json"], words].concat();
        serde_json::from_str(&printed(&words, 0)).unwrap()
    };
    let cob_id = |file: &Value| {
        let objects = file["objects"].as_array().unwrap();
        let object = objects
            .iter()
            .find(|object| object["index"] == 0x1800)
            .unwrap();
        object["subs"][1]["default"].clone()
    };
    let file_of_5 = read(&[]);
    assert_eq!(file_of_5["node"], 5);
    assert_eq!(cob_id(&file_of_5)["meaning"], 0x185);
    assert_eq!(cob_id(&read(&["--node", "7"]))["meaning"], 0x187);
    assert_eq!(cob_id(&file_of_5)["text"], "$NODEID+0x180");
    let error = printed(&["eds", "read", &fixture("utf_16.eds")], 1);
    assert!(error.contains("no object can be used"), "{error}");
}

/// The values are the drive's at that moment, not the defaults.
#[test]
fn dcf_of_a_running_drive() {
    let sim = Sim::start(&["--nodes", "3"]);
    let bus = sim.bus();
    let folder = Folder::new();
    let write = [
        "sdo", "write", "--node", "3", "--bus", bus, "0x6083", "1234567",
    ];
    printed(&write, 0);
    let file = folder.file("3.dcf");
    let words = [
        "eds", "dcf", "--node", "3", "--bus", bus, "--name", "elbow", "--output", &file,
    ];
    let ended = run(&words);
    let told = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{told}");
    // An error history without errors (CiA 301 7.5.2.4).
    assert!(
        told.contains("node 3 0x1003,8 not read: refused, 0x08000024"),
        "{told}"
    );
    printed(&["eds", "check", &file], 0);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("FileName=p3.dcf\n") && text.contains("LastEDS=p3.eds\n"));
    assert!(text.contains("NodeName=elbow\n"));
    assert!(text.contains("; not read: refused, 0x08000024"));
    let json: Value = serde_json::from_str(&printed(&["eds", "read", &file, "--json"], 0)).unwrap();
    assert_eq!(json["node"], 3);
    let sub = |index: u64, sub: usize| {
        let objects = json["objects"].as_array().unwrap();
        let object = objects
            .iter()
            .find(|object| object["index"] == index)
            .unwrap();
        object["subs"][sub].clone()
    };
    assert_eq!(sub(0x6083, 0)["value"]["meaning"], 1_234_567);
    assert_eq!(sub(0x6083, 0)["default"]["meaning"], 2_000_000);
    assert_eq!(sub(0x1018, 4)["value"]["meaning"], 1003);
    assert_eq!(sub(0x1800, 1)["value"]["text"], "0x00000183");
    assert_eq!(sub(0x1008, 0)["value"]["meaning"], "P3");
    assert_eq!(sub(0x1003, 1)["value"], Value::Null);

    // With a file's dictionary, also what the drive does not have.
    let words = [
        "eds",
        "dcf",
        "--node",
        "3",
        "--bus",
        bus,
        "--eds",
        &fixture("well_formed.eds"),
    ];
    let ended = run(&words);
    assert_eq!(ended.status.code(), Some(0));
    let text = String::from_utf8(ended.stdout).unwrap();
    assert!(text.contains("; not read: refused, 0x06020000"), "{text}");
    assert!(text.contains("[607Dsub1]\n") && text.contains("LastEDS=sample.eds\n"));
    // ObjFlags, bit 1: not to be read on scan.
    let told = |flags: &str| {
        let text = std::fs::read_to_string(fixture("well_formed.eds")).unwrap();
        let file = folder.file("flags.eds");
        std::fs::write(&file, text.replace("ObjFlags=0x1", flags)).unwrap();
        let ended = run(&["eds", "dcf", "--node", "3", "--bus", bus, "--eds", &file]);
        String::from_utf8(ended.stderr)
            .unwrap()
            .contains("0x2000,0")
    };
    assert!(told("ObjFlags=0x1") && !told("ObjFlags=0x2"));
    let error = printed(
        &[
            "eds",
            "dcf",
            "--node",
            "9",
            "--bus",
            bus,
            "--timeout",
            "50ms",
        ],
        1,
    );
    assert!(
        error.contains("node 9: reading 0x1000,0: no answer within 50 ms"),
        "{error}"
    );
    sim.end();
}

/// So that files can be compared.
#[test]
fn an_eds_is_the_same_each_time() {
    assert_eq!(printed(&["eds", "p3"], 0), printed(&["eds", "p3"], 0));
}
