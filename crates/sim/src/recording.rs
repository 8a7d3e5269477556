//! A run written down so that it can be repeated: the recording, and beside it the causes.
//!
//! The recording (`FILE`) holds every frame, in the format that its ending tells
//! ([`bus::recording`]); a replay is compared with candump's. The run file (`FILE.run`) holds what
//! the frames follow from: seed, drives, what they had stored, and each outside frame with the
//! nanosecond at which it was handed to the bus. Its lines, of which `lose`, `duplicate` and
//! `error-frames` are there only if they change something:
//!
//! ```text
//! servobus run 1
//! seed 42
//! bit-rate 1M
//! lose 1%
//! duplicate 0.5%
//! error-frames on
//! drive 1 p3
//! flash 1 0x0000 53425331…
//! (0.020000000) client1 000#8100
//! block 1 on 0.350000000
//! wire 0.400000000 flip 12 181/7FF from any skip 0 times 1 seen-by all
//! serial 1 0.500000000 3F53570D
//! serial 1 0.600000000 hang-up
//! end 10.000000000
//! ```
//!
//! Drives without a node ID are `u1`, `u2` and so on ([`Place`]). Without its line the bit rate is
//! 1 Mbit/s. On a bus that loses or repeats frames outside frames are written down before that
//! happens to them, and what outside programs got of the drives' frames is not in the log. With
//! `error-frames on` error messages are in the log, too.
//!
//! The lines `flash` are what a drive's flash held, both sets of parameters and programs, each line
//! a stretch without erased bytes between. An earlier version wrote `stored 1 53425031…`, the newest
//! set of parameters alone; that is read, too.
//!
//! `serial` is what came over a drive's serial line, from when on it was on the wire; what the drive
//! answered is a comment.
//!
//! A scenario is there whole, its name in `scenario-file` and each of its lines behind `scenario`;
//! what it did are comments, lines that begin with `#`.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use bus::recording::{Content, Direction, Recorder};
use can::{BitRate, Frame};
use canopen::Instant;
use personalities::Personality;

use crate::disturbance::Disturbance;
use crate::error_frame::ErrorSeen;
use crate::flash::ERASED;
use crate::flash_file::FlashFile;
use crate::medium::{Sender, Traffic};
use crate::notice::{Happening, Notice, NoticeKind};
use crate::place::Place;
use crate::probe::ProbeSample;
use crate::scenario::{Problems, Scenario};
use crate::serial::SerialAct;
use crate::wire_act::WireAct;
use crate::{BusSettings, DriveSettings};

/// The name of the bus in logs.
pub(crate) const CHANNEL: &str = "can0";
pub(crate) const FIRST_LINE: &str = "servobus run 1";
/// In a run file: who was at a serial line has gone.
pub(crate) const HANG_UP: &str = "hang-up";
/// What a comment in a run file begins with.
pub(crate) const COMMENT: char = '#';

/// An outside frame and when it was handed to the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Injection {
    /// When.
    pub at: Instant,
    /// Number of the outside program.
    pub client: u32,
    /// What.
    pub frame: Frame,
}

/// What a drive had stored before the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredBefore {
    /// Whose.
    pub place: Place,
    /// The image of its flash ([`FlashFile::image`]).
    pub image: Vec<u8>,
}

/// What a run begins with.
#[derive(Clone, Debug)]
pub struct RunHeader {
    /// The seed.
    pub seed: u64,
    /// The bit rate of outside programs.
    pub bit_rate: BitRate,
    /// What was done to frames between them and the bus.
    pub disturbance: Disturbance,
    /// Whether its recording has error messages.
    pub error_frames: bool,
    /// Places and what drives are there.
    pub drives: Vec<(Place, &'static Personality)>,
    /// What they have stored.
    pub stored: Vec<StoredBefore>,
    /// What the drives' worlds are and what happens to them.
    pub scenario: Option<Scenario>,
}

impl RunHeader {
    /// The header of a run with these settings.
    pub fn of(settings: &BusSettings) -> RunHeader {
        let drives = &settings.drives;
        RunHeader {
            seed: settings.seed,
            bit_rate: settings.bit_rate,
            disturbance: settings.disturbance,
            error_frames: settings.error_frames,
            drives: drives.iter().map(|d| (d.place, d.personality)).collect(),
            stored: drives
                .iter()
                .filter(|drive| !drive.store.image().is_empty())
                .map(|drive| StoredBefore {
                    place: drive.place,
                    image: drive.store.image().to_vec(),
                })
                .collect(),
            scenario: settings.scenario.clone(),
        }
    }

