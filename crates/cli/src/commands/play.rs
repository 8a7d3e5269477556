//! `servobus play`: plays transcripts against drives, virtual or not.

use std::path::PathBuf;
use std::process::ExitCode;

use bus::Endpoint;
use canopen::NodeId;
use client::block_on;
use client::transcript::{Options, Report, Transcript, WithoutPhysics, play};
use personalities::Personality;
use sim::{Bus, BusSettings, DriveSettings};

use crate::plant_bench::PlantBench;
use crate::wire::{self, WireLink};
use crate::{Failure, drive_kind, output};

/// Play transcripts: bus dialogues with expected answers.
///
/// Against virtual drives (--virtual) in simulated time, each transcript on a bus of its own with the
/// drives that its head names; or against the bus at an endpoint (--bus) in real time, one after the
/// other. A real drive's motor cannot be looked at; assertions about it are reported as not checked.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus play --virtual transcripts/p3/*.txt
  servobus play --virtual transcripts/mixed/*.txt                 different drives on one bus
  servobus play --bus socketcand://127.0.0.1:29536 transcripts/p3/enumerate.txt
  servobus play --virtual --json transcripts/p3/modes.txt

Exit code 1 if a transcript fails, 2 if one cannot be read; then none is played. The notation is
described in docs/transcripts.md.")]
#[command(group = clap::ArgGroup::new("stage").required(true).args(["bus", "virtual_drives"]))]
pub(crate) struct Arguments {
    /// The transcripts.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Play against the bus there: socketcand://HOST:PORT[/CHANNEL] or slcan://HOST:PORT.
    #[arg(long, value_name = "ENDPOINT")]
    bus: Option<Endpoint>,
    /// Play against virtual drives in simulated time.
    #[arg(long = "virtual")]
    virtual_drives: bool,
    /// From it everything random in the virtual drives follows.
    #[arg(long, default_value_t = 1, requires = "virtual_drives")]
    seed: u64,
    /// Print JSON: an array of reports.
    #[arg(long)]
    json: bool,
}

/// A transcript and the drives it is for.
struct Piece {
    transcript: Transcript,
    /// Of the nodes that its head names, as far as it says which drive each is.
    drives: Vec<(NodeId, &'static Personality)>,
    /// The drive that it names for all others.
    drive: Option<&'static Personality>,
}

impl Piece {
    fn read(path: &std::path::Path) -> Result<Piece, Failure> {
        let transcript = Transcript::read(path).map_err(Failure::input)?;
        let by_name = |name: &str| {
            personalities::by_name(name).ok_or_else(|| {
                Failure::input(format!(
                    "{}: it is for a drive '{name}', which is not known here; there are: {}",
                    path.display(),
                    drive_kind::names()
                ))
            })
        };
        let header = transcript.header();
        let drive = header.drive.as_deref().map(by_name).transpose()?;
        let mut drives = Vec::new();
        for node in &header.nodes {
            if let Some(name) = header.drive_of(*node) {
                drives.push((*node, by_name(name)?));
            }
        }
        Ok(Piece {
            drives,
            drive,
            transcript,
        })
    }

    fn options(&self) -> Options {
        let words = |(node, drive): &(NodeId, &Personality)| (*node, drive_kind::words(drive));
        Options {
            drives: self.drives.iter().map(words).collect(),
            drive: self.drive.map(drive_kind::words).unwrap_or_default(),
            ..Options::default()
        }
    }

    /// The drives that its head asks for.
    fn virtual_bus(&self, seed: u64) -> Result<Bus, Failure> {
        let nodes = &self.transcript.header().nodes;
        if nodes.is_empty() || self.drives.len() != nodes.len() {
            return Err(Failure::input(format!(
                "{}: it does not say which drives it is for; write \"drive p3\" and \"nodes 1\" at \
                 its head, or for each node a line like \"node 2 = md80\", or play it with --bus",
                self.transcript.file()
            )));
        }
        let drives = self.drives.iter();
        let drives = drives.map(|(node, drive)| DriveSettings::new(*node, drive));
        Ok(Bus::new(BusSettings::new(seed, drives.collect())))
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for transcripts that cannot be read or a bus that cannot be reached.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let pieces: Result<Vec<Piece>, Failure> = arguments
        .files
        .iter()
        .map(|path| Piece::read(path))
        .collect();
    let pieces = pieces?;
    let reports = match &arguments.bus {
        Some(endpoint) => on_wire(&pieces, endpoint, arguments.json)?,
        None => virtually(&pieces, arguments)?,
    };
    let failed = reports.iter().filter(|report| !report.passed()).count();
    if arguments.json {
        output::print_json(&reports)?;
    } else if reports.len() > 1 {
        let (all, passed) = (reports.len(), reports.len() - failed);
        output::print(format!(
            "{all} transcripts: {passed} passed, {failed} failed"
        ))?;
    }
    Ok(Failure::code(failed == 0))
}

fn virtually(pieces: &[Piece], arguments: &Arguments) -> Result<Vec<Report>, Failure> {
    let buses: Result<Vec<Bus>, Failure> = pieces
        .iter()
        .map(|piece| piece.virtual_bus(arguments.seed))
        .collect();
    let mut reports = Vec::new();
    for (piece, mut bus) in pieces.iter().zip(buses?) {
        let mut bench = PlantBench::new(&mut bus);
        let report = block_on(play(&piece.transcript, &mut bench, &piece.options()));
        for notice in bus.take_notices() {
            output::tell(format_args!("{}: {notice}", piece.transcript.file()));
        }
        show(&report, arguments.json)?;
        reports.push(report);
    }
    Ok(reports)
}

fn on_wire(pieces: &[Piece], endpoint: &Endpoint, json: bool) -> Result<Vec<Report>, Failure> {
    wire::run(endpoint, async |connection| {
        let mut bench = WithoutPhysics(WireLink::new(connection));
        let mut reports = Vec::new();
        for piece in pieces {
            let report = play(&piece.transcript, &mut bench, &piece.options()).await;
            show(&report, json)?;
            reports.push(report);
        }
        Ok(reports)
    })
}

fn show(report: &Report, json: bool) -> Result<(), Failure> {
    match json {
        true => Ok(()),
        false => output::print(report),
    }
}
