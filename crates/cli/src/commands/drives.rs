//! `servobus drives`: what the documented drives can do, one beside the other.

mod comparison;

use std::process::ExitCode;

use personalities::Personality;

use crate::{Failure, drive_kind, output};

/// Compare the documented drives: modes, services, units, errors and limits.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus drives
  servobus drives p3 md80
  servobus drives --json > drives.json

All of it is read from the drives' own tables, so what is printed is what a virtual drive does. A \"-\" says
that the drive does not have it. Behind a limit stands its default.")]
pub(crate) struct Arguments {
    /// Which drives. [default: all]
    #[arg(value_name = "DRIVE", value_parser = drive_kind::parse)]
    drives: Vec<&'static Personality>,
    /// Print JSON: an array of parts with rows, a cell for each drive.
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print tables in Markdown.
    #[arg(long)]
    markdown: bool,
}

/// Runs it.
///
/// # Errors
/// None but those of standard output.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let drives = match arguments.drives.as_slice() {
        [] => personalities::ALL,
        drives => drives,
    };
    let parts = comparison::compare(drives);
    if arguments.json {
        output::print_json(&parts)?;
        return Ok(ExitCode::SUCCESS);
    }
    for (n, part) in parts.iter().enumerate() {
        let mut header = vec![part.title];
        header.extend(drives.iter().map(|drive| drive.name));
        if arguments.markdown {
            let gap = if n == 0 { "" } else { "\n" };
            let line = |cells: &[&str]| format!("| {} |\n", cells.join(" | "));
            let mut text = format!("{gap}{}", line(&header));
            text += &line(&vec!["---"; header.len()]);
            for row in &part.rows {
                let mut cells = vec![row.name.as_str()];
                cells.extend(row.drives.iter().map(String::as_str));
                text += &line(&cells);
            }
            output::print(text.trim_end_matches('\n'))?;
            continue;
        }
        let mut table = output::table(&header);
        for row in &part.rows {
            table.add_row(core::iter::once(&row.name).chain(&row.drives));
        }
        let gap = if n == 0 { "" } else { "\n" };
        output::print(format!("{gap}{}", table.trim_fmt()))?;
    }
    Ok(ExitCode::SUCCESS)
}
