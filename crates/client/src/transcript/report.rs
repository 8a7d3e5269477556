//! What playing a transcript found.

use std::fmt;

use serde::Serialize;

/// The outcome of playing a transcript.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// The transcript.
    pub file: String,
    /// Frames sent.
    pub sent: u32,
    /// Expected frames that came.
    pub matched: u32,
    /// Frames that came and a rule ignored.
    pub ignored: u32,
    /// Physical assertions that hold.
    pub assertions: u32,
    /// Misprints that were shown to be ones.
    pub misprints: Vec<Misprint>,
    /// Physical assertions that nobody could check.
    pub not_checked: Vec<NotChecked>,
    /// Where the drive departed from the transcript; `None` if it never did.
    pub failure: Option<Failure>,
    /// How long it took on the link's clock.
    pub duration_ns: u64,
}

impl Report {
    /// Whether the bus did all that the transcript says. Assertions that were not checked do not
    /// count against it; look at [`Report::not_checked`].
    pub fn passed(&self) -> bool {
        self.failure.is_none()
    }
}

/// A misprint, and what the drive does instead.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Misprint {
    /// Line.
    pub line: usize,
    /// Where it is printed and what is wrong.
    pub reason: String,
    /// What came instead of what is printed.
    pub instead: String,
}

/// A physical assertion that could not be checked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NotChecked {
    /// Line.
    pub line: usize,
    /// The line.
    pub text: String,
}

/// Where and how the drive departed from the transcript.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The transcript.
    pub file: String,
    /// Line; one past the last if it happened after the end.
    pub line: usize,
    /// The line.
    pub text: String,
    /// What happened.
    #[serde(flatten)]
    pub kind: FailureKind,
}

/// A frame that was expected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Expected {
    /// Line.
    pub line: usize,
    /// The frame, with its wildcards.
    pub frame: String,
    /// What it would have meant.
    pub meaning: String,
}

/// A frame that was received.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Received {
    /// The frame.
    pub frame: String,
    /// What it means.
    pub meaning: String,
    /// When, in nanoseconds after the line before.
    pub after_ns: u64,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum FailureKind {
    /// Another frame came.
    Differs {
        /// What was expected: one frame, or any of several.
        expected: Vec<Expected>,
        /// What came.
        received: Received,
        /// The bytes that differ.
        differences: Vec<String>,
    },
    /// No frame came in time.
    Missing {
        /// What was expected.
        expected: Vec<Expected>,
        /// How long was waited.
        within_ns: u64,
    },
    /// The right frame came too early.
    Early {
        /// What was expected.
        expected: Vec<Expected>,
        /// What came.
        received: Received,
        /// The earliest time allowed.
        from_ns: u64,
    },
    /// A frame came that no line lists and no rule ignores.
    Unlisted {
        /// What came.
        received: Received,
    },
    /// A physical assertion does not hold.
    Assertion {
        /// What was measured, with its unit.
        measured: String,
        /// What should have been.
        wanted: String,
    },
    /// The drive did as the misprint says, so it is none.
    NoMisprint {
        /// The reason given.
        reason: String,
    },
    /// The line cannot be played.
    Unplayable {
        /// Why, and what to do.
        cause: String,
    },
    /// The link broke.
    Link {
        /// What it said.
        cause: String,
    },
}

/// Nanoseconds as people read them.
pub(super) fn duration(ns: u64) -> String {
    match ns {
        0..1_000_000 => format!("{} us", ns as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{} ms", (ns as f64 / 1e3).round() / 1e3),
        _ => format!("{} s", (ns as f64 / 1e6).round() / 1e3),
    }
}

fn write_expected(f: &mut fmt::Formatter<'_>, expected: &[Expected]) -> fmt::Result {
    for (n, frame) in expected.iter().enumerate() {
        let label = if n == 0 { "expected" } else { "      or" };
        write!(
            f,
            "\n  {label}  {}\n            {}",
            frame.frame, frame.meaning
        )?;
    }
    Ok(())
}

fn write_received(f: &mut fmt::Formatter<'_>, received: &Received) -> fmt::Result {
    let Received {
        frame,
        meaning,
        after_ns,
    } = received;
    write!(f, "\n  received  {frame}   after {}", duration(*after_ns))?;
    write!(f, "\n            {meaning}")
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", self.file, self.line)?;
        match &self.kind {
            FailureKind::Differs {
                expected,
                received,
                differences,
            } => {
                f.write_str("another frame came than expected")?;
                write_expected(f, expected)?;
                write_received(f, received)?;
                differences
                    .iter()
                    .try_for_each(|difference| write!(f, "\n  differs   {difference}"))
            }
            FailureKind::Missing {
                expected,
                within_ns,
            } => {
                write!(f, "no frame came within {}", duration(*within_ns))?;
                write_expected(f, expected)
            }
            FailureKind::Early {
                expected,
                received,
                from_ns,
            } => {
                write!(f, "the frame came before {} had passed", duration(*from_ns))?;
                write_expected(f, expected)?;
                write_received(f, received)
            }
            FailureKind::Unlisted { received } => {
                f.write_str("a frame came that is not listed; list it, or add an ignore rule")?;
                write!(f, "\n  at        {}", self.text)?;
                write_received(f, received)
            }
            FailureKind::Assertion { measured, wanted } => {
                f.write_str("the drive is not as asserted")?;
                write!(f, "\n  expected  {wanted}\n  measured  {measured}")
            }
            FailureKind::NoMisprint { reason } => {
                write!(
                    f,
                    "the drive does as printed, so this is no misprint: {reason}"
                )
            }
            FailureKind::Unplayable { cause } => write!(f, "{cause}\n  at        {}", self.text),
            FailureKind::Link { cause } => {
                write!(f, "the bus is lost: {cause}\n  at        {}", self.text)
            }
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passed() { "passed" } else { "FAILED" };
        write!(
            f,
            "{}: {verdict}, {} sent, {} as expected",
            self.file, self.sent, self.matched
        )?;
        if self.ignored > 0 {
            write!(f, ", {} ignored", self.ignored)?;
        }
        if self.assertions > 0 {
            write!(f, ", physical assertions that hold: {}", self.assertions)?;
        }
        write!(f, ", {}", duration(self.duration_ns))?;
        for misprint in &self.misprints {
            write!(f, "\n{}:{}: ", self.file, misprint.line)?;
            write!(
                f,
                "misprint, {}; instead: {}",
                misprint.reason, misprint.instead
            )?;
        }
        for not_checked in &self.not_checked {
            write!(f, "\n{}:{}: NOT CHECKED, ", self.file, not_checked.line)?;
            write!(f, "a real drive has no plant to ask: {}", not_checked.text)?;
        }
        match &self.failure {
            Some(failure) => write!(f, "\n{failure}"),
            None => Ok(()),
        }
    }
}
