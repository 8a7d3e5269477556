//! A question to the user, while the bus is read.

use std::fmt::Display as Shown;
use std::io::{self, Write};
use std::sync::mpsc::{self, TryRecvError};
use std::thread;

use canopen::NodeId;
use client::LinkError;

use super::super::stop::Stop;
use crate::{Failure, output};

/// Why the user could not be asked, or has not answered.
#[derive(Debug)]
pub(crate) enum NoAnswer {
    /// By Ctrl-C or a signal.
    Stopped,
    /// What is asked about could not be shown.
    Output(Failure),
    /// The answer could not be read.
    Input(io::Error),
    /// The bus was lost meanwhile.
    Link(LinkError),
}

impl NoAnswer {
    /// With what has become of what was asked about.
    pub(crate) fn failure(self, node: NodeId, end: impl Shown) -> Failure {
        let tell = |why: &dyn Shown| format!("node {node}: {why}; {end}");
        match self {
            NoAnswer::Stopped => Failure::unsuccessful(tell(&"stopped")),
            NoAnswer::Output(Failure::ReaderGone) => {
                Failure::unsuccessful(tell(&"nobody reads the results"))
            }
            NoAnswer::Output(Failure::Unsuccessful(why)) => Failure::unsuccessful(tell(&why)),
            NoAnswer::Output(Failure::Input(why)) => Failure::input(tell(&why)),
            NoAnswer::Input(error) => {
                Failure::input(tell(&format_args!("cannot read the answer: {error}")))
            }
            NoAnswer::Link(error) => Failure::unsuccessful(tell(&error)),
        }
    }
}

/// How often a question that waits looks for the answer and for Ctrl-C, ms.
pub(crate) const LOOK_MS: u64 = 20;

/// Asks on standard error and takes a line of standard input. `idle` passes [`LOOK_MS`] and reads the
/// bus.
///
/// # Errors
/// There is no answer.
pub(crate) async fn is_yes(
    text: &str,
    stop: &Stop,
    idle: impl AsyncFnMut() -> Result<(), LinkError>,
) -> Result<bool, NoAnswer> {
    let mut error = io::stderr().lock();
    let _ = write!(error, "{text}").and_then(|()| error.flush());
    drop(error);
    match answer(stop, idle).await {
        Ok(answer) => Ok(matches!(answer.trim().to_lowercase().as_str(), "y" | "yes")),
        Err(why) => {
            // Nobody has ended the question's line.
            output::tell("");
            Err(why)
        }
    }
}

/// A line of standard input. Reading it may last for ever, so another thread does; the bus is
/// read meanwhile.
async fn answer(
    stop: &Stop,
    mut idle: impl AsyncFnMut() -> Result<(), LinkError>,
) -> Result<String, NoAnswer> {
    let (sender, answer) = mpsc::channel();
    thread::spawn(move || {
        let mut line = String::new();
        // If nobody waits any more, nobody needs it.
        let _ = sender.send(io::stdin().read_line(&mut line).map(|_| line));
    });
    loop {
        if stop.asked() {
            return Err(NoAnswer::Stopped);
        }
        match answer.try_recv() {
            Ok(line) => return line.map_err(NoAnswer::Input),
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return Ok(String::new()),
        }
        idle().await.map_err(NoAnswer::Link)?;
    }
}
