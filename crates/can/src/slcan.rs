//! The slcan text protocol (Lawicel CANUSB/CAN232), for both ends, without I/O.
//!
//! The host sends commands, each closed by a carriage return; the adapter answers each with a
//! carriage return (done) or BEL (refused) and sends received frames as lines of the same shape:
//!
//! | host → adapter | | adapter → host | |
//! |---|---|---|---|
//! | `O` `L` `C` | open, open listen-only, close | `\r` / BEL | done / refused |
//! | `S0`–`S8` | bit rate | | |
//! | `sXXYY` | bit timing registers | | |
//! | `tIIIL…` `TIIIIIIIIL…` | send data, 11/29 bit | `z\r` / `Z\r` | queued |
//! | `rIIIL` `RIIIIIIIIL` | send remote, 11/29 bit | `z\r` / `Z\r` | queued |
//! | `V` `N` `F` | version, serial number, flags | `V1013` `N0001` `F00` | |
//! | `Z0` `Z1` | time stamps off, on | `tIIIL…SSSS` | with milliseconds |
//! | `MXXXXXXXX` `mXXXXXXXX` | acceptance code, mask | | |
//!
//! [`Commands`] decodes what a host sends, [`Answers`] what an adapter sends. Both take bytes one
//! at a time, in any portions, and survive anything: a line that is too long or makes no sense
//! gives one [`Error`], and the next carriage return starts afresh. A line feed in front of a line
//! is passed over, so that lines ended by CR LF work too.

use crate::{ExtendedId, Frame, Id, StandardId};

/// Ends every command, and says "done" where it stands alone.
pub const DONE: u8 = b'\r';
/// Says "refused"; stands alone, without a carriage return.
pub const REFUSED: u8 = 0x07;
/// Time stamps count milliseconds from 0 and wrap here, every minute.
pub const TIMESTAMP_WRAP_MS: u16 = 60_000;

/// The longest line: `T`, 8 digits, length, 16 digits of data, 4 of time stamp.
const LINE: usize = 30;

/// What a host asks of the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// A bare carriage return: does nothing, hosts send it to clear the adapter's line buffer.
    Empty,
    /// `O`: open the channel.
    Open,
    /// `L`: open the channel to listen only.
    Listen,
    /// `C`: close the channel.
    Close,
    /// `S0`–`S8`: standard bit rate.
    BitRate(BitRate),
    /// `sXXYY`: the bit timing registers BTR0 and BTR1 of an SJA1000 at 16 MHz.
    BitTiming([u8; 2]),
    /// `t`, `T`, `r`, `R`: send this frame.
    Send(Frame),
    /// `V`: which version?
    Version,
    /// `N`: which serial number?
    SerialNumber,
    /// `F`: read and clear the status flags.
    Flags,
    /// `Z0`, `Z1`: time stamps off, on.
    Timestamps(bool),
    /// `MXXXXXXXX`: acceptance code.
    AcceptanceCode(u32),
    /// `mXXXXXXXX`: acceptance mask; a 1 means "do not care".
    AcceptanceMask(u32),
}

/// What an adapter sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A bare carriage return: done.
    Done,
    /// BEL: refused.
    Refused,
    /// `z` (11 bit) or `Z` (29 bit): the frame is queued for sending.
    Queued {
        /// Whether the frame's identifier has 29 bits.
        extended: bool,
    },
    /// `t`, `T`, `r`, `R`: a frame from the bus.
    Received {
        /// The frame.
        frame: Frame,
        /// Milliseconds, 0 to 59 999, if time stamps are on.
        timestamp_ms: Option<u16>,
    },
    /// `Vhhss`: version of hardware and software, each as two decimal digits in a byte (0x13: 1.3).
    Version {
        /// Hardware version.
        hardware: u8,
        /// Software version.
        software: u8,
    },
    /// `Nxxxx`: four characters of serial number.
    SerialNumber([u8; 4]),
    /// `Fxx`: status flags; bit 3 data overrun, bit 7 bus error, others as in the SJA1000.
    Flags(u8),
}

/// The nine standard bit rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BitRate(u8);

impl BitRate {
    const PER_SECOND: [u32; 9] = [
        10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000,
    ];

    /// The rate with number `code`, 0 to 8.
    pub fn from_code(code: u8) -> Option<BitRate> {
        (usize::from(code) < Self::PER_SECOND.len()).then_some(BitRate(code))
    }

    /// The standard rate of exactly this many bits per second.
    pub fn from_bits_per_s(rate: u32) -> Option<BitRate> {
        Self::PER_SECOND
            .iter()
            .position(|known| *known == rate)
            .map(|code| BitRate(code as u8))
    }

