//! The bus dialogue for people: one line a frame, with repetition folded away.

use std::fmt::Write as _;
use std::io::{self, Write};

use can::Frame;
use canopen::Instant;
use client::decode::{Decoded, Decoder, Meaning};
use client::{Seen, Way};

/// Prints frames as they pass, decoded.
///
/// An acknowledge of an SDO write is not a line of its own: how long it took stands behind the
/// write. While the dialogue is folded, frames are decoded and counted, not printed; only
/// emergencies always are.
pub(super) struct Dialogue<'w> {
    output: &'w mut dyn Write,
    decoder: Decoder,
    /// A write that waits for its acknowledge.
    open: Option<Open>,
    fold: Option<Fold>,
    /// The first error of `output`; nothing is printed after it.
    error: Option<io::Error>,
}

struct Open {
    line: String,
    sent: Instant,
    node: u8,
    index: u16,
    sub: u8,
}

struct Fold {
    /// Lines that are still to be printed.
    lines: u32,
    frames: u64,
}

impl<'w> Dialogue<'w> {
    pub(super) fn new(output: &'w mut dyn Write, decoder: Decoder) -> Dialogue<'w> {
        Dialogue {
            output,
            decoder,
            open: None,
            fold: None,
            error: None,
        }
    }

    /// Prints a line that is no frame.
    pub(super) fn say(&mut self, line: &str) {
        self.close();
        self.print(line);
    }

    /// The heading of what follows.
    pub(super) fn heading(&mut self, text: &str) {
        self.say("");
        self.say(text);
    }

    /// Prints `lines` more lines, then only counts, until [`Dialogue::unfold`].
    pub(super) fn fold(&mut self, lines: u32) {
        self.close();
        self.fold = Some(Fold { lines, frames: 0 });
    }

    /// Says how many frames were not printed and what they were, and prints on.
    pub(super) fn unfold(&mut self, what: &str) {
        self.close();
        if let Some(fold) = self.fold.take()
            && fold.frames > 0
        {
            let frames = thousands(fold.frames);
            self.print(&format!("{:14}... {frames} frames more: {what}", ""));
        }
    }

    /// A frame passed.
    pub(super) fn see(&mut self, seen: &Seen) {
        let decoded = self.decoder.decode(seen.at, &seen.frame);
        if let (
            Some(open),
            &Meaning::Written {
                node, index, sub, ..
            },
        ) = (&self.open, &decoded.meaning)
            && (open.node, open.index, open.sub) == (node, index, sub)
        {
            let took_ms = seen.at.since_ns(open.sent) as f64 * 1e-6;
            let line = format!("{}  [ok, {took_ms:.2} ms]", open.line);
            self.open = None;
            self.frame_line(&line, 2);
            return;
        }
        self.close();
        let arrow = match seen.way {
            Way::Sent => '\u{2192}',
            Way::Received => '\u{2190}',
        };
        let meaning = decoded.meaning.clone();
        let line = format!("{arrow}{}", in_words(decoded));
        match meaning {
            Meaning::Write { node, value } if seen.way == Way::Sent => {
                self.open = Some(Open {
                    line,
                    sent: seen.at,
                    node,
                    index: value.index,
                    sub: value.sub,
                });
            }
            Meaning::Emergency { .. } => self.print(&line),
            _ => self.frame_line(&line, 1),
        }
    }

    /// Prints a frame again that was folded away.
    pub(super) fn show(&mut self, at: Instant, frame: &Frame) {
        self.close();
        let decoded = self.decoder.decode(at, frame);
        self.print(&format!("\u{2190}{}", in_words(decoded)));
    }

    /// A write without acknowledge is a line like any other.
    fn close(&mut self) {
        if let Some(open) = self.open.take() {
            self.frame_line(&open.line, 1);
        }
    }

    /// Prints the line of a frame, or of `frames` of them, unless the dialogue is folded.
    fn frame_line(&mut self, line: &str, frames: u64) {
        match &mut self.fold {
            Some(fold) if fold.lines == 0 => fold.frames += frames,
            Some(fold) => {
                fold.lines -= 1;
                self.print(line);
            }
            None => self.print(line),
        }
    }

    fn print(&mut self, line: &str) {
        if self.error.is_none() {
            self.error = writeln!(self.output, "{}", line.trim_end()).err();
        }
    }

    /// Whether everything could be printed.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.close();
        match self.error {
            Some(error) => Err(error),
            None => self.output.flush(),
        }
    }
}

/// A frame in words. Objects in a PDO stand without their names, which the mapping has told.
fn in_words(mut decoded: Decoded) -> String {
    if let Meaning::Pdo { nodes } = &mut decoded.meaning {
        for value in nodes
            .iter_mut()
            .flat_map(|node| node.values.iter_mut().flatten())
        {
            value.name = None;
        }
    }
    decoded.to_string()
}

/// A number with commas between its thousands.
pub(super) fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (n, digit) in digits.chars().enumerate() {
        if n > 0 && (digits.len() - n).is_multiple_of(3) {
            text.push(',');
        }
        let _ = text.write_char(digit);
    }
    text
}
