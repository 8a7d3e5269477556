//! `servobus eds check`: what is wrong with a file.

use std::process::ExitCode;

use eds::{Finding, Severity};
use serde::Serialize;

use crate::{Failure, output};

/// Report what is wrong with an EDS or DCF.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus eds check puck4.eds
  servobus eds check puck4.eds --json

Each finding is one line, FILE:LINE:COLUMN: SEVERITY: what is wrong; what was made of it [RULE].
  error      something of the file cannot be used
  warning    it is used, but contradicts something else, or other programs will stumble over it
  tolerated  not as CiA 306 says, but there is only one way to read it

Exit code 0 without findings or with tolerated ones only, 1 with errors or warnings.")]
pub(super) struct Arguments {
    /// The file.
    file: String,
    /// Print JSON: an array of findings.
    #[arg(long)]
    json: bool,
}

/// A finding, for programs.
#[derive(Debug, Serialize)]
struct Entry<'a> {
    line: u32,
    column: u32,
    severity: &'static str,
    rule: &'static str,
    what: &'a str,
    advice: &'a str,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the file cannot be read.
pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let file = arguments.file.as_str();
    let reading = eds::read(&super::get(file)?);
    if arguments.json {
        let entries: Vec<Entry<'_>> = reading.findings.iter().map(entry).collect();
        output::print_json(&entries)?;
    } else {
        for finding in &reading.findings {
            output::print(finding.in_file(file))?;
        }
        if reading.more_findings > 0 {
            output::print(format!("{file}: {} more findings", reading.more_findings))?;
        }
        output::print(format!("{file}: {}", summary(&reading.findings)))?;
    }
    let is_bad = reading.worst > Some(Severity::Tolerated);
    Ok(Failure::code(!is_bad))
}

fn entry(finding: &Finding) -> Entry<'_> {
    Entry {
        line: finding.place.line,
        column: finding.place.column,
        severity: finding.severity().name(),
        rule: finding.rule.name(),
        what: &finding.what,
        advice: &finding.advice,
    }
}

/// How many findings there are of each severity.
pub(super) fn summary(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return "no findings".to_owned();
    }
    let count = |severity| {
        let findings = findings.iter();
        findings
            .filter(|finding| finding.severity() == severity)
            .count()
    };
    format!(
        "{} errors, {} warnings, {} tolerated",
        count(Severity::Error),
        count(Severity::Warning),
        count(Severity::Tolerated)
    )
}
