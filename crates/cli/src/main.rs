//! The `servobus` command: virtual servo drives on a CAN bus, and a tool for such drives.
//!
//! One file per subcommand in `commands`; each has its arguments (clap) and one function that runs
//! it. A subcommand returns its exit code, or a [`Failure`] that carries one message.

mod commands;
pub(crate) mod demo;
mod drive_kind;
mod failure;
mod identify;
mod named_drives;
mod node_list;
mod object_address;
mod output;
mod plant_bench;
mod record_file;
mod scenario_file;
mod time_span;
mod wire;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use commands::{
    calibrate, drives, eds, lss, monitor, nmt, od, play, program, replay, scan, scenario, sdo, sim,
    tune,
};
pub(crate) use failure::Failure;

/// Virtual CiA 402 servo drives on a CAN bus, and a tool to find, read, operate and test such drives.
#[derive(Debug, Parser)]
#[command(
    version,
    arg_required_else_help = true,
    after_help = "\
Exit codes:
  0  it is done
  1  it did not succeed: a drive refused or gave no answer, a transcript failed, a replay differs,
     the connection was lost
  2  bad input or surroundings: unknown words, files that cannot be read, ports that are busy,
     a bus that cannot be reached; nothing has been done then

Start here:
  servobus sim --nodes 1-3            three virtual drives behind socketcand://127.0.0.1:29536
  servobus scan                       (in another terminal) who is on that bus?
  servobus sdo read --node 1 0x6041   its statusword, in words"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Sim(sim::Arguments),
    Replay(replay::Arguments),
    Scan(scan::Arguments),
    Sdo(sdo::Arguments),
    Nmt(nmt::Arguments),
    Lss(lss::Arguments),
    Monitor(monitor::Arguments),
    Od(od::Arguments),
    Drives(drives::Arguments),
    Eds(eds::Arguments),
    Calibrate(calibrate::Arguments),
    Tune(tune::Arguments),
    Play(play::Arguments),
    Program(program::Arguments),
    Scenario(scenario::Arguments),
    Demo(demo::Arguments),
}

fn main() -> ExitCode {
    let result = match &Arguments::parse().command {
        Command::Sim(arguments) => sim::run(arguments),
        Command::Replay(arguments) => replay::run(arguments),
        Command::Scan(arguments) => scan::run(arguments),
        Command::Sdo(arguments) => sdo::run(arguments),
        Command::Nmt(arguments) => nmt::run(arguments),
        Command::Lss(arguments) => lss::run(arguments),
        Command::Monitor(arguments) => monitor::run(arguments),
        Command::Od(arguments) => od::run(arguments),
        Command::Drives(arguments) => drives::run(arguments),
        Command::Eds(arguments) => eds::run(arguments),
        Command::Calibrate(arguments) => calibrate::run(arguments),
        Command::Tune(arguments) => tune::run(arguments),
        Command::Play(arguments) => play::run(arguments),
        Command::Program(arguments) => program::run(arguments),
        Command::Scenario(arguments) => scenario::run(arguments),
        Command::Demo(arguments) => demo::run(arguments),
    };
    result.unwrap_or_else(|failure| failure.report())
}
