//! What is done to the two sets of parameters that a drive's flash holds: which of them is spoiled,
//! what a power cut in a save reaches, and that a replay begins with both.

mod master;
use master::*;

use std::path::{Path, PathBuf};

use canopen::Instant;
use personalities::p3::P3;
use personalities::p3_extended::P3_EXTENDED;
use sim::scenario::Scenario;
use sim::{
    Bus, BusSettings, DriveSettings, FlashFile, Injection, Notice, NoticeKind, Place, Recording,
    RunHeader, replay,
};

/// The settings with `text` set up.
fn with_scenario(mut settings: BusSettings, text: &str) -> BusSettings {
    let scenario = Scenario::read("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let set_up = scenario.set_up(&mut settings, Instant::NEVER);
    set_up.unwrap_or_else(|error| panic!("{error}"));
    settings
}

fn booted(settings: BusSettings) -> Master {
    let mut master = Master {
        bus: Bus::new(settings),
        log: Vec::new(),
    };
    master.run_ms(50);
    master.log.clear();
    master
}

/// A folder with what drive 1 has saved: a heartbeat of 20 ms, then one of 50 ms.
fn two_sets(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("stored-sets");
    let folder = folder.join(name);
    let _ = std::fs::remove_dir_all(&folder);
    let mut master = Master::with(vec![in_folder(&folder)]);
    for ms in [20, 50] {
        master.write_u16(1, 0x1017, 0, ms);
        master.write(1, 0x1010, 1, &SAVE);
    }
    folder
}

fn in_folder(folder: &Path) -> DriveSettings {
    let place = Place::of_node(id(1));
    DriveSettings {
        store: FlashFile::file(folder, "p3", place).unwrap(),
        ..p3(1)
    }
}

/// Records a run of 200 ms in which drive 1 gets `frames`; the log, and what a replay makes of it.
fn recorded(name: &str, settings: BusSettings, frames: &[(u64, u16, &[u8])]) -> [String; 2] {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let mut recording = Recording::create(&path, &RunHeader::of(&settings)).unwrap();
    let mut bus = Bus::new(settings);
    for (ms, id, data) in frames {
        let (at, client, frame) = (Instant::ZERO.plus_ms(*ms), 1, frame(*id, data));
        bus.run_until(at);
        let injection = Injection { at, client, frame };
        recording.injection(&injection).unwrap();
        bus.send(client, frame);
    }
    let end = Instant::ZERO.plus_ms(200);
    bus.run_until(end);
    for happening in bus.take_happenings() {
        recording.happening(&happening).unwrap();
    }
    recording.finish(end).unwrap();
    let mut again = Vec::new();
    replay(&path, &mut again).unwrap();
    let log = std::fs::read(&path).unwrap();
    [log, again].map(|log| String::from_utf8(log).unwrap())
}

#[test]
fn a_replay_falls_back_to_the_set_before_as_the_run_did() {
    let folder = two_sets("spoilt");
    let settings = with_scenario(
        BusSettings::new(5, vec![in_folder(&folder)]),
        "[[event]]\nat = \"60 ms\"\ndo = \"spoil-store\"\ndrive = 1\nbytes = 3\n",
    );
    // What is in the file after the header was made is no part of the recording.
    let frames: [(u64, u16, &[u8]); 1] = [(80, 0x000, &[0x81, 1])];
    let [log, again] = recorded("spoilt.log", settings, &frames);
    let beats = log.lines().filter(|line| line.contains("701#05"));
    assert!(beats.count() >= 4, "every 20 ms at the end: {log}");
    assert_eq!(log, again);
}

/// How far the cut is into a save depends on what the slots hold.
#[test]
fn a_replay_cuts_the_power_where_the_run_did() {
    let save = [0x22, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65];
    let frames: [(u64, u16, &[u8]); 2] = [
        (60, 0x601, &[0x22, 0x17, 0x10, 0, 10, 0]),
        (70, 0x601, &save),
    ];
    let mut booted = [0, 0];
    for steps in [0, 3, 4, 30, 400, 100_000] {
        let folder = two_sets("cut");
        let settings = with_scenario(
            BusSettings::new(5, vec![in_folder(&folder)]),
            &format!(
                "[[event]]\nat = \"0 s\"\ndo = \"cut-power-in-save\"\ndrive = 1\n\
                 steps = {steps}\n"
            ),
        );
        let [log, again] = recorded("cut.log", settings, &frames);
        assert_eq!(log, again, "{steps}");
        booted[usize::from(log.matches("701#00").count() > 1)] += 1;
    }
    assert!(booted[0] > 0 && booted[1] > 0, "{booted:?}");
}

#[test]
fn the_newest_set_is_spoiled_also_if_the_one_before_is_the_same() {
    for saves in 1..=4 {
        let text = "[[event]]\nat = \"1 s\"\ndo = \"spoil-store\"\ndrive = 1\n";
        let mut master = booted(with_scenario(BusSettings::new(7, vec![p3(1)]), text));
        master.write_i32(1, 0x6065, 0, 1234);
        for _ in 0..saves {
            master.write(1, 0x1010, 1, &SAVE);
        }
        let now_ms = master.now().0 / 1_000_000;
        master.run_ms(1_001 - now_ms);
        master.bus.take_notices();
        master.send(0x000, &[0x81, 1]);
        master.run_ms(60);
        let notices = master.bus.take_notices();
        let told: Vec<String> = notices.iter().map(ToString::to_string).collect();
        let what = match saves {
            1 => "the stored parameters are damaged",
            _ => "the newest stored parameters are damaged",
        };
        assert!(
            told.len() == 1 && told[0].contains(what),
            "{saves}: {told:?}"
        );
        let kept = master.read(1, 0x6065, 0) == 1234;
        assert_eq!(kept, saves > 1, "{saves}");
    }
}

/// The example does what it says with every kind of drive: also with one whose first start writes a
/// program into the flash, and whose node ID LSS stores.
#[test]
fn a_power_cut_waits_for_a_save_of_parameters() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenarios/memory.toml");
    let text = std::fs::read_to_string(path).unwrap();
    for personality in [&P3, &P3_EXTENDED] {
        let drive = |node| DriveSettings::new(id(node), personality);
        let settings = with_scenario(BusSettings::new(7, vec![drive(1), drive(2)]), &text);
        let mut master = booted(settings);
        let name = personality.name;
        assert_eq!(master.read(2, 0x6065, 0), 20_000, "{name}");
        // Nothing but what the scenario has done: the first start has written its program.
        let told = master.bus.take_notices();
        let of_scenario = |notice: &&Notice| matches!(notice.kind, NoticeKind::Scenario(_));
        assert_eq!(told.iter().filter(of_scenario).count(), 1, "{told:?}");
        assert_eq!(told.len(), 1, "{name}: {told:?}");
        // 500 ms: damage, and 510 ms: off and on.
        master.run_ms(800 - master.now().0 / 1_000_000);
        assert_eq!(master.emergency_codes(1), [0x6320], "{name}");
        assert_ne!(master.read(1, 0x6065, 0), 20_000, "{name}");
        master.write_i32(2, 0x6065, 0, 999);
        let save = frame(0x602, &[0x23, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65]);
        master.bus.take_notices();
        master.log.clear();
        master.bus.send(0, save);
        master.run_ms(100);
        let told = master.bus.take_notices();
        assert_eq!(told.len(), 1, "{name}: {told:?}");
        assert!(told[0].to_string().contains("failed while it saved"));
        let ids: Vec<u32> = master.log.iter().map(|t| t.frame.raw_id()).collect();
        assert_eq!(ids, [0x602, 0x702], "{name}: {ids:X?}");
        assert_eq!(master.read(2, 0x6065, 0), 20_000, "{name}");
        // Only that save.
        master.write_i32(2, 0x6065, 0, 999);
        master.write(2, 0x1010, 1, &SAVE);
        master.send(0x000, &[0x81, 2]);
        master.run_ms(60);
        assert_eq!(master.read(2, 0x6065, 0), 999, "{name}");
    }
}
