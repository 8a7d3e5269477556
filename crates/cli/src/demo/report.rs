//! What came of it, as a table.

use bus::recording::Format;
use canopen::NodeId;
use comfy_table::{Cell, CellAlignment, Table, presets};

use super::dialogue::thousands;
use super::script::{Arrival, Trouble};
use super::stage::Phase;
use super::{PLOT, Report, Settings};

/// An act and what came of it.
#[derive(Debug)]
pub(super) struct Act {
    pub(super) node: NodeId,
    /// Which axis of the drive, from 0.
    pub(super) axis: usize,
    /// Number and name of the mode.
    pub(super) mode: String,
    /// Whether there is a position to follow.
    pub(super) follows: bool,
    /// What was to be reached, in words.
    pub(super) target: String,
    pub(super) reached: Arrival,
    pub(super) phase: Phase,
}

impl Act {
    /// Of the first axis, with a position to follow. An axis that does not obey has missed its target.
    ///
    /// # Errors
    /// All other trouble breaks the play off.
    pub(super) fn new(
        node: NodeId,
        mode: String,
        target: String,
        (result, phase): (Result<Arrival, Trouble>, Phase),
    ) -> Result<Act, Trouble> {
        let reached = match result {
            Ok(arrival) => arrival,
            Err(Trouble::Axis(error)) => Err(error.to_string()),
            Err(trouble) => return Err(trouble),
        };
        Ok(Act {
            node,
            axis: 0,
            mode,
            follows: true,
            target,
            reached,
            phase,
        })
    }
}

impl Act {
    /// The node, and the axis if it is not the first.
    pub(super) fn who(&self) -> String {
        match self.axis {
            0 => self.node.to_string(),
            axis => format!("{}, axis {}", self.node, axis + 1),
        }
    }
}

/// The table, and what else there is to say.
pub(super) fn text(report: &Report, settings: &Settings<'_>) -> String {
    let mut lines = vec![String::new(), table(&report.acts).to_string()];
    for act in &report.acts {
        if let Err(why) = &act.reached {
            lines.push(format!(
                "node {}, {}: not reached, {why}",
                act.who(),
                act.target
            ));
        }
    }
    lines.push(
        match report.is_p3() {
            true => {
                "Reached is what the master saw on the bus: target reached (statusword bit 10; in cyclic\n\
                 position follows command, bit 12) and the actual value in its window, for good. Current\n\
                 and following error are the drive's own measurements of every control period."
            }
            false => {
                "Reached is what the master read by SDO: the actual value in its window, for good, and with a\n\
                 profile target reached (statusword bit 10), if the drive has one. Current and following\n\
                 error, in counts of the motor, are the drive's first axis's own measurements."
            }
        }
        .to_owned(),
    );
    let reached = report.acts.iter().filter(|act| act.reached.is_ok()).count();
    lines.push(format!(
        "\n{reached} of {} targets reached in {:.3} s of virtual time.",
        report.acts.len(),
        report.length_ns as f64 * 1e-9
    ));
    lines.push(format!("plot: {PLOT}"));
    if let (Some(path), Some(frames)) = (settings.record, report.recorded) {
        let again = match Format::of(path) {
            Ok(Format::Candump) => {
                format!("; servobus replay {} plays it again", path.display())
            }
            _ => String::new(),
        };
        lines.push(format!(
            "recording: {}, {} frames{again}",
            path.display(),
            thousands(frames)
        ));
    }
    lines.join("\n")
}

fn table(acts: &[Act]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_header([
        "node",
        "mode",
        "target",
        "reached\nin",
        "peak\ncurrent",
        "largest\nfollowing error",
        "bus\nload",
    ]);
    for act in acts {
        let extremes = act.phase.extremes(act.node);
        let reached = match act.reached {
            Ok(ns) => format!("{:.1} ms", ns as f64 * 1e-6),
            Err(_) => "not reached".to_owned(),
        };
        let is_first = act.axis == 0;
        let error = match act.follows && is_first {
            // There is no position to follow.
            false => "\u{2013}".to_owned(),
            true => format!("{:.1} counts", extremes.following_error_counts),
        };
        let current = match is_first {
            false => "\u{2013}".to_owned(),
            true => format!("{:.3} A", extremes.current_a),
        };
        let right = |text: String| Cell::new(text).set_alignment(CellAlignment::Right);
        table.add_row([
            right(act.who()),
            Cell::new(&act.mode),
            Cell::new(&act.target),
            right(reached),
            right(current),
            right(error),
            right(format!("{:.0} %", act.phase.load_percent())),
        ]);
    }
    table
}