    /// The settings of a bus on which the run can be repeated.
    ///
    /// # Errors
    /// [`Problems`] of the scenario.
    pub(crate) fn settings(&self) -> Result<BusSettings, Problems> {
        let drives = self.drives.iter();
        let mut settings = BusSettings {
            seed: self.seed,
            bit_rate: self.bit_rate,
            disturbance: self.disturbance,
            error_frames: self.error_frames,
            drives: drives
                .map(|&(place, personality)| DriveSettings::at(place, personality))
                .collect(),
            scenario: None,
        };
        if let Some(scenario) = &self.scenario {
            scenario.set_up(&mut settings, Instant::NEVER)?;
        }
        // What a scenario stores is here, too.
        for drive in &mut settings.drives {
            let stored = self
                .stored
                .iter()
                .find(|stored| stored.place == drive.place);
            drive.store = FlashFile::of_image(stored.map_or(&[], |stored| &stored.image));
        }
        Ok(settings)
    }
}

/// Writes a run down while it happens.
#[derive(Debug)]
pub struct Recording {
    log: Recorder,
    run: BufWriter<File>,
    frames: u64,
}

/// The name of the file with the causes of the run that `log` shows.
pub(crate) fn run_path(log: &Path) -> PathBuf {
    let mut path = log.to_owned().into_os_string();
    path.push(".run");
    PathBuf::from(path)
}

impl Recording {
    /// Begins the recording `path`, in the format that its ending tells, and its run file; existing
    /// ones are replaced.
    ///
    /// # Errors
    /// Those of the file system, and an ending that tells no format.
    pub fn create(path: &Path, header: &RunHeader) -> io::Result<Recording> {
        let log = Recorder::create(path, CHANNEL)?;
        let mut run = BufWriter::new(File::create(run_path(path))?);
        writeln!(run, "{FIRST_LINE}")?;
        writeln!(run, "seed {}", header.seed)?;
        writeln!(run, "bit-rate {}", header.bit_rate.word())?;
        if !header.disturbance.is_none() {
            writeln!(run, "lose {}", header.disturbance.lose)?;
            writeln!(run, "duplicate {}", header.disturbance.duplicate)?;
        }
        if header.error_frames {
            writeln!(run, "error-frames on")?;
        }
        for (place, personality) in &header.drives {
            writeln!(run, "drive {place} {}", personality.name)?;
        }
        for stored in &header.stored {
            for (at, bytes) in written_pieces(&stored.image) {
                let hex = hex(bytes);
                writeln!(run, "flash {} {at:#06X} {hex}", stored.place)?;
            }
        }
        if let Some(scenario) = &header.scenario {
            let file = scenario.file().replace(['\n', '\r'], " ");
            writeln!(run, "scenario-file {file}")?;
            for line in scenario.text().lines() {
                writeln!(run, "scenario {line}")?;
            }
        }
        Ok(Recording {
            log,
            run,
            frames: 0,
        })
    }

    /// A frame went over the bus.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn frame(&mut self, traffic: &Traffic) -> io::Result<()> {
        self.frames += 1;
        write_frame(&mut self.log, traffic)
    }

