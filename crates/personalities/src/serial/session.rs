//! The command line itself: from bytes to what they ask for, and to the answer.

use canopen::{Abort, Instant};

use super::history::{Asked, History};
use super::line::{Line, Taken};
use super::output::Output;
use super::request::{Numbers, Request, parse};
use super::{Action, Command, Kind, Objects, Of};

/// The command line of one drive.
///
/// Call [`CommandLine::receive`] with each byte as it comes, while [`CommandLine::is_ready`];
/// [`CommandLine::poll`] at [`CommandLine::next_deadline`]; and send what [`CommandLine::transmit`]
/// gives. Whatever comes, it is answered or passed over: no input is an error of the program.
///
/// A line ends with a carriage return or an underscore. Small letters mean the same as capitals, and
/// other control characters nothing, but for ENQ (0x05), which is answered ACK (0x06) at once.
/// Characters are sent back as they come, unless that is switched off. A line that is too long, has
/// something in it that is no text, or makes no sense is answered `-`.
#[derive(Clone, Copy, Debug)]
pub struct CommandLine {
    commands: &'static [Command],
    channels: u8,
    line: Line,
    output: Output,
    echoes: bool,
    history: History,
    /// Queries of the history are asked again by themselves, each so many milliseconds.
    every_ms: u16,
    due: Instant,
    /// The line has not been answered: parameters are being stored.
    waits: bool,
}

/// ACK: somebody is there.
const ACKNOWLEDGE: u8 = 0x06;

/// The line was not obeyed: its answer is `-`.
#[derive(Clone, Copy, Debug)]
struct Refused;

impl From<Abort> for Refused {
    fn from(_: Abort) -> Refused {
        Refused
    }
}

impl CommandLine {
    /// That of a drive which has just been switched on, with these commands and so many channels.
    pub const fn new(commands: &'static [Command], channels: u8) -> CommandLine {
        CommandLine {
            commands,
            channels,
            line: Line::EMPTY,
            output: Output::EMPTY,
            echoes: true,
            history: History::EMPTY,
            every_ms: 0,
            due: Instant::NEVER,
            waits: false,
        }
    }

    /// Whether it takes another byte now. It does not while the answer to a store is awaited, nor
    /// while so much waits to be sent that the next answer would not fit.
    pub fn is_ready(&self) -> bool {
        !self.waits && self.output.has_room()
    }

    /// Takes a byte from the line. While it is not ready, the byte is lost.
    pub fn receive(&mut self, byte: u8, now: Instant, drive: &mut impl Objects) {
        if !self.is_ready() {
            return;
        }
        let taken = self.line.push(byte);
        if self.echoes && matches!(taken, Taken::Character | Taken::End) {
            self.output.push(byte);
        }
        if taken == Taken::Enquiry {
            self.output.push(ACKNOWLEDGE);
        }
        if taken == Taken::End {
            let line = core::mem::replace(&mut self.line, Line::EMPTY);
            self.obey(&line, now, drive);
        }
    }

    /// Asks the next query of the history again, if it is time.
    pub fn poll(&mut self, now: Instant, drive: &mut impl Objects) {
        if now < self.due || self.due == Instant::NEVER {
            return;
        }
        // After a pause there is one, not a burst.
        let due = self.due.plus_ms(u64::from(self.every_ms));
        self.due = if due > now {
            due
        } else {
            now.plus_ms(u64::from(self.every_ms))
        };
        if self.is_ready() {
            self.ask_again(drive);
        }
    }

    /// When [`CommandLine::poll`] must be called next.
    pub fn next_deadline(&self) -> Instant {
        self.due
    }

    /// The next byte to send, if there is one.
    pub fn transmit(&mut self) -> Option<u8> {
        self.output.pop()
    }

    /// Whether [`CommandLine::transmit`] would give nothing.
    pub fn is_silent(&self) -> bool {
        self.output.is_empty()
    }

    /// What [`Objects::store`] was asked for is done (`true`), or could not be. Does nothing if
    /// nobody waits for it.
    pub fn stored(&mut self, done: bool) {
        if core::mem::take(&mut self.waits) {
            self.acknowledge(done);
        }
    }

    /// Nobody is at the other end any more: half a line is forgotten, queries are not asked again by
    /// themselves, and what waits is not sent.
    pub fn hang_up(&mut self) {
        self.line = Line::EMPTY;
        self.due = Instant::NEVER;
        self.output = Output::EMPTY;
        self.waits = false;
    }

    fn obey(&mut self, line: &Line, now: Instant, drive: &mut impl Objects) {
        let Some(text) = line.text() else {
            return self.acknowledge(false);
        };
        if text.is_empty() {
            return;
        }
        match parse(text) {
            None => self.acknowledge(false),
            Some(Request::Clear) => {
                self.history = History::EMPTY;
                self.due = Instant::NEVER;
            }
            Some(Request::Repeat { every_ms }) => {
                self.every_ms = every_ms;
                self.due = now.plus_ms(u64::from(every_ms));
            }
            Some(Request::Next) => match self.due {
                Instant::NEVER => self.ask_again(drive),
                _ => self.due = Instant::NEVER,
            },
            Some(Request::Command {
                kind,
                name,
                numbers,
            }) => {
                if self.command(kind, name, numbers, drive).is_err() {
                    self.acknowledge(false);
                }
            }
        }
    }

