//! The log format of candump (`candump -l`, `-L`), which canplayer, python-can, tshark and many
//! others read.
//!
//! ```text
//! (0.000123) can0 181#0102          data, 11-bit identifier
//! (0.000250) can0 1ABCDEF0#         data, 29-bit identifier, no bytes
//! (0.000377) can0 701#R             remote, length 0
//! (0.000500) can0 701#R4            remote, length 4
//! (1436509052.249713) vcan0 044#2A366C2BBA R      a real candump's, with its direction
//! ```
//!
//! Time stamps written are virtual: seconds since the start of the bus, with six digits of
//! microseconds. What is below a microsecond is cut off, not rounded, so that a stamp never lies
//! after the event and the order of two frames is kept.
//!
//! As for canplayer, a line that does not begin with `(` is a comment.

use super::{Content, Direction};
use crate::ErrorFrame;
use can::{ExtendedId, Frame, Id, StandardId};
use std::io::{self, BufRead, Write};

/// SocketCAN's mark for error messages, bit 29 of the identifier.
const ERROR_MESSAGE: u32 = 1 << 29;

/// The longest line canplayer reads.
const LONGEST: usize = 398;

/// One line of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// When, in nanoseconds: since the start of the bus (virtual) or since 1970 (a real log).
    pub stamp_ns: u64,
    /// Name of the bus.
    pub channel: String,
    /// What.
    pub content: Content,
    /// Which way it went, if the log says so.
    pub direction: Option<Direction>,
}

/// Writes one line.
///
/// # Errors
/// Those of `output`.
pub fn write_line(
    output: &mut impl Write,
    stamp_ns: u64,
    channel: &str,
    frame: &Frame,
) -> io::Result<()> {
    let micros = stamp_ns / 1_000;
    writeln!(
        output,
        "({}.{:06}) {channel} {frame}",
        micros / 1_000_000,
        micros % 1_000_000
    )
}

/// Writes one line, of an error message too.
///
/// # Errors
/// Those of `output`.
pub fn write_content(
    output: &mut impl Write,
    stamp_ns: u64,
    channel: &str,
    content: &Content,
) -> io::Result<()> {
    match content {
        Content::Frame(frame) => write_line(output, stamp_ns, channel, frame),
        Content::Error(error) => {
            let micros = stamp_ns / 1_000;
            let (seconds, micros) = (micros / 1_000_000, micros % 1_000_000);
            let id = error.class | ERROR_MESSAGE;
            let data = u64::from_be_bytes(error.data);
            writeln!(
                output,
                "({seconds}.{micros:06}) {channel} {id:08X}#{data:016X}"
            )
        }
    }
}

/// Reads a log line by line; comments are passed over.
#[derive(Debug)]
pub struct Reader<R> {
    input: R,
    line: u64,
    text: Vec<u8>,
}

/// Why a log could not be read on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// A line that canplayer would not play either.
    #[error("line {line}, column {column}: {wrong}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// Counted from 1, in characters.
        column: usize,
        /// What is wrong there.
        wrong: Wrong,
    },
    /// The file could not be read.
    #[error("line {line}: {source}")]
    Read {
        /// Counted from 1.
        line: u64,
        /// What the system says.
        source: io::Error,
    },
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Wrong {
    /// Not `(seconds.fraction)`.
    #[error("a time stamp like (0.000123) is expected, with 6 or 9 digits behind the point")]
    Time,
    /// No name of a bus.
    #[error("the name of the bus is expected, like can0")]
    Channel,
    /// Neither three nor eight digits before `#`.
    #[error("an identifier of 3 or 8 hexadecimal digits and a '#' are expected")]
    Identifier,
    /// More than 7FF in three digits, or more than 1FFFFFFF in eight.
    #[error("the identifier is out of range, 7FF and 1FFFFFFF are the highest")]
    Range,
    /// A CAN FD or CAN XL frame.
    #[error("this is a CAN FD frame, which this bus does not carry")]
    Fd,
    /// Not pairs of hexadecimal digits.
    #[error("data are written as pairs of hexadecimal digits")]
    Data,
    /// More than eight bytes.
    #[error("a frame carries at most 8 bytes")]
    TooMuchData,
    /// The length of a remote frame is not a digit from 0 to 8.
    #[error("the length of a remote frame is a digit from 0 to 8")]
    RemoteLength,
    /// More text than belongs there.
    #[error("nothing is expected here but R (received) or T (sent)")]
    Rest,
    /// More characters than canplayer reads.
    #[error("the line is longer than {LONGEST} characters")]
    TooLong,
    /// Not ASCII.
    #[error("this is not text")]
    NotText,
}

