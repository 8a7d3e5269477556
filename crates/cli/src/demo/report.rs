//! What came of it, as a table.

use bus::recording::Format;
use canopen::NodeId;
use comfy_table::{Cell, CellAlignment, Table, presets};

use super::dialogue::thousands;
use super::script::{Arrival, Trouble, mode_of};
use super::stage::Phase;
use super::{PLOT, Report, Settings};

/// An act and what came of it.
#[derive(Debug)]
pub(super) struct Act {
    pub(super) node: NodeId,
    /// What was to be reached, in words.
    target: String,
    pub(super) reached: Arrival,
    pub(super) phase: Phase,
}

impl Act {
    /// An axis that does not obey has missed its target.
    ///
    /// # Errors
    /// All other trouble breaks the play off.
    pub(super) fn new(
        node: NodeId,
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
            target,
            reached,
            phase,
        })
    }
}

/// The table, and what else there is to say.
pub(super) fn text(report: &Report, settings: &Settings<'_>) -> String {
    let mut lines = vec![String::new(), table(&report.acts).to_string()];
    for act in &report.acts {
        if let Err(why) = &act.reached {
            lines.push(format!(
                "node {}, {}: not reached, {why}",
                act.node, act.target
            ));
        }
    }
    lines.push(
        "Reached is what the master saw on the bus: target reached (statusword bit 10; in cyclic\n\
         position follows command, bit 12) and the actual value in its window, for good. Current\n\
         and following error are the drive's own measurements of every control period."
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
        let mode = mode_of(act.node);
        let extremes = act.phase.extremes(act.node);
        let reached = match act.reached {
            Ok(ns) => format!("{:.1} ms", ns as f64 * 1e-6),
            Err(_) => "not reached".to_owned(),
        };
        let error = match mode {
            // There is no position to follow.
            cia402::Mode::PROFILE_TORQUE => "\u{2013}".to_owned(),
            _ => format!("{:.1} counts", extremes.following_error_counts),
        };
        let right = |text: String| Cell::new(text).set_alignment(CellAlignment::Right);
        table.add_row([
            right(act.node.to_string()),
            Cell::new(format!("{} {mode}", mode.0)),
            Cell::new(&act.target),
            right(reached),
            right(format!("{:.3} A", extremes.current_a)),
            right(error),
            right(format!("{:.0} %", act.phase.load_percent())),
        ]);
    }
    table
}