    /// The number behind `S`, 0 to 8.
    pub fn code(self) -> u8 {
        self.0
    }

    /// Bits per second.
    pub fn bits_per_s(self) -> u32 {
        Self::PER_SECOND
            .get(usize::from(self.0))
            .copied()
            .unwrap_or(1_000_000)
    }
}

/// Why a line was not understood. Positions count from 0, the command letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// No command or answer starts with this byte.
    Unknown(u8),
    /// The line has `got` characters where this one needs `expected`.
    Length {
        /// What the command letter and the data length ask for.
        expected: u8,
        /// What came.
        got: u8,
    },
    /// The character at `at` is not a digit of the kind that belongs there.
    Digit {
        /// Where.
        at: u8,
        /// What stands there.
        byte: u8,
    },
    /// The identifier does not fit into 11 or 29 bits.
    Identifier(u32),
    /// A data length over 8.
    DataLength(u8),
    /// No standard bit rate has this number.
    BitRate(u8),
    /// More characters than any line has; the rest up to the carriage return was skipped.
    TooLong,
    /// A BEL in the middle of a line: the adapter refused something and the line is incomplete.
    Interrupted,
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Error::Unknown(byte) => write!(f, "unknown slcan line '{}'", byte.escape_ascii()),
            Error::Length { expected, got } => {
                write!(f, "slcan line of {got} characters, {expected} expected")
            }
            Error::Digit { at, byte } => {
                write!(
                    f,
                    "'{}' at position {at} of the slcan line is no digit",
                    byte.escape_ascii()
                )
            }
            Error::Identifier(id) => write!(f, "identifier {id:X} is out of range"),
            Error::DataLength(length) => write!(f, "data length {length} is over 8"),
            Error::BitRate(code) => write!(f, "bit rate S{code} is unknown, S0 to S8 exist"),
            Error::TooLong => write!(f, "slcan line of more than {LINE} characters"),
            Error::Interrupted => write!(f, "slcan line cut short by a BEL"),
        }
    }
}

impl core::error::Error for Error {}

/// A command or an answer as text, ready to be sent.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text {
    bytes: [u8; LINE + 1],
    len: u8,
}

impl Text {
    const EMPTY: Text = Text {
        bytes: [0; LINE + 1],
        len: 0,
    };

    /// The bytes, the closing carriage return (or BEL) included.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&[])
    }

    fn push(mut self, byte: u8) -> Text {
        if let Some(slot) = self.bytes.get_mut(usize::from(self.len)) {
            *slot = byte;
            self.len += 1;
        }
        self
    }

    fn hex(self, value: u32, digits: u32) -> Text {
        (0..digits).rev().fold(self, |text, digit| {
            let nibble = (value >> (4 * digit) & 0xF) as u8;
            text.push(if nibble < 10 {
                b'0' + nibble
            } else {
                b'A' + nibble - 10
            })
        })
    }

    fn frame(self, frame: &Frame) -> Text {
        let letter = match (frame.is_remote(), frame.is_extended()) {
            (false, false) => b't',
            (false, true) => b'T',
            (true, false) => b'r',
            (true, true) => b'R',
        };
        let digits = if frame.is_extended() { 8 } else { 3 };
        let head = self
            .push(letter)
            .hex(frame.raw_id(), digits)
            .push(b'0' + frame.len());
        frame
            .data()
            .iter()
            .fold(head, |text, byte| text.hex(u32::from(*byte), 2))
    }
}

impl AsRef<[u8]> for Text {
    fn as_ref(&self) -> &[u8] {
        self.as_bytes()
    }
}

impl core::fmt::Debug for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "\"{}\"", self.as_bytes().escape_ascii())
    }
}

impl Command {
    /// The command as the host sends it.
    pub fn encode(&self) -> Text {
        let text = Text::EMPTY;
        let text = match *self {
            Command::Empty => text,
            Command::Open => text.push(b'O'),
            Command::Listen => text.push(b'L'),
            Command::Close => text.push(b'C'),
            Command::BitRate(rate) => text.push(b'S').push(b'0' + rate.code()),
            Command::BitTiming(registers) => text
                .push(b's')
                .hex(u32::from(u16::from_be_bytes(registers)), 4),
            Command::Send(frame) => text.frame(&frame),
            Command::Version => text.push(b'V'),
            Command::SerialNumber => text.push(b'N'),
            Command::Flags => text.push(b'F'),
            Command::Timestamps(on) => text.push(b'Z').push(if on { b'1' } else { b'0' }),
            Command::AcceptanceCode(code) => text.push(b'M').hex(code, 8),
            Command::AcceptanceMask(mask) => text.push(b'm').hex(mask, 8),
        };
        text.push(DONE)
    }

