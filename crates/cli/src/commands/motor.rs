//! What `calibrate` and `tune` have in common: the drive, the bar, Ctrl-C, and the question at the
//! end.

mod display;
mod table;

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use canopen::NodeId;
use client::Client;
use client::session::{Change, ProcedureError, Session};
use serde::Serialize;

use super::stop::Stop;
use crate::wire::{WireArguments, WireLink};
use crate::{Failure, output, time_span};

pub(super) use display::Display;
pub(super) use table::ChangeRow;

/// Which drive, and what becomes of the results.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Common {
    /// The node ID, 1 to 127.
    #[arg(long, value_parser = super::sdo::parse_node)]
    node: NodeId,
    /// Save the results without asking.
    #[arg(long, conflicts_with = "dry_run")]
    yes: bool,
    /// Show the results and save nothing.
    #[arg(long)]
    dry_run: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// How long to wait for each answer.
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = time_span::parse)]
    timeout: Duration,
    #[command(flatten)]
    wire: WireArguments,
}

/// What a procedure leaves behind, for programs.
#[derive(Debug, Serialize)]
struct Outcome<R> {
    node: u8,
    result: R,
    changes: Vec<ChangeRow>,
    saved: bool,
}

/// What the user wants of the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wish {
    Save,
    Discard,
}

impl Common {
    /// Runs `work` on the drive, shows what it found, and saves that if the user wants it.
    ///
    /// # Errors
    /// Exit code 2 if the bus cannot be reached or nobody can be asked, 1 if the procedure did not
    /// succeed; the motor is without power then.
    pub(super) fn run<R: Serialize>(
        &self,
        work: impl AsyncFnOnce(
            &mut Session<'_, WireLink, Display>,
        ) -> Result<(R, Vec<String>), ProcedureError>,
    ) -> Result<(), Failure> {
        let asks = !self.yes && !self.dry_run;
        if asks && !(io::stdin().is_terminal() && io::stderr().is_terminal()) {
            return Err(Failure::input(
                "nobody can be asked whether to save; add --yes to save or --dry-run to look only",
            ));
        }
        let stop = Stop::watch()?;
        self.wire.run(async |connection| {
            let mut client = Client::new(WireLink::new(connection));
            client.settings.answer_ms = time_span::milliseconds(self.timeout);
            let mut session = Session::new(&mut client, self.node, Display::new(stop.clone()));
            let done = work(&mut session).await;
            session.watch().clear();
            let (result, lines) = match done {
                Ok(done) => done,
                Err(error) => {
                    // What earlier procedures of the same command found is not saved either.
                    let taken_back = session.discard().await;
                    let more = taken_back.err().map(|more| format!("; {more}"));
                    return Err(Failure::unsuccessful(format!(
                        "{error}{}",
                        more.unwrap_or_default()
                    )));
                }
            };
            let changes = session.found().to_vec();
            if !self.json {
                for line in lines {
                    output::print(line)?;
                }
                output::print(table::text(&changes))?;
            }
            let wish = self.wish(&changes, &stop)?;
            match wish {
                Wish::Save => session.save().await.map(|_| ()),
                Wish::Discard => session.discard().await,
            }
            .map_err(Failure::unsuccessful)?;
            let saved = wish == Wish::Save;
            match (self.json, saved) {
                (true, _) => output::print_json(&Outcome {
                    node: self.node.get(),
                    result,
                    changes: changes.iter().map(ChangeRow::from).collect(),
                    saved,
                }),
                (false, true) => output::print(format_args!("node {}: saved", self.node)),
                (false, false) => output::print(format_args!(
                    "node {}: not saved, the old values are back",
                    self.node
                )),
            }
        })
    }

    /// Whether to save, as the words of the command or the user say.
    fn wish(&self, changes: &[Change], stop: &Stop) -> Result<Wish, Failure> {
        if self.dry_run || changes.is_empty() || stop.asked() {
            return Ok(Wish::Discard);
        }
        if self.yes {
            return Ok(Wish::Save);
        }
        let mut error = io::stderr().lock();
        let _ =
            write!(error, "save these in node {}? [y/N] ", self.node).and_then(|()| error.flush());
        let mut answer = String::new();
        io::stdin()
            .read_line(&mut answer)
            .map_err(|error| Failure::input(format!("cannot read the answer: {error}")))?;
        match answer.trim().to_lowercase().as_str() {
            "y" | "yes" if !stop.asked() => Ok(Wish::Save),
            _ => Ok(Wish::Discard),
        }
    }
}
