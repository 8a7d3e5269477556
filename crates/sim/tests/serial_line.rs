//! The serial line of a Roboteq controller: the same drive as by CAN, at the pace of the line, and
//! again in a replay.

mod master;

use std::path::PathBuf;

use canopen::{Access, Address, DataType, Instant};
use master::{Master, id};
use personalities::Personality;
use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2, ROBOTEQ_3};
use personalities::serial::{Action, Command, Kind, Of};
use sim::{
    Bus, BusSettings, DriveSettings, Place, Recording, RunHeader, SerialAct, Traffic, replay,
};

/// A byte at 115,200 bit/s.
const BYTE_NS: u64 = 86_806;

fn place() -> Place {
    Place::of_node(id(1))
}

fn controller(personality: &'static Personality) -> Master {
    let mut master = Master::with(vec![DriveSettings::new(id(1), personality)]);
    assert_eq!(say(&mut master, "^ECHOF 1\r"), "^ECHOF 1\r+\r");
    master
}

fn send(bus: &mut Bus, bytes: &[u8]) {
    bus.run_until(bus.now());
    bus.act_on_serial(place(), &SerialAct::Bytes(bytes.to_vec()));
}

/// What came back until nothing has come for so many ms.
fn hear(master: &mut Master, quiet_ms: u64) -> String {
    let mut heard = Vec::new();
    let mut quiet = 0;
    while quiet < quiet_ms {
        master.run_ms(1);
        let sent = master.bus.take_serial();
        quiet = if sent.is_empty() { quiet + 1 } else { 0 };
        heard.extend(sent.iter().map(|byte| byte.byte));
    }
    String::from_utf8(heard).expect("text")
}

/// A line, and what came back.
fn say(master: &mut Master, line: &str) -> String {
    send(&mut master.bus, line.as_bytes());
    hear(master, 10)
}

/// The integer behind an object, by SDO; its abort code if it is refused.
fn by_can(master: &mut Master, at: Address) -> Result<i64, u32> {
    let data_type = data_type(master, at);
    let raw = master.try_read(1, at.index, at.sub)?;
    Ok(data_type.number(u32::from_le_bytes(raw)))
}

fn data_type(master: &mut Master, at: Address) -> DataType {
    let table = &master.drive(1).personality().device.table;
    let entry = table.find(at.index, at.sub).expect("an object");
    entry.field.data_type()
}

fn write_by_can(master: &mut Master, at: Address, value: i64) -> Result<(), u32> {
    let size = usize::from(data_type(master, at).size());
    master.try_write(1, at.index, at.sub, &value.to_le_bytes()[..size])
}

/// A value that the object takes, and another one.
fn values(command: &Command) -> [i64; 2] {
    match command.name {
        "ROM" => [3, -2],
        "POS" => [-700, 700],
        "FSA" => [1, 0],
        "OVL" | "UVL" => [200, 210],
        "OTL" => [60, 70],
        "MXRPM" => [1500, 1600],
        "S" => [-250, 250],
        "MS" => [1, 2],
        _ => [1, 2],
    }
}

/// What is written by one way is read by the other, and what one way refuses the other does, too.
#[test]
fn both_ways_lead_to_the_same_objects() {
    let mut master = controller(&ROBOTEQ_3);
    let port = ROBOTEQ_3.serial.expect("a serial line");
    let mut compared = 0;
    for command in port.commands {
        let Action::Write(object) = command.action else {
            continue;
        };
        let (count, steps) = match command.of {
            Of::Order => continue,
            Of::Drive => (1, 1),
            Of::Channel => (3, 1),
            Of::Pair => (3, 2),
            Of::Elements(count) => (1, count),
        };
        for which in 0..count * steps {
            let at = object.at(which / steps, which % steps);
            let rows = ROBOTEQ_3.device.table.rows();
            let row = rows.iter().find(|row| {
                row.address.index == at.index
                    && (row.address.sub..row.address.sub + row.count).contains(&at.sub)
            });
            let row = row.expect("a row");
            let number = match command.of {
                Of::Drive => String::new(),
                _ => format!("{} ", which + 1),
            };
            let (set, get) = match command.kind {
                Kind::Command => ('!', '?'),
                _ => ('^', '~'),
            };
            let name = command.name;
            let [one, other] = values(command);
            let line = format!("{set}{name} {number}{one}\r");
            assert_eq!(say(&mut master, &line), "+\r", "{line}");
            if row.access != Access::WriteOnly {
                assert_eq!(by_can(&mut master, at), Ok(one), "{line}");
                let query = format!("{get}{name} {number}\r");
                assert_eq!(write_by_can(&mut master, at, other), Ok(()), "{name}");
                let answer = say(&mut master, &query);
                assert_eq!(answer, format!("{name}={other}\r"), "{query}");
                compared += 1;
            }
            // Beyond what the object takes: refused by both, or by both held within.
            for wrong in [i64::from(i32::MIN), i64::from(i32::MAX)] {
                let fits = row
                    .data_type
                    .bounds()
                    .is_some_and(|(l, h)| l <= wrong && wrong <= h);
                let line = format!("{set}{name} {number}{wrong}\r");
                let answer = say(&mut master, &line);
                if fits {
                    let refused = write_by_can(&mut master, at, wrong).is_err();
                    assert_eq!(answer == "-\r", refused, "{line}");
                } else {
                    assert_eq!(answer, "-\r", "{line}");
                }
            }
        }
    }
    assert!(compared > 60, "{compared}");
}

