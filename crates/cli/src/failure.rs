//! Why a subcommand ended without success, and the exit code that says so.

use std::fmt::Display;
use std::io;
use std::process::ExitCode;

use crate::output;

/// Exit code: what was asked for did not succeed.
const UNSUCCESSFUL: u8 = 1;
/// Exit code: bad input or surroundings.
const BAD_INPUT: u8 = 2;

/// Why a subcommand ended without success.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What was asked for did not succeed. Exit code 1.
    Unsuccessful(String),
    /// Bad input or surroundings. Exit code 2.
    Input(String),
    /// Whoever read the output has enough (`servobus od p3 | head`). Exit code 0, no message.
    ReaderGone,
}

impl Failure {
    /// What was asked for did not succeed.
    pub(crate) fn unsuccessful(why: impl Display) -> Failure {
        Failure::Unsuccessful(why.to_string())
    }

    /// Bad input or surroundings.
    pub(crate) fn input(why: impl Display) -> Failure {
        Failure::Input(why.to_string())
    }

    /// Writing to standard output failed.
    pub(crate) fn output(error: io::Error) -> Failure {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Failure::ReaderGone,
            _ => Failure::Input(format!("cannot write to standard output: {error}")),
        }
    }

    /// Prints the message and gives the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let (message, code) = match self {
            Failure::Unsuccessful(message) => (message, UNSUCCESSFUL),
            Failure::Input(message) => (message, BAD_INPUT),
            Failure::ReaderGone => return ExitCode::SUCCESS,
        };
        output::tell(format_args!("error: {message}"));
        ExitCode::from(code)
    }

    /// The exit code of a subcommand that has said all it has to say: 0 or 1.
    pub(crate) fn code(succeeded: bool) -> ExitCode {
        match succeeded {
            true => ExitCode::SUCCESS,
            false => ExitCode::from(UNSUCCESSFUL),
        }
    }
}
