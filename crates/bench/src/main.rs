//! `servobus-bench`: measures all subjects and prints a table, or runs one case of one subject, as
//! it does itself under valgrind.

mod control_period;
mod subjects;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs, io};

use bench::block::{self, Contents};
use bench::cyclic_bus::{Cycle, CyclicBus, NoCycle};
use bench::measure::{self, MeasureError};
use bench::period::{self, PeriodTime};
use bench::reference::{self, ReferenceError};
use bench::report::{Figure, Report, Row};
use bench::subject::{Case, Direction, Side, Wrong};
use clap::Parser;
use clap::builder::PossibleValuesParser;
use clap::builder::TypedValueParser as _;

use crate::subjects::{SubjectName, blocks};

/// Counts the instructions a CANopen frame costs, ours beside two other Rust stacks.
///
/// Without options, measures every case of every subject under valgrind and prints a table.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Also writes the figures to this file
    #[arg(long, value_name = "FILE", conflicts_with = "subject")]
    json: Option<PathBuf>,

    /// Puts the control period of motulator beside ours: what python/reference/motulator_bench.py printed
    #[arg(long, value_name = "FILE", conflicts_with = "subject")]
    motulator: Option<PathBuf>,

    /// Runs one case of this stack and measures nothing
    #[arg(long, requires = "case", requires = "iterations", value_parser = subject_parser())]
    subject: Option<SubjectName>,

    /// The case to run
    #[arg(long, requires = "subject", value_parser = case_parser())]
    case: Option<Case>,

    /// How many times to run it
    #[arg(long, requires = "subject", value_name = "N")]
    iterations: Option<u64>,
}

fn subject_parser() -> impl clap::builder::TypedValueParser<Value = SubjectName> {
    let names = SubjectName::ALL.map(SubjectName::name);
    PossibleValuesParser::new(names).try_map(|name| {
        let mut all = SubjectName::ALL.into_iter();
        all.find(|subject| subject.name() == name)
            .ok_or("no such subject")
    })
}

fn case_parser() -> impl clap::builder::TypedValueParser<Value = Case> {
    PossibleValuesParser::new(Case::ALL.map(Case::name)).try_map(|name| {
        let mut all = Case::ALL.into_iter();
        all.find(|case| case.name() == name).ok_or("no such case")
    })
}