/// Each query tells what an upload tells.
#[test]
fn queries_tell_what_uploads_tell() {
    let mut master = controller(&ROBOTEQ_2);
    for line in [
        "^FSA 1\r",
        "!ROM 2 3\r",
        "!CW 2 6\r",
        "!CW 2 15\r",
        "!S 2 300\r",
    ] {
        assert_eq!(say(&mut master, line), "+\r", "{line}");
    }
    master.run_ms(300);
    // Currents and speeds are never twice the same.
    let lively = ["A", "BA", "F", "S", "C", "E", "V", "P"];
    let mut compared = 0;
    for command in ROBOTEQ_2.serial.expect("a serial line").commands {
        let (Action::Read(object), Kind::Query | Kind::Get) = (command.action, command.kind) else {
            continue;
        };
        let (count, steps) = match command.of {
            Of::Drive | Of::Order => (1, 1),
            Of::Channel => (2, 1),
            Of::Pair => (2, 2),
            Of::Elements(count) => (1, count),
        };
        let prefix = if command.kind == Kind::Query {
            '?'
        } else {
            '~'
        };
        let answer = say(&mut master, &format!("{prefix}{}\r", command.name));
        let told = answer.trim_end().split_once('=').expect("an answer").1;
        let told: Vec<i64> = told
            .split(':')
            .map(|n| n.parse().expect("a number"))
            .collect();
        assert_eq!(told.len(), usize::from(count * steps), "{}", command.name);
        for (which, told) in (0..).zip(told) {
            let at = object.at(which / steps, which % steps);
            let read = by_can(&mut master, at).expect("readable");
            if lively.contains(&command.name) {
                let tolerance = match command.name {
                    // Of a turning shaft, and of a voltage that follows each sample.
                    "C" => 10_000,
                    "P" => 100,
                    _ => 20.max(read.abs() / 10),
                };
                assert!((read - told).abs() <= tolerance, "{at}: {told} {read}");
            } else {
                assert_eq!(told, read, "{} {at}", command.name);
            }
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared}");
}

fn rpm(master: &mut Master, axis: usize) -> f64 {
    let speed = master.drive(1).worlds()[axis].truth().speed_rad_s;
    f64::from(speed) * 60.0 / core::f64::consts::TAU
}

/// Switched on, moved and watched by serial line alone; then stopped by CAN.
#[test]
fn the_line_moves_the_same_motor_as_can_does() {
    let mut master = controller(&ROBOTEQ_2);
    assert_eq!(say(&mut master, "?SW\r"), "SW=0:0\r");
    assert_eq!(say(&mut master, "^FSA 1\r"), "+\r");
    assert_eq!(say(&mut master, "?SW 2\r"), format!("SW={}\r", 0x0250));
    for line in [
        "!ROM 2 3\r",
        "!CW 2 6\r",
        "!CW 2 7\r",
        "!CW 2 15\r",
        "!S 2 600\r",
    ] {
        assert_eq!(say(&mut master, line), "+\r", "{line}");
    }
    master.run_ms(1000);
    // R10: one command, two objects.
    assert_eq!(master.read(1, 0x68FF, 0), 600);
    assert_eq!(master.read(1, 0x6842, 0), 600);
    let speed = rpm(&mut master, 1);
    assert!((speed - 600.0).abs() < 10.0, "{speed}");
    assert!(rpm(&mut master, 0).abs() < 1.0);
    let told = say(&mut master, "?F 2\r");
    let told: f64 = told
        .trim_start_matches("F=")
        .trim_end()
        .parse()
        .expect("a speed");
    assert!((told - 600.0).abs() < 15.0, "{told}");
    let status = say(&mut master, "?SW 2\r");
    let word: u16 = status
        .trim_start_matches("SW=")
        .trim_end()
        .parse()
        .expect("a word");
    assert_eq!(word & 0x6F, 0x27, "{status}");
    // CAN stops it.
    master.write_i32(1, 0x68FF, 0, 0);
    master.run_ms(1000);
    assert!(rpm(&mut master, 1).abs() < 10.0);
    assert_eq!(say(&mut master, "!CW 2 7\r"), "+\r");
    assert_eq!(master.read(1, 0x6841, 0) & 0x6F, 0x23);
    master.write_u16(1, 0x6840, 0, 0);
    assert_eq!(say(&mut master, "?SW 2\r"), format!("SW={}\r", 0x0250));
}

/// Without the state machine and in open loop: `!G` alone turns the motor.
#[test]
fn g_is_the_voltage_in_open_loop() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(say(&mut master, "!G 300\r"), "+\r");
    assert_eq!(say(&mut master, "!G 1 1001\r"), "-\r");
    master.run_ms(2000);
    let speed = rpm(&mut master, 0);
    assert!(speed > 300.0, "{speed}");
    assert_eq!(say(&mut master, "!EX\r"), "+\r");
    assert_eq!(say(&mut master, "?FF\r"), "FF=16\r");
    assert_eq!(say(&mut master, "!G 0\r!MG\r"), "+\r+\r");
    master.run_ms(1500);
    assert_eq!(say(&mut master, "?FF\r"), "FF=0\r");
}

