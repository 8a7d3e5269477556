//! `servobus scenario`: checks scenarios, and lists what they may say.

use std::path::PathBuf;
use std::process::ExitCode;

use ::sim::Disturbance;
use ::sim::scenario::{acts_document, parameters_document, parameters_template};
use canopen::Instant;
use personalities::Personality;
use personalities::p3::P3;

use super::sim::Plan;
use crate::{Failure, drive_kind, output, scenario_file};

/// Check scenarios, and list what they may say.
///
/// A scenario is a TOML file that says what drives there are, what their motors, loads and sensors
/// are like, and what goes wrong when. `servobus sim --scenario FILE` and `servobus demo --scenario
/// FILE` play it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus scenario check sag.toml        is it right? nothing is started
  servobus scenario parameters            every parameter with unit, default and range
  servobus scenario parameters --toml     the same as a file to begin with
  servobus scenario parameters --drive md80 --toml     that of another drive
  servobus scenario acts                  events, conditions and acts
  servobus sim --scenario sag.toml        play it")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Check scenarios; every mistake is shown with its line and column.
    ///
    /// Exit code 2 if there is one.
    Check {
        /// Files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// List every key and parameter with its unit, default and range.
    Parameters {
        /// The defaults of this drive's world. [default: of p3, and of the drives that differ from it]
        #[arg(long, value_name = "NAME", value_parser = drive_kind::parse)]
        drive: Option<&'static Personality>,
        /// As a scenario that sets every parameter to its default.
        #[arg(long)]
        toml: bool,
    },
    /// List the keys of events, the conditions, and the acts.
    Acts,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for scenarios with mistakes.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        Command::Check { files } => {
            let mut wrong = Vec::new();
            for file in files {
                match check(file) {
                    Ok(words) => output::print(words)?,
                    Err(Failure::Input(message)) => wrong.push(message),
                    Err(other) => return Err(other),
                }
            }
            if !wrong.is_empty() {
                return Err(Failure::Input(wrong.join("\n")));
            }
        }
        Command::Parameters { drive, toml: true } => {
            output::print(parameters_template(drive.unwrap_or(&P3)).trim_end())?;
        }
        Command::Parameters { drive, toml: false } => {
            output::print(parameters_document(*drive).trim_end())?;
        }
        Command::Acts => output::print(acts_document().trim_end())?,
    }
    Ok(ExitCode::SUCCESS)
}

fn check(file: &std::path::Path) -> Result<String, Failure> {
    let scenario = scenario_file::read(file)?;
    let events = scenario.event_count();
    let plan = Plan::of_scenario(scenario);
    plan.check()?;
    plan.settings(Disturbance::default(), None, false)?;
    let drives: Vec<String> = plan
        .drives
        .iter()
        .map(|(place, kind)| format!("{place} ({})", kind.name))
        .collect();
    let word = if events == 1 { "event" } else { "events" };
    let end = match plan.end {
        Instant::NEVER => String::new(),
        end => format!(", ends at {} s", end.seconds()),
    };
    Ok(format!(
        "{}: right; drives {}; seed {}; {events} {word}{end}",
        file.display(),
        drives.join(", "),
        plan.seed
    ))
}
