//! What `calibrate` and `tune` have in common: the drive, the bar, Ctrl-C, and the question at the
//! end.

mod display;
pub(super) mod question;
mod table;

use std::io::{self, IsTerminal};
use std::time::Duration;

use canopen::NodeId;
use client::session::{Change, ProcedureError, SaveError, Session, Watch};
use client::{Client, Link};
use personalities::Personality;
use serde::Serialize;

use super::stop::Stop;
use crate::identify::{self, Identity};
use crate::wire::{WireArguments, WireLink};
use crate::{Failure, output, time_span};

use self::question::NoAnswer;
pub(super) use display::Display;
pub(super) use table::ChangeRow;

/// Which drive, and what becomes of the results.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Common {
    /// The node ID, 1 to 127.
    #[arg(long, value_parser = super::sdo::parse_node)]
    pub(super) node: NodeId,
    /// Save the results without asking.
    #[arg(long, conflicts_with = "dry_run")]
    pub(super) yes: bool,
    /// Show the results and save nothing.
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Print JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// How long to wait for each answer.
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = time_span::parse)]
    pub(super) timeout: Duration,
    #[command(flatten)]
    pub(super) wire: WireArguments,
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

/// What is told when results are given up.
const NOT_SAVED: &str = "not saved, the old values are back";

impl Common {
    /// Whether there is somebody to ask, or nobody need be.
    ///
    /// # Errors
    /// There is nobody.
    pub(super) fn can_ask(&self) -> Result<(), Failure> {
        let asks = !self.yes && !self.dry_run;
        match asks && !(io::stdin().is_terminal() && io::stderr().is_terminal()) {
            true => Err(Failure::input(
                "nobody can be asked whether to save; add --yes to save or --dry-run to look only",
            )),
            false => Ok(()),
        }
    }

    /// The drive that the node says it is, if it is known.
    ///
    /// # Errors
    /// Exit code 2 if the bus cannot be reached, 1 if it is lost.
    pub(super) fn drive(&self) -> Result<Option<&'static Personality>, Failure> {
        let identity = self.wire.run(async |connection| {
            let mut client = Client::new(WireLink::new(connection));
            client.settings.answer_ms = time_span::milliseconds(self.timeout);
            let identity = identify::node(&mut client, self.node).await;
            identity.map_err(Failure::unsuccessful)
        });
        identity.map(Identity::drive)
    }

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
        self.can_ask()?;
        let stop = Stop::watch()?;
        self.wire.run(async |connection| {
            let mut client = Client::new(WireLink::new(connection));
            client.settings.answer_ms = time_span::milliseconds(self.timeout);
            let mut session = Session::new(&mut client, self.node, Display::new(stop.clone()));
            let done = work(&mut session).await;
            session.watch().clear();
            let (result, lines) = match done {
                Ok(done) => done,
                // What earlier procedures of the same command found has its old value again, too.
                Err(error) => return Err(Failure::unsuccessful(error)),
            };
            let changes = session.found().to_vec();
            let shown = self.show(&lines, &changes).map_err(NoAnswer::Output);
            let wish = match shown {
                Ok(()) => self.wish(&mut session, &changes, &stop).await,
                Err(why) => Err(why),
            };
            let wish = match wish {
                Ok(wish) => wish,
                Err(why) => {
                    let taken_back = session.discard().await;
                    return Err(match taken_back {
                        Ok(()) => why.failure(self.node, NOT_SAVED),
                        Err(error) => why.failure(self.node, format_args!("not saved; {error}")),
                    });
                }
            };
            match wish {
                Wish::Save => {
                    if let Err(error) = session.save().await {
                        return Err(not_all_saved(&mut session, &error).await);
                    }
                }
                Wish::Discard => session.discard().await.map_err(Failure::unsuccessful)?,
            }
            let saved = wish == Wish::Save;
            match (self.json, saved) {
                (true, _) => output::print_json(&Outcome {
                    node: self.node.get(),
                    result,
                    changes: changes.iter().map(ChangeRow::from).collect(),
                    saved,
                }),
                (false, true) => output::print(format_args!("node {}: saved", self.node)),
                (false, false) => output::print(format_args!("node {}: {NOT_SAVED}", self.node)),
            }
        })
    }

    /// Shows the results to people.
    fn show(&self, lines: &[String], changes: &[Change]) -> Result<(), Failure> {
        if self.json {
            return Ok(());
        }
        for line in lines {
            output::print(line)?;
        }
        output::print(table::text(changes))
    }

    /// Whether to save, as the words of the command or the user say.
    async fn wish<L: Link, W: Watch>(
        &self,
        session: &mut Session<'_, L, W>,
        changes: &[Change],
        stop: &Stop,
    ) -> Result<Wish, NoAnswer> {
        if self.dry_run || changes.is_empty() {
            return Ok(Wish::Discard);
        }
        if stop.asked() {
            return Err(NoAnswer::Stopped);
        }
        if self.yes {
            return Ok(Wish::Save);
        }
        let asked = format!("save these in node {}? [y/N] ", self.node);
        let idle = async || session.idle(question::LOOK_MS).await;
        match question::is_yes(&asked, stop, idle).await? {
            true => Ok(Wish::Save),
            false => Ok(Wish::Discard),
        }
    }
}

/// Tells what is saved and what is not. Where nothing is, the old values come back; else old and new
/// ones would be mixed, so the drive keeps the new ones until its next reset.
async fn not_all_saved<L: Link, W: Watch>(
    session: &mut Session<'_, L, W>,
    error: &SaveError,
) -> Failure {
    if error.saved.is_empty() && !error.is_unsure() {
        return Failure::unsuccessful(match session.discard().await {
            Ok(()) => format!("{error}; the old values are back"),
            Err(more) => format!("{error}; {more}"),
        });
    }
    Failure::unsuccessful(format!(
        "{error}; the drive works with all new values until its next reset: before that, save the \
         others by 0x1010,4, or calibrate or tune again"
    ))
}
