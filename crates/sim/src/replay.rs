//! A recorded run, read from its run file and repeated.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use bus::recording::Content;
use bus::recording::candump::{self, Reader, write_content, write_line};
use can::{BitRate, Frame, UnknownBitRate};
use canopen::Instant;

use crate::Bus;
use crate::disturbance::{Disturbance, NoShare, Share};
use crate::flash::ERASED;
use crate::flash_file::{CAPACITY, FlashFile};
use crate::notice::Happening;
use crate::place::{NoPlace, Place};
use crate::recording::{CHANNEL, COMMENT, FIRST_LINE, HANG_UP, RunHeader, StoredBefore, run_path};
use crate::scenario::{Problems, Scenario};
use crate::serial::SerialAct;
use crate::wire_act::{NoWireAct, WireAct};

/// Something that happens to a run from outside.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Cause {
    Frame { client: u32, frame: Frame },
    Block { place: Place, blocked: bool },
    Wire(WireAct),
    Serial { place: Place, act: SerialAct },
    End,
}

/// Why a recorded run cannot be repeated.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// A file cannot be read.
    #[error("{}: {source}{hint}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
        /// What to do about it.
        hint: &'static str,
    },
    /// A line makes no sense.
    #[error("{}:{line}:{column}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// What is wrong there, and what is expected.
        what: String,
    },
    /// The scenario in it cannot be played.
    #[error("{}: the scenario that it holds: {problems}", path.display())]
    Scenario {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problems: Problems,
    },
    /// What was read cannot be written on.
    #[error("cannot write the replayed log: {0}")]
    Write(io::Error),
}

/// A run as it was recorded.
#[derive(Debug)]
struct Run {
    header: RunHeader,
    causes: Vec<(Instant, Cause)>,
}

/// What a replay was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replayed {
    /// Frames written.
    pub frames: u64,
    /// Where the run ended.
    pub end: Instant,
    /// The run file has no end mark: the recording was cut off, and so is the replay, after the
    /// last outside frame that it holds.
    pub cut_off: bool,
}

/// Runs again what led to the log `path`, and writes the log that comes of it to `output`.
///
/// # Errors
/// [`ReadError`].
pub fn replay(path: &Path, output: &mut impl Write) -> Result<Replayed, ReadError> {
    let replayed = replay_each(path, &mut |happening| match happening {
        Happening::Frame(traffic) => write_line(output, traffic.at.0, CHANNEL, &traffic.frame),
        Happening::Error(error) => write_content(output, error.at.0, CHANNEL, &error.content()),
        Happening::Notice(_) => Ok(()),
    })?;
    output.flush().map_err(ReadError::Write)?;
    Ok(replayed)
}

/// Runs again what led to the recording `path`, of whatever format, and gives each frame and each
/// notice that comes of it to `each`.
///
/// # Errors
/// [`ReadError`]; an error of `each` is [`ReadError::Write`].
pub fn replay_each(
    path: &Path,
    each: &mut impl FnMut(Happening) -> io::Result<()>,
) -> Result<Replayed, ReadError> {
    let path = run_path(path);
    let run = read_run(&path)?;
    let settings = run.header.settings();
    let settings = settings.map_err(|problems| ReadError::Scenario { path, problems })?;
    let mut bus = Bus::new(settings);
    let mut replayed = Replayed {
        frames: 0,
        end: Instant::ZERO,
        cut_off: true,
    };
    for (at, cause) in run.causes {
        bus.run_until(at);
        replayed.end = at;
        for happening in bus.take_happenings() {
            replayed.frames += u64::from(matches!(happening, Happening::Frame(_)));
            each(happening).map_err(ReadError::Write)?;
        }
        match cause {
            Cause::Frame { client, frame } => {
                bus.send(client, frame);
            }
            Cause::Block { place, blocked } => {
                if let Some(drive) = bus.drive_at(place) {
                    drive.plant().set_blocked(blocked);
                }
            }
            // That its drives are there was looked at when it was read.
            Cause::Wire(act) => drop(bus.act(act)),
            Cause::Serial { place, act } => bus.act_on_serial(place, &act),
            Cause::End => replayed.cut_off = false,
        }
    }
    Ok(replayed)
}

