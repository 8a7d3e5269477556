//! Reading a line.

use super::Kind;

/// A line in its parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request<'a> {
    /// A command of some kind.
    Command {
        kind: Kind,
        name: &'a [u8],
        numbers: Numbers,
    },
    /// `#`: the next query of the history, or no more of them.
    Next,
    /// `# C`: the history becomes empty.
    Clear,
    /// `# nn`: a query of the history each so many milliseconds.
    Repeat { every_ms: u16 },
}

/// The numbers of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Numbers {
    None,
    One(i32),
    Two(i32, i32),
}

/// The parts of a line without spaces at its ends; `None` if it makes no sense.
pub(crate) fn parse(text: &[u8]) -> Option<Request<'_>> {
    let (prefix, rest) = text.split_first()?;
    if *prefix == b'#' {
        return history(rest.trim_ascii());
    }
    let kind = Kind::of(*prefix)?;
    // The first number may follow the name at once: `?T2`.
    let rest = rest.trim_ascii_start();
    let end = rest.iter().position(|byte| !byte.is_ascii_alphabetic());
    let (name, rest) = rest.split_at_checked(end.unwrap_or(rest.len()))?;
    if name.is_empty() {
        return None;
    }
    let mut words = rest
        .split(|byte| *byte == b' ')
        .filter(|word| !word.is_empty());
    let numbers = match (words.next(), words.next(), words.next()) {
        (None, ..) => Numbers::None,
        (Some(one), None, _) => Numbers::One(number(one)?),
        (Some(one), Some(two), None) => Numbers::Two(number(one)?, number(two)?),
        (_, _, Some(_)) => return None,
    };
    Some(Request::Command {
        kind,
        name,
        numbers,
    })
}

/// What stands behind `#`.
fn history(text: &[u8]) -> Option<Request<'static>> {
    match text {
        [] => Some(Request::Next),
        b"C" | b"c" => Some(Request::Clear),
        _ => match u16::try_from(number(text)?) {
            Ok(every_ms @ 1..=32_000) => Some(Request::Repeat { every_ms }),
            _ => None,
        },
    }
}

/// A decimal number of 32 bits, with a sign if it is negative.
fn number(word: &[u8]) -> Option<i32> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0_i32;
    for digit in digits {
        let digit = i32::from(char::from(*digit).to_digit(10)? as u8);
        // Downwards, because the least number is further from zero than the greatest.
        value = value.checked_mul(10)?.checked_sub(digit)?;
    }
    if negative {
        Some(value)
    } else {
        value.checked_neg()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_32_bits_and_a_sign() {
        let rows: [(&[u8], Option<i32>); 12] = [
            (b"0", Some(0)),
            (b"-0", Some(0)),
            (b"15", Some(15)),
            (b"007", Some(7)),
            (b"2147483647", Some(i32::MAX)),
            (b"2147483648", None),
            (b"-2147483648", Some(i32::MIN)),
            (b"-2147483649", None),
            (b"99999999999999999999", None),
            (b"-", None),
            (b"1a", None),
            (b"+1", None),
        ];
        for (text, value) in rows {
            assert_eq!(number(text), value, "{}", text.escape_ascii());
        }
    }

    #[test]
    fn lines_in_their_parts() {
        let command = |kind, name, numbers| {
            Some(Request::Command {
                kind,
                name,
                numbers,
            })
        };
        let rows: [(&[u8], Option<Request<'_>>); 20] = [
            (
                b"!CW 1 15",
                command(Kind::Command, b"CW", Numbers::Two(1, 15)),
            ),
            (
                b"! CW  1   15",
                command(Kind::Command, b"CW", Numbers::Two(1, 15)),
            ),
            (b"?sw", command(Kind::Query, b"sw", Numbers::None)),
            (b"?T2", command(Kind::Query, b"T", Numbers::One(2))),
            (b"!G1 -5", command(Kind::Command, b"G", Numbers::Two(1, -5))),
            (b"!G-5", command(Kind::Command, b"G", Numbers::One(-5))),
            (b"!1 5", None),
            (b"~MAC 2", command(Kind::Get, b"MAC", Numbers::One(2))),
            (b"^FSA 1", command(Kind::Set, b"FSA", Numbers::One(1))),
            (
                b"%EESAV",
                command(Kind::Maintenance, b"EESAV", Numbers::None),
            ),
            (b"#", Some(Request::Next)),
            (b"# C", Some(Request::Clear)),
            (b"#c", Some(Request::Clear)),
            (b"# 100", Some(Request::Repeat { every_ms: 100 })),
            (b"# 0", None),
            (b"# 32001", None),
            (b"# x", None),
            (b"!CW 1 15 2", None),
            (b"CW 1 15", None),
            (b"!", None),
        ];
        for (text, expected) in rows {
            assert_eq!(parse(text), expected, "{}", text.escape_ascii());
        }
    }
}