impl<R: BufRead> Reader<R> {
    /// Reads from here on.
    pub fn new(input: R) -> Reader<R> {
        Reader {
            input,
            line: 0,
            text: Vec::new(),
        }
    }

    /// The next line that is no comment.
    fn record(&mut self) -> Result<Option<Record>, ReadError> {
        loop {
            self.line += 1;
            let line = self.line;
            self.text.clear();
            // One byte more than allowed and the line feed: a file without line feeds, a binary
            // one perhaps, must not fill the memory.
            let mut some = io::Read::take(&mut self.input, LONGEST as u64 + 2);
            let count = some
                .read_until(b'\n', &mut self.text)
                .map_err(|source| ReadError::Read { line, source })?;
            if count == 0 {
                return Ok(None);
            }
            let text = self.text.strip_suffix(b"\n").unwrap_or(&self.text);
            let wrong = |column, wrong| ReadError::Line {
                line,
                column: column + 1,
                wrong,
            };
            if text.len() > LONGEST {
                return Err(wrong(LONGEST, Wrong::TooLong));
            }
            let text = text.strip_suffix(b"\r").unwrap_or(text);
            if text.first() != Some(&b'(') {
                continue;
            }
            if let Some(column) = text.iter().position(|byte| !byte.is_ascii()) {
                return Err(wrong(column, Wrong::NotText));
            }
            let text = String::from_utf8_lossy(text);
            return parse_line(&text)
                .map(Some)
                .map_err(|(column, what)| wrong(column, what));
        }
    }
}

/// Ends after the first error.
impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Record, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.line == u64::MAX {
            return None;
        }
        let record = self.record();
        if record.is_err() {
            self.line = u64::MAX;
        }
        record.transpose()
    }
}

/// Where in the line, from 0, and what.
type Fault = (usize, Wrong);

fn parse_line(line: &str) -> Result<Record, Fault> {
    let mut words = words(line);
    let (at, time) = words.next().ok_or((0, Wrong::Time))?;
    let stamp_ns = parse_time(time).ok_or((at, Wrong::Time))?;
    let (_, channel) = words.next().ok_or((line.len(), Wrong::Channel))?;
    let (at, frame) = words.next().ok_or((line.len(), Wrong::Identifier))?;
    let content = parse_content(frame).map_err(|(offset, wrong)| (at + offset, wrong))?;
    let direction = match words.next() {
        None => None,
        Some((_, "R")) => Some(Direction::Received),
        Some((_, "T")) => Some(Direction::Sent),
        Some((at, _)) => return Err((at, Wrong::Rest)),
    };
    match words.next() {
        Some((at, _)) => Err((at, Wrong::Rest)),
        None => Ok(Record {
            stamp_ns,
            channel: channel.to_owned(),
            content,
            direction,
        }),
    }
}

/// Words and where they begin.
fn words(line: &str) -> impl Iterator<Item = (usize, &str)> {
    line.split_ascii_whitespace()
        .map(|word| (word.as_ptr() as usize - line.as_ptr() as usize, word))
}

fn parse_time(word: &str) -> Option<u64> {
    let (seconds, fraction) = word.strip_prefix('(')?.strip_suffix(')')?.split_once('.')?;
    // canplayer takes the fraction for a number of microseconds, python-can for a decimal
    // fraction; they agree at six digits only. Nine are nanoseconds beyond doubt.
    let scale = match fraction.len() {
        6 => 1_000,
        9 => 1,
        _ => return None,
    };
    let number = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<u64>().ok().filter(|_| digits)
    };
    number(seconds)?
        .checked_mul(1_000_000_000)?
        .checked_add(number(fraction)? * scale)
}