/// What is stored is there after a reset; echo and history are as at first.
#[test]
fn eesav_stores_and_answers_when_it_is_done() {
    let mut master = controller(&ROBOTEQ_2);
    assert_eq!(say(&mut master, "^MAC 2 4321\r^EDEC 1 987\r"), "+\r+\r");
    let began = master.now();
    send(&mut master.bus, b"%EESAV\r?SW 1\r");
    // Meanwhile another store is refused, by CAN as by the line itself.
    let mut plus = Vec::new();
    while plus.is_empty() {
        master.run_ms(1);
        assert!(master.now().since_ns(began) < 2_000_000_000, "no answer");
        plus = master.bus.take_serial();
    }
    assert_eq!(plus[0].byte, b'+');
    let took = plus[0].at.since_ns(began);
    assert!(took > 5_000_000, "flash is not written in {took} ns");
    assert_eq!(hear(&mut master, 10).trim_start_matches('\r'), "SW=0\r");
    // NMT reset.
    assert_eq!(say(&mut master, "?A 1\r!CW 1"), "A=0\r");
    master.send(0, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(say(&mut master, "~MAC\r"), "~MAC\rMAC=20000:4321\r");
    assert_eq!(say(&mut master, "~EDEC 1\r#\r"), "~EDEC 1\rEDEC=987\r#\r");
}

/// Each byte takes its time, in both directions.
#[test]
fn bytes_come_at_the_pace_of_the_line() {
    let mut master = controller(&ROBOTEQ);
    let began = master.now();
    send(&mut master.bus, b"?VNM\r");
    master.run_ms(10);
    let sent = master.bus.take_serial();
    let text: Vec<u8> = sent.iter().map(|byte| byte.byte).collect();
    assert_eq!(text, b"VNM=262400\r");
    // Five bytes to come, and one of the answer.
    assert_eq!(sent[0].at.since_ns(began), 6 * BYTE_NS);
    for pair in sent.windows(2) {
        assert_eq!(pair[1].at.since_ns(pair[0].at), BYTE_NS);
    }
    // Sixteen queries at once are answered one after the other, and none is lost.
    let began = master.now();
    send(&mut master.bus, &b"?VNM\r".repeat(800));
    let mut count = 0;
    while count < 800 * 11 {
        master.run_ms(20);
        count += master.bus.take_serial().len();
        assert!(master.now().since_ns(began) < 2_000_000_000, "{count}");
    }
    let took = master.now().since_ns(began);
    assert!(took >= 800 * 11 * BYTE_NS, "{took}");
}

#[test]
fn repeated_queries_come_by_themselves_until_the_other_end_hangs_up() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(say(&mut master, "# C\r?SW\r# 20\r"), "SW=0\r");
    let began = master.now();
    let mut times = Vec::new();
    while master.now().since_ns(began) < 1_000_000_000 {
        master.run_ms(10);
        let sent = master.bus.take_serial();
        times.extend(
            sent.iter()
                .filter(|byte| byte.byte == b'\r')
                .map(|byte| byte.at),
        );
    }
    assert!((49..=50).contains(&times.len()), "{}", times.len());
    for pair in times.windows(2) {
        assert_eq!(pair[1].since_ns(pair[0]), 20_000_000);
    }
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(hear(&mut master, 100), "");
    // Half a line has gone with its sender.
    send(&mut master.bus, b"!CW 1 1");
    master.run_ms(2);
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(say(&mut master, "5\r"), "-\r");
    // What it had sent as a whole is obeyed, though it went at once; what that has to say nobody hears.
    send(&mut master.bus, b"!TC 1 7\r?TC\r!TC 1 8");
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(say(&mut master, "?TC\r"), "TC=7\r");
}