    fn parse(line: &[u8]) -> Result<Command, Error> {
        let (Some(&letter), line) = (line.first(), Line(line)) else {
            return Ok(Command::Empty);
        };
        Ok(match letter {
            b'O' => line.exactly(1, Command::Open)?,
            b'L' => line.exactly(1, Command::Listen)?,
            b'C' => line.exactly(1, Command::Close)?,
            b'V' => line.exactly(1, Command::Version)?,
            b'N' => line.exactly(1, Command::SerialNumber)?,
            b'F' => line.exactly(1, Command::Flags)?,
            b'S' => {
                line.exactly(2, ())?;
                let code = line.decimal(1)?;
                Command::BitRate(BitRate::from_code(code).ok_or(Error::BitRate(code))?)
            }
            b's' => {
                line.exactly(5, ())?;
                Command::BitTiming([line.hex(1, 2)? as u8, line.hex(3, 2)? as u8])
            }
            b'Z' => {
                line.exactly(2, ())?;
                match line.at(1)? {
                    b'0' => Command::Timestamps(false),
                    b'1' => Command::Timestamps(true),
                    byte => return Err(Error::Digit { at: 1, byte }),
                }
            }
            b'M' => Command::AcceptanceCode(line.exactly(9, ()).and_then(|()| line.hex(1, 8))?),
            b'm' => Command::AcceptanceMask(line.exactly(9, ()).and_then(|()| line.hex(1, 8))?),
            b't' | b'T' | b'r' | b'R' => {
                let (frame, length) = line.frame()?;
                Command::Send(line.exactly(length, frame)?)
            }
            other => return Err(Error::Unknown(other)),
        })
    }
}

impl Answer {
    /// The answer as the adapter sends it. Of a time stamp over 59 999 the remainder is sent.
    pub fn encode(&self) -> Text {
        let text = Text::EMPTY;
        let text = match *self {
            Answer::Refused => return text.push(REFUSED),
            Answer::Done => text,
            Answer::Queued { extended } => text.push(if extended { b'Z' } else { b'z' }),
            Answer::Received {
                frame,
                timestamp_ms: None,
            } => text.frame(&frame),
            Answer::Received {
                frame,
                timestamp_ms: Some(ms),
            } => text.frame(&frame).hex(u32::from(ms % TIMESTAMP_WRAP_MS), 4),
            Answer::Version { hardware, software } => text
                .push(b'V')
                .hex(u32::from(hardware), 2)
                .hex(u32::from(software), 2),
            Answer::SerialNumber(characters) => {
                characters.into_iter().fold(text.push(b'N'), Text::push)
            }
            Answer::Flags(flags) => text.push(b'F').hex(u32::from(flags), 2),
        };
        text.push(DONE)
    }

    fn parse(line: &[u8]) -> Result<Answer, Error> {
        let (Some(&letter), line) = (line.first(), Line(line)) else {
            return Ok(Answer::Done);
        };
        Ok(match letter {
            b'z' => line.exactly(1, Answer::Queued { extended: false })?,
            b'Z' => line.exactly(1, Answer::Queued { extended: true })?,
            b'V' => {
                line.exactly(5, ())?;
                Answer::Version {
                    hardware: line.hex(1, 2)? as u8,
                    software: line.hex(3, 2)? as u8,
                }
            }
            b'N' => {
                line.exactly(5, ())?;
                Answer::SerialNumber([line.at(1)?, line.at(2)?, line.at(3)?, line.at(4)?])
            }
            b'F' => Answer::Flags(line.exactly(3, ()).and_then(|()| line.hex(1, 2))? as u8),
            b't' | b'T' | b'r' | b'R' => {
                let (frame, length) = line.frame()?;
                let timestamp_ms = if line.0.len() == usize::from(length) + 4 {
                    Some(line.hex(length, 4)? as u16)
                } else {
                    line.exactly(length, None)?
                };
                Answer::Received {
                    frame,
                    timestamp_ms,
                }
            }
            other => return Err(Error::Unknown(other)),
        })
    }
}

/// Decoder of what a host sends: the adapter's side.
#[derive(Clone, Debug, Default)]
pub struct Commands(Buffer);

impl Commands {
    /// A decoder at the start of a line.
    pub fn new() -> Commands {
        Commands::default()
    }

