//! A transfer as its user sees it: a bar if it is long, and an end by Ctrl-C.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use canopen::{Abort, Address, NodeId};
use client::Client;
use client::sdo::{Access, Cause, Done, Progress, SdoError, Sink};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::stop::Stop;
use super::Common;
use crate::Failure;
use crate::identify::Identity;
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
    let read = upload_and(common, object, sink, async |_| Ok(()));
    read.map(|(done, ())| done)
}

/// Reads an object into `sink`, and asks which drive the node is.
///
/// # Errors
/// As the node says, or Ctrl-C; the node has been told then.
pub(super) fn upload_and_identify(
    common: &Common,
    object: Address,
    sink: &mut impl Sink,
) -> Result<(Done, Identity), Failure> {
    upload_and(common, object, sink, async |client| {
        common.identity(client).await
    })
}

fn upload_and<T>(
    common: &Common,
    object: Address,
    sink: &mut impl Sink,
    then: impl AsyncFnOnce(&mut Client<WireLink>) -> Result<T, Failure>,
) -> Result<(Done, T), Failure> {
    let stop = Stop::watch()?;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let mut bar = Bar::new();
        let watch = |progress| bar.show(progress, &stop);
        let outcome = client.upload_to(common.node, object, sink, watch).await;
        let done = bar.end(outcome, &stop)?;
        Ok((done, then(&mut client).await?))
    })
}

/// Writes the bytes of `source` to an object, and gives what else that has. If it `asks` and nobody has
/// said it, the node is asked first which drive it is; else `source` comes before anything is sent.
///
/// # Errors
/// As the node or the source says, or Ctrl-C; the node has been told then.
pub(super) fn download<T>(
    common: &Common,
    object: Address,
    asks: bool,
    source: impl FnOnce(Identity) -> Result<(Vec<u8>, T), Failure>,
) -> Result<T, Failure> {
    let said = match asks {
        true => common.said(),
        false => Some(Identity::Unknown),
    };
    let ready = match said {
        Some(identity) => Ok(source(identity)?),
        None => Err(source),
    };
    let stop = Stop::watch()?;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let (bytes, more) = match ready {
            Ok(ready) => ready,
            Err(source) => source(common.identity(&mut client).await?)?,
        };
        let Ok(count) = u32::try_from(bytes.len()) else {
            let most = u32::MAX;
            let what = format!("{object}: no object has more than {most} bytes");
            return Err(Failure::input(what));
        };
        let mut bar = Bar::new();
        let watch = |progress| bar.show(progress, &stop);
        let mut left = bytes.as_slice();
        let written = client.download_from(common.node, object, count, &mut left, watch);
        let outcome = written.await;
        bar.end(outcome, &stop)?;
        Ok(more)
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
