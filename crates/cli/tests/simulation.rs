//! `servobus sim` and `servobus replay`: beginning, end, doors, stores and recordings.

mod support;

use std::fs;
use std::net::TcpListener;
use std::time::{Duration, Instant};

use bus::recording::Content;
use bus::recording::candump::Reader;
use bus::{Connection, Endpoint};
use can::{Frame, StandardId};
use support::{Folder, Sim, printed};

#[test]
fn it_says_when_it_is_ready_and_ends_after_the_time_asked_for() {
    let began = Instant::now();
    let sim = Sim::with_doors(
        &[
            "socketcand://127.0.0.1:0",
            "slcan://127.0.0.1:0",
            "socketcand://127.0.0.1:0/vcan7",
        ],
        &["--nodes", "1-3", "--for", "300ms"],
    );
    assert_eq!(sim.ready, "ready: 3 virtual p3 drives, nodes 1-3");
    let port = |line: &str, before: &str, after: &str| {
        let port = line
            .strip_prefix(before)
            .and_then(|line| line.strip_suffix(after));
        let port: u16 = port.unwrap_or_else(|| panic!("{line}")).parse().unwrap();
        assert_ne!(port, 0);
    };
    port(&sim.doors[0], "socketcand://127.0.0.1:", " channel can0");
    port(&sim.doors[1], "slcan://127.0.0.1:", "");
    port(&sim.doors[2], "socketcand://127.0.0.1:", " channel vcan7");
    let ended = sim.wait();
    assert_eq!(ended.status.code(), Some(0));
    // Booting, at most 22 ms, is not paced.
    assert!(began.elapsed() >= Duration::from_millis(300 - 22));
    // Three boot-ups.
    assert!(
        ended.stdout.starts_with("simulated 0.300 s in "),
        "{ended:?}"
    );
    assert!(ended.stdout.contains("; 3 frames, "), "{ended:?}");
}

#[test]
fn one_drive_is_singular_and_speed_is_kept() {
    let began = Instant::now();
    let sim = Sim::with_doors(
        &["none"],
        &["--nodes", "5", "--for", "100ms", "--speed", "0.25"],
    );
    assert_eq!(sim.ready, "ready: 1 virtual p3 drive, node 5");
    assert_eq!(sim.wait().status.code(), Some(0));
    assert!(began.elapsed() >= Duration::from_millis(4 * (100 - 22)));
}

#[test]
fn without_doors_it_can_run_as_fast_as_the_machine() {
    let text = printed(
        &[
            "sim", "--bus", "none", "--speed", "max", "--for", "20s", "--nodes", "1,4",
        ],
        0,
    );
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "ready: 2 virtual p3 drives, nodes 1,4");
    assert!(lines[1].starts_with("simulated 20.000 s in "), "{text}");
    assert_eq!(lines.len(), 2, "{text}");
}

#[test]
fn signals_end_it_cleanly() {
    for signal in ["TERM", "INT"] {
        let sim = Sim::start(&[]);
        sim.signal(signal);
        let ended = sim.wait();
        assert_eq!(ended.status.code(), Some(0), "{signal}: {ended:?}");
        assert_eq!(ended.stderr, "");
    }
    let sim = Sim::with_doors(&["none"], &["--speed", "max"]);
    sim.end();
}

#[test]
fn a_busy_port_is_named_and_costs_no_earlier_recording() {
    let folder = Folder::new();
    let log = folder.file("run.log");
    fs::write(&log, "precious").unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let door = format!("socketcand://{}", listener.local_addr().unwrap());
    let error = printed(&["sim", "--bus", &door, "--record", &log], 2);
    assert!(
        error.starts_with(&format!(
            "error: cannot listen on {door}/can0: the port is in use"
        )),
        "{error}"
    );
    assert_eq!(fs::read_to_string(&log).unwrap(), "precious");
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

/// Runs `work` with a client of the bus.
fn outside<T>(bus: &str, work: impl AsyncFnOnce(&mut Connection) -> T) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .enable_time()
        .build()
        .unwrap();
    let endpoint: Endpoint = bus.parse().unwrap();
    runtime.block_on(async {
        let mut connection = bus::connect(&endpoint).await.unwrap();
        work(&mut connection).await
    })
}

/// Asks and waits for the answer of that identifier; of an SDO answer also the object must be the one
/// that was asked for, since another master may ask the same node for others.
async fn ask(connection: &mut Connection, request: Frame, answer: u32) -> Frame {
    connection.send(request).await.unwrap();
    let is_sdo = (0x581..=0x5FF).contains(&answer);
    loop {
        let received = tokio::time::timeout(Duration::from_secs(5), connection.receive());
        let frame = received.await.expect("an answer").unwrap().frame;
        let same_object = || frame.bytes()[1..4] == request.bytes()[1..4];
        if frame.raw_id() == answer && (!is_sdo || same_object()) {
            return frame;
        }
    }
}

