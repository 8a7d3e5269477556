//! The same causes have the same effects: however time is cut, on however many threads, and from a
//! recording.

mod master;
use master::*;

use std::path::PathBuf;

use canopen::Instant;
use rand_core::{RngCore as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sim::{
    Bus, BusSettings, FlashFile, Injection, Place, ReadError, Recording, RunHeader, Traffic,
    replay, run_fleet,
};

/// A script of outside frames that makes three drives do all sorts of things, garbage included.
fn script(seed: u64) -> Vec<(Instant, u32, can::Frame)> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut frames = Vec::new();
    let mut say = |ms: u64, client: u32, id: u16, data: &[u8]| {
        frames.push((
            Instant::ZERO.plus_ns(ms * 1_000_000 + u64::from(client) * 333),
            client,
            frame(id, data),
        ));
    };
    for node in 1..=3_u16 {
        let t = 40 + u64::from(node);
        say(
            t,
            0,
            0x600 + node,
            &[0x22, 0x01, 0x1A, 1, 0x20, 0, 0x64, 0x60],
        );
        say(t + 3, 0, 0x600 + node, &[0x22, 0x01, 0x1A, 0, 1]);
        say(t + 6, 0, 0x600 + node, &[0x22, 0x40, 0x60, 0, 0x86, 0]);
        say(t + 9, 0, 0x600 + node, &[0x22, 0x40, 0x60, 0, 0x0F, 0]);
        say(t + 12, 0, 0x600 + node, &[0x22, 0x60, 0x60, 0, 3]);
        say(
            t + 15,
            1,
            0x600 + node,
            &[0x22, 0xFF, 0x60, 0, 0x50, 0xC3, node as u8, 0],
        );
        say(
            t + 18,
            0,
            0x600 + node,
            &[0x22, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65],
        );
    }
    for ms in 70..260 {
        say(ms, 0, 0x080, &[]);
        if ms % 7 == 0 {
            let word = random.next_u64().to_le_bytes();
            say(
                ms,
                1 + u32::from(word[0] & 1),
                0x600 + u16::from(word[1] % 4),
                &[0x40, word[2], 0x60, 0],
            );
        }
        if ms % 31 == 0 {
            say(
                ms,
                2,
                random.next_u32() as u16 & 0x7FF,
                &random.next_u64().to_le_bytes(),
            );
        }
    }
    say(200, 0, 0x000, &[0x81, 2]);
    say(240, 0, 0x000, &[0x82, 3]);
    frames.sort_by_key(|(at, client, _)| (*at, *client));
    frames
}

fn settings(seed: u64) -> BusSettings {
    BusSettings::new(seed, vec![p3(1), p3(2), p3(3)])
}

const END: Instant = Instant(300_000_000);

/// Runs the script; each stretch of time is cut as `cut` says.
fn run(seed: u64, mut cut: impl FnMut(Instant, Instant) -> Instant) -> Vec<Traffic> {
    let mut bus = Bus::new(settings(seed));
    let mut traffic = Vec::new();
    let end = [(END, 0, None)];
    let frames = script(seed)
        .into_iter()
        .map(|(at, client, frame)| (at, client, Some(frame)));
    for (at, client, frame) in frames.chain(end) {
        while bus.now() < at {
            let to = cut(bus.now(), at).min(at);
            bus.run_until(to);
            traffic.extend(bus.take_traffic());
        }
        if let Some(frame) = frame {
            bus.send(client, frame);
        }
    }
    traffic
}

#[test]
fn slicing_makes_no_difference() {
    for seed in 1..=4 {
        let whole = run(seed, |_, until| until);
        assert!(whole.len() > 400, "{}", whole.len());
        let drives = whole
            .iter()
            .filter(|t| matches!(t.sender, sim::Sender::Drive(_)));
        assert!(drives.count() > 200);
        for slices in 0..4 {
            let mut random = Pcg64Mcg::seed_from_u64(seed * 100 + slices);
            let cut = run(seed, |now, _| {
                // From one nanosecond to some milliseconds, evenly in the logarithm.
                let ns = 1_u64 << (random.next_u32() % 23);
                now.plus_ns(1 + random.next_u64() % ns)
            });
            assert_eq!(whole, cut, "seed {seed}, slices {slices}");
        }
    }
}

#[test]
fn run_to_frame_makes_no_difference() {
    let whole = run(5, |_, until| until);
    let mut bus = Bus::new(settings(5));
    let mut traffic = Vec::new();
    for (at, client, frame) in script(5) {
        while bus.run_to_frame(at) {
            traffic.extend(bus.take_traffic());
        }
        traffic.extend(bus.take_traffic());
        bus.send(client, frame);
    }
    while bus.run_to_frame(END) {
        traffic.extend(bus.take_traffic());
    }
    traffic.extend(bus.take_traffic());
    assert_eq!(whole, traffic);
}

