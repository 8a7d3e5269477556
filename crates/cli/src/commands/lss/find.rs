//! `scan` and `assign`: the devices without a node ID.

use std::process::ExitCode;
use std::time::Duration;

use canopen::NodeId;
use canopen::lss::Known;
use client::Client;
use client::lss::{Assignment, Found};
use client::scan::Scan;
use serde::Serialize;

use super::identity::{self, Row};
use super::progress::Display;
use super::{Common, milliseconds, short_time};
use crate::node_list::NodeList;
use crate::wire::WireLink;
use crate::{Failure, output};

/// How devices are looked for.
#[derive(Debug, clap::Args)]
struct Search {
    #[command(flatten)]
    common: Common,
    /// Only devices with this vendor ID.
    #[arg(long, value_name = "NUMBER", value_parser = identity::number)]
    vendor: Option<u32>,
    /// Only devices with this product code.
    #[arg(long, value_name = "NUMBER", requires = "vendor", value_parser = identity::number)]
    product: Option<u32>,
    /// Only devices with this revision number.
    #[arg(long, value_name = "NUMBER", requires = "product", value_parser = identity::number)]
    revision: Option<u32>,
    /// How long a device may take to answer in a scan. A slower one is not found. On a slow bus
    /// frames take their time, too: say 100ms below 125 kbit/s.
    #[arg(long, value_name = "TIME", default_value = "20ms", value_parser = short_time)]
    scan_timeout: Duration,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Search {
    fn known(&self) -> Known {
        Known {
            vendor: self.vendor,
            product: self.product,
            revision: self.revision,
            serial: None,
        }
    }

    fn settings(&self) -> canopen::lss::Settings {
        let settings = self.common.settings();
        let scan_ms = milliseconds(self.scan_timeout);
        // Where answers come late, those of the other devices come later, too.
        let longer =
            u32::from(settings.settle_ms) * u32::from(scan_ms) / u32::from(settings.scan_ms);
        let settle_ms = u16::try_from(longer).unwrap_or(u16::MAX);
        canopen::lss::Settings {
            scan_ms,
            settle_ms: settings.settle_ms.max(settle_ms),
            ..settings
        }
    }
}

/// Find the devices that have no node ID.
///
/// By fastscan; configured devices do not take part. Ends with all devices in LSS waiting.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss scan
  servobus lss scan --vendor 0x408 --product 3      quicker, if that is known
  servobus lss scan --scan-timeout 100ms            for slow devices

Exit code 1 if none was found.")]
pub(super) struct ScanArguments {
    #[command(flatten)]
    search: Search,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if it is lost or the scan comes to no end.
pub(super) fn scan(arguments: &ScanArguments) -> Result<ExitCode, Failure> {
    let search = &arguments.search;
    let found = search.common.run(async |mut client| {
        let mut lss = client.lss();
        lss.settings = search.settings();
        let mut display = Display::new();
        let found = lss
            .find_unconfigured(search.known(), &mut |progress| display.show(progress))
            .await;
        display.clear();
        found.map_err(Failure::unsuccessful)
    })?;
    let Found { devices, doubtful } = found;
    for identity in &doubtful {
        output::tell(format_args!(
            "warning: a scan ended with {identity}, but no such device answers; frames were lost"
        ));
    }
    if search.json {
        let rows: Vec<Row> = devices.iter().copied().map(Row::from).collect();
        output::print_json(&rows)?;
    } else if devices.is_empty() {
        output::print("no device without a node ID was found")?;
    } else {
        let mut table = output::table(&["identity", "serial"]);
        for identity in &devices {
            table.add_row([identity.to_string(), identity.serial.to_string()]);
        }
        output::print(table.trim_fmt())?;
    }
    Ok(Failure::code(!devices.is_empty()))
}

/// Give node IDs to the devices that have none, and store them.
///
/// The device with the lowest identity gets the lowest node ID. Before, the node IDs are asked for,
/// so that no two devices have the same.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss assign --ids 5,6,7
  servobus lss assign --ids 10-20 --no-store        until the next power-on

Exit code 1 if a node ID was not used up, or a device did not take its own.")]
pub(super) struct AssignArguments {
    /// The node IDs: 5, 1-3 or 1,4.
    #[arg(long, value_name = "NODES", allow_hyphen_values = true)]
    ids: NodeList,
    /// Do not store them.
    #[arg(long)]
    no_store: bool,
    #[command(flatten)]
    search: Search,
}

/// What was assigned, for programs.
#[derive(Debug, Serialize)]
struct AssignedRow {
    node: u8,
    #[serde(flatten)]
    identity: Row,
    booted: bool,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached or has one of the node IDs already, 1 if a device does
/// not take part as it should.
pub(super) fn assign(arguments: &AssignArguments) -> Result<ExitCode, Failure> {
    let search = &arguments.search;
    let ids = arguments.ids.nodes();
    let assignment = search.common.run(async |mut client| {
        refuse_taken(&mut client, &arguments.ids).await?;
        let mut lss = client.lss();
        lss.settings = search.settings();
        let mut display = Display::new();
        let mut show = |progress| display.show(progress);
        let assignment = lss
            .assign(ids, search.known(), !arguments.no_store, &mut show)
            .await;
        display.clear();
        assignment.map_err(Failure::unsuccessful)
    })?;
    let Assignment { assigned, more } = assignment;
    if search.json {
        let rows = assigned.iter().map(|assigned| AssignedRow {
            node: assigned.node.get(),
            identity: assigned.identity.into(),
            booted: assigned.booted,
        });
        output::print_json(&rows.collect::<Vec<_>>())?;
    } else {
        for assigned in &assigned {
            let booted = match assigned.booted {
                true => "has booted",
                false => "no boot-up within 2000 ms",
            };
            let (node, identity) = (assigned.node, assigned.identity);
            output::print(format_args!("node {node}: {identity}, {booted}"))?;
        }
    }
    let unused: Vec<String> = ids
        .iter()
        .skip(assigned.len())
        .map(NodeId::to_string)
        .collect();
    if !unused.is_empty() {
        output::tell(format_args!(
            "no more devices without a node ID; left over: {}",
            unused.join(", ")
        ));
    }
    if more {
        output::tell("there are more devices without a node ID; give more with --ids");
    }
    let booted = assigned.iter().all(|assigned| assigned.booted);
    Ok(Failure::code(unused.is_empty() && booted))
}

/// Asks whether somebody has one of the node IDs.
async fn refuse_taken(client: &mut Client<WireLink>, ids: &NodeList) -> Result<(), Failure> {
    for nodes in ids.runs() {
        let scan = Scan {
            nodes: nodes.clone(),
            ..Scan::default()
        };
        let taken = client.scan(&scan).await.map_err(Failure::unsuccessful)?;
        // Heartbeats of others are heard, too.
        if let Some(taken) = taken.iter().find(|taken| nodes.contains(&taken.node)) {
            return Err(Failure::input(format_args!(
                "there is a node {} on the bus already; choose other --ids",
                taken.node
            )));
        }
    }
    Ok(())
}