/// A master at work: irregular times, several nodes, a reset, garbage, a burst.
fn make_traffic(bus: &str) {
    outside(bus, async |connection| {
        let status = frame(0x601, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
        for pause_us in [0, 170, 1_300, 40, 7_001] {
            let answer = ask(connection, status, 0x581).await;
            assert_eq!(answer.data()[..4], [0x42, 0x41, 0x60, 0]);
            tokio::time::sleep(Duration::from_micros(pause_us)).await;
        }
        ask(
            connection,
            frame(0x601, &[0x22, 0x40, 0x60, 0, 0x86, 0]),
            0x581,
        )
        .await;
        ask(
            connection,
            frame(0x601, &[0x22, 0x40, 0x60, 0, 0x0F, 0]),
            0x581,
        )
        .await;
        ask(connection, frame(0x601, &[0x22, 0x60, 0x60, 0, 4]), 0x581).await;
        ask(
            connection,
            frame(0x601, &[0x22, 0x71, 0x60, 0, 30, 0]),
            0x581,
        )
        .await;
        for _ in 0..100 {
            connection.send(frame(0x080, &[])).await.unwrap();
            connection
                .send(frame(0x602, &[0x40, 0x64, 0x60, 0]))
                .await
                .unwrap();
        }
        connection.send(frame(0x603, &[0x23])).await.unwrap();
        ask(connection, frame(0x000, &[0x81, 0x02]), 0x702).await;
    });
}

#[test]
fn a_recorded_run_with_outside_frames_is_repeated_byte_for_byte() {
    let folder = Folder::new();
    let log = folder.file("run.log");
    let sim = Sim::start(&["--nodes", "1-3", "--seed", "7", "--record", &log]);
    let bus = sim.bus().to_owned();
    // Two at once, so that frames of different clients meet.
    std::thread::scope(|scope| {
        scope.spawn(|| make_traffic(&bus));
        scope.spawn(|| make_traffic(&bus));
    });
    printed(&["scan", "--bus", &bus], 0);
    let ended = sim.end();
    assert!(
        ended.stderr.contains("client 1 joined from 127.0.0.1:"),
        "{ended:?}"
    );
    assert!(
        ended.stderr.contains("client 3 left: it disconnected"),
        "{ended:?}"
    );

    // What candump's readers see: times that never go back, and both sides of the dialogue.
    let text = fs::read(&log).unwrap();
    let records: Vec<_> = Reader::new(text.as_slice()).map(Result::unwrap).collect();
    assert!(records.is_sorted_by_key(|record| record.stamp_ns));
    assert!(records[0].stamp_ns < 100_000_000, "stamps begin at zero");
    let count = |id: u32| {
        let of_id = |content: &Content| matches!(content, Content::Frame(f) if f.raw_id() == id);
        records
            .iter()
            .filter(|record| of_id(&record.content))
            .count()
    };
    assert_eq!((count(0x080), count(0x000)), (200, 2));
    assert!(count(0x581) >= 18 && count(0x603) >= 2);

    let words = printed(&["replay", &log], 0);
    assert_eq!(
        words,
        format!("{log}: {} frames, identical\n", records.len())
    );
    let again = folder.file("again.log");
    printed(&["replay", &log, "--output", &again], 0);
    assert_eq!(fs::read(&again).unwrap(), text);
    assert_eq!(
        printed(&["replay", &log, "--output", "-"], 0).as_bytes(),
        text
    );
    let error = printed(&["replay", &log, "--output", &log], 2);
    assert!(error.contains("that is the recording itself"), "{error}");

    // A log that was tampered with is found out, with the line.
    let tampered = String::from_utf8(text)
        .unwrap()
        .replacen("can0 080#\n", "can0 080#01\n", 1);
    let line = tampered
        .lines()
        .position(|line| line.ends_with("080#01"))
        .unwrap()
        + 1;
    fs::write(&log, &tampered).unwrap();
    let error = printed(&["replay", &log], 1);
    assert!(
        error.starts_with(&format!("error: {log}:{line}: the replay differs\n")),
        "{error}"
    );
    assert!(
        error.contains("  recorded  (") && error.contains(" can0 080#01\n"),
        "{error}"
    );
}

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    let folder = Folder::new();
    let log = |name: &str, seed: &str| {
        let path = folder.file(name);
        let words = [
            "sim", "--bus", "none", "--speed", "max", "--for", "1s", "--nodes", "1-3",
        ];
        printed(
            &[&words[..], &["--seed", seed, "--record", &path]].concat(),
            0,
        );
        fs::read_to_string(path).unwrap()
    };
    let first = log("a.log", "1");
    assert_eq!(first.lines().count(), 3);
    assert_eq!(first, log("b.log", "1"));
    assert_ne!(first, log("c.log", "2"));
}

