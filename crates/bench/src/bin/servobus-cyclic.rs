//! `servobus-cyclic`: cyclic synchronous position on one bus, its figures as JSON and its frames as
//! a recording, so that others can count.

use std::path::PathBuf;
use std::process::ExitCode;

use bench::cyclic_bus::{Cycle, CyclicBus};
use bench::mixed_bus::{MIXES, MixedBus, SYNC_HZ};
use canopen::Instant;
use clap::Parser;
use serde_json::json;
use sim::Traffic;

/// Runs drives in cyclic synchronous position, or a mixed bus, on a simulated bus of 1 Mbit/s.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// How many drives
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=15))]
    drives: u8,
    /// One of each documented drive at 250 SYNC per second instead
    #[arg(long, conflicts_with_all = ["drives", "sync_hz"])]
    mixed: bool,
    /// SYNC per second, a divisor of 1000 from 4 on
    #[arg(long, value_name = "HZ", default_value_t = 1000)]
    sync_hz: u32,
    /// Simulated seconds
    #[arg(long, value_name = "S", default_value_t = 10)]
    seconds: u64,
    /// Writes the frames of the cycles to this file, .log, .pcapng or .mcap
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

type Figures = Result<(Instant, serde_json::Value), Box<dyn std::error::Error>>;

fn alike(arguments: &Arguments, see: impl FnMut(&Traffic)) -> Figures {
    let cycle = Cycle {
        drives: arguments.drives,
        sync_hz: arguments.sync_hz,
    };
    let mut bus = CyclicBus::new(cycle, 1)?;
    let outcome = bus.run(arguments.seconds * u64::from(arguments.sync_hz), see);
    let figures = json!({
        "cycles": outcome.cycles,
        "missed": outcome.missed,
        "not_following": outcome.not_following,
        "frames": outcome.frames,
        "load": outcome.load,
        "following_error_counts": outcome.following_error_counts,
        "wall_s": outcome.wall.as_secs_f64(),
    });
    Ok((bus.now(), figures))
}

fn mixed(seconds: u64, see: impl FnMut(&Traffic)) -> Figures {
    let mut bus = MixedBus::new(MIXES, 1)?;
    let outcome = bus.run(seconds * u64::from(SYNC_HZ), see);
    let each: usize = MIXES
        .iter()
        .map(|mix| mix.rpdos.len() + mix.tpdos.len())
        .sum();
    let figures = json!({
        "cycles": outcome.cycles,
        "missed": outcome.missed,
        "not_following": outcome.not_following,
        "unexpected": outcome.unexpected.len(),
        "frames": outcome.frames,
        "frames_per_cycle": 1 + each,
        "load": outcome.load,
        "wall_s": outcome.wall.as_secs_f64(),
    });
    Ok((bus.now(), figures))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let mut log = match &arguments.record {
        Some(path) => Some(sim::begin_frames(path)?),
        None => None,
    };
    let mut failed = Ok(());
    let see = |traffic: &Traffic| {
        if let Some(log) = &mut log
            && failed.is_ok()
        {
            failed = sim::write_frame(log, traffic);
        }
    };
    let (end, figures) = match arguments.mixed {
        true => mixed(arguments.seconds, see)?,
        false => alike(arguments, see)?,
    };
    failed?;
    if let Some(log) = log {
        log.finish(end.0)?;
    }
    println!("{figures}");
    Ok(())
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("servobus-cyclic: {error}");
            ExitCode::FAILURE
        }
    }
}
