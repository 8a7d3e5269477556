//! `servobus tune`: brings the loops to what hangs on the motor.

use std::process::ExitCode;

use client::tune::{Asked, Tuned};
use serde::Serialize;

use super::motor::Common;
use crate::Failure;

/// Tune the velocity or the position loop of a P3 to its load.
///
/// The shaft turns some turns each way, with its load. The response to small steps is measured and
/// fitted, and bandwidth and damping (0x3019) are corrected until the closed loop has the natural
/// frequency that is asked for. Ctrl-C, a fault, a lost bus or a bad fit take the power away and
/// give every object its old value again.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus tune velocity --node 1 --bandwidth 40
  servobus tune position --node 1 --bandwidth 10 --yes

The drive must be calibrated; see servobus calibrate.
Exit code 1 if the loop did not become as asked; nothing is saved then, but for a drive that refuses
in the middle of saving: the message says what is saved.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    Velocity(Loop<40>),
    Position(Loop<10>),
}

/// Measure the loop and correct bandwidth and damping until it is as asked.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus tune velocity --node 1 --bandwidth 40 --damping 1
  servobus tune position --node 1 --bandwidth 10 --dry-run")]
struct Loop<const HZ: u32> {
    /// Natural frequency of the closed loop, Hz, 2 to 150.
    #[arg(long, value_name = "HZ", default_value_t = f64::from(HZ), value_parser = parse_hz)]
    bandwidth: f64,
    /// Damping ratio of the closed loop, 0.4 to 2.
    #[arg(
        long,
        value_name = "RATIO",
        default_value_t = 1.0,
        allow_hyphen_values = true,
        value_parser = parse_damping
    )]
    damping: f64,
    #[command(flatten)]
    common: Common,
}

fn parse_hz(text: &str) -> Result<f64, String> {
    between(text, 2.0, 150.0)
}

fn parse_damping(text: &str) -> Result<f64, String> {
    between(text, 0.4, 2.0)
}

fn between(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse().ok();
    number
        .filter(|number| (low..=high).contains(number))
        .ok_or_else(|| format!("write a number from {low} to {high}"))
}

impl<const HZ: u32> Loop<HZ> {
    fn asked(&self) -> Asked {
        Asked {
            bandwidth_hz: self.bandwidth,
            damping: self.damping,
        }
    }
}

/// What was reached, for programs.
#[derive(Debug, Serialize)]
struct Reached {
    natural_hz: f64,
    damping: Option<f64>,
    misfit: f64,
    inertia_ratio: f64,
    friction_permille: f64,
    load_permille: f64,
    rounds: u32,
}

fn told(tuned: &Tuned) -> (Reached, Vec<String>) {
    let shaft = &tuned.shaft;
    let damping = match tuned.damping {
        Some(damping) => format!(", damping {damping:.2}"),
        None => String::new(),
    };
    let lines = vec![
        format!(
            "the shaft: inertia {:.2} times the rotor's, friction {:.0} and load {:.0} per mille of \
             rated torque",
            shaft.inertia_ratio, shaft.friction_pm, shaft.load_pm
        ),
        format!(
            "the loop: natural frequency {:.1} Hz{damping}; the model leaves {:.1} % of the response",
            tuned.natural_hz,
            tuned.misfit * 100.0
        ),
    ];
    let reached = Reached {
        natural_hz: tuned.natural_hz,
        damping: tuned.damping,
        misfit: tuned.misfit,
        inertia_ratio: shaft.inertia_ratio,
        friction_permille: shaft.friction_pm,
        load_permille: shaft.load_pm,
        rounds: tuned.rounds,
    };
    (reached, lines)
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached or nobody can be asked, 1 if the loop did not become as
/// asked.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let common = match &arguments.what {
        What::Velocity(arguments) => &arguments.common,
        What::Position(arguments) => &arguments.common,
    };
    common.can_ask()?;
    if let Some(drive) = common.drive()?
        && let Some(offers) = drive.commissioning.tuning
    {
        return Err(Failure::unsuccessful(format!(
            "node {} is a {}: {offers}",
            common.node, drive.name
        )));
    }
    match &arguments.what {
        What::Velocity(arguments) => arguments
            .common
            .run(async |session| Ok(told(&session.tune_velocity(arguments.asked()).await?))),
        What::Position(arguments) => arguments
            .common
            .run(async |session| Ok(told(&session.tune_position(arguments.asked()).await?))),
    }?;
    Ok(ExitCode::SUCCESS)
}
