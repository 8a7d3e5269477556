//! A drive's command line: lines of text over a serial line, which read and write the same objects as
//! CANopen does.
//!
//! A line is a character that says its kind, a name, and numbers: `!CW 1 15`. What names there are,
//! and which objects they mean, is a table of the personality ([`Command`]); the grammar is
//! [`CommandLine`]'s. It is a state machine as the rest of the drive is: bytes and time are passed in
//! ([`CommandLine::receive`], [`CommandLine::poll`]), bytes come out ([`CommandLine::transmit`]), and
//! the drive's objects are lent for the call ([`Objects`]).

mod history;
mod line;
mod output;
mod request;
mod row;
mod session;

use canopen::{Abort, Address};

pub use row::{Action, Command, Kind, Object, Of};
pub use session::CommandLine;

/// What a personality says of its serial line.
#[derive(Debug)]
pub struct SerialPort {
    /// The commands that it understands.
    pub commands: &'static [Command],
    /// Bits per second; a byte is ten of them.
    pub bits_per_s: u32,
}

impl SerialPort {
    /// How long a byte takes on the wire, ns: a start bit, eight data bits, a stop bit.
    pub const fn byte_ns(&self) -> u64 {
        let bits_per_s = if self.bits_per_s == 0 {
            1
        } else {
            self.bits_per_s
        };
        (10_000_000_000 + bits_per_s as u64 / 2) / bits_per_s as u64
    }
}

/// The objects of a drive as its command line reaches them: judged as those of an SDO client are.
pub trait Objects {
    /// The present value of an object that is an integer.
    ///
    /// # Errors
    /// What an SDO upload would be answered.
    fn read(&mut self, object: Address) -> Result<i64, Abort>;

    /// Writes an object that is an integer.
    ///
    /// # Errors
    /// What an SDO download would be answered; for a value that the object's type cannot hold, what
    /// its range says.
    fn write(&mut self, object: Address, value: i64) -> Result<(), Abort>;

    /// Asks for all parameters to be stored. When they are, or could not be,
    /// [`CommandLine::stored`] is called.
    ///
    /// # Errors
    /// Why they cannot be stored now.
    fn store(&mut self) -> Result<(), Abort>;
}
