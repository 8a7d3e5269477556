//! `set-id`, `bit-rate`, `inquire` and `waiting`: devices that are known.

use std::process::ExitCode;

use canopen::NodeId;
use canopen::lss::{BitTiming, Identity, Settings, State};
use client::lss::{Lss, LssError};
use client::{Client, Link};
use serde::Serialize;

use super::identity::{self, Row};
use super::{Common, linger};
use crate::wire::WireLink;
use crate::{Failure, output};

/// The client as LSS master.
fn lss(client: &mut Client<WireLink>, settings: Settings) -> Lss<'_, WireLink> {
    let mut lss = client.lss();
    lss.settings = settings;
    lss
}

/// Sends all devices to waiting whether `done` succeeded or not, so that none stays selected.
async fn leave<T, L: Link>(lss: &mut Lss<'_, L>, done: Result<T, LssError>) -> Result<T, Failure> {
    let left = lss.switch(State::Waiting).await;
    let done = done.map_err(Failure::unsuccessful)?;
    left.map_err(Failure::unsuccessful)?;
    Ok(done)
}

/// Give one device a node ID.
///
/// A device without one boots with it at once. Another keeps its node ID until its communication is
/// reset, and loses the new one with its power unless it is stored.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss set-id --identity 0x408:3:0x10002:3004 9
  servobus lss set-id --identity 0x408:3:0x10002:3004 9 --store
  servobus lss set-id --identity 0x408:3:0x10002:3004 none      back to no node ID")]
pub(super) struct SetIdArguments {
    /// Which device: VENDOR:PRODUCT:REVISION:SERIAL.
    #[arg(long, value_name = "V:P:R:S", value_parser = identity::parse)]
    identity: Identity,
    /// The node ID, 1 to 127, or `none`.
    #[arg(value_name = "NEW", allow_hyphen_values = true, value_parser = parse_new)]
    new: NewId,
    /// Let the device store it.
    #[arg(long)]
    store: bool,
    #[command(flatten)]
    common: Common,
}

/// A node ID, or none.
#[derive(Clone, Copy, Debug)]
struct NewId(Option<NodeId>);

fn parse_new(text: &str) -> Result<NewId, String> {
    if text == "none" {
        return Ok(NewId(None));
    }
    let id = text.parse().ok().and_then(NodeId::new);
    id.map(|id| NewId(Some(id)))
        .ok_or_else(|| "write a node ID from 1 to 127, or none".to_owned())
}

