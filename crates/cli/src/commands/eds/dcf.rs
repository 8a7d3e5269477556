//! `servobus eds dcf`: what a drive holds, as a device configuration file.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use canopen::{Abort, Address, NodeId};
use client::Client;
use client::sdo::{Cause, SdoError};
use eds::{Commissioning, DataType, Dcf, Eds, Live, Style, Value};
use personalities::Personality;

use crate::identify::{self, Identity};
use crate::wire::{WireArguments, WireLink};
use crate::{Failure, drive_kind, output, time_span};

/// Read every parameter of a drive and write them as a DCF.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus eds dcf --node 1 > 1.dcf
  servobus eds dcf --node 1 --eds puck4.eds --output 1.dcf
  servobus eds dcf --node 1 --name elbow

Each object that the EDS calls readable is read by SDO and becomes its ParameterValue, but for those
whose ObjFlags forbid it. Objects that the drive refuses get none; a comment in the file and a line
on standard error say why. Exit code 1 if the drive does not answer.")]
pub(super) struct Arguments {
    /// The node ID, 1 to 127.
    #[arg(long, value_name = "ID", value_parser = super::super::sdo::parse_node)]
    node: NodeId,
    /// The drive's EDS [default: that of --drive]
    #[arg(long, value_name = "FILE")]
    eds: Option<String>,
    /// Whose dictionary to read where there is no EDS [default: that of the drive that the node says it
    /// is]
    #[arg(long, value_name = "NAME", value_parser = drive_kind::parse)]
    drive: Option<&'static Personality>,
    /// The node's name in the file.
    #[arg(long, value_name = "TEXT", default_value = "")]
    name: String,
    /// The bit rate in the file, in kbit/s.
    #[arg(long, value_name = "KBIT", default_value_t = 1000)]
    bit_rate: u16,
    /// How long to wait for each answer.
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = time_span::parse)]
    timeout: Duration,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    output: Option<String>,
    #[command(flatten)]
    wire: WireArguments,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for an EDS that cannot be read or a bus that cannot be reached, 1 if the drive does
/// not answer.
pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let (eds, style) = match &arguments.eds {
        Some(path) => {
            let reading = eds::read(&super::get(path)?);
            if reading.eds.objects.is_empty() {
                let what = format!("{path}: no object can be used; see servobus eds check");
                return Err(Failure::input(what));
            }
            (reading.eds, reading.style)
        }
        None => (sim::data_sheet(drive(arguments)?), Style::default()),
    };
    let mut live = upload(arguments, &eds)?;
    let values = live
        .values()
        .filter(|live| matches!(live, Live::Value(_)))
        .count();
    let serial = match live.get(&(0x1018, 4)) {
        Some(Live::Value(value)) => value.number(arguments.node),
        _ => None,
    };
    let commissioning = Commissioning {
        node_id: arguments.node.get(),
        node_name: arguments.name.clone(),
        bit_rate_kbit: arguments.bit_rate,
        lss_serial_number: serial
            .and_then(|serial| u32::try_from(serial).ok())
            .unwrap_or(0),
        ..Commissioning::default()
    };
    let dcf = Dcf::new(&eds, &commissioning, |index, sub, _| {
        live.remove(&(index, sub)).unwrap_or(Live::Nothing)
    });
    let mut eds = dcf.into_eds();
    stamp(&mut eds);
    super::put(&eds, style, arguments.output.as_deref())?;
    if let Some(path) = &arguments.output {
        output::tell(format_args!(
            "{path}: {values} values of node {}",
            arguments.node.get()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// The drive that was named, else the one that the node says it is.
///
/// # Errors
/// It is none that is known here.
fn drive(arguments: &Arguments) -> Result<&'static Personality, Failure> {
    if let Some(drive) = arguments.drive {
        return Ok(drive);
    }
    let node = arguments.node;
    let identity = arguments.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings.answer_ms = time_span::milliseconds(arguments.timeout);
        let identity = identify::node(&mut client, node).await;
        identity.map_err(Failure::unsuccessful)
    })?;
    match identity {
        Identity::Drive(drive) => Ok(drive),
        Identity::Unknown => Err(Failure::input(format!(
            "node {node} is no drive that is known here; give its file with --eds, or say which drive it \
             is with --drive"
        ))),
        Identity::Silent => Err(Failure::unsuccessful(format!(
            "node {node}: reading 0x1000,0: no answer within {} ms",
            time_span::milliseconds(arguments.timeout)
        ))),
    }
}