fn parse_content(word: &str) -> Result<Content, Fault> {
    let (digits, rest) = word.split_once('#').ok_or((0, Wrong::Identifier))?;
    let value = digits
        .bytes()
        .enumerate()
        .try_fold(0_u64, |value, (at, byte)| {
            let digit = char::from(byte).to_digit(16).filter(|_| at < 8);
            digit
                .map(|digit| value << 4 | u64::from(digit))
                .ok_or((at, Wrong::Identifier))
        })? as u32;
    let id: Option<Id> = match digits.len() {
        3 => Some(
            StandardId::new(value as u16)
                .ok_or((0, Wrong::Range))?
                .into(),
        ),
        8 if value & ERROR_MESSAGE != 0 && value >> 30 == 0 => None,
        8 => Some(ExtendedId::new(value).ok_or((0, Wrong::Range))?.into()),
        _ => return Err((0, Wrong::Identifier)),
    };
    let start = digits.len() + 1;
    if rest.starts_with('#') {
        return Err((start, Wrong::Fd));
    }
    if let (Some(length), Some(id)) = (rest.strip_prefix(['R', 'r']), id) {
        let frame = match length.as_bytes() {
            [] => Frame::remote_frame(id, 0),
            [digit @ b'0'..=b'8'] => Frame::remote_frame(id, digit - b'0'),
            _ => None,
        };
        return frame
            .map(Content::Frame)
            .ok_or((start + 1, Wrong::RemoteLength));
    }
    let (data, length) = parse_data(rest).map_err(|(at, wrong)| (start + at, wrong))?;
    let frame = id.map(|id| Frame::data_frame(id, data.get(..length).unwrap_or(&[])));
    match frame {
        Some(frame) => frame.map(Content::Frame).ok_or((start, Wrong::TooMuchData)),
        None => Ok(Content::Error(ErrorFrame {
            class: value & (ERROR_MESSAGE - 1),
            data,
        })),
    }
}