#[test]
fn another_seed_is_another_run() {
    // Same script, so that only the drives' own delays differ.
    let stamps = |seed| {
        let mut bus = Bus::new(settings(seed));
        bus.run_until(Instant(50_000_000));
        let traffic = bus.take_traffic();
        traffic.iter().map(|t| t.at).collect::<Vec<_>>()
    };
    assert_eq!(stamps(1), stamps(1));
    assert_ne!(stamps(1), stamps(2));
}

#[test]
fn a_fleet_is_the_same_on_any_number_of_threads() {
    let trace = |threads| {
        let mut buses: Vec<Bus> = (0..6).map(|seed| Bus::new(settings(seed))).collect();
        let mut traffic = vec![Vec::new(); buses.len()];
        let scripts: Vec<_> = (0..6).map(script).collect();
        // All buses advance together, in slices of 10 ms, and get their frames in between.
        for slice in 1..=30 {
            let until = Instant::ZERO.plus_ms(slice * 10);
            for (bus, frames) in buses.iter_mut().zip(&scripts) {
                let due = |at: Instant| at >= bus.now() && at < until;
                let frames: Vec<_> = frames.iter().filter(|(at, ..)| due(*at)).collect();
                for (_, client, frame) in frames {
                    bus.send(*client, *frame);
                }
            }
            run_fleet(&mut buses, until, threads).unwrap();
            for (bus, traffic) in buses.iter_mut().zip(&mut traffic) {
                traffic.extend(bus.take_traffic());
            }
        }
        let positions: Vec<u64> = buses
            .iter_mut()
            .map(|bus| {
                bus.drive(id(1))
                    .unwrap()
                    .plant()
                    .truth()
                    .position_turns()
                    .to_bits()
            })
            .collect();
        (traffic, positions)
    };
    let one = trace(1);
    assert!(one.0.iter().all(|traffic| traffic.len() > 300));
    assert!(one.1.iter().any(|bits| *bits != 0), "something moved");
    assert_eq!(one, trace(2));
    assert_eq!(one, trace(5));
}