    /// Takes the next byte. The carriage return that closes a line gives its command, or why it
    /// is none: answer the one with what it asks for and the other with [`Answer::Refused`].
    pub fn push(&mut self, byte: u8) -> Option<Result<Command, Error>> {
        if byte != DONE {
            self.0.push(byte);
            return None;
        }
        let command = self.0.line().and_then(Command::parse);
        self.0 = Buffer::default();
        Some(command)
    }

    /// How many bytes have come since the last carriage return, for an owner who wants to drop a
    /// peer that sends none.
    pub fn unfinished(&self) -> u32 {
        self.0.count
    }
}

/// Decoder of what an adapter sends: the host's side.
#[derive(Clone, Debug, Default)]
pub struct Answers(Buffer);

impl Answers {
    /// A decoder at the start of a line.
    pub fn new() -> Answers {
        Answers::default()
    }

    /// Takes the next byte. A carriage return or BEL gives the answer, or why the line is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<Answer, Error>> {
        let answer = match byte {
            DONE => self.0.line().and_then(Answer::parse),
            REFUSED if self.0.count == 0 => Ok(Answer::Refused),
            REFUSED => Err(Error::Interrupted),
            _ => {
                self.0.push(byte);
                return None;
            }
        };
        self.0 = Buffer::default();
        Some(answer)
    }

    /// How many bytes have come since the last carriage return or BEL.
    pub fn unfinished(&self) -> u32 {
        self.0.count
    }
}

/// One line as it comes in. `count` goes on past the end of `bytes`, which marks it as too long.
#[derive(Clone, Debug, Default)]
struct Buffer {
    bytes: [u8; LINE],
    count: u32,
}

impl Buffer {
    fn push(&mut self, byte: u8) {
        if byte == b'\n' && self.count == 0 {
            return;
        }
        if let Some(slot) = self.bytes.get_mut(self.count as usize) {
            *slot = byte;
        }
        self.count = self.count.saturating_add(1);
    }

    fn line(&self) -> Result<&[u8], Error> {
        self.bytes.get(..self.count as usize).ok_or(Error::TooLong)
    }
}

/// A line of at most 30 characters, read by position.
#[derive(Clone, Copy)]
struct Line<'a>(&'a [u8]);

impl Line<'_> {
    fn exactly<T>(self, expected: u8, value: T) -> Result<T, Error> {
        let got = self.0.len() as u8;
        if got == expected {
            Ok(value)
        } else {
            Err(Error::Length { expected, got })
        }
    }

    fn at(self, at: u8) -> Result<u8, Error> {
        let got = self.0.len() as u8;
        let expected = at.saturating_add(1);
        self.0
            .get(usize::from(at))
            .copied()
            .ok_or(Error::Length { expected, got })
    }

    fn decimal(self, at: u8) -> Result<u8, Error> {
        match self.at(at)? {
            byte @ b'0'..=b'9' => Ok(byte - b'0'),
            byte => Err(Error::Digit { at, byte }),
        }
    }

    fn hex(self, from: u8, digits: u8) -> Result<u32, Error> {
        (from..from.saturating_add(digits)).try_fold(0_u32, |value, at| {
            let byte = self.at(at)?;
            let digit = char::from(byte)
                .to_digit(16)
                .ok_or(Error::Digit { at, byte })?;
            Ok(value << 4 | digit)
        })
    }

    /// The frame and how many characters it takes.
    fn frame(self) -> Result<(Frame, u8), Error> {
        let letter = self.at(0)?;
        let (id, digits): (Id, u8) = if letter.is_ascii_uppercase() {
            let id = self.hex(1, 8)?;
            (ExtendedId::new(id).ok_or(Error::Identifier(id))?.into(), 8)
        } else {
            let id = self.hex(1, 3)?;
            (
                StandardId::new(id as u16)
                    .ok_or(Error::Identifier(id))?
                    .into(),
                3,
            )
        };
        let length = self.decimal(1 + digits)?;
        let head = 2 + digits;
        if letter.eq_ignore_ascii_case(&b'r') {
            let frame = Frame::remote_frame(id, length).ok_or(Error::DataLength(length))?;
            return Ok((frame, head));
        }
        let mut bytes = [0; 8];
        let data = bytes
            .get_mut(..usize::from(length))
            .ok_or(Error::DataLength(length))?;
        let expected = head + 2 * length;
        if self.0.len() < usize::from(expected) {
            return Err(Error::Length {
                expected,
                got: self.0.len() as u8,
            });
        }
        for (index, byte) in (0_u8..).zip(data.iter_mut()) {
            *byte = self.hex(head + 2 * index, 2)? as u8;
        }
        let frame = Frame::data_frame(id, data).ok_or(Error::DataLength(length))?;
        Ok((frame, expected))
    }
}