fn read_run(path: &Path) -> Result<Run, ReadError> {
    let fail = |source: io::Error| {
        let hint = match source.kind() {
            io::ErrorKind::NotFound => {
                "; a log is replayed from the .run file that --record writes beside it: keep the \
                 two together"
            }
            _ => "",
        };
        ReadError::Read {
            path: path.to_owned(),
            source,
            hint,
        }
    };
    let mut input = BufReader::new(File::open(path).map_err(fail)?);
    let mut run = Run {
        header: RunHeader {
            seed: 0,
            bit_rate: BitRate::Mbit1,
            disturbance: Disturbance::default(),
            error_frames: false,
            drives: Vec::new(),
            stored: Vec::new(),
            scenario: None,
        },
        causes: Vec::new(),
    };
    let mut scenario: Option<(String, String)> = None;
    let mut lines = 0;
    let mut line = Vec::new();
    loop {
        line.clear();
        input.read_until(b'\n', &mut line).map_err(fail)?;
        // A line without its end was being written when the recording was cut off.
        let Some(line) = line.strip_suffix(b"\n") else {
            break;
        };
        let wrong = |column: usize, what: String| ReadError::Line {
            path: path.to_owned(),
            line: lines + 1,
            column,
            what,
        };
        let line = std::str::from_utf8(line)
            .map_err(|error| wrong(error.valid_up_to() + 1, "this is not text".to_owned()))?;
        if lines == 0 {
            if line != FIRST_LINE {
                let what = format!("a run file begins with '{FIRST_LINE}'");
                return Err(wrong(1, what));
            }
        } else if let Some(name) = line.strip_prefix("scenario-file ") {
            scenario = Some((name.to_owned(), String::new()));
        } else if let Some(text) = scenario_line(line) {
            let Some((_, whole)) = &mut scenario else {
                return Err(wrong(
                    1,
                    "the line 'scenario-file NAME' is missing".to_owned(),
                ));
            };
            whole.push_str(text);
            whole.push('\n');
        } else if !line.is_empty() && !line.starts_with(COMMENT) {
            read_line(&mut run, line).map_err(|(column, what)| wrong(column, what))?;
        }
        lines += 1;
    }
    if lines == 0 || run.header.drives.is_empty() {
        return Err(ReadError::Line {
            path: path.to_owned(),
            line: lines.max(1),
            column: 1,
            what: format!("a run file begins with '{FIRST_LINE}' and names its drives"),
        });
    }
    if let Some((file, text)) = scenario {
        let read = Scenario::read(&file, &text);
        run.header.scenario = Some(read.map_err(|problems| ReadError::Scenario {
            path: path.to_owned(),
            problems,
        })?);
    }
    Ok(run)
}

/// A line of the scenario; an empty one may have lost its space.
fn scenario_line(line: &str) -> Option<&str> {
    match line {
        "scenario" => Some(""),
        _ => line.strip_prefix("scenario "),
    }
}

/// What is wrong, and at which column.
type Wrong = (usize, String);

