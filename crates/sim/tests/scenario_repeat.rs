//! The same seed and scenario give the same trace: however time is cut, with outside frames, and
//! from a recording. Another seed draws other worlds.

mod master;
use master::*;

use std::path::PathBuf;

use canopen::Instant;
use sim::scenario::Scenario;
use sim::{
    Bus, BusSettings, DriveSettings, Happening, Injection, Place, Recording, RunHeader, replay,
    replay_each,
};

/// Everything random, and an act of each kind.
const SCENARIO: &str = "
[drive.all]
hidden_truth = true
[drive.all.sensors]
current_noise = 3
[drive.all.encoder]
noise = 1
[drive.all.stored]
\"0x6065\" = 30000
[drive.all.spread]
sensors.current_gain_a = \"3 %\"

[[event]]
name = \"sag\"
when = { drive = 1, state = \"operation enabled\" }
delay = \"3 ms\"
do = \"motor-supply\"
drive = 1
to = \"30 V\"
for = \"20 ms\"
[[event]]
after = \"sag\"
do = \"bad-encoder-answers\"
drive = \"all\"
share = \"1 %\"
[[event]]
when = { drive = 1, speed_above = \"5 rad/s\" }
do = \"block-shaft\"
drive = 1
for = \"10 ms\"
[[event]]
when = { frame = { id = 0x080, from = \"outside\" }, nth = 20 }
do = \"flip-bit\"
frames = { id = 0x080 }
bit = 15
count = 3
[[event]]
at = \"120 ms\"
every = \"20 ms\"
do = \"stall-processor\"
drive = 2
for = \"1 ms\"
[[event]]
at = \"150 ms\"
do = \"flood\"
id = 0x300
period = \"150 us\"
for = \"10 ms\"
[[event]]
at = \"170 ms\"
do = \"spoil-store\"
drive = 2
bytes = 5
[[event]]
at = \"171 ms\"
do = \"hang-processor\"
drive = 2
";

fn settings(seed: u64) -> BusSettings {
    let mut settings = BusSettings::new(seed, vec![p3(1), p3(2), p3(3)]);
    let scenario = Scenario::read("all.toml", SCENARIO).unwrap_or_else(|error| panic!("{error}"));
    let set_up = scenario.set_up(&mut settings, Instant::NEVER);
    set_up.unwrap_or_else(|error| panic!("{error}"));
    settings
}

fn script() -> Vec<(Instant, can::Frame)> {
    let mut frames = Vec::new();
    let mut say = |us: u64, id: u16, data: &[u8]| {
        frames.push((Instant::ZERO.plus_ns(us * 1_000), frame(id, data)));
    };
    for node in 1..=3_u16 {
        let us = 40_000 + 100 * u64::from(node);
        say(us, 0x600 + node, &[0x22, 0x40, 0x60, 0, 0x86, 0]);
        say(us + 3_000, 0x600 + node, &[0x22, 0x40, 0x60, 0, 0x0F, 0]);
        say(us + 6_000, 0x600 + node, &[0x22, 0x60, 0x60, 0, 3]);
        say(
            us + 9_000,
            0x600 + node,
            &[0x22, 0xFF, 0x60, 0, 0x50, 0xC3, 0, 0],
        );
    }
    for ms in 55..230 {
        say(ms * 1_000, 0x080, &[]);
    }
    frames.sort_by_key(|(at, _)| *at);
    frames
}

/// Everything that a run tells, as text.
fn trace(bus: &mut Bus) -> Vec<String> {
    let happenings = bus.take_happenings().into_iter();
    happenings
        .map(|happening| match happening {
            Happening::Frame(traffic) => format!("{traffic:?}"),
            Happening::Notice(notice) => notice.to_string(),
            Happening::Error(error) => format!("{error:?}"),
        })
        .collect()
}

fn run(seed: u64, step_ns: u64) -> Vec<String> {
    let mut bus = Bus::new(settings(seed));
    let mut told = Vec::new();
    for (at, frame) in script() {
        while bus.now().plus_ns(step_ns) < at {
            bus.run_until(bus.now().plus_ns(step_ns));
            told.extend(trace(&mut bus));
        }
        bus.run_until(at);
        bus.send(1, frame);
    }
    bus.run_until(Instant::ZERO.plus_ms(250));
    told.extend(trace(&mut bus));
    // What the drives measured, to the last bit.
    for drive in bus.drives() {
        told.push(format!(
            "{:?} {:?}",
            drive.world().truth(),
            drive.world().sample()
        ));
    }
    told
}

#[test]
fn a_seed_gives_one_trace_however_time_is_cut() {
    let whole = run(5, 1_000_000_000);
    let scenario = whole.iter().filter(|line| line.contains(" scenario: "));
    assert!(scenario.count() > 15, "{whole:#?}");
    assert_eq!(whole, run(5, 1_000_000_000));
    for step_ns in [1_000_000, 77_777] {
        let cut = run(5, step_ns);
        let differs = whole.iter().zip(&cut).find(|(one, other)| one != other);
        assert_eq!(differs, None);
        assert_eq!(whole.len(), cut.len());
    }
    assert_ne!(whole, run(6, 1_000_000_000));
}

#[test]
fn a_recording_holds_its_scenario_and_is_repeated_with_all_that_was_told() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join("scenario.log");
    let settings = settings(5);
    let mut recording = Recording::create(&path, &RunHeader::of(&settings)).unwrap();
    let mut bus = Bus::new(settings);
    let mut told = Vec::new();
    let mut keep = |bus: &mut Bus, recording: &mut Recording| {
        for happening in bus.take_happenings() {
            recording.happening(&happening).unwrap();
            if let Happening::Notice(notice) = happening {
                told.push(notice.to_string());
            }
        }
    };
    for (at, frame) in script() {
        bus.run_until(at);
        keep(&mut bus, &mut recording);
        let client = 1;
        recording
            .injection(&Injection { at, client, frame })
            .unwrap();
        bus.send(client, frame);
    }
    let end = Instant::ZERO.plus_ms(250);
    bus.run_until(end);
    keep(&mut bus, &mut recording);
    recording.finish(end).unwrap();

    let mut again = Vec::new();
    replay(&path, &mut again).unwrap();
    assert!(again == std::fs::read(&path).unwrap());
    let mut told_again = Vec::new();
    replay_each(&path, &mut |happening| {
        if let Happening::Notice(notice) = happening {
            told_again.push(notice.to_string());
        }
        Ok(())
    })
    .unwrap();
    assert_eq!(told, told_again);
    // And they stand in the run file, between its other lines.
    let causes = std::fs::read_to_string(folder.join("scenario.log.run")).unwrap();
    let comments: Vec<&str> = causes
        .lines()
        .filter_map(|line| line.strip_prefix("# "))
        .collect();
    let scenario: Vec<&String> = told
        .iter()
        .filter(|line| line.contains(" scenario: "))
        .collect();
    assert_eq!(comments, scenario);
    let text = causes
        .lines()
        .filter_map(|line| line.strip_prefix("scenario "));
    assert!(text.eq(SCENARIO.lines()), "{causes}");
}

/// Each drive has a truth of its own within its spread, which depends on seed and place only.
#[test]
fn hidden_truth_is_drawn_within_its_spread() {
    let draw = |seed: u64, text: &str| -> Vec<plant::Parameters> {
        let drives = (1..=40).map(p3).collect();
        let mut settings = BusSettings::new(seed, drives);
        let scenario = Scenario::read("t", text).unwrap_or_else(|error| panic!("{error}"));
        let set_up = scenario.set_up(&mut settings, Instant::NEVER);
        set_up.unwrap_or_else(|error| panic!("{error}"));
        settings.drives.iter().map(|drive| drive.plant).collect()
    };
    let made = DriveSettings::at(Place::unconfigured(1).unwrap(), &personalities::p3::P3).plant;
    let spread = "[drive.all.spread]\nmotor.phase_resistance = \"20 %\"\nencoder.zero = 100\n\
                  thermal.ambient = \"10 K\"\n";
    let drawn = draw(1, spread);
    assert_eq!(drawn, draw(1, spread));
    assert_ne!(drawn, draw(2, spread));
    let ratios: Vec<f64> = drawn
        .iter()
        .map(|one| one.motor.phase_resistance_ohm / made.motor.phase_resistance_ohm)
        .collect();
    assert!(ratios.iter().all(|ratio| (0.8..=1.2).contains(ratio)));
    // Even: 40 of them reach far to both sides, and their mean is near the middle.
    assert!(ratios.iter().any(|ratio| *ratio < 0.85) && ratios.iter().any(|ratio| *ratio > 1.15));
    let mean = ratios.iter().sum::<f64>() / 40.0;
    // Four standard deviations of the mean: 4 · 0.4/√12/√40.
    assert!((mean - 1.0).abs() < 0.073, "{mean}");
    for one in &drawn {
        assert!(one.encoder.zero_counts.abs_diff(0x0DF8) <= 100);
        assert!((one.ambient_c - 25.0).abs() <= 10.0);
        assert_eq!(one.motor.flux_wb, made.motor.flux_wb, "not spread");
    }
    // A spread more does not move the others.
    let more = draw(1, &format!("{spread}motor.flux = \"5 %\"\n"));
    for (one, other) in drawn.iter().zip(&more) {
        assert_eq!(
            one.motor.phase_resistance_ohm,
            other.motor.phase_resistance_ohm
        );
        assert_ne!(one.motor.flux_wb, other.motor.flux_wb);
    }
    // The usual truth differs from drive to drive, and what is said of one holds for it alone.
    let truth = draw(
        1,
        "[drive.all]\nhidden_truth = true\n[drive.2.motor]\npole_pairs = 3\n",
    );
    for (n, one) in truth.iter().enumerate() {
        assert_eq!(one.motor.pole_pairs, if n == 1 { 3 } else { 1 });
        assert!(
            truth[..n]
                .iter()
                .all(|other| other.motor.flux_wb != one.motor.flux_wb)
        );
    }
}
