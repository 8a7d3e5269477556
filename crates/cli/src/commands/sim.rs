//! `servobus sim`: virtual drives on a bus that other programs can reach.

mod drive_list;
mod guests;
mod plan;
mod ready;
mod serial;
mod speed;
mod stage;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use ::sim::{Bus, Disturbance, Recording, RunHeader, Share, StoreError};
use bus::{Doors, Endpoint, Options, Protocol};
use can::BitRate;
use personalities::Personality;

use self::drive_list::DriveList;
pub(crate) use self::plan::Plan;
use self::serial::{Serial, SerialDoor};
use self::speed::Speed;
use self::stage::{Log, Stage};
use super::stop::Stop;
use crate::named_drives::NamedDrives;
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
  servobus sim --node 1-2=p3 --node 3=md80          two kinds on one bus; servobus drives lists them
  servobus sim --bus slcan://127.0.0.1:29537 --bus socketcand://127.0.0.1:29536/vcan0
  servobus sim --bus socketcan://vcan0              at a CAN interface of this machine
  servobus sim --bus socketcand://127.0.0.1:0       at any free port; the line printed says which
  servobus sim --record run.log                     can-utils and python-can read run.log;
                                                    servobus replay run.log repeats the run
  servobus sim --record run.mcap                    or run.pcapng: see --record
  servobus sim --bus none --speed max --for 60s     as fast as this machine can
  servobus sim --drive p3-extended --nodes unconfigured:3 --bit-rate 125k
                                                    drives for an LSS master: servobus lss scan
  servobus sim --drive roboteq --nodes 1 --serial pty
                                                    with its command line at a pseudo-terminal
  servobus sim --scenario sag.toml                  with what goes wrong in sag.toml: servobus
                                                    scenario --help

Who sends frames on the bus decides what happens; all else follows from --seed. --record writes two
files: FILE, its frames with simulated time from zero, and FILE.run with the seed, the drives,
what they had stored, and each outside frame with its nanosecond. A replay is compared with
a candump log.")]
pub(crate) struct Arguments {
    /// Which drive; `servobus od NAME` lists its objects.
    /// [default: p3]
    #[arg(long, value_name = "NAME", value_parser = drive_kind::parse)]
    drive: Option<&'static Personality>,
    /// With so many motor channels, of a drive that comes with several numbers of them: 1, 2 or 3.
    #[arg(long, value_name = "N", requires = "drive")]
    channels: Option<u8>,
    /// Their node IDs: 5, 1-3 or 1,4; unconfigured:3 for three drives without one, which wait for
    /// an LSS master; or both, as in 1-2,unconfigured:3 [default: 1-3]
    #[arg(long, allow_hyphen_values = true)]
    nodes: Option<DriveList>,
    /// Which drive is at which node, as in 1=p3 or 2-3=md80; given several times the bus is a mixed
    /// one. Takes the place of --nodes and --drive.
    #[arg(long, value_name = "ID=NAME", allow_hyphen_values = true)]
    node: Vec<NamedDrives>,
    /// Bit rate of the bus: 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k or 1M [default: 1M]
    #[arg(long, value_name = "RATE", allow_hyphen_values = true)]
    bit_rate: Option<BitRate>,
    /// Play this scenario: what the drives and their worlds are, and what goes wrong when
    /// (docs/scenarios.md). What else stands on the command line comes before what it says.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Where other programs reach the bus: socketcand://HOST:PORT[/CHANNEL], slcan://HOST:PORT, or
    /// a CAN interface of this (Linux) machine, socketcan://INTERFACE; may be given several times;
    /// `none` opens no door [default: socketcand://127.0.0.1:29536]
    #[arg(long, value_name = "ENDPOINT")]
    bus: Vec<Door>,
    /// Offer the serial command line of a drive that has one: at tcp://HOST:PORT, or as a
    /// pseudo-terminal, pty. It is that of the first such drive; 2=pty is that of node 2. May be
    /// given several times
    #[arg(long, value_name = "[ID=]ENDPOINT")]
    serial: Vec<SerialDoor>,
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
    /// From it everything random follows: latencies, serial numbers, disturbances [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// Lose so many of the frames between outside programs and the bus, in each direction, as in 1%.
    #[arg(
        long,
        value_name = "SHARE",
        default_value = "0%",
        allow_hyphen_values = true
    )]
    lose: Share,
    /// Let so many of them come twice, as in 0.5%.
    #[arg(
        long,
        value_name = "SHARE",
        default_value = "0%",
        allow_hyphen_values = true
    )]
    duplicate: Share,
    /// Write all frames to FILE, and to FILE.run what they follow from. FILE ends in .log (candump),
    /// .pcapng (Wireshark) or .mcap (Foxglove; with position, speed and current of each drive).
    /// Existing files are replaced.
    #[arg(long, value_name = "FILE", value_parser = record_file::parse)]
    record: Option<PathBuf>,
    /// Record error messages of outside programs' controller, too, as the driver of a real one
    /// tells them (SocketCAN).
    #[arg(long, requires = "record")]
    error_frames: bool,
    /// Keep the drives' stored parameters in this folder, which is made if needed; without it they
    /// are forgotten at the end.
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Start drives that have stored nothing as out of the box: an MD80 with zero parameters, to be
    /// configured and calibrated, instead of commissioned for its sample motor.
    #[arg(long)]
    factory: bool,
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
}

/// The lines that a script waits for.
fn ready(bus: &Bus, doors: &[Endpoint], serial: &[String]) -> String {
    let mut text = ready::line(bus);
    for door in doors {
        text.push('\n');
        text.push_str(&door_line(door));
    }
    for line in serial {
        text.push('\n');
        text.push_str(line);
    }
    text
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
    if arguments.speed == Speed::Max && !arguments.serial.is_empty() {
        return Err(Failure::input(
            "--speed max with --serial: simulated time cannot outrun a program outside; leave one of \
             them out",
        ));
    }
    let plan = Plan::of(arguments)?;
    plan.check()?;
    let stop = Stop::watch()?;
    let disturbance = Disturbance {
        lose: arguments.lose,
        duplicate: arguments.duplicate,
    };
    let mut settings = plan.settings(disturbance, arguments.store.as_deref(), arguments.factory)?;
    settings.error_frames = arguments.error_frames;
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
    let serial = Serial::open(&arguments.serial, &plan.drives, arguments.expose)?;
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
    let end = plan.end;
    let addresses = doors
        .as_ref()
        .map_or(vec![], |doors| doors.addresses().to_vec());
    let serial_addresses = serial.as_ref().map_or(vec![], Serial::addresses);
    let mut stage = Stage::new(Bus::new(settings), doors, serial, log);
    let began = std::time::Instant::now();
    stage.boot(end)?;
    output::print(ready(stage.bus(), &addresses, &serial_addresses))?;
    if let Some(mute) = ready::mute(stage.bus()).filter(|_| !addresses.is_empty()) {
        output::tell(mute);
    }
    match arguments.speed {
        Speed::Max => stage.run_fast(end, &stop)?,
        Speed::Times(speed) => stage.run_paced(speed, end, &stop)?,
    }
    let summary = stage.finish(began.elapsed())?;
    if !disturbance.is_none() {
        let [inward, outward] = summary.disturbed;
        output::tell(format_args!(
            "disturbed on purpose: {inward} frames to the bus, {outward} from it"
        ));
    }
    output::print(summary.text)?;
    Ok(ExitCode::SUCCESS)
}
