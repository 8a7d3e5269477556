//! `servobus eds`: electronic data sheets and device configuration files.

mod check;
mod dcf;
mod read;

use std::fs;
use std::process::ExitCode;

use eds::{Eds, Style};
use personalities::Personality;

use crate::{Failure, drive_kind, output};

/// Write, check and read EDS and DCF files.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Examples:
  servobus eds p3 > p3.eds                     the EDS of a drive, from its object dictionary
  servobus eds check puck4.eds                 what is wrong with a file, by line and column
  servobus eds read puck4.eds --node 3         its objects, defaults for node 3
  servobus eds dcf --node 1 --output 1.dcf     what a drive on the bus holds at this moment"
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Option<Action>,
    /// Which drive's EDS to write.
    #[arg(value_name = "DRIVE", value_parser = drive_kind::parse, required = true)]
    drive: Option<&'static Personality>,
    /// With so many motor channels, of a drive that comes with several numbers of them: 1, 2 or 3.
    #[arg(long, value_name = "N")]
    channels: Option<u8>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    output: Option<String>,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    Check(check::Arguments),
    Read(read::Arguments),
    Dcf(dcf::Arguments),
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for files that cannot be read or written, else as the subcommands say.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.action {
        Some(Action::Check(arguments)) => check::run(arguments),
        Some(Action::Read(arguments)) => read::run(arguments),
        Some(Action::Dcf(arguments)) => dcf::run(arguments),
        None => {
            let drive = arguments.drive;
            let drive =
                drive.ok_or_else(|| Failure::input("name a drive, as in servobus eds p3"))?;
            let drive = drive_kind::with_channels(drive, arguments.channels)?;
            put(
                &sim::data_sheet(drive),
                Style::default(),
                arguments.output.as_deref(),
            )?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// The bytes of a file.
fn get(path: &str) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| Failure::input(format!("{path}: {error}")))
}

/// Writes a file, or to standard output.
fn put(eds: &Eds, style: Style, path: Option<&str>) -> Result<(), Failure> {
    match path {
        Some(path) => fs::write(path, style.bytes(eds))
            .map_err(|error| Failure::input(format!("{path}: {error}"))),
        // A line feed is put behind it.
        None => output::print(eds::write(eds).trim_end()),
    }
}