/// While it boots or is off it hears nothing, and a drive without a line never does.
#[test]
fn who_does_not_run_hears_nothing() {
    let mut master = controller(&ROBOTEQ);
    master.send(0, &[0x81, 1]);
    master.run_us(500);
    send(&mut master.bus, b"!CW 1 15\r");
    assert_eq!(hear(&mut master, 60), "");
    assert_eq!(say(&mut master, "?CW\r"), "?CW\rCW=0\r");
    let mut p3 = Master::new(&[1]);
    assert_eq!(p3.bus.serial_room(place()), 0);
    send(&mut p3.bus, b"?SW\r");
    assert_eq!(hear(&mut p3, 20), "");
}

/// Garbage does no harm while the drive works on.
#[test]
fn garbage_on_the_line_does_not_disturb_the_drive() {
    let mut master = controller(&ROBOTEQ);
    let mut random = 0x1234_5678_9ABC_DEF1_u64;
    for _ in 0..40 {
        let bytes: Vec<u8> = (0..100)
            .map(|_| {
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                (random >> 40) as u8
            })
            .collect();
        send(&mut master.bus, &bytes);
        master.run_ms(20);
        master.bus.take_serial();
        assert_eq!(master.read(1, 0x1000, 0), 0x192);
    }
    hear(&mut master, 50);
    say(&mut master, "\r");
    assert_eq!(say(&mut master, "?VNM\r"), "VNM=262400\r");
}

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

/// The dialogue of the page: what is sent stands first, what comes back from the fifteenth character on,
/// a remark from the twenty-ninth.
#[test]
fn the_page_shows_what_happens() {
    let page = include_str!("../../../docs/roboteq-serial.md");
    let dialogue = page.split("```text\n").nth(1).expect("a dialogue");
    let dialogue = dialogue.split("```").next().expect("its end");
    let mut master = Master::with(vec![DriveSettings::new(id(1), &ROBOTEQ_2)]);
    let mut heard = String::new();
    let mut lines = 0;
    for line in dialogue.lines() {
        let column = |from: usize, to: usize| {
            let text = line.get(from..to.min(line.len())).unwrap_or("");
            text.trim()
        };
        let (sent, expected) = (column(0, 14), column(14, 28));
        if !sent.is_empty() {
            assert_eq!(heard, "", "before {sent}");
            send(&mut master.bus, format!("{sent}\r").as_bytes());
        }
        if sent == "?F" {
            // It says so: once it is there. Until then there is only one answer to hear.
            hear(&mut master, 10);
            master.run_ms(2000);
            send(&mut master.bus, b"?F\r");
        }
        if sent == "#" {
            hear(&mut master, 50);
        }
        if expected.is_empty() {
            master.run_ms(5);
            assert!(master.bus.take_serial().is_empty(), "{line}");
            continue;
        }
        for _ in 0..2000 {
            if heard.contains('\r') {
                break;
            }
            master.run_us(1000);
            let sent = master.bus.take_serial();
            heard.extend(sent.iter().map(|byte| char::from(byte.byte)));
        }
        let (answer, rest) = heard.split_once('\r').expect("an answer");
        // The measured speed is not the same each time.
        let rounded = answer.replace("=299", "=300").replace(":299", ":300");
        let rounded = rounded.replace("301", "300");
        assert_eq!(rounded, expected, "{line}");
        heard = rest.to_owned();
        lines += 1;
    }
    assert!(lines > 15, "{lines}");
}
