//! `servobus monitor`: a live trace in words.

use std::process::ExitCode;
use std::time::{Duration, Instant as RealTime};

use canopen::Instant;
use client::decode::Decoder;
use personalities::Personality;
use tokio::time::timeout;

use super::stop::Stop;
use crate::wire::{WireArguments, tell_reports};
use crate::{Failure, drive_kind, output, time_span};

/// Print the frames of a bus and what they mean, until Ctrl-C or for some time.
///
/// Down to the bits of controlword and statusword, abort codes and emergencies. The contents of
/// PDOs are known from when their mapping passes by. Times are seconds on the bus's own clock if it
/// has one, else since the connection.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus monitor
  servobus monitor --for 10s --json > trace.jsonl     one JSON object on each line
  servobus monitor --bus slcan://127.0.0.1:29537 | grep emergency")]
pub(crate) struct Arguments {
    #[command(flatten)]
    wire: WireArguments,
    /// Whose dictionary gives names and types; `servobus od NAME` lists it.
    #[arg(long, value_name = "NAME", default_value = "p3", value_parser = drive_kind::parse)]
    drive: &'static Personality,
    /// End after this (real) time, as in 10s, 500ms or 2m.
    #[arg(long = "for", value_name = "TIME", allow_hyphen_values = true, value_parser = time_span::parse)]
    time: Option<Duration>,
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
    let stop = Stop::watch()?;
    arguments.wire.run(async |mut connection| {
        let mut decoder = Decoder::with_table(arguments.drive.device.table);
        let began = RealTime::now();
        while !stop.asked() {
            let left = match arguments.time {
                Some(time) => time.saturating_sub(began.elapsed()),
                None => LOOK,
            };
            if left.is_zero() {
                break;
            }
            let received = timeout(left.min(LOOK), connection.receive()).await;
            tell_reports(&mut connection);
            let Ok(received) = received else {
                continue;
            };
            let received = received.map_err(Failure::unsuccessful)?;
            let elapsed = || u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX);
            let at = Instant(received.stamp_ns.unwrap_or_else(elapsed));
            let decoded = decoder.decode(at, &received.frame);
            if arguments.json {
                output::print_json_line(&decoded)?;
            } else {
                output::print(&decoded)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    })
}