/// Objects in a row without an answer after which a drive counts as gone.
const MAX_SILENT: u32 = 3;

/// Reads every readable object.
fn upload(arguments: &Arguments, eds: &Eds) -> Result<BTreeMap<(u16, u8), Live>, Failure> {
    let node = arguments.node;
    arguments.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings.answer_ms = time_span::milliseconds(arguments.timeout);
        let mut live = BTreeMap::new();
        let (mut silent, mut missing) = (0, 0);
        for (index, sub, entry) in eds.entries() {
            let readable = entry.access.is_none_or(eds::Access::readable) && entry.scans();
            let (true, Some(data_type)) = (readable, entry.data_type) else {
                continue;
            };
            let address = Address::new(index, sub);
            // A stream is no parameter.
            if data_type == DataType::DOMAIN {
                continue;
            }
            let answer = client.upload_all(node, address).await;
            let found = match answer {
                Ok(data) => {
                    silent = 0;
                    value(data_type, &data, entry.default.as_ref())
                }
                Err(error) => {
                    missing += usize::from(error.abort() == Some(Abort::NO_OBJECT));
                    let is_silent = matches!(error.cause, Cause::TimedOut { .. });
                    silent = if is_silent { silent + 1 } else { 0 };
                    // A drive that is not there, or goes away, is no file.
                    let is_gone = silent > 0 && live.is_empty() || silent >= MAX_SILENT;
                    if is_gone || matches!(error.cause, Cause::Link(_)) {
                        return Err(Failure::unsuccessful(error));
                    }
                    Live::Unread(why(&error))
                }
            };
            if let Live::Unread(why) = &found {
                output::tell(format_args!(
                    "node {} {address} not read: {why}",
                    node.get()
                ));
            }
            live.insert((index, sub), found);
        }
        // Some may be optional.
        if missing * 4 > live.len() {
            output::tell(format_args!(
                "node {} does not have {missing} of {} objects: if it is another drive, name it with \
                 --drive, or give its own file",
                node.get(),
                live.len()
            ));
        }
        Ok(live)
    })
}

fn value(data_type: DataType, bytes: &[u8], like: Option<&Value>) -> Live {
    match Value::from_bytes(data_type, bytes, like) {
        Some(value) => Live::Value(value),
        None if data_type == DataType::VISIBLE_STRING || data_type == DataType::UNICODE_STRING => {
            Live::Unread(format!("{} bytes came, not writable as text", bytes.len()))
        }
        None => {
            let name = data_type.name().unwrap_or("value of its type");
            Live::Unread(format!("{} bytes came, which is no {name}", bytes.len()))
        }
    }
}

/// The error without the node and the object, which stand beside it.
fn why(error: &SdoError) -> String {
    match error.abort() {
        Some(abort) => format!("refused, {abort}"),
        None => {
            let text = error.to_string();
            text.rsplit_once(": ")
                .map_or(text.clone(), |(_, why)| why.to_owned())
        }
    }
}

/// When the values were read, in UTC.
fn stamp(eds: &mut Eds) {
    // `2026-11-25T18:49:02Z`
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let number = |from: usize, to: usize| now.get(from..to).and_then(|text| text.parse().ok());
    let (Some(month), Some(day), Some(hour), Some(minute)) =
        (number(5, 7), number(8, 10), number(11, 13), number(14, 16))
    else {
        return;
    };
    let year = now.get(..4).and_then(|text| text.parse().ok()).unwrap_or(0);
    let date = eds::FileDate {
        year,
        month,
        day,
        hour,
        minute,
    };
    let info = eds
        .info
        .iter_mut()
        .find(|section| section.name == "FileInfo");
    if let Some(info) = info {
        info.set("ModificationTime", date.time());
        info.set("ModificationDate", date.date());
        info.set("ModifiedBy", "servobus");
    }
}
