//! The text of the socketcand protocol, for both ends: where messages begin and end, and what a
//! message about a frame looks like.
//!
//! A message is `< word … >`; nothing separates two of them. Frames:
//!
//! ```text
//! client  < send ID LENGTH BYTE BYTE … >     < sendrtr ID LENGTH >
//! server  < frame ID SECONDS.MICROS DATA >   < rtr ID SECONDS.MICROS LENGTH >
//! ```
//!
//! Two words are this project's own: a client that says `< notes >` is sent, between the frames,
//! what people should know of, as `< note SECONDS.MICROS TEXT >`.
//!
//! Identifiers and data are hexadecimal. An identifier of three digits has 11 bits, one of eight
//! has 29. The data of `frame` are written without blanks; where there are none, two blanks stand
//! in a row, which python-can insists on.

use can::{ExtendedId, Frame, Id, StandardId};
use std::io::Write;

/// The longest message taken, brackets included. The longest that makes sense has 46 characters;
/// real clients pad now and then.
const LONGEST: usize = 256;

/// What the bytes of a stream turned out to be.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Piece {
    /// The words of a message.
    Message(String),
    /// A message that was not closed before the next one began; that next one goes on.
    CutShort,
    /// Not this protocol, or no longer: the stream cannot be trusted from here on.
    Lost(Lost),
}

/// Why a stream was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Lost {
    #[error("a message of more than {LONGEST} characters")]
    TooLong,
    #[error("'{}' between two messages, where only '<' may stand", .0.escape_ascii())]
    Between(u8),
    #[error("a byte {0:#04x} inside a message, which is text")]
    NotText(u8),
}

/// Cuts a stream of bytes into messages.
#[derive(Debug, Default)]
pub(crate) struct Messages {
    text: Option<String>,
}

impl Messages {
    /// Takes the next byte. After [`Piece::Lost`] the caller should stop.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Piece> {
        let Some(text) = &mut self.text else {
            return match byte {
                b'<' => {
                    self.text = Some(String::new());
                    None
                }
                // Whoever types by hand ends lines.
                b' ' | b'\t' | b'\r' | b'\n' => None,
                other => Some(Piece::Lost(Lost::Between(other))),
            };
        };
        match byte {
            b'>' => self.text.take().map(Piece::Message),
            b'<' => {
                text.clear();
                Some(Piece::CutShort)
            }
            b' '..=b'~' | b'\t' | b'\r' | b'\n' => {
                text.push(char::from(byte));
                if text.len() + 2 <= LONGEST {
                    return None;
                }
                self.text = None;
                Some(Piece::Lost(Lost::TooLong))
            }
            other => {
                self.text = None;
                Some(Piece::Lost(Lost::NotText(other)))
            }
        }
    }
}

/// Why the words of a frame were refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BadFrame {
    #[error("{0} is missing")]
    Missing(&'static str),
    #[error("identifier {0} has neither 3 nor 8 hexadecimal digits")]
    IdDigits(String),
    #[error("identifier {0} is out of range, 7FF and 1FFFFFFF are the highest")]
    IdRange(String),
    #[error("length {0} is not a number from 0 to 8")]
    Length(String),
    #[error("length {length} announced, but {bytes} bytes follow")]
    Count { length: u8, bytes: usize },
    #[error("data {0} are not hexadecimal bytes")]
    Data(String),
    #[error("time {0} is not SECONDS.MICROSECONDS")]
    Time(String),
}

/// The words behind `send` (`remote` false) or `sendrtr`.
pub(crate) fn parse_send<'a>(
    mut words: impl Iterator<Item = &'a str>,
    remote: bool,
) -> Result<Frame, BadFrame> {
    let id = parse_id(words.next().ok_or(BadFrame::Missing("the identifier"))?)?;
    let length = parse_length(words.next().ok_or(BadFrame::Missing("the length"))?)?;
    let mut data = [0; 8];
    let mut bytes = 0;
    for word in words {
        if let Some(slot) = data.get_mut(bytes) {
            *slot = parse_byte(word)?;
        }
        bytes += 1;
    }
    let expected = if remote { 0 } else { usize::from(length) };
    if bytes != expected {
        return Err(BadFrame::Count {
            length: expected as u8,
            bytes,
        });
    }
    let frame = if remote {
        Frame::remote_frame(id, length)
    } else {
        data.get(..bytes)
            .and_then(|data| Frame::data_frame(id, data))
    };
    frame.ok_or_else(|| BadFrame::Length(length.to_string()))
}