    fn acknowledge(&mut self, done: bool) {
        self.output.text(if done { b"+\r" } else { b"-\r" });
    }

    /// Does what a command asks for and answers it, but for a refusal.
    fn command(
        &mut self,
        kind: Kind,
        name: &[u8],
        numbers: Numbers,
        drive: &mut impl Objects,
    ) -> Result<(), Refused> {
        let is_it = |command: &Command| {
            command.kind == kind && command.name.as_bytes().eq_ignore_ascii_case(name)
        };
        let row = self.commands.iter().position(is_it).ok_or(Refused)?;
        let command = self.commands.get(row).ok_or(Refused)?;
        match kind {
            Kind::Query | Kind::Get => {
                let number = match numbers {
                    Numbers::None => None,
                    Numbers::One(number) => Some(number),
                    Numbers::Two(..) => return Err(Refused),
                };
                self.tell(command, number, drive)?;
                if let (Kind::Query, Ok(row)) = (kind, u8::try_from(row)) {
                    self.history.push(Asked { row, number });
                }
            }
            Kind::Command | Kind::Set => {
                let (which, value) = match (numbers, command.of) {
                    (Numbers::None, Of::Order) => (1, 1),
                    (Numbers::One(value), Of::Drive) => (1, value),
                    // With one channel its number may be left out.
                    (Numbers::One(value), Of::Channel) if self.channels == 1 => (1, value),
                    (Numbers::Two(which, value), Of::Channel | Of::Pair | Of::Elements(_)) => {
                        (which, value)
                    }
                    _ => return Err(Refused),
                };
                let which = self.which(command, which)?;
                self.write(command, which, value, drive)?;
                self.acknowledge(true);
            }
            Kind::Maintenance => {
                if numbers != Numbers::None {
                    return Err(Refused);
                }
                match command.action {
                    Action::Store => {
                        drive.store()?;
                        self.waits = true;
                    }
                    _ => return Err(Refused),
                }
            }
        }
        Ok(())
    }

    /// Asks the next query of the history; only its answer is sent.
    fn ask_again(&mut self, drive: &mut impl Objects) {
        let Some(asked) = self.history.next() else {
            return;
        };
        let Some(command) = self.commands.get(usize::from(asked.row)) else {
            return;
        };
        if self.tell(command, asked.number, drive).is_err() {
            self.acknowledge(false);
        }
    }

    /// How many values a command has.
    fn values(&self, command: &Command) -> u8 {
        match command.of {
            Of::Drive | Of::Order => 1,
            Of::Channel => self.channels,
            Of::Pair => self.channels.saturating_mul(2),
            Of::Elements(count) => count,
        }
    }

    /// Which value is meant by a number of a line, from 0.
    fn which(&self, command: &Command, number: i32) -> Result<u8, Refused> {
        let count = self.values(command);
        let which = number.checked_sub(1).and_then(|n| u8::try_from(n).ok());
        which.filter(|which| *which < count).ok_or(Refused)
    }

    /// Answers with a value, or with all that there are.
    fn tell(
        &mut self,
        command: &Command,
        number: Option<i32>,
        drive: &mut impl Objects,
    ) -> Result<(), Refused> {
        let (first, count) = match number {
            Some(_) if command.of == Of::Drive => return Err(Refused),
            Some(number) => (self.which(command, number)?, 1),
            None => (0, self.values(command)),
        };
        // All are read before the first is told: an answer is whole, or a refusal.
        let mut values = [0; MOST_VALUES];
        let mut told = 0;
        for (which, place) in (first..first.saturating_add(count)).zip(&mut values) {
            *place = self.read(command, which, drive)?;
            told += 1;
        }
        self.output.text(command.name.as_bytes());
        let mut between = b'=';
        for value in values.iter().take(told) {
            self.output.push(between);
            self.output.number(*value);
            between = b':';
        }
        self.output.push(b'\r');
        Ok(())
    }

    fn read(&self, command: &Command, which: u8, drive: &mut impl Objects) -> Result<i64, Refused> {
        let (channel, step) = place(command, which);
        match command.action {
            Action::Read(object) => Ok(drive.read(object.at(channel, step))?),
            Action::Echo => Ok(i64::from(!self.echoes)),
            Action::Write(_) | Action::Store => Err(Refused),
        }
    }

    fn write(
        &mut self,
        command: &Command,
        which: u8,
        value: i32,
        drive: &mut impl Objects,
    ) -> Result<(), Refused> {
        let (channel, step) = place(command, which);
        match command.action {
            Action::Write(object) => drive.write(object.at(channel, step), i64::from(value))?,
            Action::Echo => match value {
                0 | 1 => self.echoes = value == 0,
                _ => return Err(Refused),
            },
            Action::Read(_) | Action::Store => return Err(Refused),
        }
        Ok(())
    }
}

/// The most values that one answer has.
pub(super) const MOST_VALUES: usize = 16;

/// The channel, and how many sub-indices further, of a value.
fn place(command: &Command, which: u8) -> (u8, u8) {
    match command.of {
        Of::Pair => (which / 2, which % 2),
        Of::Elements(_) => (0, which),
        Of::Drive | Of::Order | Of::Channel => (which, 0),
    }
}
