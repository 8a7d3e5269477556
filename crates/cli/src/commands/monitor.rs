//! `servobus monitor`: a live trace in words.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant as RealTime};

use bus::Connection;
use bus::recording::{Content, Direction, Recorder};
use canopen::{Instant, NodeId};
use client::Client;
use client::decode::Decoder;
use client::scan::Scan;
use personalities::Personality;
use tokio::time::timeout;

use super::stop::Stop;
use crate::named_drives::{self, NamedDrives};
use crate::wire::{WireArguments, WireLink, tell_reports};
use crate::{Failure, drive_kind, identify, output, record_file, time_span};

/// Print the frames of a bus and what they mean, until Ctrl-C or for some time.
///
/// Down to the bits of controlword and statusword, abort codes and emergencies. The contents of
/// PDOs are known from when their mapping passes by. Names and units are those of --drive, --ask or
/// --node, else the standard's. What a simulation's scenario does stands between
/// the frames, in lines that begin with `#`. Times are seconds on the bus's own clock if it
/// has one, else since the connection.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus monitor                                    sends nothing; the standard's names
  servobus monitor --ask                              asks the nodes first which drives they are
  servobus monitor --for 10s --json > trace.jsonl     one JSON object on each line
  servobus monitor --bus socketcan://can0 --record bench.pcapng
  servobus monitor --drive p3                         all are this drive
  servobus monitor --node 1-2=p3 --node 3=md80        a bus with different drives
  servobus monitor --bus slcan://127.0.0.1:29537 | grep emergency")]
pub(crate) struct Arguments {
    #[command(flatten)]
    wire: WireArguments,
    /// Whose dictionary gives names, types and units; `servobus od NAME` lists it [default: the
    /// standard's, without units]
    #[arg(long, value_name = "NAME", value_parser = drive_kind::parse)]
    drive: Option<&'static Personality>,
    /// Ask every node first which drive it is, by SDO: not beside a master that is at work.
    #[arg(long)]
    ask: bool,
    /// Which drive is at these nodes, as in 4=md80; may be given several times.
    #[arg(long, value_name = "ID=NAME", allow_hyphen_values = true)]
    node: Vec<NamedDrives>,
    /// End after this (real) time, as in 10s, 500ms or 2m.
    #[arg(long = "for", value_name = "TIME", allow_hyphen_values = true, value_parser = time_span::parse)]
    time: Option<Duration>,
    /// Write all frames to FILE, which ends in .log (candump), .pcapng (Wireshark) or .mcap
    /// (Foxglove). An existing file is replaced.
    #[arg(long, value_name = "FILE", value_parser = record_file::parse)]
    record: Option<PathBuf>,
    /// Print JSON, one object on each line.
    #[arg(long)]
    json: bool,
}

/// How often to look whether the user wants an end.
const LOOK: Duration = Duration::from_millis(50);

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if it is lost.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let named = named_drives::all(&arguments.node)?;
    let stop = Stop::watch()?;
    arguments.wire.run(async |mut connection| {
        let mut log = match &arguments.record {
            Some(path) => Some(Log::create(path, connection.endpoint().channel())?),
            None => None,
        };
        let mut drives = Vec::new();
        if arguments.ask {
            (connection, drives) = who_is_there(connection).await?;
        }
        let words = arguments.drive.map(drive_kind::words).unwrap_or_default();
        let mut decoder = Decoder::with_words(words);
        for (node, drive) in drives.iter().chain(&named) {
            decoder.set_drive(*node, drive_kind::words(drive));
        }
        let began = RealTime::now();
        connection
            .ask_notes()
            .await
            .map_err(Failure::unsuccessful)?;
        while !stop.asked() {
            let left = match arguments.time {
                Some(time) => time.saturating_sub(began.elapsed()),
                None => LOOK,
            };
            if left.is_zero() {
                break;
            }
            let received = timeout(left.min(LOOK), connection.receive()).await;
            for report in tell_reports(&mut connection) {
                if let Some(log) = &mut log {
                    log.write(report.stamp_ns, &Content::Error(report.error))?;
                }
            }
            if let Some(log) = &mut log {
                log.flush()?;
            }
            for note in connection.take_notes() {
                if let Some(log) = &mut log {
                    log.note(note.stamp_ns, &note.text)?;
                }
                if arguments.json {
                    let line = serde_json::json!({ "time_ns": note.stamp_ns, "note": note.text });
                    output::print_json_line(&line)?;
                } else {
                    output::print(format_args!("# {}", note.text))?;
                }
            }
            let Ok(received) = received else {
                continue;
            };
            let received = received.map_err(Failure::unsuccessful)?;
            let elapsed = || u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX);
            let at = Instant(received.stamp_ns.unwrap_or_else(elapsed));
            if let Some(log) = &mut log {
                log.write(at.0, &Content::Frame(received.frame))?;
            }
            let decoded = decoder.decode(at, &received.frame);
            if arguments.json {
                output::print_json_line(&decoded)?;
            } else {
                output::print(&decoded)?;
            }
        }
        if let Some(log) = log {
            log.finish()?;
        }
        Ok(ExitCode::SUCCESS)
    })
}