/// The words behind `frame` (`remote` false) or `rtr`, with the time in nanoseconds.
pub(crate) fn parse_received<'a>(
    mut words: impl Iterator<Item = &'a str>,
    remote: bool,
) -> Result<(u64, Frame), BadFrame> {
    let id = parse_id(words.next().ok_or(BadFrame::Missing("the identifier"))?)?;
    let time = words.next().ok_or(BadFrame::Missing("the time"))?;
    let stamp_ns = parse_time(time).ok_or_else(|| BadFrame::Time(time.to_owned()))?;
    if remote {
        let length = parse_length(words.next().ok_or(BadFrame::Missing("the length"))?)?;
        let frame = Frame::remote_frame(id, length);
        return Ok((
            stamp_ns,
            frame.ok_or_else(|| BadFrame::Length(length.to_string()))?,
        ));
    }
    // Servers differ: one run of digits, or a blank between two bytes.
    let digits: String = words.collect();
    let bad = || BadFrame::Data(shown(&digits));
    let pairs = digits.as_bytes().chunks(2);
    let data: Vec<u8> = pairs
        .map(|pair| match pair {
            &[high, low] => Some(hex(high)? << 4 | hex(low)?),
            _ => None,
        })
        .collect::<Option<_>>()
        .ok_or_else(bad)?;
    Ok((stamp_ns, Frame::data_frame(id, &data).ok_or_else(bad)?))
}

/// Appends the `send` or `sendrtr` message for this frame.
pub(crate) fn write_send(text: &mut Vec<u8>, frame: &Frame) {
    let word = if frame.is_remote() { "sendrtr" } else { "send" };
    write_id(text, word, frame);
    let _ = write!(text, "{} ", frame.len());
    for byte in frame.data() {
        let _ = write!(text, "{byte:02X} ");
    }
    text.push(b'>');
}

/// Appends the `frame` or `rtr` message for this frame. Of the time, what is below a microsecond
/// is cut off.
pub(crate) fn write_received(text: &mut Vec<u8>, stamp_ns: u64, frame: &Frame) {
    write_id(text, if frame.is_remote() { "rtr" } else { "frame" }, frame);
    let micros = stamp_ns / 1_000;
    let _ = write!(text, "{}.{:06} ", micros / 1_000_000, micros % 1_000_000);
    if frame.is_remote() {
        let _ = write!(text, "{}", frame.len());
    }
    for byte in frame.data() {
        let _ = write!(text, "{byte:02X}");
    }
    text.extend_from_slice(b" >");
}

/// Appends the `note` message for these words: printable, without brackets, and as long as a message
/// may be.
pub(crate) fn write_note(text: &mut Vec<u8>, stamp_ns: u64, words: &str) {
    let micros = stamp_ns / 1_000;
    let (seconds, micros) = (micros / 1_000_000, micros % 1_000_000);
    let _ = write!(text, "< note {seconds}.{micros:06} ");
    let plain = words.chars().map(|character| match character {
        ' '..='~' if !matches!(character, '<' | '>') => character as u8,
        _ => b'?',
    });
    // Beside the words a note has at most 8 characters and the time's 21.
    text.extend(plain.take(LONGEST - 32));
    text.extend_from_slice(b" >");
}

/// The words behind `note`, and the time in nanoseconds.
pub(crate) fn parse_note(rest: &str) -> Result<(u64, String), BadFrame> {
    let (time, words) = rest.split_once(' ').unwrap_or((rest, ""));
    let stamp_ns = parse_time(time).ok_or_else(|| BadFrame::Time(shown(time)))?;
    Ok((stamp_ns, words.to_owned()))
}

/// What a peer sent, fit to be put into a message: short, printable, without brackets.
pub(crate) fn shown(text: &str) -> String {
    let printable = text.chars().take(40).map(|character| match character {
        '<' | '>' => '?',
        ' '..='~' => character,
        _ => '?',
    });
    let cut = if text.chars().count() > 40 { "..." } else { "" };
    format!("'{}{cut}'", printable.collect::<String>())
}

// Writing to a Vec cannot fail, so the results are dropped here and above.
fn write_id(text: &mut Vec<u8>, word: &str, frame: &Frame) {
    let digits = if frame.is_extended() { 8 } else { 3 };
    let _ = write!(text, "< {word} {:0digits$X} ", frame.raw_id());
}

