//! `servobus sim`: virtual drives on a bus that other programs can reach.

mod guests;
mod speed;
mod stage;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use ::sim::{Bus, BusSettings, DriveSettings, FlashFile, Recording, RunHeader, StoreError};
use bus::{Doors, Endpoint, Options, Protocol};
use canopen::Instant;
use personalities::Personality;

use self::speed::Speed;
use self::stage::{Log, Stage};
use super::stop::Stop;
use crate::node_list::NodeList;
use crate::{Failure, drive_kind, output, record_file, time_span};

/// Run virtual drives, until Ctrl-C or for some simulated time.
///
/// When the drives have booted and can be reached, prints a line `ready: ...` and a line for each
/// address. Who comes and goes, and what people should know of a drive, goes to standard error.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sim                                      three P3s, at socketcand://127.0.0.1:29536
  servobus sim --nodes 5 --store ./drives           one, which remembers what it stored
  servobus sim --bus slcan://127.0.0.1:29537 --bus socketcand://127.0.0.1:29536/vcan0
  servobus sim --bus socketcan://vcan0              at a CAN interface of this machine
  servobus sim --bus socketcand://127.0.0.1:0       at any free port; the line printed says which
  servobus sim --record run.log                     can-utils and python-can read run.log;
                                                    servobus replay run.log repeats the run
  servobus sim --record run.mcap                    or run.pcapng: see --record
  servobus sim --bus none --speed max --for 60s     as fast as this machine can

Who sends frames on the bus decides what happens; all else follows from --seed. --record writes two
files: FILE, its frames with simulated time from zero, and FILE.run with the seed, the drives,
what they had stored, and each outside frame with its nanosecond. A replay is compared with
a candump log.")]
pub(crate) struct Arguments {
    /// Which drive; `servobus od NAME` lists its objects.
    #[arg(long, value_name = "NAME", default_value = "p3", value_parser = drive_kind::parse)]
    drive: &'static Personality,
    /// Their node IDs: 5, 1-3 or 1,4.
    #[arg(long, default_value = "1-3", allow_hyphen_values = true)]
    nodes: NodeList,
    /// Where other programs reach the bus: socketcand://HOST:PORT[/CHANNEL], slcan://HOST:PORT, or
    /// a CAN interface of this (Linux) machine, socketcan://INTERFACE; may be given several times;
    /// `none` opens no door [default: socketcand://127.0.0.1:29536]
    #[arg(long, value_name = "ENDPOINT")]
    bus: Vec<Door>,
    /// Listen on addresses that other machines can reach. There is no password: whoever reaches
    /// the port is on the bus.
    #[arg(long)]
    expose: bool,
    /// Simulated time per real time: 1, 0.5, ..., or `max` (with --bus none only).
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    speed: Speed,
    /// End after this simulated time, as in 10s, 500ms or 2m.
    #[arg(long = "for", value_name = "TIME", allow_hyphen_values = true, value_parser = time_span::parse)]
    time: Option<Duration>,
    /// From it everything random follows: latencies, serial numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write all frames to FILE, and to FILE.run what they follow from. FILE ends in .log (candump),
    /// .pcapng (Wireshark) or .mcap (Foxglove; with position, speed and current of each drive).
    /// Existing files are replaced.
    #[arg(long, value_name = "FILE", value_parser = record_file::parse)]
    record: Option<PathBuf>,
    /// Keep the drives' stored parameters in this folder, which is made if needed; without it they
    /// are forgotten at the end.
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
}

/// An address, or none at all.
#[derive(Clone, Debug)]
enum Door {
    None,
    At(Endpoint),
}

impl std::str::FromStr for Door {
    type Err = bus::EndpointError;

    fn from_str(text: &str) -> Result<Door, Self::Err> {
        match text {
            "none" => Ok(Door::None),
            _ => text.parse().map(Door::At),
        }
    }
}

/// Where a simulated bus is, unless the user says.
const DEFAULT_PORT: u16 = 29536;