/// Asks every node which drive it is. What passes meanwhile is not shown.
///
/// # Errors
/// The bus was lost.
async fn who_is_there(
    connection: Connection,
) -> Result<(Connection, Vec<(NodeId, &'static Personality)>), Failure> {
    let mut client = Client::new(WireLink::new(connection));
    let mut drives = Vec::new();
    let scanned = client.scan(&Scan::default()).await;
    for found in scanned.map_err(Failure::unsuccessful)? {
        let drive = identify::found(&mut client, &found).await;
        let drive = drive.map_err(Failure::unsuccessful)?;
        match (NodeId::new(found.node), drive) {
            (Some(node), Some(drive)) => drives.push((node, drive)),
            _ => output::tell(format_args!(
                "node {} is no drive that is known here",
                found.node
            )),
        }
    }
    Ok((client.into_link().into_connection(), drives))
}

/// How often what was recorded is written to the file.
const FLUSH: Duration = Duration::from_millis(500);

/// A recording, its place, and how far it has come.
struct Log<'a> {
    path: &'a Path,
    recorder: Recorder,
    last_ns: u64,
    flushed: RealTime,
}

impl<'a> Log<'a> {
    fn create(path: &'a Path, channel: &str) -> Result<Log<'a>, Failure> {
        let recorder = Recorder::create(path, channel).map_err(|error| {
            Failure::input(format!(
                "{}: cannot record there: {error}; name another file with --record",
                path.display()
            ))
        })?;
        Ok(Log {
            path,
            recorder,
            last_ns: 0,
            flushed: RealTime::now(),
        })
    }

    fn write(&mut self, stamp_ns: u64, content: &Content) -> Result<(), Failure> {
        self.last_ns = stamp_ns;
        let received = Some(Direction::Received);
        let written = self.recorder.write(stamp_ns, content, received);
        written.map_err(|error| lost(self.path, &error))
    }

    fn note(&mut self, stamp_ns: u64, text: &str) -> Result<(), Failure> {
        let noted = self.recorder.note(stamp_ns, text);
        noted.map_err(|error| lost(self.path, &error))
    }

    /// Now and then.
    fn flush(&mut self) -> Result<(), Failure> {
        if self.flushed.elapsed() < FLUSH {
            return Ok(());
        }
        self.flushed = RealTime::now();
        let flushed = self.recorder.flush();
        flushed.map_err(|error| lost(self.path, &error))
    }

    fn finish(self) -> Result<(), Failure> {
        let finished = self.recorder.finish(self.last_ns);
        finished.map_err(|error| lost(self.path, &error))
    }
}

fn lost(path: &Path, error: &io::Error) -> Failure {
    Failure::input(format!(
        "{}: cannot record any more: {error}",
        path.display()
    ))
}