fn read_line(run: &mut Run, line: &str) -> Result<(), Wrong> {
    if line.starts_with('(') {
        return read_injection(run, line);
    }
    let mut words = Words { line, at: 0 };
    let (_, keyword) = words.next("a keyword")?;
    match keyword {
        "seed" => run.header.seed = words.number("the seed")?,
        "bit-rate" => {
            let (column, rate) = words.next("a bit rate")?;
            let rate: Result<BitRate, UnknownBitRate> = rate.parse();
            run.header.bit_rate = rate.map_err(|error| (column, error.to_string()))?;
        }
        "lose" => run.header.disturbance.lose = words.share()?,
        "duplicate" => run.header.disturbance.duplicate = words.share()?,
        "drive" => {
            let at = words.at;
            let place = words.place()?;
            if run.header.drives.iter().any(|(other, _)| *other == place) {
                return Err((at + 2, format!("drive {place} is there twice")));
            }
            let (column, name) = words.next("the kind of drive")?;
            let personality = personalities::by_name(name)
                .ok_or_else(|| (column, format!("no drive is called '{name}'")))?;
            run.header.drives.push((place, personality));
        }
        "stored" => {
            let place = words.place()?;
            let (column, hex) = words.next("the stored bytes")?;
            let bytes = bytes_of(column, hex)?;
            // From a version that wrote down the newest set alone.
            let memory = FlashFile::memory(bytes);
            if memory.image().is_empty() && !memory.bytes().is_empty() {
                let what = format!("a drive stores no more than {} bytes", memory.capacity());
                return Err((column, what));
            }
            let image = memory.image().to_vec();
            run.header.stored.push(StoredBefore { place, image });
        }
        "flash" => {
            let place = words.place()?;
            let (at_column, at) = words.next("an address")?;
            let (column, hex) = words.next("the bytes there")?;
            let at = at.strip_prefix("0x");
            let at = at.and_then(|at| usize::from_str_radix(at, 16).ok());
            let at = at.ok_or_else(|| {
                let what = "an address is expected, like 0x4000";
                (at_column, what.to_owned())
            })?;
            let bytes = bytes_of(column, hex)?;
            let fits = at
                .checked_add(bytes.len())
                .is_some_and(|end| end <= CAPACITY);
            if !fits {
                let what = format!("a drive's flash has {CAPACITY} bytes");
                return Err((at_column, what));
            }
            let stored = &mut run.header.stored;
            let known = stored.iter().position(|stored| stored.place == place);
            let n = known.unwrap_or(stored.len());
            if known.is_none() {
                let image = Vec::new();
                stored.push(StoredBefore { place, image });
            }
            let image = &mut stored[n].image;
            if image.len() < at + bytes.len() {
                image.resize(at + bytes.len(), ERASED);
            }
            image[at..at + bytes.len()].copy_from_slice(&bytes);
        }
        "error-frames" => match words.next("on")? {
            (_, "on") => run.header.error_frames = true,
            (column, _) => return Err((column, "on is expected".to_owned())),
        },
        "block" => {
            let place = words.place()?;
            let (column, state) = words.next("on or off")?;
            let blocked = match state {
                "on" => true,
                "off" => false,
                _ => return Err((column, "on or off is expected".to_owned())),
            };
            let at = words.time()?;
            push(run, at, Cause::Block { place, blocked })?;
        }
        "wire" => {
            let at = words.time()?;
            let (begin, act) = words.rest();
            let act: WireAct = act
                .parse()
                .map_err(|error: NoWireAct| (begin + error.at, error.to_string()))?;
            let places: Vec<Place> = run.header.drives.iter().map(|(place, _)| *place).collect();
            act.check_drives(&places)
                .map_err(|error| (begin, error.to_string()))?;
            push(run, at, Cause::Wire(act))?;
        }
        "serial" => {
            let at = words.at;
            let place = words.place()?;
            let known = run.header.drives.iter().find(|(other, _)| *other == place);
            if known.is_none_or(|(_, personality)| personality.serial.is_none()) {
                let what = format!("there is no drive {place} that has a serial line");
                return Err((at + 2, what));
            }
            let at = words.time()?;
            let (column, what) = words.next("bytes or hang-up")?;
            let act = match what {
                HANG_UP => SerialAct::HangUp,
                hex => SerialAct::Bytes(bytes_of(column, hex)?),
            };
            push(run, at, Cause::Serial { place, act })?;
        }
        "end" => {
            let at = words.time()?;
            push(run, at, Cause::End)?;
        }
        _ => {
            let what = format!(
                "'{keyword}' is no keyword of a run file: seed, bit-rate, lose, duplicate, error-frames, drive, \
                 flash, stored, scenario-file, scenario, block, wire, serial, end, or a frame \
                 '(seconds) client1 181#00'"
            );
            return Err((1, what));
        }
    }
    words.nothing_more()
}

