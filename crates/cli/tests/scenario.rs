//! Scenarios as a user plays them.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use support::{Folder, printed, run};

fn examples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenarios");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(files.len() >= 8, "{files:?}");
    files
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// What standard error says with this scenario, after it was played for so long.
fn told(folder: &Folder, scenario: &str, words: &[&str]) -> String {
    let file = folder.file("scenario.toml");
    fs::write(&file, scenario).unwrap();
    let mut all = vec![
        "sim",
        "--bus",
        "none",
        "--speed",
        "max",
        "--scenario",
        &file,
    ];
    all.extend(words);
    let output = run(&all);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stderr)
}

/// Every example is right and can be played, tells what it does, and is repeated byte for byte.
#[test]
fn every_example_is_played_and_repeated() {
    for file in examples() {
        let name = file.file_name().unwrap().to_str().unwrap();
        let file = file.to_str().unwrap();
        let checked = printed(&["scenario", "check", file], 0);
        assert!(checked.contains(": right; drives 1 (p3"), "{checked}");
        let folder = Folder::new();
        let log = folder.file("run.log");
        let words = ["sim", "--bus", "none", "--speed", "max", "--scenario", file];
        let output = run(&[&words[..], &["--for", "6s", "--record", &log]].concat());
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{name}: {told}");
        // Those that wait for a master only wait.
        let waits = ["blocked-shaft.toml", "hidden-truth.toml"].contains(&name);
        assert_ne!(told.contains(" scenario: "), waits, "{name}: {told}");
        // What was told stands in the run file as well.
        let causes = fs::read_to_string(format!("{log}.run")).unwrap();
        let comments = causes.lines().filter_map(|line| line.strip_prefix("# "));
        let lines = told.lines().filter(|line| line.contains(" scenario: "));
        assert!(comments.eq(lines), "{name}\n{causes}\n{told}");
        let again = printed(&["replay", &log], 0);
        assert!(again.contains("identical"), "{name}: {again}");
    }
}

#[test]
fn the_command_line_comes_before_the_file() {
    let folder = Folder::new();
    let scenario = "seed = 3\nnodes = [4]\nbit_rate = \"500k\"\npersonality = \"p3-extended\"\n\
                    length = \"300 ms\"\n[[event]]\nat = \"100 ms\"\ndo = \"block-shaft\"\n\
                    drive = \"all\"\n";
    let log = folder.file("run.log");
    let header = |words: &[&str]| {
        let all = [&["--record", &log][..], words].concat();
        let told = told(&folder, scenario, &all);
        let causes = fs::read_to_string(format!("{log}.run")).unwrap();
        let lines: Vec<String> = causes.lines().skip(1).take(4).map(str::to_owned).collect();
        let end = causes.lines().next_back().unwrap().to_owned();
        (lines, end, told)
    };
    let (lines, end, told) = header(&[]);
    assert_eq!(
        lines[..3],
        ["seed 3", "bit-rate 500k", "drive 4 p3-extended"]
    );
    assert_eq!(end, "end 0.300000000");
    assert_eq!(
        told,
        "0.100000 scenario: event 1 (line 6): shaft of node 4 blocked\n"
    );
    let (lines, end, _) = header(&[
        "--seed",
        "9",
        "--bit-rate",
        "1M",
        "--nodes",
        "1,2",
        "--drive",
        "p3",
        "--for",
        "200ms",
    ]);
    assert_eq!(lines, ["seed 9", "bit-rate 1M", "drive 1 p3", "drive 2 p3"]);
    assert_eq!(end, "end 0.200000000");
}

#[test]
fn a_scenario_with_mistakes_is_refused_before_anything_starts() {
    let folder = Folder::new();
    let file = folder.file("bad.toml");
    let log = folder.file("run.log");
    let words = [
        "sim",
        "--bus",
        "none",
        "--speed",
        "max",
        "--scenario",
        &file,
        "--for",
        "1s",
    ];
    for (scenario, expected) in [
        (
            "[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 7\n",
            "bad.toml:4:9: there is no drive 7 on this bus\n  4 | drive = 7\n    |         ^ its \
             drives are 1, 2, 3; add it to nodes or --nodes",
        ),
        (
            "[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n",
            "bad.toml:2:6: this never happens: the run ends at 1 s",
        ),
        ("[drive.u1]\n", "p3 has no LSS"),
        (
            "sed = 1\n",
            "the scenario has a mistake; nothing was started",
        ),
    ] {
        fs::write(&file, scenario).unwrap();
        let told = printed(&[&words[..], &["--record", &log]].concat(), 2);
        assert!(told.contains(expected), "{told}");
        assert!(!Path::new(&log).exists());
    }
    let told = printed(&["scenario", "check", &folder.file("none.toml")], 2);
    assert!(told.contains("none.toml: cannot be read: "), "{told}");
    let told = printed(&["scenario", "check", &file, &file], 2);
    assert_eq!(told.matches("did you mean 'seed'?").count(), 2, "{told}");
}

/// A run file whose scenario was spoiled is refused by its own line and column.
#[test]
fn a_replay_refuses_a_spoiled_scenario() {
    let folder = Folder::new();
    let log = folder.file("run.log");
    let scenario = "nodes = [1]\n[[event]]\nat = \"10 ms\"\ndo = \"block-shaft\"\ndrive = 1\n";
    told(&folder, scenario, &["--for", "50ms", "--record", &log]);
    let causes = fs::read_to_string(format!("{log}.run")).unwrap();
    fs::write(
        format!("{log}.run"),
        causes.replace("block-shaft", "block-shaf"),
    )
    .unwrap();
    let told = printed(&["replay", &log], 2);
    assert!(
        told.contains("scenario.toml:4:6: there is no act 'block-shaf'"),
        "{told}"
    );
    assert!(told.contains("did you mean 'block-shaft'?"), "{told}");
}

