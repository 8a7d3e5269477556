//! What `calibrate` and `tune` have in common: the drive, the bar, Ctrl-C, and the question at the
//! end.

mod display;
mod table;

use std::fmt::Display as Shown;
use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{self, TryRecvError};
use std::thread;
use std::time::Duration;

use canopen::NodeId;
use client::session::{Change, ProcedureError, SaveError, Session, Watch};
use client::{Client, Link, LinkError};
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

/// Why the user could not be asked, or has not answered.
#[derive(Debug)]
enum NoAnswer {
    /// By Ctrl-C or a signal.
    Stopped,
    /// The results could not be shown.
    Output(Failure),
    /// The answer could not be read.
    Input(io::Error),
    /// The bus was lost meanwhile.
    Link(LinkError),
}

impl NoAnswer {
    /// With what has become of the results.
    fn failure(self, node: NodeId, end: impl Shown) -> Failure {
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
const LOOK_MS: u64 = 20;
/// What is told when results are given up.
const NOT_SAVED: &str = "not saved, the old values are back";

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
        let mut error = io::stderr().lock();
        let _ =
            write!(error, "save these in node {}? [y/N] ", self.node).and_then(|()| error.flush());
        drop(error);
        match self.answer(session, stop).await {
            Ok(answer) => match answer.trim().to_lowercase().as_str() {
                "y" | "yes" => Ok(Wish::Save),
                _ => Ok(Wish::Discard),
            },
            Err(why) => {
                // Nobody has ended the question's line.
                output::tell("");
                Err(why)
            }
        }
    }

    /// A line of standard input. Reading it may last for ever, so another thread does; the bus is
    /// read meanwhile.
    async fn answer<L: Link, W: Watch>(
        &self,
        session: &mut Session<'_, L, W>,
        stop: &Stop,
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
            session.idle(LOOK_MS).await.map_err(NoAnswer::Link)?;
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
