//! The demo as a whole, without the command line.

use std::fs;
use std::path::PathBuf;

use super::cast::MOVER;
use super::dialogue::{Dialogue, thousands};
use super::{Report, Settings, play, plot, report};

/// A file of its own for each test.
fn file(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("servobus-demo-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// Plays, and gives what was printed, too.
fn played(settings: Settings<'_>) -> (Report, String) {
    let mut output = Vec::new();
    let report = play(&settings, &mut output).unwrap();
    (report, String::from_utf8(output).unwrap())
}

fn settings(seed: u64) -> Settings<'static> {
    Settings {
        drive: &personalities::p3::P3,
        seed,
        scenario: None,
        record: None,
        held: None,
    }
}

#[test]
fn every_target_is_reached_in_the_time_that_physics_gives() {
    for seed in 1..=16 {
        let (report, _) = played(settings(seed));
        assert!(report.every_target_was_reached(), "{:?}", report.acts);
        let ms: Vec<f64> = report
            .acts
            .iter()
            .map(|act| *act.reached.as_ref().unwrap() as f64 * 1e-6)
            .collect();
        // Way / velocity + velocity / acceleration, 40,960 counts at 400,000 counts/s and
        // 10,000,000 counts/s²: 142.4 ms. The handshake before takes a millisecond or two.
        assert!((142.4..147.0).contains(&ms[0]), "{ms:?}");
        // 16,384 counts do not reach that velocity: 2 √(way / acceleration) = 81.0 ms.
        assert!((81.0..86.0).contains(&ms[1]), "{ms:?}");
        // The trajectory's 910 ms; its last 20 counts take the last few milliseconds.
        assert!((890.0..915.0).contains(&ms[2]), "{ms:?}");
        // The current loop has 2 kHz; one SYNC period shows it.
        assert!((0.5..4.0).contains(&ms[3]), "{ms:?}");
        // Half of 23 mNm at 32 mNm/A are 0.359 A.
        let push = report.acts[3].phase.extremes(report.acts[3].node);
        assert!((0.355..0.45).contains(&push.current_a), "{push:?}");
        // A profile's acceleration changes by 20 million counts/s² at once; without feed-forward of it
        // the velocity loop of 2π·100 Hz lags by at most that over ω², 50.7 counts. In cyclic position
        // SYNC and the loops' periods drift against each other without a jolt: the error stays within
        // the P3's position window, and the current near what the acceleration needs. Least jerk
        // has at most 10/√3 way / time²: 4.54 million counts/s² of the 12 turns in 0.25 s, which
        // 4.45 gcm² and 31.56 mNm/A make 98 mA; as much again is left for ripple.
        for (act, most) in report.acts.iter().zip([50.7, 50.7, 20.0]) {
            let error = act.phase.extremes(act.node).following_error_counts;
            assert!(error > 1.0 && error < most, "{seed}: {error}");
        }
        let current_a = report.acts[2].phase.extremes(report.acts[2].node).current_a;
        assert!((0.098..0.2).contains(&current_a), "{seed}: {current_a}");
        // 1 SYNC of 47 to 48 bits and 3 TPDOs of 8 bytes, 111 to 135 bits each, in 1000 bit times;
        // each tenth time 3 more TPDOs, in the third act an RPDO of 4 bytes, 79 to 95 bits.
        let least = 4.7 + 33.3 + 3.3;
        for (n, act) in report.acts.iter().enumerate() {
            let rpdo = if n == 2 { 7.9 } else { 0.0 };
            let load = act.phase.load_percent();
            assert!(load > least + rpdo - 1.0, "{n}: {load}");
            assert!(load < (least + rpdo) * 1.22 + 1.0, "{n}: {load}");
        }
    }
}

#[test]
fn one_seed_gives_one_log_and_another_seed_another() {
    let run = |seed, name: &str| {
        let path = file(name);
        let (report, text) = played(Settings {
            record: Some(&path),
            ..settings(seed)
        });
        let log = fs::read(&path).unwrap();
        let causes = fs::read(path.with_added_extension("run")).unwrap();
        let lines = log.iter().filter(|byte| **byte == b'\n').count() as u64;
        assert_eq!(report.recorded, Some(lines));
        assert!(lines > 1_000, "{lines}");
        (log, causes, text, plot::svg(&report))
    };
    let first = run(7, "first.log");
    assert!(first == run(7, "second.log"));
    assert!(first.0 != run(8, "third.log").0);
}

#[test]
fn a_replay_repeats_the_log_to_the_byte() {
    let path = file("replayed.log");
    let (report, _) = played(Settings {
        record: Some(&path),
        ..settings(3)
    });
    let mut again = Vec::new();
    let replayed = sim::replay(&path, &mut again).unwrap();
    assert_eq!(Some(replayed.frames), report.recorded);
    assert_eq!(replayed.end.0, report.length_ns);
    assert!(!replayed.cut_off);
    assert!(again == fs::read(&path).unwrap());
}

#[test]
fn a_shaft_that_is_held_misses_its_targets_and_the_others_play_on() {
    let settings = Settings {
        held: Some(MOVER),
        ..settings(1)
    };
    let (report, dialogue) = played(settings);
    let reached: Vec<bool> = report.acts.iter().map(|act| act.reached.is_ok()).collect();
    assert_eq!(reached, [false, false, true, true]);
    assert!(!report.every_target_was_reached());
    let text = report::text(&report, &settings);
    assert_eq!(text.matches("not reached").count(), 4, "{text}");
    assert!(text.contains("2 of 4 targets reached"), "{text}");
    assert!(text.contains("at +0.00 turns"), "{text}");
    // It is switched off all the same.
    let off = dialogue.split("Switch off").nth(1).unwrap();
    assert!(off.contains("switch on disabled"), "{off}");
}

#[test]
fn the_dialogue_is_short_and_says_what_the_manual_prints() {
    let (_, text) = played(settings(1));
    let lines = text.lines().count();
    assert!(lines < 150, "{lines}");
    let widest = text.lines().map(|line| line.chars().count()).max();
    assert!(widest < Some(170), "{widest:?}");
    // P3 l.224 to l.226, l.309, l.324, l.325.
    for printed in [
        "0x000 2 81 00 ",
        "0x701 1 00 ",
        "0x601 5 22 00 16 00 00 ",
        "0x601 8 22 00 18 01 81 01 00 00 ",
        "0x601 6 22 40 60 00 86 00 ",
        "0x601 6 22 40 60 00 0F 00 ",
    ] {
        assert!(text.contains(printed), "{printed}");
    }
    assert!(!text.contains("emergency"), "{text}");
    assert!(!text.contains("refuses"), "{text}");
}

#[test]
fn the_plot_has_a_line_for_each_drive_in_each_chart() {
    let (report, _) = played(settings(1));
    let svg = plot::svg(&report);
    assert!(svg.starts_with("<svg width=\"1000\" height=\"960\" "));
    assert!(svg.trim_end().ends_with("</svg>"));
    for colour in ["#0072B2", "#D55E00", "#009E73"] {
        // One in the legend, one in each of three charts.
        let lines = svg.lines().filter(|line| {
            line.starts_with("<polyline") && line.contains(&format!("stroke=\"{colour}\""))
        });
        assert_eq!(lines.count(), 4, "{colour}");
    }
    for text in [
        "position, turns",
        "velocity, rpm",
        "current, A",
        "time, s",
        "node 3 pushes",
        "judged from the bus alone",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn a_folded_dialogue_counts_what_it_does_not_print() {
    use can::Frame;
    use canopen::Instant;
    use client::decode::Decoder;
    use client::{Seen, Way};

    let mut output = Vec::new();
    let mut dialogue = Dialogue::new(&mut output, Decoder::new());
    let see = |dialogue: &mut Dialogue<'_>, ms, id, data: &[u8], way| {
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(data);
        dialogue.see(&Seen {
            at: Instant::ZERO.plus_ms(ms),
            way,
            frame: Frame::classic(id, bytes, data.len() as u8),
        });
    };
    let write = |dialogue: &mut Dialogue<'_>, ms, is_answered| {
        let data = [0x22, 0x40, 0x60, 0, 0x0F, 0];
        see(dialogue, ms, 0x601, &data, Way::Sent);
        if is_answered {
            let data = [0x60, 0x40, 0x60, 0, 0, 0, 0, 0];
            see(dialogue, ms + 2, 0x581, &data, Way::Received);
        }
    };
    write(&mut dialogue, 1, true);
    write(&mut dialogue, 10, false);
    dialogue.fold(1);
    write(&mut dialogue, 20, true);
    write(&mut dialogue, 30, true);
    write(&mut dialogue, 40, false);
    // An emergency is never folded away: under-voltage.
    let emergency = [0x20, 0x32, 0x04, 0, 0, 0, 0, 0];
    see(&mut dialogue, 50, 0x081, &emergency, Way::Received);
    dialogue.unfold("three writes");
    dialogue.finish().unwrap();
    let text = String::from_utf8(output).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 5, "{text}");
    assert!(lines[0].ends_with("[ok, 2.00 ms]"), "{text}");
    assert!(
        lines[1].contains("0.010000") && !lines[1].contains("ok"),
        "{text}"
    );
    assert!(lines[2].contains("0.020000"), "{text}");
    assert!(lines[3].contains("0x3220"), "{text}");
    assert!(
        lines[4].ends_with("... 3 frames more: three writes"),
        "{text}"
    );
}

#[test]
fn thousands_are_set_apart() {
    for (number, text) in [
        (0, "0"),
        (999, "999"),
        (1_000, "1,000"),
        (7_098_012, "7,098,012"),
    ] {
        assert_eq!(thousands(number), text);
    }
}

#[test]
fn a_recording_that_cannot_be_written_is_told_before_anything_is_printed() {
    let path = file("no-folder").join("demo.log");
    let mut output = Vec::new();
    let failure = play(
        &Settings {
            record: Some(&path),
            ..settings(1)
        },
        &mut output,
    )
    .unwrap_err();
    let crate::Failure::Input(message) = failure else {
        panic!("{failure:?}")
    };
    assert!(
        message.contains("demo.log: cannot write the recording"),
        "{message}"
    );
    assert_eq!(output, b"");
}