fn read_injection(run: &mut Run, line: &str) -> Result<(), Wrong> {
    let record = match Reader::new(line.as_bytes()).next() {
        Some(Ok(record)) => record,
        Some(Err(candump::ReadError::Line { column, wrong, .. })) => {
            return Err((column, wrong.to_string()));
        }
        _ => return Err((1, "a frame is expected".to_owned())),
    };
    let client = record
        .channel
        .strip_prefix("client")
        .and_then(|n| n.parse().ok());
    let (Some(client), Content::Frame(frame)) = (client, record.content) else {
        let what =
            "a frame of an outside program is expected, like '(0.500000000) client1 000#8100'";
        return Err((1, what.to_owned()));
    };
    push(
        run,
        Instant(record.stamp_ns),
        Cause::Frame { client, frame },
    )
}

fn push(run: &mut Run, at: Instant, cause: Cause) -> Result<(), Wrong> {
    if run.causes.last().is_some_and(|(last, _)| *last > at) {
        return Err((1, "this is earlier than the line before".to_owned()));
    }
    run.causes.push((at, cause));
    Ok(())
}

fn bytes_of(column: usize, hex: &str) -> Result<Vec<u8>, Wrong> {
    from_hex(hex).ok_or_else(|| {
        let what = "pairs of hexadecimal digits are expected";
        (column, what.to_owned())
    })
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits = text.as_bytes();
    if !digits.len().is_multiple_of(2) {
        return None;
    }
    digits
        .chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok())
        .collect()
}

/// The words of a line and where they begin.
struct Words<'a> {
    line: &'a str,
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self, what: &str) -> Result<(usize, &'a str), Wrong> {
        let rest = &self.line[self.at..];
        let start = self.at + (rest.len() - rest.trim_start_matches(' ').len());
        let word = self.line[start..].split(' ').next().unwrap_or("");
        self.at = start + word.len();
        if word.is_empty() {
            return Err((start + 1, format!("{what} is expected here")));
        }
        Ok((start + 1, word))
    }

    fn number(&mut self, what: &str) -> Result<u64, Wrong> {
        let (column, word) = self.next(what)?;
        word.parse()
            .map_err(|_| (column, format!("{what} is expected, a whole number")))
    }

    fn place(&mut self) -> Result<Place, Wrong> {
        let (column, word) = self.next("a node ID")?;
        word.parse()
            .map_err(|error: NoPlace| (column, error.to_string()))
    }

    fn share(&mut self) -> Result<Share, Wrong> {
        let (column, word) = self.next("a share of the frames")?;
        word.parse()
            .map_err(|error: NoShare| (column, error.to_string()))
    }

    fn time(&mut self) -> Result<Instant, Wrong> {
        let (column, word) = self.next("a time in seconds")?;
        let read = || {
            let (whole, fraction) = word.split_once('.')?;
            let whole: u64 = whole.parse().ok()?;
            let fraction: u64 = (fraction.len() == 9).then(|| fraction.parse().ok())??;
            Some(Instant(
                whole.checked_mul(1_000_000_000)?.checked_add(fraction)?,
            ))
        };
        read().ok_or_else(|| {
            let what = "a time in seconds with nine digits is expected, like 0.020000000";
            (column, what.to_owned())
        })
    }

    /// All that is left, and where it begins.
    fn rest(&mut self) -> (usize, &str) {
        let rest = &self.line[self.at..];
        let text = rest.trim_start_matches(' ');
        let begin = self.at + rest.len() - text.len();
        self.at = self.line.len();
        (begin + 1, text)
    }

    fn nothing_more(&mut self) -> Result<(), Wrong> {
        let rest = self.line[self.at..].trim_start_matches(' ');
        if rest.is_empty() {
            return Ok(());
        }
        Err((
            self.at + 2,
            format!("nothing is expected here, found '{rest}'"),
        ))
    }
}
