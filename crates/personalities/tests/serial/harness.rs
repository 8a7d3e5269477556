//! A drive's objects as a map, and a command line before it.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "shared with the fuzz target, which uses a part"
)]

use std::collections::BTreeMap;

use canopen::{Abort, Address, Instant};
use personalities::roboteq::command_line::COMMANDS;
use personalities::serial::{Action, CommandLine, Object, Objects, Of};

/// Objects in a map: what is not there is no object.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Model {
    pub values: BTreeMap<(u16, u8), i64>,
    /// What is refused, and how.
    pub refuses: BTreeMap<(u16, u8), u32>,
    /// How often a store was asked for.
    pub stores: u32,
    pub cannot_store: bool,
}

impl Model {
    /// One with every object that the table of commands names, for so many channels.
    pub fn new(channels: u8) -> Model {
        let mut model = Model::default();
        let mut add = |object: Object, of: Of| {
            let (channels, steps) = match of {
                Of::Drive | Of::Order => (1, 1),
                Of::Elements(count) => (1, count),
                Of::Channel => (channels, 1),
                Of::Pair => (channels, 2),
            };
            for channel in 0..channels {
                for step in 0..steps {
                    let at = object.at(channel, step);
                    model.values.insert((at.index, at.sub), 0);
                }
            }
        };
        for command in COMMANDS {
            match command.action {
                Action::Read(object) | Action::Write(object) => add(object, command.of),
                Action::Echo | Action::Store => {}
            }
        }
        model
    }

    pub fn set(&mut self, index: u16, sub: u8, value: i64) {
        *self.values.get_mut(&(index, sub)).expect("an object") = value;
    }

    pub fn get(&self, index: u16, sub: u8) -> i64 {
        self.values[&(index, sub)]
    }
}

impl Objects for Model {
    fn read(&mut self, object: Address) -> Result<i64, Abort> {
        let value = self.values.get(&(object.index, object.sub));
        value.copied().ok_or(Abort::NO_OBJECT)
    }

    fn write(&mut self, object: Address, value: i64) -> Result<(), Abort> {
        let key = (object.index, object.sub);
        if let Some(code) = self.refuses.get(&key) {
            return Err(Abort(*code));
        }
        *self.values.get_mut(&key).ok_or(Abort::NO_OBJECT)? = value;
        Ok(())
    }

    fn store(&mut self) -> Result<(), Abort> {
        if self.cannot_store {
            return Err(Abort::DEVICE_STATE);
        }
        self.stores += 1;
        Ok(())
    }
}

/// A command line, its drive, and its time.
#[derive(Debug)]
pub struct Bench {
    pub line: CommandLine,
    pub drive: Model,
    pub now: Instant,
}

impl Bench {
    pub fn new(channels: u8) -> Bench {
        Bench {
            line: CommandLine::new(COMMANDS, channels),
            drive: Model::new(channels),
            now: Instant(1_000_000),
        }
    }

    /// One that does not send back what it gets.
    pub fn quiet(channels: u8) -> Bench {
        let mut bench = Bench::new(channels);
        assert_eq!(bench.say(b"^ECHOF 1\r"), "^ECHOF 1\r+\r");
        bench
    }

    /// Sends bytes as fast as they are taken; what comes back, in full.
    pub fn say(&mut self, bytes: &[u8]) -> String {
        let mut answer = Vec::new();
        for byte in bytes {
            self.line.receive(*byte, self.now, &mut self.drive);
            while let Some(byte) = self.line.transmit() {
                answer.push(byte);
            }
        }
        String::from_utf8(answer).expect("answers are text")
    }

    /// So many milliseconds, one by one; what comes by itself.
    pub fn pass_ms(&mut self, ms: u64) -> String {
        let mut answer = Vec::new();
        for _ in 0..ms {
            self.now = self.now.plus_ms(1);
            if self.now >= self.line.next_deadline() {
                self.line.poll(self.now, &mut self.drive);
            }
            while let Some(byte) = self.line.transmit() {
                answer.push(byte);
            }
        }
        String::from_utf8(answer).expect("answers are text")
    }
}