/// Up to eight pairs of digits; canplayer lets a point stand between two pairs.
fn parse_data(text: &str) -> Result<([u8; 8], usize), Fault> {
    let mut data = [0; 8];
    let mut length = 0;
    let mut digits = text.bytes().enumerate().peekable();
    while let Some((at, high)) = digits.next() {
        let low = digits.next().ok_or((at, Wrong::Data))?.1;
        let nibble = |byte: u8| char::from(byte).to_digit(16).ok_or((at, Wrong::Data));
        let slot = data.get_mut(length).ok_or((at, Wrong::TooMuchData))?;
        *slot = (nibble(high)? << 4 | nibble(low)?) as u8;
        length += 1;
        digits.next_if(|(_, byte)| *byte == b'.');
    }
    Ok((data, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<Result<Record, ReadError>> {
        Reader::new(text.as_bytes()).collect()
    }

    fn one(text: &str) -> Record {
        let mut records = read(text);
        assert_eq!(records.len(), 1, "{text}");
        records.remove(0).unwrap()
    }

    fn frame(text: &str) -> Frame {
        let Content::Frame(frame) = one(text).content else {
            panic!("{text}: no frame")
        };
        frame
    }

    #[test]
    fn written_lines() {
        let id = StandardId::new(0x181).unwrap();
        let wide = ExtendedId::new(0x123).unwrap();
        let table = [
            (
                0,
                Frame::data_frame(id, &[1, 0xFE]).unwrap(),
                "(0.000000) can0 181#01FE\n",
            ),
            // Cut off, not rounded.
            (
                123_999,
                Frame::data_frame(id, &[]).unwrap(),
                "(0.000123) can0 181#\n",
            ),
            (
                61_000_001_000,
                Frame::remote_frame(id, 0).unwrap(),
                "(61.000001) can0 181#R\n",
            ),
            (
                1_000_000_000,
                Frame::remote_frame(wide, 4).unwrap(),
                "(1.000000) can0 00000123#R4\n",
            ),
        ];
        for (stamp_ns, frame, line) in table {
            let mut text = Vec::new();
            write_line(&mut text, stamp_ns, "can0", &frame).unwrap();
            assert_eq!(String::from_utf8(text).unwrap(), line);
            let record = one(line);
            assert_eq!(record.stamp_ns, stamp_ns / 1_000 * 1_000);
            assert_eq!(
                (record.content, record.direction),
                (Content::Frame(frame), None)
            );
        }
    }

    /// Lines as real logs have them.
    #[test]
    fn real_lines() {
        let record = one("(1436509052.249713) vcan0 044#2A366C2BBA R\n");
        assert_eq!(record.stamp_ns, 1_436_509_052_249_713_000);
        assert_eq!(record.channel, "vcan0");
        assert_eq!(record.direction, Some(Direction::Received));
        assert_eq!(
            frame("(0000000001.000002) can0 123#11.22.33 T").data(),
            [0x11, 0x22, 0x33]
        );
        assert_eq!(one("(1.000002003) can0 123#").stamp_ns, 1_000_002_003);
        assert_eq!(frame("(1.000000) can0 1abcdef0#r8\r\n").len(), 8);
        let error = one("(1.000000) can0 20000004#0004000000000000");
        let data = [0, 4, 0, 0, 0, 0, 0, 0];
        assert_eq!(error.content, Content::Error(ErrorFrame { class: 4, data }));
        let text = "# a comment\n\n (1.0) not at the start either\n(2.000000) can0 7FF#\n";
        assert_eq!(read(text).len(), 1);
    }

    #[test]
    fn faults_are_named_by_place() {
        let table = [
            ("(1) can0 123#", 1, Wrong::Time),
            ("(1.5) can0 123#", 1, Wrong::Time),
            ("(a.000000) can0 123#", 1, Wrong::Time),
            ("(99999999999999999999.000000) can0 123#", 1, Wrong::Time),
            ("(1.000000", 1, Wrong::Time),
            ("(1.000000)", 11, Wrong::Channel),
            ("(1.000000) can0", 16, Wrong::Identifier),
            ("(1.000000) can0 123", 17, Wrong::Identifier),
            ("(1.000000) can0 1234#", 17, Wrong::Identifier),
            ("(1.000000) can0 1G3#", 18, Wrong::Identifier),
            ("(1.000000) can0 1234567890123#", 25, Wrong::Identifier),
            ("(1.000000) can0 800#", 17, Wrong::Range),
            ("(1.000000) can0 40000000#", 17, Wrong::Range),
            ("(1.000000) can0 123##0AA", 21, Wrong::Fd),
            ("(1.000000) can0 123#1", 21, Wrong::Data),
            ("(1.000000) can0 123#11x2", 23, Wrong::Data),
            (
                "(1.000000) can0 123#112233445566778899",
                37,
                Wrong::TooMuchData,
            ),
            ("(1.000000) can0 123#R9", 22, Wrong::RemoteLength),
            ("(1.000000) can0 123# X", 22, Wrong::Rest),
            ("(1.000000)  can0 123#  R R", 26, Wrong::Rest),
            ("(1.000000) can0 123#\u{e9}", 21, Wrong::NotText),
        ];
        for (text, place, what) in table {
            let text = format!("comment\n{text}\n(1.000000) can0 123#\n");
            let records = read(&text);
            let [
                Err(ReadError::Line {
                    line: 2,
                    column,
                    wrong,
                }),
            ] = records[..]
            else {
                panic!("{text}: {records:?}")
            };
            assert_eq!((column, wrong), (place, what), "{text}");
        }
        let binary = vec![b'('; 100_000];
        let records: Vec<_> = Reader::new(&binary[..]).collect();
        assert!(matches!(
            records[..],
            [Err(ReadError::Line {
                line: 1,
                column: 399,
                ..
            })]
        ));
    }

    #[test]
    fn messages_say_where() {
        let error = read("(1.000000) can0 123#R9")
            .remove(0)
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            "line 1, column 22: the length of a remote frame is a digit from 0 to 8"
        );
    }

    proptest::proptest! {
        #[test]
        fn noise_is_survived(noise in "[(). 0-9a-fR#T\n]{0,80}") {
            for record in read(&noise).into_iter().flatten() {
                proptest::prop_assert!(!record.channel.is_empty());
            }
        }
    }
}
