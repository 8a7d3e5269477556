//! A line of a transcript, read from left to right, and what to say when it makes no sense.

use std::fmt;

/// Why a transcript cannot be read: the thing, the place and the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    /// The file, as the user named it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

impl fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SyntaxError {
            file,
            line,
            column,
            message,
            remedy,
        } = self;
        write!(f, "{file}:{line}:{column}: {message}; {remedy}")
    }
}

impl std::error::Error for SyntaxError {}

/// A word and where it begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    /// Byte offset in the line.
    pub(super) at: usize,
}

/// Reads a line from left to right.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    pub(super) file: &'a str,
    /// From 1.
    pub(super) line: usize,
    text: &'a str,
    /// Byte offset of what comes next; on a character boundary.
    at: usize,
    /// Byte offset where the part ends that is read.
    end: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(file: &'a str, line: usize, text: &'a str) -> Cursor<'a> {
        Cursor {
            file,
            line,
            text,
            at: 0,
            end: text.len(),
        }
    }

    /// What is left.
    pub(super) fn rest(&self) -> &'a str {
        &self.text[self.at..self.end]
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn skip_blanks(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
    }

    /// Ends the part that is read `length` bytes after here.
    pub(super) fn cut(&mut self, length: usize) {
        self.end = self.at + length;
    }

    /// Takes `prefix`, if it is next.
    pub(super) fn take(&mut self, prefix: &str) -> bool {
        let found = self.rest().starts_with(prefix);
        if found {
            self.at += prefix.len();
        }
        found
    }

    /// The characters up to the first that `ends` names; may be empty.
    pub(super) fn until(&mut self, ends: impl Fn(char) -> bool) -> Word<'a> {
        let rest = self.rest();
        let length = rest.find(ends).unwrap_or(rest.len());
        let word = Word {
            text: &rest[..length],
            at: self.at,
        };
        self.at += length;
        word
    }

    /// The next word, up to a blank; empty at the end.
    pub(super) fn word(&mut self) -> Word<'a> {
        self.skip_blanks();
        self.until(char::is_whitespace)
    }

    /// An error at byte offset `at` of the line.
    pub(super) fn error(
        &self,
        at: usize,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> SyntaxError {
        let before = self.text.get(..at).unwrap_or(self.text);
        SyntaxError {
            file: self.file.to_owned(),
            line: self.line,
            column: before.chars().count() + 1,
            message: message.into(),
            remedy: remedy.into(),
        }
    }

    /// Nothing but blanks may be left.
    pub(super) fn finish(&mut self) -> Result<(), SyntaxError> {
        self.skip_blanks();
        match self.rest() {
            "" => Ok(()),
            rest => Err(self.error(
                self.at,
                format!("\"{}\" is too much here", rest.trim_end()),
                "remove it, or set a comment off by \" # \"",
            )),
        }
    }
}

/// A number, decimal or hexadecimal after `0x`.
pub(super) fn integer(text: &str) -> Option<i64> {
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) if digits.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            i64::from_str_radix(digits, 16).ok()
        }
        Some(_) => None,
        None if text.bytes().all(|byte| byte.is_ascii_digit()) => text.parse().ok(),
        None => None,
    }
}