/// What a fuzzer's bytes do: the first says how many channels there are; then 0x80 and above are acts
/// of time, of the other end and of storing, every other byte comes over the line as it is, and 0x7F
/// lets the next one come over it, whichever it is.
///
/// Checked: nothing panics; what is sent is text; a line is answered at most once, so answers are no
/// more than lines and repetitions; an answer is whole; without a write nothing in the drive changes.
pub fn run(input: &[u8]) {
    let Some((first, input)) = input.split_first() else {
        return;
    };
    let mut bench = Bench::new(first % 3 + 1);
    for (value, place) in (1..).zip(bench.drive.values.values_mut()) {
        *place = value;
    }
    if first & 4 != 0 {
        bench
            .drive
            .refuses
            .insert((0x6040, 0), Abort::DEVICE_STATE.0);
    }
    let mut lines = 0_u64;
    let mut polls = 0_u64;
    let mut stored = 0_u64;
    let mut enquiries = 0_u64;
    let mut sent = Vec::new();
    let mut bytes = input.iter();
    while let Some(byte) = bytes.next() {
        let before = bench.drive.clone();
        let literal = *byte == 0x7F;
        match *byte {
            0x80..=0x9F => {
                let ms = u64::from(byte & 0x1F) * u64::from(byte & 0x1F);
                bench.now = bench.now.plus_ms(ms);
                if bench.now >= bench.line.next_deadline() {
                    polls += 1;
                }
                bench.line.poll(bench.now, &mut bench.drive);
                assert!(bench.line.next_deadline() > bench.now);
                assert_eq!(bench.drive, before, "time writes nothing");
            }
            0xA0..=0xAF => {
                bench.line.stored(byte & 1 != 0);
                stored += 1;
            }
            0xB0..=0xB7 => {
                bench.line.hang_up();
                assert!(bench.line.is_silent() && bench.line.is_ready());
                assert_eq!(bench.line.next_deadline(), Instant::NEVER);
                sent.clear();
                (lines, polls, stored, enquiries) = (0, 0, 0, 0);
            }
            // Only some of what waits is sent before the next byte.
            0xB8..=0xBF => {
                for _ in 0..byte & 7 {
                    sent.extend(bench.line.transmit());
                }
            }
            0xC0..=0xFF => {
                while let Some(byte) = bench.line.transmit() {
                    sent.push(byte);
                }
            }
            _ => {
                let byte = if literal {
                    bytes.next().copied().unwrap_or(0)
                } else {
                    *byte
                };
                if !bench.line.is_ready() {
                    bench.line.receive(byte, bench.now, &mut bench.drive);
                    assert_eq!(
                        bench.drive, before,
                        "nothing is taken while it is not ready"
                    );
                    continue;
                }
                bench.line.receive(byte, bench.now, &mut bench.drive);
                if matches!(byte, b'\r' | b'_') {
                    lines += 1;
                } else {
                    enquiries += u64::from(byte == 0x05);
                    assert_eq!(bench.drive, before, "only a whole line writes");
                }
            }
        }
    }
    while let Some(byte) = bench.line.transmit() {
        sent.push(byte);
    }
    assert!(
        sent.iter()
            .all(|byte| matches!(byte, b'\r' | 0x06 | b' '..=b'~'))
    );
    let acknowledged = sent.iter().filter(|byte| **byte == 0x06).count() as u64;
    assert!(acknowledged <= enquiries, "{acknowledged} {enquiries}");
    // Echoes of line ends, and an answer each.
    let ends = sent.iter().filter(|byte| **byte == b'\r').count() as u64;
    assert!(ends <= 2 * lines + polls + stored, "{ends} {lines} {polls}");
    // It is as usable as before.
    bench.line.stored(false);
    while bench.line.transmit().is_some() {}
    bench.line.hang_up();
    bench.say(b"\r^ECHOF 1\r");
    bench.drive.set(0x30F1, 0, 1);
    assert_eq!(bench.say(b"~FSA\r"), "FSA=1\r");
}
