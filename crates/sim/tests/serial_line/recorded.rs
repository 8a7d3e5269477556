//! What came over the line is a cause: it is recorded, and a replay repeats it.

use std::path::PathBuf;

use canopen::Instant;
use personalities::roboteq::ROBOTEQ;
use sim::{Bus, BusSettings, DriveSettings, Recording, RunHeader, SerialAct, Traffic, replay};

use crate::bench::place;
use crate::master::{self, id};

type Act = (u64, Option<&'static [u8]>);

/// By serial line: switched on, moved, stored, asked; somebody goes in the middle of a line.
const SCRIPT: &[Act] = &[
    (50_000_000, Some(b"^ECHOF 1\r^FSA 1\r")),
    (60_000_111, Some(b"!ROM 1 3\r!CW 1 6\r!CW 1 15\r!S 1 500")),
    (90_000_222, Some(b"\r?F_?A_# 5\r")),
    (150_000_333, None),
    (170_000_444, Some(b"\x00\xFF!!\r^MAC 1 777\r%EESAV\r?SW\r")),
    (400_000_555, Some(b"!CW 1 ")),
    (410_000_666, None),
    (420_000_777, Some(b"0\r!S 1 -300\r")),
];

fn settings() -> BusSettings {
    BusSettings::new(3, vec![DriveSettings::new(id(1), &ROBOTEQ)])
}

fn act(script: Option<&[u8]>) -> SerialAct {
    script.map_or(SerialAct::HangUp, |bytes| SerialAct::Bytes(bytes.to_vec()))
}

/// The script, and an SDO read of position and statusword each 10 ms; what the bus carried and the line
/// sent.
fn run(step_ns: u64, recording: &mut Option<Recording>) -> (Vec<Traffic>, Vec<sim::SerialByte>) {
    let mut bus = Bus::new(settings());
    let mut traffic = Vec::new();
    let mut sent = Vec::new();
    let mut script = SCRIPT.iter().peekable();
    let mut read_at = 45_000_000;
    while bus.now().0 < 700_000_000 {
        let next_act = script.peek().map_or(u64::MAX, |(at, _)| *at);
        let until = (bus.now().0 + step_ns).min(next_act).min(read_at);
        bus.run_until(Instant(until));
        let new = bus.take_traffic();
        if let Some(recording) = recording {
            for traffic in &new {
                recording.frame(traffic).expect("written");
            }
        }
        traffic.extend(new);
        sent.extend(bus.take_serial());
        if until == next_act {
            let (_, bytes) = script.next().expect("an act");
            let act = act(*bytes);
            if let Some(recording) = recording {
                recording.serial(bus.now(), place(), &act).expect("written");
            }
            bus.act_on_serial(place(), &act);
        }
        if until == read_at {
            let request = match read_at / 10_000_000 % 2 {
                0 => [0x40, 0x64, 0x60, 0, 0, 0, 0, 0],
                _ => [0x40, 0x41, 0x60, 0, 0, 0, 0, 0],
            };
            let frame = master::frame(0x601, &request);
            if let Some(recording) = recording {
                let (at, client) = (bus.now(), 0);
                let injection = sim::Injection { at, client, frame };
                recording.injection(&injection).expect("written");
            }
            bus.send(0, frame);
            read_at += 10_000_000;
        }
    }
    (traffic, sent)
}

#[test]
fn however_time_is_cut_it_is_the_same() {
    let (frames, bytes) = run(20_000_000, &mut None);
    assert!(bytes.len() > 80, "{}", bytes.len());
    let text: String = bytes.iter().map(|byte| char::from(byte.byte)).collect();
    assert!(
        text.contains("+\r") && text.contains("-\r") && text.contains("SW="),
        "{text}"
    );
    for step_ns in [100_000, 1_234_567] {
        let (other_frames, other_bytes) = run(step_ns, &mut None);
        assert_eq!(frames, other_frames);
        assert_eq!(bytes, other_bytes);
    }
}

#[test]
fn a_replay_repeats_what_came_over_the_line() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("serial_line.log");
    let recording = Recording::create(&path, &RunHeader::of(&settings())).expect("created");
    let mut recording = Some(recording);
    run(7_000_000, &mut recording);
    let end = Instant(700_000_000);
    recording
        .expect("it is there")
        .finish(end)
        .expect("finished");
    let log = std::fs::read(&path).expect("a log");
    let mut again = Vec::new();
    replay(&path, &mut again).expect("replayed");
    assert!(log == again, "the replay differs");
    // Without the line's acts it is another run: the test sees what it is to see.
    let run_file = path.with_file_name("serial_line.log.run");
    let causes = std::fs::read_to_string(&run_file).expect("a run file");
    assert_eq!(causes.matches("\nserial 1 ").count(), SCRIPT.len());
    let without: String = causes
        .lines()
        .filter(|line| !line.starts_with("serial "))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(&run_file, without).expect("written");
    let mut other = Vec::new();
    replay(&path, &mut other).expect("replayed");
    assert!(log != other);
}

#[test]
fn a_run_file_names_drives_that_have_a_line() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("no_serial_line.log");
    let rows = [
        (
            "drive 1 p3\nserial 1 0.100000000 3F\n",
            "3:8: there is no drive 1 that has a serial line",
        ),
        (
            "drive 1 roboteq\nserial 2 0.100000000 3F\n",
            "3:8: there is no drive 2",
        ),
        (
            "drive 1 roboteq\nserial 1 0.100000000 3\n",
            "3:22: pairs of hexadecimal digits",
        ),
        (
            "drive 1 roboteq\nserial 1 0.100000000\n",
            "bytes or hang-up is expected",
        ),
        ("drive 1 roboteq\nserial 1 soon 3F\n", "a time in seconds"),
    ];
    for (text, message) in rows {
        std::fs::write(
            path.with_extension("log.run"),
            format!("servobus run 1\n{text}"),
        )
        .expect("written");
        let error = replay(&path, &mut Vec::new())
            .expect_err("refused")
            .to_string();
        assert!(error.contains(message), "{error}");
    }
}
