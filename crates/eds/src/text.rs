//! Bytes to text and back. CiA 306 wants ASCII; real files hold ISO 8859-1 or UTF-8.

use crate::finding::{Findings, Place, Rule};

/// The largest file that is read: far more than any EDS has.
pub const MAX_BYTES: usize = 4 << 20;

/// How characters are written as bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// ASCII, or UTF-8 where there are other characters.
    #[default]
    Utf8,
    /// ISO 8859-1.
    Latin1,
}

/// How lines end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Newline {
    /// Line feed.
    #[default]
    Lf,
    /// Carriage return and line feed.
    CrLf,
    /// Carriage return.
    Cr,
}

impl Newline {
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Newline::Lf => "\n",
            Newline::CrLf => "\r\n",
            Newline::Cr => "\r",
        }
    }

    /// How the first line of `text` ends.
    pub(crate) fn of(text: &str) -> Newline {
        match text.find(['\r', '\n']) {
            Some(at) if text[at..].starts_with("\r\n") => Newline::CrLf,
            Some(at) if text[at..].starts_with('\r') => Newline::Cr,
            _ => Newline::Lf,
        }
    }
}

/// The text of a file, and how it was encoded; `None` if it is not read at all.
pub(crate) fn decode(bytes: &[u8], findings: &mut Findings) -> Option<(String, Encoding)> {
    let whole = Place::default();
    if bytes.len() > MAX_BYTES {
        let what = format!("the file has {} bytes, more than {MAX_BYTES}", bytes.len());
        findings.add(Rule::TooLarge, whole, what, "it is not read; is it an EDS?");
        return None;
    }
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        let advice = "it is not read; save it as ISO 8859-1 or UTF-8";
        findings.add(Rule::Utf16, whole, "the file is UTF-16", advice);
        return None;
    }
    let first = Place { line: 1, column: 1 };
    let bytes = match bytes.strip_prefix(&[0xEF, 0xBB, 0xBF]) {
        Some(rest) => {
            let advice = "it is passed over; save the file without one";
            findings.add(Rule::ByteOrderMark, first, "a byte order mark", advice);
            rest
        }
        None => bytes,
    };
    Some(match std::str::from_utf8(bytes) {
        Ok(text) => {
            if let Some((at, strange)) = text.char_indices().find(|(_, c)| !c.is_ascii()) {
                let what = format!("{strange:?} is not ASCII");
                let advice = "read as UTF-8; some readers want ISO 8859-1, so use ASCII";
                findings.add(Rule::Utf8, place(text, at), what, advice);
            }
            (text.to_owned(), Encoding::Utf8)
        }
        Err(_) => {
            let text: String = bytes.iter().map(|&byte| char::from(byte)).collect();
            if let Some((at, strange)) = text.char_indices().find(|(_, c)| !c.is_ascii()) {
                let byte = u32::from(strange);
                let what = format!("byte 0x{byte:02X} is neither ASCII nor UTF-8");
                let advice = format!("read as ISO 8859-1, {strange:?}; use ASCII");
                findings.add(Rule::Latin1, place(&text, at), what, advice);
            }
            (text, Encoding::Latin1)
        }
    })
}

/// The line and column of a byte offset.
fn place(text: &str, at: usize) -> Place {
    let mut found = Place { line: 1, column: 1 };
    for (line, content) in lines(text) {
        let start = content.as_ptr() as usize - text.as_ptr() as usize;
        if start > at {
            break;
        }
        let before = content.char_indices().take_while(|(i, _)| start + i < at);
        found = Place {
            line,
            column: before.count() as u32 + 1,
        };
    }
    found
}

/// Lines with their numbers, however they end.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (u32, &str)> {
    let mut rest = Some(text);
    let mut number = 0;
    std::iter::from_fn(move || {
        let text = rest?;
        number += 1;
        match text.find(['\r', '\n']) {
            Some(at) => {
                let (line, end) = text.split_at(at);
                let after = end.strip_prefix("\r\n").or_else(|| end.get(1..));
                rest = after;
                Some((number, line))
            }
            None => {
                rest = None;
                Some((number, text))
            }
        }
    })
}

/// The bytes of `text`, whose lines end with a line feed. Text that ISO 8859-1 cannot hold, or that
/// would be taken for UTF-8 when it is read again, becomes UTF-8.
pub(crate) fn encode(text: &str, encoding: Encoding, newline: Newline) -> Vec<u8> {
    let text = match newline {
        Newline::Lf => text.to_owned(),
        other => text.replace('\n', other.text()),
    };
    if encoding == Encoding::Latin1 {
        let latin1: Option<Vec<u8>> = text
            .chars()
            .map(|c| u8::try_from(u32::from(c)).ok())
            .collect();
        if let Some(bytes) = latin1
            && std::str::from_utf8(&bytes).is_err()
        {
            return bytes;
        }
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_end() {
        let found: Vec<_> = lines("a\r\nb\rc\n\nd").collect();
        assert_eq!(found, [(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")]);
        assert_eq!(Newline::of("a\r\nb\n"), Newline::CrLf);
        assert_eq!(Newline::of("a\rb\n"), Newline::Cr);
        assert_eq!(Newline::of("a"), Newline::Lf);
    }

    #[test]
    fn places_count_characters() {
        assert_eq!(place("ab\r\nä;x", 7), Place { line: 2, column: 3 });
        assert_eq!(place("ab", 0), Place { line: 1, column: 1 });
    }

    #[test]
    fn latin_1_that_looks_like_utf_8_becomes_utf_8() {
        // 0xC3 0xA4 is "Ã¤" in ISO 8859-1 and "ä" in UTF-8.
        assert_eq!(encode("Ã¤", Encoding::Latin1, Newline::Lf), "Ã¤".as_bytes());
        assert_eq!(encode("ä", Encoding::Latin1, Newline::Lf), [0xE4]);
        assert_eq!(
            encode("Ω\n", Encoding::Latin1, Newline::CrLf),
            "Ω\r\n".as_bytes()
        );
    }
}
