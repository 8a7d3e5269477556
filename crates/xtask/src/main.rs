//! `cargo xtask`: every chore that a developer or a CI machine runs.
//!
//! `cargo xtask test` is all that CI runs. Each of its steps is a file here: [`mod@format`], [`lint`],
//! [`rust_tests`], [`docs`], [`book`], [`transcripts`], [`outside`], [`dissect`], [`mod@vm`], [`thumb`]. A step that needs
//! something installs it, if it can do so without harm, and says so: Python packages into a virtual
//! environment under `target/`, Debian packages with apt where this runs as root, a Rust target
//! with rustup. What cannot be done on a machine is named in the table at the end, and fails only
//! where `CI=true`.

mod apt;
mod bench;
mod book;
mod command;
mod debian_rust;
mod dissect;
mod docs;
mod format;
mod fuzz;
mod lint;
mod outside;
mod python;
mod rust_tests;
mod step;
mod thumb;
mod transcripts;
mod vm;
mod workspace;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::step::{Outcome, Step};
use crate::thumb::Source;
use crate::workspace::Workspace;

/// Every chore that a developer or CI runs.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    /// What cannot be done on this machine fails, as with CI=true
    #[arg(long, global = true)]
    ci: bool,

    #[command(subcommand)]
    chore: Chore,
}

#[derive(Debug, Subcommand)]
enum Chore {
    /// All checks, from formatting to the build for a Cortex-M4F; runs all even if one fails
    Test {
        /// Only these steps
        #[arg(long, value_delimiter = ',', value_name = "STEP", value_parser = step_names())]
        only: Vec<String>,
    },
    /// Counts what a frame and a control period cost, beside other stacks (valgrind)
    Bench {
        /// Also writes the figures to this file
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Runs one fuzz target on its committed corpus and beyond
    Fuzz {
        /// A name from fuzz/fuzz_targets
        target: String,
        /// Executions before it ends; 0 never ends
        #[arg(long, default_value_t = 1_000_000, value_name = "N")]
        runs: u64,
    },
    /// Renders the book (mdBook) to target/book and follows its links
    Book,
    /// Tests against the CAN of a real Linux kernel, in a virtual machine (QEMU)
    Vm,
    /// Builds the no_std crates for a Cortex-M4F, thumbv7em-none-eabihf
    Thumb {
        /// Where the target's core library comes from
        #[arg(long, value_enum, default_value_t = Source::Auto)]
        source: Source,
    },
}

/// The steps of `test`, cheapest first.
const STEPS: &[Step] = &[
    Step {
        name: "format",
        what: "rustfmt has nothing to change",
        run: format::run,
    },
    Step {
        name: "lint",
        what: "clippy, warnings denied",
        run: lint::run,
    },
    Step {
        name: "rust-tests",
        what: "all Rust tests",
        run: rust_tests::run,
    },
    Step {
        name: "docs",
        what: "the API documentation, warnings denied",
        run: docs::run,
    },
    Step {
        name: "book",
        what: "the book renders, and no link in it leads nowhere",
        run: book::run,
    },
    Step {
        name: "transcripts",
        what: "the bus dialogues of the manuals, played against virtual drives",
        run: transcripts::run,
    },
    Step {
        name: "outside",
        what: "python-can and python-canopen drive the virtual drives",
        run: outside::run,
    },
    Step {
        name: "dissect",
        what: "tshark reads the recording of that",
        run: dissect::run,
    },
    Step {
        name: "vm",
        what: "real CAN interfaces, in a virtual machine",
        run: vm::run,
    },
    Step {
        name: "thumb",
        what: "the no_std crates for thumbv7em-none-eabihf",
        run: thumb::run,
    },
];

fn step_names() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(STEPS.iter().map(|step| step.name))
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let strict = arguments.ci || std::env::var("CI").is_ok_and(|value| value == "true");
    let workspace = match Workspace::find() {
        Ok(workspace) => workspace,
        Err(error) => {
            eprintln!("cargo xtask: {error}");
            return ExitCode::FAILURE;
        }
    };
    let chosen: Vec<&Step> = match &arguments.chore {
        Chore::Test { only } => STEPS
            .iter()
            .filter(|step| only.is_empty() || only.iter().any(|name| name == step.name))
            .collect(),
        _ => Vec::new(),
    };
    let outcome = match arguments.chore {
        Chore::Test { .. } => return step::run_all(&chosen, &workspace, strict),
        Chore::Bench { json } => bench::run(&workspace, json.as_deref()),
        Chore::Fuzz { target, runs } => fuzz::run(&workspace, &target, runs),
        Chore::Book => book::run(&workspace),
        Chore::Vm => vm::run(&workspace),
        Chore::Thumb { source } => thumb::build(&workspace, source),
    };
    match Outcome::from(outcome) {
        Outcome::Done(what) => {
            println!("{what}");
            ExitCode::SUCCESS
        }
        Outcome::Failed(what) => {
            eprintln!("cargo xtask: {what}");
            ExitCode::FAILURE
        }
        Outcome::Impossible { why, remedy } => {
            eprintln!("cargo xtask: not possible here: {why}\n  {remedy}");
            ExitCode::FAILURE
        }
    }
}
