//! `servobus nmt`: network management commands.

use std::process::ExitCode;

use can::Frame;
use canopen::nmt::Command;
use canopen::{Instant, NodeId};
use client::{Client, LinkError};

use crate::wire::{WireArguments, WireLink};
use crate::{Failure, output};

/// Send a network management command to a node or to all.
///
/// NMT commands are not answered; but a node that was reset boots, and that is waited for.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus nmt start                 all nodes to operational
  servobus nmt pre-operational 3
  servobus nmt reset-node 1          and wait until it has booted, for up to 2 s
  servobus nmt stop all --bus slcan://127.0.0.1:29537

Exit code 1 if a node that was reset does not boot within 2 s (with `all`: if none does).")]
pub(crate) struct Arguments {
    /// What to do.
    #[arg(value_enum)]
    service: Service,
    /// A node ID from 1 to 127, or `all`.
    #[arg(value_name = "NODE|all", default_value = "all", allow_hyphen_values = true, value_parser = parse_addressee)]
    node: Addressee,
    #[command(flatten)]
    wire: WireArguments,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Service {
    /// To operational: PDOs are exchanged.
    Start,
    /// To stopped: nothing but NMT and heartbeat.
    Stop,
    /// To pre-operational: SDOs, no PDOs.
    PreOperational,
    /// Restart the whole device.
    ResetNode,
    /// Restart its communication only.
    ResetCommunication,
}

impl Service {
    fn command(self) -> Command {
        match self {
            Service::Start => Command::Start,
            Service::Stop => Command::Stop,
            Service::PreOperational => Command::EnterPreOperational,
            Service::ResetNode => Command::ResetNode,
            Service::ResetCommunication => Command::ResetCommunication,
        }
    }

    fn boots(self) -> bool {
        matches!(self, Service::ResetNode | Service::ResetCommunication)
    }
}

/// One node, or all.
#[derive(Clone, Copy, Debug)]
struct Addressee(Option<NodeId>);

fn parse_addressee(text: &str) -> Result<Addressee, String> {
    if text == "all" {
        return Ok(Addressee(None));
    }
    let id = text.parse().ok().and_then(NodeId::new);
    id.map(|node| Addressee(Some(node)))
        .ok_or_else(|| "write a node ID from 1 to 127, or all".to_owned())
}

/// How long a node may take to boot.
const BOOT_MS: u64 = 2_000;
/// How long all nodes are waited for.
const BOOT_ALL_MS: u64 = 500;
/// How long the connection stays open behind a command, so that it gets onto the wire.
const LINGER_MS: u64 = 50;

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if it is lost or a node does not boot.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let (command, Addressee(node)) = (arguments.service.command(), arguments.node);
    let boots = arguments.service.boots();
    let booted = arguments.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        let listen_ms = match (boots, node) {
            (false, _) => LINGER_MS,
            (true, Some(_)) => BOOT_MS,
            (true, None) => BOOT_ALL_MS,
        };
        let sent = client.nmt(command, node).await;
        sent.map_err(Failure::unsuccessful)?;
        let until = client.now().plus_ms(listen_ms);
        let heard = boot_ups(&mut client, node, until).await;
        heard.map_err(Failure::unsuccessful)
    })?;
    let who = node.map_or_else(|| "all nodes".to_owned(), |node| format!("node {node}"));
    output::print(format!("sent: {command}, {who}"))?;
    if !boots {
        return Ok(ExitCode::SUCCESS);
    }
    for node in &booted {
        output::print(format!("node {node} has booted"))?;
    }
    if booted.is_empty() {
        let ms = if node.is_some() { BOOT_MS } else { BOOT_ALL_MS };
        let which = node.map_or_else(|| "all".to_owned(), |node| node.to_string());
        let mute: Vec<&str> = personalities::ALL
            .iter()
            .filter(|drive| !drive.device.dialect.boot_up)
            .map(|drive| drive.name)
            .collect();
        return Err(Failure::unsuccessful(format!(
            "{who}: no boot-up within {ms} ms; some drives send none ({}): go on with servobus nmt \
             pre-operational {which}",
            mute.join(", ")
        )));
    }
    Ok(ExitCode::SUCCESS)
}

/// Who boots until `until`; returns early when `only` has.
async fn boot_ups(
    client: &mut Client<WireLink>,
    only: Option<NodeId>,
    until: Instant,
) -> Result<Vec<NodeId>, LinkError> {
    let mut booted = Vec::new();
    while let Some((_, frame)) = client.receive(until).await? {
        let Some(node) = boot_up(&frame).filter(|node| only.is_none_or(|only| only == *node))
        else {
            continue;
        };
        booted.push(node);
        if only.is_some() {
            break;
        }
    }
    Ok(booted)
}

/// Who says that it has booted (CiA 301 7.2.8.3.3).
fn boot_up(frame: &Frame) -> Option<NodeId> {
    let is_boot_up = frame.data() == [0] && !frame.is_remote();
    let id = frame.key().checked_sub(0x700).filter(|_| is_boot_up)?;
    NodeId::new(u8::try_from(id).ok()?)
}