/// The list of parameters is a scenario, and one that changes nothing.
#[test]
fn the_list_of_parameters_is_a_scenario() {
    let folder = Folder::new();
    let file = folder.file("all.toml");
    let list = printed(&["scenario", "parameters", "--toml"], 0);
    fs::write(&file, &list).unwrap();
    let checked = printed(&["scenario", "check", &file], 0);
    assert!(
        checked.contains("drives 1 (p3); seed 1; 0 events"),
        "{checked}"
    );
    let tables = printed(&["scenario", "parameters"], 0);
    assert!(
        tables.contains("| `motor_voltage` | V | 48 V; roboteq 24 V |"),
        "{tables}"
    );
    for line in list.lines().filter(|line| line.contains(" = ")) {
        let key = line.split(" = ").next().unwrap();
        assert!(tables.contains(&format!("| `{key}` | ")), "{key}");
    }
    assert!(printed(&["scenario", "acts"], 0).contains("| `motor-supply` | "));
}

/// That of each drive is one, too, with its own motor.
#[test]
fn each_drive_has_its_own_list_of_parameters() {
    let folder = Folder::new();
    for drive in personalities::ALL {
        let file = folder.file("all.toml");
        let words = ["scenario", "parameters", "--drive", drive.name];
        let list = printed(&[&words[..], &["--toml"]].concat(), 0);
        fs::write(&file, &list).unwrap();
        let checked = printed(&["scenario", "check", &file], 0);
        let expected = format!("drives 1 ({}); seed 1", drive.name);
        assert!(checked.contains(&expected), "{checked}");
        let run = |words: &[&str], log: &str| {
            let log = folder.file(log);
            let sim = ["sim", "--bus", "none", "--speed", "max", "--for", "300ms"];
            printed(&[&sim[..], words, &["--record", &log]].concat(), 0);
            fs::read(log).unwrap()
        };
        // It changes nothing.
        let with = run(&["--scenario", &file], "with.log");
        let without = run(&["--drive", drive.name, "--nodes", "1"], "without.log");
        assert!(with == without, "{}", drive.name);
        let tables = printed(&words, 0);
        for (name, line) in [
            ("p3", "| `pole_pairs` | – | 1 |"),
            ("roboteq-2", "| `pole_pairs` | – | 8 |"),
            ("md80", "| `pole_pairs` | – | 21 |"),
        ] {
            assert!(drive.name != name || tables.contains(line), "{tables}");
        }
    }
}

/// A monitor is told what the scenario does; so is its recording, and another master is not.
#[test]
fn a_monitor_shows_what_the_scenario_does() {
    let folder = Folder::new();
    let file = folder.file("often.toml");
    let scenario = "[[event]]\nname = \"jolt\"\nat = \"50 ms\"\nevery = \"50 ms\"\n\
                    do = \"block-shaft\"\ndrive = 1\nfor = \"1 ms\"\n";
    fs::write(&file, scenario).unwrap();
    let sim = support::Sim::start(&["--nodes", "1", "--scenario", &file]);
    let log = folder.file("seen.pcapng");
    let words = ["monitor", "--bus", sim.bus(), "--for", "600ms"];
    let seen = printed(&[&words[..], &["--record", &log]].concat(), 0);
    let lines: Vec<&str> = seen.lines().collect();
    assert!(lines.len() > 10, "{seen}");
    let is_told = |line: &&&str| {
        let Some((time, words)) = line.split_once(" scenario: event \"jolt\" (line 1)") else {
            return false;
        };
        let time = time
            .strip_prefix("# ")
            .and_then(|time| time.parse::<f64>().ok());
        let words = words.trim_start_matches(" is over");
        time.is_some() && words.starts_with(": shaft of node 1 ")
    };
    assert_eq!(lines.iter().filter(is_told).count(), lines.len(), "{seen}");
    let seen = printed(&[&words[..], &["--json"]].concat(), 0);
    assert!(seen.contains("\"note\":"), "{seen}");
    // Who does not ask is not told: a scan meets frames only.
    let found = printed(&["scan", "--bus", sim.bus(), "--nodes", "1"], 0);
    assert!(!found.contains("scenario"), "{found}");
    let recorded = fs::read(&log).unwrap();
    let needle = b"scenario: event \"jolt\"";
    assert!(recorded.windows(needle.len()).any(|bytes| bytes == needle));
    sim.end();
}

/// The demo under a scenario: the shaft of node 1 is blocked, so it does not get there.
#[test]
fn the_demo_plays_under_a_scenario() {
    let folder = Folder::new();
    let file = folder.file("blocked.toml");
    let scenario = "[[event]]\nname = \"stuck\"\nwhen = { position = \"3 turns\" }\n\
                    do = \"block-shaft\"\ndrive = 1\n";
    fs::write(&file, scenario).unwrap();
    let output = support::servobus(&["demo", "--scenario", &file, "--record", "demo.log"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let line = " scenario: event \"stuck\" (line 1): shaft of node 1 blocked\n";
    assert!(said.contains(line), "{said}");
    let again = printed(&["replay", &folder.file("demo.log")], 0);
    assert!(again.contains("identical"), "{again}");
    for (scenario, expected) in [
        ("nodes = [5]", "the demo has nodes 1 to 3, and no drive 5"),
        ("bit_rate = \"500k\"", "the demo's bus has 1 Mbit/s"),
        ("personality = \"p3-extended\"", "the demo's drives are p3"),
    ] {
        fs::write(&file, scenario).unwrap();
        let told = printed(&["demo", "--scenario", &file], 2);
        assert!(told.contains(expected), "{told}");
    }
}
