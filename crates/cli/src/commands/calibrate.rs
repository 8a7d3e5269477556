//! `servobus calibrate`: brings a drive and a new motor together.

mod own;

use std::process::ExitCode;

use client::Link;
use client::calibrate::{CurrentSensor, ElectricalZero, EncoderLag, Method};
use client::session::{ProcedureError, Session, Watch};
use serde::Serialize;

use super::motor::Common;
use crate::Failure;

/// Calibrate a drive to its motor.
///
/// A P3 step by step: current sensors, electrical zero, phase order, encoder lag. An MD80 does it by itself,
/// which `own` begins and follows. Which drive it is, the node says.
///
/// The motor gets power and turns. Supply, temperature and limits are checked before. Whatever ends a
/// calibration early takes the power away and gives every object its old value again: Ctrl-C, a
/// fault, a lost bus, a result that cannot be. Results are shown, then saved if you say so.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate all --node 1                 in the right order; asks before it saves
  servobus calibrate own --node 2                 the drive's own (MD80)
  servobus calibrate current-sensor --node 1 --yes
  servobus calibrate electrical-zero --node 1 --dry-run
  servobus calibrate electrical-zero --node 1 --method stall --yes    as the manual prints it

The shaft must be free: nothing may be coupled to it.
Exit code 1 if the calibration did not succeed; nothing is saved then, but for a drive that refuses
in the middle of saving: the message says what is saved.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    CurrentSensor(CurrentSensorArguments),
    ElectricalZero(ElectricalZeroArguments),
    PhaseOrder(PhaseOrderArguments),
    EncoderLag(EncoderLagArguments),
    Own(own::OwnArguments),
    All(AllArguments),
}

impl What {
    fn common(&self) -> &Common {
        match self {
            What::CurrentSensor(arguments) => &arguments.common,
            What::ElectricalZero(arguments) => &arguments.common,
            What::PhaseOrder(arguments) => &arguments.common,
            What::EncoderLag(arguments) => &arguments.common,
            What::Own(arguments) => &arguments.common,
            What::All(arguments) => &arguments.common,
        }
    }
}

/// Find what the current sensors read without current (0x3009). The motor gets no power.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate current-sensor --node 1
  servobus calibrate current-sensor --node 1 --yes --json")]
struct CurrentSensorArguments {
    #[command(flatten)]
    common: Common,
}

/// Find how the encoder sits on the rotor (0x3011,1) and the order of the phases (0x3011,2).
///
/// The shaft turns once forward and back, then to and fro by torque.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate electrical-zero --node 1
  servobus calibrate electrical-zero --node 1 --method approach --dry-run")]
struct ElectricalZeroArguments {
    /// How: turn, one turn forward and back, which averages friction, cogging and eccentricity;
    /// approach, angle 0 from both sides, which averages friction; stall, as the manual prints it.
    #[arg(long, value_name = "NAME", default_value = "turn", value_parser = parse_method)]
    method: Method,
    #[command(flatten)]
    common: Common,
}

/// Find the order of the phases alone (0x3011,2). The shaft makes one electrical turn and back.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate phase-order --node 1")]
struct PhaseOrderArguments {
    #[command(flatten)]
    common: Common,
}

/// Find how late the encoder is (0x3013,5). The shaft turns both ways at half of its speed.
///
/// Current sensors and electrical zero must be calibrated.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate encoder-lag --node 1")]
struct EncoderLagArguments {
    #[command(flatten)]
    common: Common,
}

/// All of them in the right order: current-sensor, electrical-zero with phase-order, encoder-lag; or the
/// drive's own calibration.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate all --node 1
  servobus calibrate all --node 1 --yes --bus socketcan://can0")]
struct AllArguments {
    #[command(flatten)]
    common: Common,
}

const METHODS: [(&str, Method); 3] = [
    ("turn", Method::Turn),
    ("approach", Method::Approach),
    ("stall", Method::Stall),
];

fn parse_method(text: &str) -> Result<Method, String> {
    let found = METHODS.iter().find(|(name, _)| *name == text);
    found.map(|(_, method)| *method).ok_or_else(|| {
        let names: Vec<&str> = METHODS.iter().map(|(name, _)| *name).collect();
        format!("there is no such method; there are: {}", names.join(", "))
    })
}

/// What was found, for programs.
#[derive(Debug, Default, Serialize)]
struct Found {
    #[serde(skip_serializing_if = "Option::is_none")]
    bias_counts: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zero_counts: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polarity: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    friction_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    inertia_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lag_us: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lag_left_deg: Option<f64>,
}

