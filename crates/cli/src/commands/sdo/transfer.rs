//! A transfer as its user sees it: a bar if it is long, and an end by Ctrl-C.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use canopen::{Abort, Address, NodeId};
use client::Client;
use client::sdo::{Access, Cause, Done, Progress, SdoError, Sink, Source};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::stop::Stop;
use super::Common;
use crate::Failure;
use crate::wire::WireLink;

/// A transfer gets a bar above this many bytes, or when it has taken this long.
const LONG_BYTES: u64 = 1024;
const LONG: Duration = Duration::from_secs(1);

/// Reads an object into `sink`.
///
/// # Errors
/// As the node says, or Ctrl-C; the node has been told then.
pub(super) fn upload(
    common: &Common,
    object: Address,
    sink: &mut impl Sink,
) -> Result<Done, Failure> {
    let stop = Stop::watch()?;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let mut bar = Bar::new();
        let watch = |progress| bar.show(progress, &stop);
        let outcome = client.upload_to(common.node, object, sink, watch).await;
        bar.end(outcome, &stop)
    })
}

/// Writes an object of `bytes` bytes from `source`.
///
/// # Errors
/// As the node says, or Ctrl-C; the node has been told then.
pub(super) fn download(
    common: &Common,
    object: Address,
    bytes: u32,
    source: &mut impl Source,
) -> Result<Done, Failure> {
    let stop = Stop::watch()?;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let mut bar = Bar::new();
        let watch = |progress| bar.show(progress, &stop);
        let written = client.download_from(common.node, object, bytes, source, watch);
        let outcome = written.await;
        bar.end(outcome, &stop)
    })
}

/// How far the transfer is. Drawn on standard error, if that is a terminal, and only when the
/// transfer turns out to be long.
struct Bar {
    began: Instant,
    now: Progress,
    bar: Option<ProgressBar>,
}

impl Bar {
    fn new() -> Bar {
        Bar {
            began: Instant::now(),
            now: Progress::default(),
            bar: None,
        }
    }

    fn show(&mut self, progress: Progress, stop: &Stop) -> ControlFlow<Abort> {
        if stop.asked() {
            return ControlFlow::Break(Abort::GENERAL);
        }
        self.now = progress;
        let total = progress.total.map(u64::from);
        let is_long = total.is_some_and(|total| total > LONG_BYTES);
        if self.bar.is_none() && (is_long || self.began.elapsed() > LONG) {
            self.bar = Some(drawn(total));
        }
        if let Some(bar) = &mut self.bar {
            if bar.length() != total {
                // The size has become known, or another protocol is tried.
                *bar = drawn(total);
            }
            bar.set_position(u64::from(progress.done));
        }
        ControlFlow::Continue(())
    }

    /// Takes the bar away and makes the one message of a failure.
    fn end(self, outcome: Result<Done, SdoError>, stop: &Stop) -> Result<Done, Failure> {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
        outcome.map_err(|error| match error {
            SdoError {
                node,
                object,
                access,
                cause: Cause::Failed(client::sdo::Failure::Cancelled(_)),
            } if stop.asked() => Failure::unsuccessful(stopped(node, object, access, self.now)),
            error => Failure::unsuccessful(error),
        })
    }
}

fn drawn(total: Option<u64>) -> ProgressBar {
    const KNOWN: &str = "{bar:40} {bytes}/{total_bytes} {bytes_per_sec}, {eta} left";
    const UNKNOWN: &str = "{spinner} {bytes} {bytes_per_sec}";
    let (bar, template) = match total {
        Some(total) => (ProgressBar::new(total), KNOWN),
        None => (ProgressBar::new_spinner(), UNKNOWN),
    };
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        // The templates above are right.
        Err(_) => bar,
    }
}

fn stopped(node: NodeId, object: Address, access: Access, progress: Progress) -> String {
    let done = progress.done;
    let access = match access {
        Access::Read => "reading",
        Access::Write => "writing",
    };
    let of = match progress.total {
        Some(total) => format!(" of {total}"),
        None => String::new(),
    };
    format!("node {node}: {access} {object}: stopped after {done}{of} bytes; the node was told")
}
