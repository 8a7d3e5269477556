//! What people see while a procedure runs, on standard error.

use std::io::{self, IsTerminal};
use std::time::Duration;

use client::session::{Progress, Watch};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::stop::Stop;
use crate::output;

/// Shows a procedure's steps, with a bar on a terminal; ends it by Ctrl-C.
#[derive(Debug)]
pub(crate) struct Display {
    stop: Stop,
    bar: Option<ProgressBar>,
    step: &'static str,
}

impl Display {
    pub(crate) fn new(stop: Stop) -> Display {
        let bar = io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(1);
            // The template is right.
            let style = ProgressStyle::with_template("{spinner} {msg} {bar:30}");
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Display {
            stop,
            bar,
            step: "",
        }
    }

    fn line(&self, text: String) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => output::tell(text),
        }
    }

    /// Takes the bar away.
    pub(crate) fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Watch for Display {
    fn progress(&mut self, progress: &Progress) {
        match progress {
            Progress::Step(text) => {
                match &self.bar {
                    Some(bar) => {
                        bar.set_message(*text);
                        bar.set_length(1);
                        bar.set_position(0);
                    }
                    // Rounds repeat their steps.
                    None if self.step != *text => output::tell(format_args!("{text} ...")),
                    None => {}
                }
                self.step = text;
            }
            Progress::Part { done, of } => {
                if let Some(bar) = &self.bar {
                    bar.set_length(u64::from(*of));
                    bar.set_position(u64::from(*done));
                }
            }
            Progress::Measured { what, value, unit } => {
                let unit = match *unit {
                    "" => String::new(),
                    unit => format!(" {unit}"),
                };
                self.line(format!("  {what}: {value:.3}{unit}"));
            }
        }
    }

    fn stop(&mut self) -> bool {
        self.stop.asked()
    }
}
