//! What is wrong with a scenario, and where.

use std::fmt;
use std::ops::Range;

/// A scenario's text and the name that people know it by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    pub(super) name: &'a str,
    pub(super) text: &'a str,
}

/// Bytes of the text.
pub(super) type Span = Range<usize>;

impl Source<'_> {
    /// The line of a byte, counted from 1.
    pub(super) fn line_of(&self, byte: usize) -> usize {
        self.before(byte).matches('\n').count() + 1
    }

    fn before(&self, byte: usize) -> &str {
        let mut end = byte.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        &self.text[..end]
    }

    fn problem(&self, span: &Span, what: String, remedy: String) -> Problem {
        let before = self.before(span.start);
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let line = self.line_of(span.start);
        let shown = self.text.lines().nth(line - 1).unwrap_or("").to_owned();
        let marked = self.before(span.end).get(before.len()..).unwrap_or("");
        let marks = marked.lines().next().unwrap_or("").chars().count().max(1);
        Problem {
            line,
            column,
            shown,
            marks,
            what,
            remedy,
        }
    }
}

/// Something that is wrong with a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The line, counted from 1.
    pub line: usize,
    /// The character in it, counted from 1.
    pub column: usize,
    /// What is wrong.
    pub what: String,
    /// What is expected, and what to do.
    pub remedy: String,
    /// The text of the line.
    shown: String,
    /// How many characters the trouble is long.
    marks: usize,
}

/// Everything that is wrong with a scenario, in the order of its lines. Shown as
///
/// ```text
/// sag.toml:4:6: 'W' is no unit of a voltage
///   4 | to = "20 W"
///     |      ^^^^^^ write it in V, mV or kV, as in "48 V"
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problems {
    /// The file's name, as it was given.
    pub file: String,
    /// At least one.
    pub list: Vec<Problem>,
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, problem) in self.list.iter().enumerate() {
            let Problem {
                line,
                column,
                what,
                remedy,
                shown,
                marks,
            } = problem;
            if number > 0 {
                f.write_str("\n")?;
            }
            writeln!(f, "{}:{line}:{column}: {what}", self.file)?;
            // Tabs stay tabs, so that the marks stand under what they mark.
            let gap: String = shown
                .chars()
                .take(column - 1)
                .map(|c| if c == '\t' { '\t' } else { ' ' })
                .collect();
            let number = line.to_string();
            let margin = " ".repeat(number.len());
            writeln!(f, "  {number} | {shown}")?;
            write!(f, "  {margin} | {gap}{} {remedy}", "^".repeat(*marks))?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// Collects problems while a scenario is read.
#[derive(Debug)]
pub(super) struct Findings<'a> {
    pub(super) source: Source<'a>,
    list: Vec<Problem>,
}

impl<'a> Findings<'a> {
    pub(super) fn new(source: Source<'a>) -> Findings<'a> {
        let list = Vec::new();
        Findings { source, list }
    }

    /// `what` is wrong there; `remedy` says what to do about it.
    pub(super) fn push(&mut self, span: &Span, what: impl Into<String>, remedy: impl Into<String>) {
        let problem = self.source.problem(span, what.into(), remedy.into());
        if !self.list.contains(&problem) {
            self.list.push(problem);
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// `value`, if nothing is wrong.
    pub(super) fn finish<T>(mut self, value: T) -> Result<T, Problems> {
        if self.list.is_empty() {
            return Ok(value);
        }
        self.list
            .sort_by_key(|problem| (problem.line, problem.column));
        Err(Problems {
            file: self.source.name.to_owned(),
            list: self.list,
        })
    }
}

/// `a`, `b` or `c`, each in quotes.
pub(super) fn any_of<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = words.into_iter().map(|word| format!("'{word}'")).collect();
    listed(&quoted)
}

/// `a, b or c`.
pub(super) fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// The word that is most like `wrong`, if one is like it at all.
pub(super) fn nearest<'w>(
    wrong: &str,
    words: impl IntoIterator<Item = &'w str>,
) -> Option<&'w str> {
    let likeness = |word: &str| strsim::jaro_winkler(&wrong.to_lowercase(), &word.to_lowercase());
    words
        .into_iter()
        .map(|word| (likeness(word), word))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, word)| word)
}

/// `did you mean 'this'?`, else all the words there are.
pub(super) fn suggestion(wrong: &str, words: &[&str]) -> String {
    match nearest(wrong, words.iter().copied()) {
        Some(word) => format!("did you mean '{word}'?"),
        None => format!("write {}", any_of(words.iter().copied())),
    }
}