    /// There is something that people should know of. What a scenario does is a comment of the run
    /// file, too.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn notice(&mut self, notice: &Notice) -> io::Result<()> {
        if let NoticeKind::Scenario(_) = notice.kind {
            writeln!(self.run, "{COMMENT} {notice}")?;
        }
        write_notice(&mut self.log, notice)
    }

    /// Any of them.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn happening(&mut self, happening: &Happening) -> io::Result<()> {
        match happening {
            Happening::Frame(traffic) => self.frame(traffic),
            Happening::Notice(notice) => self.notice(notice),
            Happening::Error(error) => write_error(&mut self.log, error),
        }
    }

    /// Whether samples are kept ([`Recording::sample`]): so in MCAP only.
    pub fn takes_samples(&self) -> bool {
        self.log.takes_signals()
    }

    /// What a probe saw, as signals of `drive/PLACE`, and of `drive/PLACE/2` and so on of further axes.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn sample(&mut self, sample: &ProbeSample) -> io::Result<()> {
        let values = [
            ("position_turns", sample.position_turns),
            ("speed_rad_s", f64::from(sample.speed_rad_s)),
            ("current_a", f64::from(sample.current_a)),
            ("demand_counts", f64::from(sample.demand_counts)),
            ("position_counts", f64::from(sample.position_counts)),
        ];
        let source = match sample.axis {
            0 => format!("drive/{}", sample.place),
            further => format!("drive/{}/{}", sample.place, further + 1),
        };
        self.log.signals(sample.at.0, &source, &values)
    }

    /// An outside frame was handed to the bus.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn injection(&mut self, injection: &Injection) -> io::Result<()> {
        let Injection { at, client, frame } = injection;
        writeln!(self.run, "({}) client{client} {frame}", seconds(*at))
    }

    /// A shaft was blocked or set free.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn block(&mut self, at: Instant, place: Place, blocked: bool) -> io::Result<()> {
        let state = if blocked { "on" } else { "off" };
        writeln!(self.run, "block {place} {state} {}", seconds(at))
    }

    /// Something was done to the wire ([`crate::Bus::act`]).
    ///
    /// # Errors
    /// Those of the file system.
    pub fn act(&mut self, at: Instant, act: &WireAct) -> io::Result<()> {
        writeln!(self.run, "wire {} {act}", seconds(at))
    }

    /// Something happened at the outer end of a drive's serial line ([`crate::Bus::act_on_serial`]).
    ///
    /// # Errors
    /// Those of the file system.
    pub fn serial(&mut self, at: Instant, place: Place, act: &SerialAct) -> io::Result<()> {
        let what = match act {
            SerialAct::Bytes(bytes) => hex(bytes),
            SerialAct::HangUp => HANG_UP.to_owned(),
        };
        writeln!(self.run, "serial {place} {} {what}", seconds(at))
    }

    /// A drive has sent a line over its serial line: a comment of the run file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn serial_answer(&mut self, at: Instant, place: Place, line: &[u8]) -> io::Result<()> {
        let line = line.escape_ascii();
        writeln!(
            self.run,
            "{COMMENT} serial {place} {} answers {line}",
            seconds(at)
        )
    }

    /// Ends the recording at the time that the run has reached. Returns the frames in the log.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn finish(mut self, at: Instant) -> io::Result<u64> {
        writeln!(self.run, "end {}", seconds(at))?;
        self.run.flush()?;
        self.log.finish(at.0)?;
        Ok(self.frames)
    }

    /// Writes what is waiting to the files.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&mut self) -> io::Result<()> {
        self.run.flush()?;
        self.log.flush()
    }
}

/// Begins a recording of frames alone, without a run file: what a replay gives, in any format.
///
/// # Errors
/// Those of the file system, and an ending that tells no format.
pub fn begin_frames(path: &Path) -> io::Result<Recorder> {
    Recorder::create(path, CHANNEL)
}

/// Writes an error message.
///
/// # Errors
/// Those of the file system.
pub fn write_error(log: &mut Recorder, error: &ErrorSeen) -> io::Result<()> {
    log.write(error.at.0, &error.content(), Some(Direction::Received))
}

/// Writes a frame that went over the bus.
///
/// # Errors
/// Those of the file system.
pub fn write_frame(log: &mut Recorder, traffic: &Traffic) -> io::Result<()> {
    // Seen from the simulation, which its drives belong to.
    let direction = match traffic.sender {
        Sender::Drive(_) => Direction::Sent,
        Sender::Outside(_) | Sender::Stranger => Direction::Received,
    };
    let content = Content::Frame(traffic.frame);
    log.write(traffic.at.0, &content, Some(direction))
}

/// Writes what people should know of.
///
/// # Errors
/// Those of the file system.
pub fn write_notice(log: &mut Recorder, notice: &Notice) -> io::Result<()> {
    log.note(notice.at.0, &notice.to_string())
}

/// The stretches of an image that are not erased, and where they begin. Fewer erased bytes than a line
/// of their own would take do not end one.
fn written_pieces(image: &[u8]) -> Vec<(usize, &[u8])> {
    const GAP: usize = 16;
    let mut pieces: Vec<std::ops::Range<usize>> = Vec::new();
    for (at, _) in image.iter().enumerate().filter(|(_, b)| **b != ERASED) {
        match pieces.last_mut() {
            Some(piece) if at - piece.end < GAP => piece.end = at + 1,
            _ => pieces.push(at..at + 1),
        }
    }
    let pieces = pieces.into_iter();
    pieces.map(|piece| (piece.start, &image[piece])).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut hex, byte| {
        let _ = write!(hex, "{byte:02X}");
        hex
    })
}

fn seconds(at: Instant) -> String {
    format!("{}.{:09}", at.0 / 1_000_000_000, at.0 % 1_000_000_000)
}