fn parse_id(word: &str) -> Result<Id, BadFrame> {
    let digits = word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let id = u32::from_str_radix(word, 16).ok().filter(|_| digits);
    let id = id.ok_or_else(|| BadFrame::IdDigits(shown(word)))?;
    let id: Option<Id> = match word.len() {
        3 => StandardId::new(id as u16).map(Id::Standard),
        8 => ExtendedId::new(id).map(Id::Extended),
        _ => return Err(BadFrame::IdDigits(shown(word))),
    };
    id.ok_or_else(|| BadFrame::IdRange(shown(word)))
}

fn parse_length(word: &str) -> Result<u8, BadFrame> {
    match word.as_bytes() {
        [digit @ b'0'..=b'8'] => Ok(digit - b'0'),
        _ => Err(BadFrame::Length(shown(word))),
    }
}

fn parse_byte(word: &str) -> Result<u8, BadFrame> {
    match *word.as_bytes() {
        [low] => hex(low),
        [high, low] => hex(high).zip(hex(low)).map(|(high, low)| high << 4 | low),
        _ => None,
    }
    .ok_or_else(|| BadFrame::Data(shown(word)))
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).map(|digit| digit as u8)
}

/// Seconds and a fraction of up to nine digits, in nanoseconds.
fn parse_time(word: &str) -> Option<u64> {
    let (seconds, fraction) = word.split_once('.').unwrap_or((word, "0"));
    let number = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<u64>().ok().filter(|_| digits)
    };
    let scale = 10_u64.pow(9_u32.checked_sub(u32::try_from(fraction.len()).ok()?)?);
    number(seconds)?
        .checked_mul(1_000_000_000)?
        .checked_add(number(fraction)? * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(bytes: &[u8]) -> Vec<Piece> {
        let mut messages = Messages::default();
        bytes
            .iter()
            .filter_map(|byte| messages.push(*byte))
            .collect()
    }

    fn message(text: &str) -> Piece {
        Piece::Message(text.to_owned())
    }

    #[test]
    fn notes_are_plain_and_fit_into_a_message() {
        let note = |words: &str| {
            let mut text = Vec::new();
            write_note(&mut text, 1_234_567_890, words);
            let [Piece::Message(message)] = &pieces(&text)[..] else {
                panic!("{words}")
            };
            let (word, rest) = message.trim().split_once(' ').unwrap();
            assert_eq!(word, "note");
            parse_note(rest).unwrap()
        };
        let stamp_ns = 1_234_567_000;
        let told = note("scenario: \"sag\" <20 V>\n\u{b0}");
        assert_eq!(told, (stamp_ns, "scenario: \"sag\" ?20 V???".to_owned()));
        assert_eq!(note("").1, "");
        assert_eq!(note(&"x".repeat(1_000)).1, "x".repeat(LONGEST - 32));
        let mut text = Vec::new();
        write_note(&mut text, u64::MAX, &"x".repeat(1_000));
        assert!(text.len() <= LONGEST, "{}", text.len());
        assert!(parse_note("soon x").is_err() && parse_note("").is_err());
    }

    #[test]
    fn streams_are_cut_into_messages() {
        assert_eq!(pieces(b"< hi >"), [message(" hi ")]);
        assert_eq!(
            pieces(b"<echo>\r\n< a b >< c"),
            [message("echo"), message(" a b ")]
        );
        assert_eq!(
            pieces(b"< send 12< echo >"),
            [Piece::CutShort, message(" echo ")]
        );
        assert_eq!(pieces(b"G"), [Piece::Lost(Lost::Between(b'G'))]);
        assert_eq!(pieces(b"< \0"), [Piece::Lost(Lost::NotText(0))]);
        let mut long = b"<".to_vec();
        long.extend([b'a'; 254]);
        assert_eq!(pieces(&long), []);
        assert_eq!(
            pieces(&[&long[..], b"a"].concat()),
            [Piece::Lost(Lost::TooLong)]
        );
        assert!(matches!(
            &pieces(&[&long[..], b">"].concat())[..],
            [Piece::Message(_)]
        ));
    }

    fn send(text: &str) -> Result<Frame, BadFrame> {
        parse_send(text.split_ascii_whitespace(), false)
    }

    /// The forms that python-can sends, and the two examples of the protocol's document.
    #[test]
    fn sent_frames() {
        assert_eq!(send("201 3 1 2 ab ").unwrap().to_string(), "201#0102AB");
        assert_eq!(send("080 0  ").unwrap().to_string(), "080#");
        assert_eq!(send("123 0").unwrap().to_string(), "123#");
        assert_eq!(
            send("1AAAAAAA 2 1 F1").unwrap().to_string(),
            "1AAAAAAA#01F1"
        );
        assert_eq!(send("00000001 8 1 2 3 4 5 6 7 08").unwrap().raw_id(), 1);
        let remote = parse_send("701 1".split(' '), true).unwrap();
        assert_eq!(remote.to_string(), "701#R1");
    }

    #[test]
    fn refused_frames() {
        let table = [
            ("", "the identifier is missing"),
            ("123", "the length is missing"),
            (
                "12 0",
                "identifier '12' has neither 3 nor 8 hexadecimal digits",
            ),
            (
                "+12 0",
                "identifier '+12' has neither 3 nor 8 hexadecimal digits",
            ),
            ("xyz 0", "identifier 'xyz' has neither"),
            (
                "800 0",
                "identifier '800' is out of range, 7FF and 1FFFFFFF are the highest",
            ),
            ("20000000 0", "identifier '20000000' is out of range"),
            (
                "123 9 1 2 3 4 5 6 7 8 9",
                "length '9' is not a number from 0 to 8",
            ),
            ("123 +1 1", "length '+1' is not"),
            ("123 2 1", "length 2 announced, but 1 bytes follow"),
            (
                "123 2 1 2 3 4 5 6 7 8 9 10 11",
                "length 2 announced, but 11 bytes follow",
            ),
            ("123 1 123", "data '123' are not hexadecimal bytes"),
            ("123 1 +1", "data '+1' are not hexadecimal bytes"),
        ];
        for (text, message) in table {
            let error = send(text).unwrap_err().to_string();
            assert!(error.starts_with(message), "{text}: {error}");
        }
    }

    #[test]
    fn received_frames_as_python_can_wants_them() {
        let written = |stamp_ns, frame: &Frame| {
            let mut text = Vec::new();
            write_received(&mut text, stamp_ns, frame);
            String::from_utf8(text).unwrap()
        };
        let standard = StandardId::new(0x301).unwrap();
        let frame = Frame::data_frame(standard, &[1, 2, 0xAB]).unwrap();
        assert_eq!(
            written(23_424_242_999, &frame),
            "< frame 301 23.424242 0102AB >"
        );
        let empty = Frame::data_frame(StandardId::new(0x80).unwrap(), &[]).unwrap();
        assert_eq!(written(1_000, &empty), "< frame 080 0.000001  >");
        let wide = Frame::data_frame(ExtendedId::new(5).unwrap(), &[0]).unwrap();
        assert_eq!(written(0, &wide), "< frame 00000005 0.000000 00 >");
        let remote = Frame::remote_frame(standard, 4).unwrap();
        assert_eq!(written(0, &remote), "< rtr 301 0.000000 4 >");
        for frame in [frame, empty, wide, remote] {
            let text = written(7_000_001_000, &frame);
            let words = text
                .trim_matches(['<', '>'])
                .split_ascii_whitespace()
                .skip(1);
            assert_eq!(
                parse_received(words, frame.is_remote()),
                Ok((7_000_001_000, frame))
            );
            let mut text = Vec::new();
            write_send(&mut text, &frame);
            let text = String::from_utf8(text).unwrap();
            let words = text
                .trim_matches(['<', '>'])
                .split_ascii_whitespace()
                .skip(1);
            assert_eq!(parse_send(words, frame.is_remote()), Ok(frame));
        }
    }

    #[test]
    fn times() {
        assert_eq!(parse_time("23.424242"), Some(23_424_242_000));
        assert_eq!(parse_time("0.5"), Some(500_000_000));
        assert_eq!(
            parse_time("1417687245.814579123"),
            Some(1_417_687_245_814_579_123)
        );
        assert_eq!(parse_time("1"), Some(1_000_000_000));
        for bad in [
            "",
            ".",
            "1.",
            ".5",
            "-1.0",
            "1.0000000001",
            "99999999999999999999.0",
            "1e5",
        ] {
            assert_eq!(parse_time(bad), None, "{bad}");
        }
    }

    /// Data with blanks between the bytes, as some servers send them.
    #[test]
    fn received_data_with_blanks() {
        let words = "123 23.424242 11 22 33 44".split(' ');
        assert_eq!(
            parse_received(words, false).unwrap().1.to_string(),
            "123#11223344"
        );
        for bad in ["123 1.0 1", "123 1.0 1x", "123 1.0 112233445566778899"] {
            assert!(parse_received(bad.split(' '), false).is_err(), "{bad}");
        }
    }
}