fn file(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("repeat");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

#[test]
fn a_recording_replays_byte_for_byte() {
    // What drive 2 has stored makes a difference from the first frame on.
    let stored = {
        let mut master = Master::new(&[2]);
        master.write_u16(2, 0x1017, 0, 20);
        master.write_i32(2, 0x6083, 0, 333_333);
        master.write(2, 0x1010, 1, &SAVE);
        master.drive(2).stored().to_vec()
    };
    let log = file("three.log");
    let mut settings = settings(9);
    settings.drives[1].store = FlashFile::memory(stored);
    let mut recording = Recording::create(&log, &RunHeader::of(&settings)).unwrap();
    let mut bus = Bus::new(settings);
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut blocked = false;
    for (at, client, frame) in script(9) {
        while bus.now() < at {
            let slice = bus.now().plus_ns(1 + random.next_u64() % 3_000_000);
            bus.run_until(slice.min(at));
            for traffic in bus.take_traffic() {
                recording.frame(&traffic).unwrap();
            }
        }
        if at > Instant(150_000_000) && !blocked {
            blocked = true;
            bus.drive(id(1)).unwrap().plant().set_blocked(true);
            recording.block(at, Place::of_node(id(1)), true).unwrap();
        }
        recording
            .injection(&Injection { at, client, frame })
            .unwrap();
        bus.send(client, frame);
    }
    bus.run_until(END);
    for traffic in bus.take_traffic() {
        recording.frame(&traffic).unwrap();
    }
    let frames = recording.finish(END).unwrap();
    assert!(frames > 400);
    let original = std::fs::read(&log).unwrap();
    let text = String::from_utf8(original.clone()).unwrap();
    assert!(
        text.contains("702#05") || text.contains("702#7F"),
        "the stored heartbeat"
    );

    let mut again = Vec::new();
    let replayed = replay(&log, &mut again).unwrap();
    assert_eq!(
        (replayed.frames, replayed.end, replayed.cut_off),
        (frames, END, false)
    );
    assert_eq!(original, again);

    // Without its last line it was cut off: the replay is the beginning of the log.
    let run = file("three.log.run");
    let causes = std::fs::read_to_string(&run).unwrap();
    let without_end: String = causes
        .lines()
        .filter(|line| !line.starts_with("end"))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(&run, without_end).unwrap();
    let mut cut = Vec::new();
    let replayed = replay(&log, &mut cut).unwrap();
    assert!(replayed.cut_off);
    assert!(cut.len() > original.len() / 2 && original.starts_with(&cut));

    // Cut off in the middle of a line, wherever that is: what was whole is replayed.
    for bytes in [causes.len() - 1, causes.len() - 9, causes.len() * 2 / 3] {
        std::fs::write(&run, &causes[..bytes]).unwrap();
        let mut cut = Vec::new();
        assert!(replay(&log, &mut cut).unwrap().cut_off);
        assert!(original.starts_with(&cut));
    }

    // Other causes, another log.
    std::fs::write(&run, causes.replace("block 1 on", "block 3 on")).unwrap();
    let mut other = Vec::new();
    replay(&log, &mut other).unwrap();
    assert_ne!(original, other);
}

#[test]
fn a_malformed_run_file_is_told_by_line_and_column() {
    let log = file("bad.log");
    let run = file("bad.log.run");
    for (text, place, what) in [
        ("", "1:1", "begins with 'servobus run 1'"),
        ("servobus run 2\n", "1:1", "begins with 'servobus run 1'"),
        ("servobus run 1\nseed 1\n", "2:1", "names its drives"),
        ("servobus run 1\nsaat 1\n", "2:1", "'saat'"),
        ("servobus run 1\nseed\n", "2:5", "the seed is expected"),
        ("servobus run 1\nseed 1x\n", "2:6", "whole number"),
        ("servobus run 1\nseed 1 2\n", "2:8", "found '2'"),
        ("servobus run 1\nbit-rate 33k\n", "2:10", "125k, 250k"),
        ("servobus run 1\nlose 1\n", "2:6", "as in 1%"),
        ("servobus run 1\nduplicate 101%\n", "2:11", "0% to 100%"),
        ("servobus run 1\ndrive u0 p3\n", "2:7", "u1 to u127"),
        ("servobus run 1\ndrive 0 p3\n", "2:7", "1 to 127"),
        ("servobus run 1\ndrive 128 p3\n", "2:7", "1 to 127"),
        ("servobus run 1\ndrive 1 p4\n", "2:9", "'p4'"),
        ("servobus run 1\ndrive 1 p3\ndrive 1 p3\n", "3:7", "twice"),
        (
            "servobus run 1\ndrive 1 p3\nstored 1 0\n",
            "3:10",
            "hexadecimal",
        ),
        (
            "servobus run 1\ndrive 1 p3\nstored 1 0g\n",
            "3:10",
            "hexadecimal",
        ),
        (
            "servobus run 1\ndrive 1 p3\nflash 1 12 00\n",
            "3:9",
            "like 0x4000",
        ),
        (
            "servobus run 1\ndrive 1 p3\nflash 1 0x10 0\n",
            "3:14",
            "hexadecimal",
        ),
        (
            "servobus run 1\ndrive 1 p3\nflash 1 0x47FFF 0000\n",
            "3:9",
            "294912 bytes",
        ),
        (
            "servobus run 1\ndrive 1 p3\nblock 1 maybe 1.000000000\n",
            "3:9",
            "on or off",
        ),
        (
            "servobus run 1\ndrive 1 p3\nblock 1 on 1.0\n",
            "3:12",
            "nine digits",
        ),
        (
            "servobus run 1\ndrive 1 p3\nend 99999999999999999999.000000000\n",
            "3:5",
            "nine digits",
        ),
        (
            "servobus run 1\ndrive 1 p3\n(0.100000) client1 181#00\nend 0.050000000\n",
            "4:1",
            "earlier",
        ),
        (
            "servobus run 1\ndrive 1 p3\n(0.100000) can0 181#00\n",
            "3:1",
            "outside program",
        ),
        (
            "servobus run 1\ndrive 1 p3\n(x) client1 181#00\n",
            "3:1",
            "",
        ),
        (
            "servobus run 1\ndrive 1 p3\n(0.100000) client1 181#0\n",
            "3:",
            "",
        ),
        ("servobus run 1\r\n", "1:1", ""),
    ] {
        std::fs::write(&run, text).unwrap();
        let error = replay(&log, &mut Vec::new()).expect_err(text);
        let message = error.to_string();
        assert!(
            matches!(error, ReadError::Line { .. }),
            "{text:?}: {message}"
        );
        let at = format!("{}:{place}", run.display());
        assert!(
            message.starts_with(&at) && message.contains(what),
            "{text:?}: {message}"
        );
    }
    std::fs::write(&run, b"servobus run 1\ndrive 1 p\xFF\n").unwrap();
    let message = replay(&log, &mut Vec::new()).unwrap_err().to_string();
    assert!(message.contains(":2:10: "), "{message}");
    std::fs::remove_file(&run).unwrap();
    let message = replay(&log, &mut Vec::new()).unwrap_err().to_string();
    assert!(message.contains("keep the two together"), "{message}");
}
