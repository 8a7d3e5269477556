//! `servobus scan`: who is on a bus.

use std::process::ExitCode;
use std::time::Duration;

use client::Client;
use client::scan::{Found, Scan};
use serde::Serialize;

use crate::node_list::NodeList;
use crate::wire::{WireArguments, WireLink};
use crate::{Failure, identify, output, time_span};

/// Find the nodes of a bus and what they say they are.
///
/// Asks each node ID for 0x1000, then those that answer for 0x1008 to 0x100A and 0x1018. From
/// outside nobody can tell a virtual drive from a real one for sure; most drives of `servobus
/// sim` say "sim", "sim1" or "simulated" as their hardware.
///
/// "drive" is the name that other commands have for it, if it is one of the documented drives
/// (`servobus drives`).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus scan
  servobus scan --nodes 1-8 --listen 1s     also hear heartbeats, which tell the NMT state
  servobus scan --bus slcan://10.0.0.7:3333 --json

A drive may be mute until the first NMT message, as the P3 of 2016 is: servobus nmt pre-operational ends
that. Exit code 1 if no node was found.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    wire: WireArguments,
    /// Node IDs to ask: 5, 1-3 or 1,4.
    #[arg(long, default_value = "1-127", allow_hyphen_values = true)]
    nodes: NodeList,
    /// How long to listen for heartbeats and boot-ups first, as in 1s.
    #[arg(long, value_name = "TIME", value_parser = time_span::parse)]
    listen: Option<Duration>,
    /// How long a node may take to answer.
    #[arg(long, value_name = "TIME", default_value = "50ms", value_parser = time_span::parse)]
    timeout: Duration,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if it is lost.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let found = arguments.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        let mut found: Vec<Found> = Vec::new();
        let mut listen_ms = arguments.listen.map_or(0, time_span::milliseconds);
        for nodes in arguments.nodes.runs() {
            let scan = Scan {
                nodes,
                listen_ms,
                answer_ms: time_span::milliseconds(arguments.timeout),
                ..Scan::default()
            };
            let more = client.scan(&scan).await.map_err(Failure::unsuccessful)?;
            merge(&mut found, more);
            listen_ms = 0;
        }
        let mut named = Vec::new();
        for node in found {
            let drive = match node.answers_sdo {
                true => identify::found(&mut client, &node).await,
                false => Ok(None),
            };
            let drive = drive
                .map_err(Failure::unsuccessful)?
                .map(|drive| drive.name);
            named.push(Named { node, drive });
        }
        Ok(named)
    })?;
    if arguments.json {
        output::print_json(&found)?;
    } else if found.is_empty() {
        output::print("no node was found")?;
    } else {
        output::print(listing(&found))?;
    }
    Ok(Failure::code(!found.is_empty()))
}

/// A node and the documented drive that it is, if it is one.
#[derive(Debug, Serialize)]
struct Named {
    #[serde(flatten)]
    node: Found,
    drive: Option<&'static str>,
}

/// A node may have been heard while others were asked.
fn merge(found: &mut Vec<Found>, more: Vec<Found>) {
    for new in more {
        match found.iter_mut().find(|old| old.node == new.node) {
            Some(old) if new.answers_sdo => {
                let state = new.state.or(old.state);
                *old = Found { state, ..new };
            }
            Some(old) => old.state = new.state.or(old.state),
            None => found.push(new),
        }
    }
    found.sort_by_key(|found| found.node);
}

fn listing(found: &[Named]) -> String {
    let mut table = output::table(&[
        "node", "drive", "name", "hardware", "software", "profile", "vendor", "product",
        "revision", "serial", "state",
    ]);
    let text = |text: &Option<String>| match text {
        Some(text) => text.escape_default().to_string(),
        None => "-".to_owned(),
    };
    let number = |number: Option<u32>| {
        number.map_or_else(|| "-".to_owned(), |number| format!("0x{number:08X}"))
    };
    for Named { node, drive } in found {
        let state = match (node.state, node.answers_sdo) {
            (Some(state), true) => state.to_string(),
            (Some(state), false) => format!("{state}, no SDO answer"),
            (None, true) => "not heard".to_owned(),
            (None, false) => "no SDO answer".to_owned(),
        };
        table.add_row([
            node.node.to_string(),
            drive.unwrap_or("-").to_owned(),
            text(&node.name),
            text(&node.hardware),
            text(&node.software),
            node.profile()
                .map_or_else(|| "-".to_owned(), |profile| profile.to_string()),
            number(node.vendor),
            number(node.product),
            number(node.revision),
            node.serial
                .map_or_else(|| "-".to_owned(), |serial| serial.to_string()),
            state,
        ]);
    }
    table.trim_fmt()
}
