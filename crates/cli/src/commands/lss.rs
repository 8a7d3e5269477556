//! `servobus lss`: node IDs and bit rates by layer setting services.

mod configure;
mod find;
mod identity;
mod progress;

use std::process::ExitCode;
use std::time::Duration;

use client::{Client, Link};

use crate::wire::{WireArguments, WireLink};
use crate::{Failure, time_span};

/// Give devices their node IDs and bit rates (LSS, CiA 305).
///
/// There must be no other LSS master on the bus. A device is named by its identity, the four
/// numbers of object 0x1018: VENDOR:PRODUCT:REVISION:SERIAL.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus lss scan                              who has no node ID?
  servobus lss assign --ids 5,6,7                give each of them one, and store it
  servobus lss set-id --identity 0x408:3:0x10002:3004 9 --store
  servobus lss inquire --identity 0x408:3:0x10002:3004

Exit code 1 if a device refuses or does not answer.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    service: Service,
}

#[derive(Debug, clap::Subcommand)]
enum Service {
    Scan(find::ScanArguments),
    Assign(find::AssignArguments),
    SetId(configure::SetIdArguments),
    BitRate(configure::BitRateArguments),
    Inquire(configure::InquireArguments),
    Waiting(configure::WaitingArguments),
}

/// Where the bus is, and how long to wait.
#[derive(Debug, clap::Args)]
struct Common {
    #[command(flatten)]
    wire: WireArguments,
    /// How long a device may take to answer.
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = short_time)]
    timeout: Duration,
    /// How long a device may take to store.
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = short_time)]
    store_timeout: Duration,
}

impl Common {
    fn settings(&self) -> canopen::lss::Settings {
        canopen::lss::Settings {
            answer_ms: milliseconds(self.timeout),
            store_ms: milliseconds(self.store_timeout),
            ..canopen::lss::Settings::default()
        }
    }

    /// Connects and runs `work` with a client.
    fn run<T>(
        &self,
        work: impl AsyncFnOnce(Client<WireLink>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        self.wire
            .run(async |connection| work(Client::new(WireLink::new(connection))).await)
    }
}

/// LSS times have 16 bits of milliseconds.
fn short_time(text: &str) -> Result<Duration, String> {
    let time = time_span::parse(text)?;
    match u16::try_from(time_span::milliseconds(time)) {
        Ok(_) => Ok(time),
        Err(_) => Err("it must be at most 65s".to_owned()),
    }
}

/// Of a time that [`short_time`] gave.
fn milliseconds(time: Duration) -> u16 {
    u16::try_from(time_span::milliseconds(time)).unwrap_or(u16::MAX)
}

/// How long the connection stays open behind a request without answer, so that it gets onto the
/// wire.
const LINGER_MS: u64 = 50;

/// Waits until what was sent is on the wire.
async fn linger(client: &mut Client<WireLink>) -> Result<(), Failure> {
    let until = client.now().plus_ms(LINGER_MS);
    while client
        .link()
        .receive(until)
        .await
        .map_err(Failure::unsuccessful)?
        .is_some()
    {}
    Ok(())
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the bus cannot be reached or what is asked for makes no sense, 1 if a device
/// refuses or does not answer.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.service {
        Service::Scan(arguments) => find::scan(arguments),
        Service::Assign(arguments) => find::assign(arguments),
        Service::SetId(arguments) => configure::set_id(arguments),
        Service::BitRate(arguments) => configure::bit_rate(arguments),
        Service::Inquire(arguments) => configure::inquire(arguments),
        Service::Waiting(arguments) => configure::waiting(arguments),
    }
}