impl Arguments {
    /// Where to open doors.
    fn endpoints(&self) -> Result<Vec<Endpoint>, Failure> {
        if self.bus.is_empty() {
            return Ok(vec![Endpoint::new(
                Protocol::Socketcand,
                "127.0.0.1",
                DEFAULT_PORT,
            )]);
        }
        let endpoints: Vec<Endpoint> = self
            .bus
            .iter()
            .filter_map(|door| match door {
                Door::None => None,
                Door::At(endpoint) => Some(endpoint.clone()),
            })
            .collect();
        if !endpoints.is_empty() && endpoints.len() < self.bus.len() {
            return Err(Failure::input(
                "--bus none opens no door, and another --bus opens one: leave one of them out",
            ));
        }
        Ok(endpoints)
    }

    fn settings(&self) -> Result<BusSettings, Failure> {
        let drive = |&node| {
            let mut settings = DriveSettings::new(node, self.drive);
            if let Some(folder) = &self.store {
                settings.store = FlashFile::file(folder, self.drive.name, node.get())
                    .map_err(|error| Failure::input(store_message(&error)))?;
            }
            Ok(settings)
        };
        let drives: Result<Vec<DriveSettings>, Failure> =
            self.nodes.nodes().iter().map(drive).collect();
        Ok(BusSettings {
            seed: self.seed,
            drives: drives?,
        })
    }

    /// The lines that a script waits for.
    fn ready(&self, doors: &[Endpoint]) -> String {
        let count = self.nodes.nodes().len();
        let (drives, nodes) = match count {
            1 => ("drive", "node"),
            _ => ("drives", "nodes"),
        };
        let name = self.drive.name;
        let mut text = format!(
            "ready: {count} virtual {name} {drives}, {nodes} {}",
            self.nodes
        );
        for door in doors {
            text.push('\n');
            text.push_str(&door_line(door));
        }
        text
    }
}

fn store_message(error: &StoreError) -> String {
    match error {
        StoreError::Folder { .. } => format!("{error}; name another folder with --store"),
        _ => error.to_string(),
    }
}

/// `socketcand://127.0.0.1:29536 channel can0`
fn door_line(door: &Endpoint) -> String {
    let whole = door.to_string();
    match door.protocol() {
        Protocol::Socketcand => {
            let channel = format!("/{}", door.channel());
            let address = whole.strip_suffix(&channel).unwrap_or(&whole);
            format!("{address} channel {}", door.channel())
        }
        Protocol::Slcan | Protocol::SocketCan => whole,
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2, before anything was opened or written that could be done without.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let endpoints = arguments.endpoints()?;
    if arguments.speed == Speed::Max
        && let Some(endpoint) = endpoints.first()
    {
        return Err(Failure::input(format!(
            "--speed max with a door ({endpoint}): simulated time cannot outrun a program outside; \
             add --bus none, or leave --speed out"
        )));
    }
    let stop = Stop::watch()?;
    let settings = arguments.settings()?;
    // The doors first: a busy port must not cost the user an earlier recording.
    let doors = match endpoints.as_slice() {
        [] => None,
        endpoints => {
            let options = Options {
                public: arguments.expose,
                ..Options::default()
            };
            Some(Doors::open(endpoints, &options).map_err(Failure::input)?)
        }
    };
    let log = match &arguments.record {
        Some(path) => {
            let recording =
                Recording::create(path, &RunHeader::of(&settings)).map_err(|error| {
                    Failure::input(format!(
                        "{}: cannot record there: {error}; name another file with --record",
                        path.display()
                    ))
                })?;
            Some(Log::new(path.clone(), recording))
        }
        None => None,
    };
    let end = arguments.time.map_or(Instant::NEVER, |time| {
        Instant::ZERO.plus_ns(time_span::nanoseconds(time))
    });
    let addresses = doors.as_ref().map_or(&[][..], Doors::addresses);
    let ready = arguments.ready(addresses);
    let mut stage = Stage::new(Bus::new(settings), doors, log);
    let began = std::time::Instant::now();
    stage.boot(end)?;
    output::print(ready)?;
    match arguments.speed {
        Speed::Max => stage.run_fast(end, &stop)?,
        Speed::Times(speed) => stage.run_paced(speed, end, &stop)?,
    }
    let summary = stage.finish(began.elapsed())?;
    output::print(summary)?;
    Ok(ExitCode::SUCCESS)
}
