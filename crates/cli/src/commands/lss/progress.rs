//! What people see while a scan goes on.

use std::io::{self, IsTerminal, Write};

use client::lss::Progress;

use crate::output;

/// Shows progress on standard error: one line that changes on a terminal, else only what is found.
#[derive(Debug)]
pub(super) struct Display {
    terminal: bool,
    /// Whether the changing line is there.
    shown: bool,
}

/// Questions of one scan.
const QUESTIONS: u16 = 133;

impl Display {
    pub(super) fn new() -> Display {
        Display {
            terminal: io::stderr().is_terminal(),
            shown: false,
        }
    }

    /// Shows how far it is.
    pub(super) fn show(&mut self, progress: Progress) {
        match progress {
            Progress::Scanning { asked } if self.terminal => {
                let percent = u32::from(asked) * 100 / u32::from(QUESTIONS);
                self.shown = true;
                // If nobody reads that, nobody is told.
                let mut error = io::stderr().lock();
                let _ = write!(error, "\rscanning, {percent:3} %").and_then(|()| error.flush());
            }
            Progress::Scanning { .. } => {}
            Progress::Found(identity) => self.line(format!("found {identity}")),
            Progress::Lost => {
                self.line("a scan found none of the devices that answer; again".into())
            }
            Progress::Assigned(assigned) => self.line(format!(
                "{} is node {} now",
                assigned.identity, assigned.node
            )),
        }
    }

    fn line(&mut self, text: String) {
        self.clear();
        output::tell(text);
    }

    /// Takes the changing line away.
    pub(super) fn clear(&mut self) {
        if std::mem::take(&mut self.shown) {
            let mut error = io::stderr().lock();
            let _ = write!(error, "\r\x1b[K").and_then(|()| error.flush());
        }
    }
}