/// A node ID in words.
fn words(id: Option<NodeId>) -> String {
    id.map_or_else(|| "no node ID".to_owned(), |id| format!("node ID {id}"))
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if the device refuses or does not answer.
pub(super) fn set_id(arguments: &SetIdArguments) -> Result<ExitCode, Failure> {
    let NewId(new) = arguments.new;
    let identity = arguments.identity;
    let old = arguments.common.run(async |mut client| {
        let mut lss = lss(&mut client, arguments.common.settings());
        let done = change_id(&mut lss, identity, new, arguments.store).await;
        let old = leave(&mut lss, done).await?;
        linger(&mut client).await?;
        Ok(old)
    })?;
    let stored = match arguments.store {
        true => ", stored",
        false => ", not stored",
    };
    output::print(format_args!("{identity}: {}{stored}", words(new)))?;
    match (old, new) {
        (Some(old), new) if Some(old) != new => output::print(format_args!(
            "it is node {old} until its communication is reset: \
             servobus nmt reset-communication {old}"
        ))?,
        (None, Some(new)) => output::print(format_args!("it boots as node {new}"))?,
        _ => {}
    }
    Ok(ExitCode::SUCCESS)
}

/// Selects a device and gives it a node ID; gives the one it has.
async fn change_id<L: Link>(
    lss: &mut Lss<'_, L>,
    identity: Identity,
    new: Option<NodeId>,
    store: bool,
) -> Result<Option<NodeId>, LssError> {
    lss.select(identity).await?;
    let old = lss.inquire_node_id().await?;
    lss.set_node_id(new).await?;
    if store {
        lss.store().await?;
    }
    Ok(old)
}

/// Give devices a bit rate.
///
/// A device takes it with its next power-on if it is stored. With --activate all devices on the bus
/// are told to change at once: each sends nothing for DELAY_MS, changes, and sends nothing for
/// DELAY_MS more. This tool cannot change the bit rate of the interface behind --bus; do that
/// within these delays, then send the devices back with `servobus lss waiting`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss bit-rate 250 --identity 0x408:3:0x10002:3004 --store
  servobus lss bit-rate 500 --identity 0x408:3:0x10002:3004 --identity 0x408:3:0x10002:3005 \\
      --store --activate 2000")]
pub(super) struct BitRateArguments {
    /// In kbit/s: 1000, 800, 500, 250, 125, 50, 20, 10, or `auto`.
    #[arg(value_name = "KBIT_S", value_parser = parse_rate)]
    rate: BitTiming,
    /// Which device: VENDOR:PRODUCT:REVISION:SERIAL. May be given several times.
    #[arg(long, required = true, value_name = "V:P:R:S", value_parser = identity::parse)]
    identity: Vec<Identity>,
    /// Let the devices store it.
    #[arg(long)]
    store: bool,
    /// Let all devices on the bus change to their new bit rate now, with this delay in milliseconds.
    #[arg(long, value_name = "DELAY_MS")]
    activate: Option<u16>,
    #[command(flatten)]
    common: Common,
}

fn parse_rate(text: &str) -> Result<BitTiming, String> {
    if text == "auto" {
        return Ok(BitTiming::Automatic);
    }
    let rate = text.parse().ok().and_then(BitTiming::from_kbit_s);
    rate.ok_or_else(|| "write 1000, 800, 500, 250, 125, 50, 20, 10 or auto".to_owned())
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if a device refuses or does not answer; nothing is
/// activated then.
pub(super) fn bit_rate(arguments: &BitRateArguments) -> Result<ExitCode, Failure> {
    let rate = arguments.rate;
    arguments.common.run(async |mut client| {
        let mut lss = lss(&mut client, arguments.common.settings());
        for identity in &arguments.identity {
            let done = change_rate(&mut lss, *identity, rate, arguments.store).await;
            leave(&mut lss, done).await?;
            let stored = match arguments.store {
                true => ", stored",
                false => "",
            };
            output::print(format_args!("{identity}: {rate}{stored}"))?;
        }
        if let Some(delay_ms) = arguments.activate {
            let switched = lss.switch(State::Configuration).await;
            switched.map_err(Failure::unsuccessful)?;
            let activated = lss.activate_bit_timing(delay_ms).await;
            activated.map_err(Failure::unsuccessful)?;
        }
        linger(&mut client).await
    })?;
    match arguments.activate {
        Some(delay_ms) => output::print(format_args!(
            "the devices change in {delay_ms} ms and are silent until {} ms; give the interface \
             its new bit rate, then: servobus lss waiting",
            u32::from(delay_ms) * 2
        ))?,
        None if !arguments.store => {
            output::print("nothing changes: give --store, --activate or both")?;
        }
        None => output::print("it counts from the next power-on")?,
    }
    Ok(ExitCode::SUCCESS)
}

async fn change_rate<L: Link>(
    lss: &mut Lss<'_, L>,
    identity: Identity,
    rate: BitTiming,
    store: bool,
) -> Result<(), LssError> {
    lss.select(identity).await?;
    lss.set_bit_timing(rate).await?;
    match store {
        true => lss.store().await,
        false => Ok(()),
    }
}

/// Ask a device for its identity and node ID.
///
/// Without --identity there must be one device only on the bus.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss inquire
  servobus lss inquire --identity 0x408:3:0x10002:3004 --json")]
pub(super) struct InquireArguments {
    /// Which device: VENDOR:PRODUCT:REVISION:SERIAL.
    #[arg(long, value_name = "V:P:R:S", value_parser = identity::parse)]
    identity: Option<Identity>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    common: Common,
}

/// What was inquired, for programs.
#[derive(Debug, Serialize)]
struct InquiredRow {
    node: Option<u8>,
    #[serde(flatten)]
    identity: Row,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if no device answers, or several do.
pub(super) fn inquire(arguments: &InquireArguments) -> Result<ExitCode, Failure> {
    let (identity, id) = arguments.common.run(async |mut client| {
        let mut lss = lss(&mut client, arguments.common.settings());
        let identity = match arguments.identity {
            Some(identity) => identity,
            None => only_device(&mut lss).await?,
        };
        let done = ask(&mut lss, identity).await;
        let inquired = leave(&mut lss, done).await?;
        linger(&mut client).await?;
        Ok(inquired)
    })?;
    if arguments.json {
        output::print_json(&InquiredRow {
            node: id.map(NodeId::get),
            identity: identity.into(),
        })?;
    } else {
        output::print(format_args!("{identity}: {}", words(id)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The identity of the only device.
async fn only_device<L: Link>(lss: &mut Lss<'_, L>) -> Result<Identity, Failure> {
    let switched = lss.switch(State::Configuration).await;
    switched.map_err(Failure::unsuccessful)?;
    let asked = lss.inquire_identity().await;
    let identity = leave(lss, asked).await?;
    // Four numbers of several devices make no identity that anybody has.
    let selected = lss.select(identity).await;
    selected.map_err(|error| match error.is_time_out() {
        true => Failure::unsuccessful(
            "several devices answered; name the one that is meant with --identity",
        ),
        false => Failure::unsuccessful(error),
    })?;
    Ok(identity)
}

async fn ask<L: Link>(
    lss: &mut Lss<'_, L>,
    identity: Identity,
) -> Result<(Identity, Option<NodeId>), LssError> {
    lss.select(identity).await?;
    let told = lss.inquire_identity().await?;
    Ok((told, lss.inquire_node_id().await?))
}

/// Send all devices to LSS waiting.
///
/// A device that has got a node ID while it had none boots then. There is no answer.
#[derive(Debug, clap::Args)]
pub(super) struct WaitingArguments {
    #[command(flatten)]
    common: Common,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached, 1 if it is lost.
pub(super) fn waiting(arguments: &WaitingArguments) -> Result<ExitCode, Failure> {
    arguments.common.run(async |mut client| {
        let mut lss = lss(&mut client, arguments.common.settings());
        let switched = lss.switch(State::Waiting).await;
        switched.map_err(Failure::unsuccessful)?;
        linger(&mut client).await
    })?;
    output::print("sent: all devices to LSS waiting")?;
    Ok(ExitCode::SUCCESS)
}