/// The format makes no difference to the run: the samples for MCAP neither.
#[test]
fn every_format_holds_the_same_frames() {
    let folder = Folder::new();
    let file = |name: &str| folder.file(name);
    for ending in ["log", "pcapng", "mcap"] {
        let path = file(&format!("run.{ending}"));
        let words = ["sim", "--bus", "none", "--speed", "max", "--for", "1s"];
        printed(&[&words[..], &["--record", &path]].concat(), 0);
    }
    let log = fs::read_to_string(file("run.log")).unwrap();
    assert_eq!(log.lines().count(), 3);
    let causes = |ending: &str| fs::read(file(&format!("run.{ending}.run"))).unwrap();
    assert!(causes("log") == causes("pcapng") && causes("log") == causes("mcap"));
    // From the causes the log can be made again, and from a log the other formats.
    for ending in ["pcapng", "mcap"] {
        let again = file(&format!("{ending}.log"));
        printed(
            &[
                "replay",
                &file(&format!("run.{ending}")),
                "--output",
                &again,
            ],
            0,
        );
        assert_eq!(fs::read_to_string(&again).unwrap(), log);
    }
    let again = file("again.pcapng");
    printed(&["replay", &file("run.log"), "--output", &again], 0);
    assert_eq!(
        fs::read(again).unwrap(),
        fs::read(file("run.pcapng")).unwrap()
    );

    // The signals of MCAP: three drives for a second, every 5 ms.
    let bytes = fs::read(file("run.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    let mut counts = std::collections::BTreeMap::new();
    for message in messages {
        let message = message.unwrap();
        let content: serde_json::Value = serde_json::from_slice(&message.data).unwrap();
        if message.channel.topic.starts_with("drive/") {
            assert_eq!(content["position_turns"], 0.0);
        }
        *counts.entry(message.channel.topic.clone()).or_insert(0) += 1;
    }
    let expected = [
        ("can0", 3),
        ("drive/1", 201),
        ("drive/2", 201),
        ("drive/3", 201),
    ];
    let expected = expected.map(|(topic, count)| (topic.to_owned(), count));
    assert_eq!(counts, expected.into());
}

/// `monitor --record` on a bus with traffic, in every format.
#[test]
fn the_monitor_records_what_it_shows() {
    let folder = Folder::new();
    let sim = Sim::start(&["--nodes", "1"]);
    outside(sim.bus(), async |connection| {
        let heartbeat = frame(0x601, &[0x22, 0x17, 0x10, 0, 20, 0]);
        ask(connection, heartbeat, 0x581).await;
    });
    for ending in ["log", "pcapng", "mcap"] {
        let path = folder.file(&format!("seen.{ending}"));
        let words = ["monitor", "--for", "300ms", "--bus", sim.bus(), "--record"];
        let shown = printed(&[&words[..], &[&path]].concat(), 0);
        let shown = shown.lines().count();
        assert!(shown >= 5, "{shown} heartbeats in 300 ms");
        let bytes = fs::read(&path).unwrap();
        let recorded = match ending {
            "log" => Reader::new(bytes.as_slice()).map(Result::unwrap).count(),
            // A block of the same length for each frame: 28 bytes, the packet, flags, the length.
            "pcapng" => bytes.windows(4).filter(|w| *w == [60, 0, 0, 0]).count() / 2,
            _ => mcap::MessageStream::new(&bytes).unwrap().count(),
        };
        assert_eq!(recorded, shown, "{ending}");
    }
}

#[test]
fn a_recording_that_was_cut_off_is_repeated_as_far_as_it_goes() {
    let folder = Folder::new();
    let log = folder.file("run.log");
    let sim = Sim::start(&["--nodes", "1-3", "--record", &log]);
    make_traffic(sim.bus());
    // Longer than the time after which what was recorded is in the files.
    std::thread::sleep(Duration::from_millis(900));
    sim.signal("KILL");
    sim.wait();
    let words = printed(&["replay", &log], 0);
    assert!(
        words.contains("identical (the recording was cut off"),
        "{words}"
    );
}

#[test]
fn stored_parameters_are_there_in_the_next_run() {
    let folder = Folder::new();
    let store = folder.file("drives");
    let sim = Sim::start(&["--store", &store]);
    let bus = sim.bus().to_owned();
    let sdo = |bus: &str, words: &[&str]| {
        let (access, rest) = words.split_first().unwrap();
        printed(
            &[&["sdo", access, "--node", "1", "--bus", bus], rest].concat(),
            0,
        )
    };
    sdo(&bus, &["write", "0x1017", "200"]);
    sdo(&bus, &["write", "0x6065", "1234"]);
    let saved = sdo(&bus, &["write", "0x1010,1", "save"]);
    assert_eq!(
        saved,
        "node 1 has taken 0x1010,1 Save all = 0x65766173: \"save\"\n"
    );
    sim.end();

    let log = folder.file("second.log");
    let sim = Sim::start(&["--store", &store, "--record", &log]);
    let bus = sim.bus().to_owned();
    let text = sdo(&bus, &["read", "0x1017"]);
    assert_eq!(text, "node 1 0x1017,0 Heartbeat period = 200 (0xC8) ms\n");
    let json: serde_json::Value =
        serde_json::from_str(&sdo(&bus, &["read", "0x6065", "--json"])).unwrap();
    assert_eq!(json["value"], 1234);
    sim.end();
    // What it had stored belongs to the recording; the replay does not look into the folder.
    fs::remove_dir_all(&store).unwrap();
    printed(&["replay", &log], 0);

    // Without --store nothing is kept.
    let sim = Sim::start(&[]);
    let text = sdo(sim.bus(), &["read", "0x1017"]);
    assert_eq!(text, "node 1 0x1017,0 Heartbeat period = 0 ms\n");
}

#[test]
fn a_damaged_store_is_kept_beside_and_reported() {
    let folder = Folder::new();
    let store = folder.file("drives");
    let sim = Sim::start(&["--store", &store]);
    let bus = sim.bus().to_owned();
    for words in [["0x1017", "200"], ["0x1010,1", "save"]] {
        printed(
            &[&["sdo", "write", "--node", "1", "--bus", &bus], &words[..]].concat(),
            0,
        );
    }
    sim.end();
    let file = fs::read_dir(&store)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let mut bytes = fs::read(&file).unwrap();
    // The set is the last that was written; behind it the page is filled up with 0xFF.
    let last = bytes.iter().rposition(|byte| *byte != 0xFF).unwrap();
    bytes[last] ^= 0x10;
    fs::write(&file, &bytes).unwrap();

    let log = folder.file("run.log");
    let sim = Sim::start(&["--store", &store, "--record", &log]);
    let bus = sim.bus().to_owned();
    let text = printed(&["sdo", "read", "--node", "1", "--bus", &bus, "0x1017"], 0);
    assert_eq!(text, "node 1 0x1017,0 Heartbeat period = 0 ms\n");
    let ended = sim.end();
    let kept = format!("{}.corrupt", file.display());
    assert_eq!(fs::read(&kept).unwrap(), bytes);
    assert!(
        ended
            .stderr
            .contains("node 1: the stored parameters are damaged"),
        "{ended:?}"
    );
    assert!(
        ended.stderr.contains(&format!("kept as {kept}")),
        "{ended:?}"
    );
    // The emergency: code 0x6320, little-endian.
    let frames = fs::read_to_string(&log).unwrap();
    assert!(
        frames.lines().any(|line| line.contains(" 081#2063")),
        "{frames}"
    );
    printed(&["replay", &log], 0);
}

/// A frame that a drive and a client send at the same time, bit for bit, is one frame on the wire.
/// It must not use up the client's place in its mailbox for good.
#[test]
fn a_client_that_imitates_a_drive_keeps_its_mailbox() {
    let folder = Folder::new();
    let log = folder.file("run.log");
    let sim = Sim::start(&["--record", &log]);
    outside(sim.bus(), async |connection| {
        // A heartbeat each millisecond, which the client sends, too, as fast as the bus takes it.
        ask(
            connection,
            frame(0x601, &[0x22, 0x17, 0x10, 0, 1, 0]),
            0x581,
        )
        .await;
        let heartbeat = frame(0x701, &[5]);
        for _ in 0..2_000 {
            connection.send(heartbeat).await.unwrap();
        }
        for _ in 0..200 {
            connection.send(frame(0x080, &[])).await.unwrap();
        }
        let statusword = frame(0x601, &[0x40, 0x41, 0x60, 0]);
        ask(connection, statusword, 0x581).await;
    });
    sim.end();
    // With all four places free, several frames are handed over at a time.
    let run = fs::read_to_string(format!("{log}.run")).unwrap();
    let syncs: Vec<&str> = run
        .lines()
        .filter_map(|line| line.strip_suffix(" client1 080#"))
        .collect();
    let most = syncs.chunk_by(|a, b| a == b).map(<[&str]>::len).max();
    assert_eq!((syncs.len(), most), (200, Some(4)));
    printed(&["replay", &log], 0);
}