impl Found {
    fn sensor(&mut self, lines: &mut Vec<String>, found: &CurrentSensor) {
        let [a, b] = found.bias;
        self.bias_counts = Some([a, b]);
        lines.push(format!(
            "current sensors: {a:.2} and {b:.2} counts without current, spread {:.2}",
            found.spread
        ));
    }

    fn zero(&mut self, lines: &mut Vec<String>, found: &ElectricalZero) {
        self.zero_counts = Some(found.zero_counts);
        self.polarity = found.polarity;
        self.friction_deg = Some(found.friction_deg);
        self.spread_deg = Some(found.spread_deg);
        self.inertia_ratio = found.inertia_ratio;
        let order = match found.polarity {
            Some(1) => ", the encoder counts with the field",
            Some(_) => ", the encoder counts against the field",
            None => "",
        };
        lines.push(format!(
            "electrical zero: {:.1} counts; friction {:.1}, spread {:.1} electrical degrees{order}",
            found.zero_counts, found.friction_deg, found.spread_deg
        ));
        if let Some(ratio) = found.inertia_ratio {
            lines.push(format!(
                "the shaft is free: its inertia is {ratio:.2} times the rotor's"
            ));
        }
    }

    fn lag(&mut self, lines: &mut Vec<String>, found: &EncoderLag) {
        self.lag_us = Some(found.lag_us);
        self.lag_left_deg = Some(found.left_deg);
        lines.push(format!(
            "encoder lag: {:.0} us; {:.2} electrical degrees are left at {:.0} counts/s and {:.0} % \
             of the supply",
            found.lag_us,
            found.left_deg,
            found.speed,
            found.voltage_share * 100.0
        ));
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached or nobody can be asked, 1 if the calibration did not
/// succeed.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let common = arguments.what.common();
    common.can_ask()?;
    let drive = common.drive()?;
    let offers = drive.and_then(|drive| Some((drive, drive.commissioning.calibrating?)));
    match (&arguments.what, offers) {
        (What::Own(arguments), _) => return own::run(arguments, drive).map(|()| ExitCode::SUCCESS),
        (What::All(_), Some((drive, _))) => {
            return own::run_named(common, drive, None, &[]).map(|()| ExitCode::SUCCESS);
        }
        (_, Some((drive, offers))) => {
            let node = common.node;
            let how = match drive.commissioning.calibrations.is_empty() {
                true => String::new(),
                false => format!(", with servobus calibrate own --node {node}"),
            };
            return Err(Failure::unsuccessful(format!(
                "node {node} is a {}: {offers}{how}",
                drive.name
            )));
        }
        (_, None) => {}
    }
    let (mut found, mut lines) = (Found::default(), Vec::new());
    match &arguments.what {
        What::Own(_) => Ok(()),
        What::CurrentSensor(CurrentSensorArguments { common }) => common.run(async |session| {
            let result = session.calibrate_current_sensor().await?;
            found.sensor(&mut lines, &result);
            Ok((found, lines))
        }),
        What::ElectricalZero(ElectricalZeroArguments { method, common }) => {
            common.run(async |session| {
                let result = session.calibrate_electrical_zero(*method).await?;
                found.zero(&mut lines, &result);
                Ok((found, lines))
            })
        }
        What::PhaseOrder(PhaseOrderArguments { common }) => common.run(async |session| {
            found.polarity = Some(session.calibrate_phase_order().await?);
            Ok((found, lines))
        }),
        What::EncoderLag(EncoderLagArguments { common }) => common.run(async |session| {
            let result = session.calibrate_encoder_lag().await?;
            found.lag(&mut lines, &result);
            Ok((found, lines))
        }),
        What::All(AllArguments { common }) => common.run(async |session| {
            all(session, &mut found, &mut lines).await?;
            Ok((found, lines))
        }),
    }?;
    Ok(ExitCode::SUCCESS)
}

async fn all<L: Link, W: Watch>(
    session: &mut Session<'_, L, W>,
    found: &mut Found,
    lines: &mut Vec<String>,
) -> Result<(), ProcedureError> {
    let sensor = session.calibrate_current_sensor().await?;
    found.sensor(lines, &sensor);
    let zero = session.calibrate_electrical_zero(Method::Turn).await?;
    found.zero(lines, &zero);
    let lag = session.calibrate_encoder_lag().await?;
    found.lag(lines, &lag);
    Ok(())
}
