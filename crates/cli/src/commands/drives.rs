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
that the drive does not have it. Behind the object of a limit or threshold stands what a virtual drive has
there at its first start; 0 is none.")]
pub(crate) struct Arguments {
    /// Which drives. [default: all; in tables, of those that differ in their channels only one]
    #[arg(value_name = "DRIVE", value_parser = drive_kind::parse)]
    drives: Vec<&'static Personality>,
    /// Print JSON: the drives' names, and parts with rows, a cell for each drive in that order.
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
        [] if arguments.json => personalities::ALL.to_vec(),
        [] => drive_kind::families(),
        drives => drives.to_vec(),
    };
    let parts = comparison::compare(&drives);
    if arguments.json {
        let names: Vec<&str> = drives.iter().map(|drive| drive.name).collect();
        output::print_json(&serde_json::json!({ "drives": names, "parts": parts }))?;
        return Ok(ExitCode::SUCCESS);
    }
    // Titles are long: a line for each keeps the columns narrow.
    let titles = drives.iter().map(|drive| match arguments.markdown {
        true => format!("- `{}`: {}", drive.name, drive.title),
        false => format!("{}: {}", drive.name, drive.title),
    });
    output::print(titles.collect::<Vec<_>>().join("\n"))?;
    for part in &parts {
        let mut header = vec![part.title];
        header.extend(drives.iter().map(|drive| drive.name));
        if arguments.markdown {
            let line = |cells: &[&str]| format!("| {} |\n", cells.join(" | "));
            let mut text = format!("\n{}", line(&header));
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
        output::print(format!("\n{}", table.trim_fmt()))?;
    }
    Ok(ExitCode::SUCCESS)
}