#[derive(Debug, thiserror::Error)]
enum Error {
    #[error("{0} has no clock, hence no {case}", case = Case::IdlePoll.name())]
    NoClock(&'static str),
    #[error("{case} is between servobus's own client and server, not for {subject}", case = case.name())]
    OursOnly { subject: &'static str, case: Case },
    #[error("{subject}, {case}: {wrong}", case = case.name())]
    Wrong {
        subject: &'static str,
        case: Case,
        wrong: Wrong,
    },
    #[error("a debug build says nothing about cost: build with --release")]
    DebugBuild,
    #[error(transparent)]
    Measure(#[from] MeasureError),
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    #[error("the path of this program: {0}")]
    Program(io::Error),
    #[error(transparent)]
    NoCycle(#[from] NoCycle),
    #[error("{0}: {1}")]
    Json(PathBuf, io::Error),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match (arguments.subject, arguments.case, arguments.iterations) {
        (Some(subject), Some(case), Some(iterations)) => subjects::run(subject, case, iterations),
        _ => measure_all(arguments.json.as_deref(), arguments.motulator.as_deref()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("servobus-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure_all(json: Option<&Path>, motulator: Option<&Path>) -> Result<(), Error> {
    if cfg!(debug_assertions) {
        return Err(Error::DebugBuild);
    }
    let program = env::current_exe().map_err(Error::Program)?;
    let motulator = motulator.map(reference::read).transpose()?;
    let mut report = Report {
        subjects: SubjectName::ALL
            .map(SubjectName::name)
            .into_iter()
            .chain(motulator.map(|_| reference::MOTULATOR))
            .collect(),
        rows: Vec::new(),
    };
    for case in Case::ALL {
        let figure = |subject: SubjectName| -> Result<Option<Figure>, MeasureError> {
            if !subject.offers(case) {
                return Ok(None);
            }
            let subject = subject.name();
            let arguments = ["--subject", subject, "--case", case.name(), "--iterations"];
            let cost = measure::cost(&program, &arguments, case.run_lengths())?;
            Ok(Some(match case.is_block() {
                true => Figure::InstructionsPerByte(cost.per_byte(block::BYTES)),
                false => Figure::Instructions(cost.per_iteration()),
            }))
        };
        report.rows.push(Row {
            metric: case.metric(),
            figures: SubjectName::ALL
                .into_iter()
                .map(figure)
                .chain(motulator.map(|_| Ok(None)))
                .collect::<Result<_, _>>()?,
        });
    }
    control_periods(&mut report, motulator);
    block_speed(&mut report)?;
    cyclic_hour(&mut report)?;
    println!("{}", report.table());
    if let Some(path) = json {
        let text = format!("{:#}\n", report.json());
        fs::write(path, text).map_err(|error| Error::Json(path.to_owned(), error))?;
    }
    Ok(())
}

/// One drive with its motor: in a world without imperfections, and in one that has them all.
fn control_periods(report: &mut Report, motulator: Option<PeriodTime>) {
    let servobus = SubjectName::Servobus.name();
    for (parameters, metrics, beside) in [
        (
            plant::VIRTUAL_P3,
            ["control_period_ns", "control_period_median_ns"],
            motulator,
        ),
        (
            plant::COMPLETE_P3,
            ["control_period_full_ns", "control_period_full_median_ns"],
            None,
        ),
    ] {
        let run = control_period::new(&parameters);
        let ours = period::measure(period::RUNS, period::PERIODS, run);
        let times: Vec<_> = [(servobus, ours), (reference::MOTULATOR, beside)]
            .into_iter()
            .filter_map(|(name, time)| Some((name, time?)))
            .collect();
        report.push_control_period(metrics, &times);
    }
}

/// An hour of cyclic synchronous position on a bus of 1 Mbit/s: real time, load, following error.
fn cyclic_hour(report: &mut Report) -> Result<(), Error> {
    const HOUR_S: u64 = 3600;
    let metrics = [
        (
            Cycle::FAST,
            [
                "cyclic_hour_4_drives_1000_hz_wall_s",
                "cyclic_hour_4_drives_1000_hz_missed",
                "cyclic_hour_4_drives_1000_hz_load_percent",
                "cyclic_hour_4_drives_1000_hz_following_error_counts",
            ],
        ),
        (
            Cycle::WIDE,
            [
                "cyclic_hour_6_drives_500_hz_wall_s",
                "cyclic_hour_6_drives_500_hz_missed",
                "cyclic_hour_6_drives_500_hz_load_percent",
                "cyclic_hour_6_drives_500_hz_following_error_counts",
            ],
        ),
    ];
    for (cycle, metrics) in metrics {
        let mut bus = CyclicBus::new(cycle, 1)?;
        let outcome = bus.run(HOUR_S * u64::from(cycle.sync_hz), |_| {});
        let missed = outcome.missed + outcome.not_following;
        let figures = [
            outcome.wall.as_secs_f64(),
            missed as f64,
            100.0 * outcome.load,
            outcome.following_error_counts,
        ];
        for (metric, figure) in metrics.into_iter().zip(figures) {
            report.push_decimal(metric, SubjectName::Servobus.name(), figure);
        }
    }
    Ok(())
}

/// How fast our own pair transfers blocks.
fn block_speed(report: &mut Report) -> Result<(), Error> {
    let contents = Contents::new(block::BYTES);
    let upload = [
        "block_upload_bytes_per_s",
        "block_upload_median_bytes_per_s",
    ];
    let pair = blocks::uploads(&contents);
    push_block_speed(
        report,
        Case::Block(Direction::Upload, Side::Pair),
        upload,
        pair,
    )?;
    let download = [
        "block_download_bytes_per_s",
        "block_download_median_bytes_per_s",
    ];
    let pair = blocks::downloads(&contents);
    push_block_speed(
        report,
        Case::Block(Direction::Download, Side::Pair),
        download,
        pair,
    )
}

fn push_block_speed(
    report: &mut Report,
    case: Case,
    metrics: [&'static str; 2],
    mut transfer: impl FnMut() -> Result<(), Wrong>,
) -> Result<(), Error> {
    let subject = SubjectName::Servobus.name();
    let mut result = Ok(());
    let run = || {
        if let Err(wrong) = transfer() {
            result = Err(wrong);
        }
    };
    let time = period::measure(period::RUNS, period::TRANSFERS, run);
    result.map_err(|wrong| Error::Wrong {
        subject,
        case,
        wrong,
    })?;
    if let Some(time) = time {
        report.push_block_speed(metrics, subject, block::BYTES, time);
    }
    Ok(())
}
