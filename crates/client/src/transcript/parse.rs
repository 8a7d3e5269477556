//! From text to steps.

use std::fmt;
use std::path::Path;

use canopen::NodeId;

use super::expression;
use super::parse_frame::{self, Names, Use};
use super::parse_quantity::{assertion, between, duration, finished, node};
use super::pattern::Pattern;
use super::source::{Cursor, SyntaxError, Word};
use super::step::{Action, Block, Expectation, Header, Ignored, Span, Step, Transcript};

/// Why there is no transcript.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TranscriptError {
    /// The file cannot be read.
    Unreadable {
        /// As the user named it.
        file: String,
        /// What the operating system said.
        cause: String,
    },
    /// Its text makes no sense.
    Syntax(SyntaxError),
}

impl fmt::Display for TranscriptError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TranscriptError::Unreadable { file, cause } => {
                write!(
                    f,
                    "{file}: cannot be read ({cause}); give the path of a transcript"
                )
            }
            TranscriptError::Syntax(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for TranscriptError {}

impl From<SyntaxError> for TranscriptError {
    fn from(error: SyntaxError) -> TranscriptError {
        TranscriptError::Syntax(error)
    }
}

impl Transcript {
    /// Reads a transcript from a file.
    ///
    /// # Errors
    /// [`TranscriptError`], whose text names the thing, the place and the remedy.
    pub fn read(path: &Path) -> Result<Transcript, TranscriptError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| TranscriptError::Unreadable {
            file: file.clone(),
            cause: error.to_string(),
        })?;
        let text = match std::str::from_utf8(&bytes) {
            Ok(text) => text,
            Err(error) => return Err(not_text(&file, &bytes[..error.valid_up_to()]).into()),
        };
        Ok(Transcript::parse(&file, text)?)
    }

    /// Reads a transcript from a text; `file` is what messages call it.
    ///
    /// # Errors
    /// The first [`SyntaxError`].
    pub fn parse(file: &str, text: &str) -> Result<Transcript, SyntaxError> {
        // Some editors put a byte order mark in front.
        let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
        let mut parser = Parser {
            file,
            lines: text.lines().collect(),
            next: 0,
            names: Names::new(),
            header: Header::default(),
            has_steps: false,
        };
        let (steps, ended) = parser.steps(Place::File, 0)?;
        let finally = match ended {
            Ended::Finally => parser.steps(Place::Finally, 0)?.0,
            _ => Vec::new(),
        };
        Ok(Transcript {
            file: file.to_owned(),
            header: parser.header,
            steps,
            finally,
        })
    }
}

/// The error for a file that is no UTF-8 text after the bytes in `good`.
fn not_text(file: &str, good: &[u8]) -> SyntaxError {
    let good = String::from_utf8_lossy(good);
    let line = good.matches('\n').count() + 1;
    let last = good.rsplit('\n').next().unwrap_or("");
    SyntaxError {
        file: file.to_owned(),
        line,
        column: last.chars().count() + 1,
        message: "a byte that is not UTF-8 text".to_owned(),
        remedy: "store the file as UTF-8, or give the path of a transcript".to_owned(),
    }
}

/// Where steps stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    File,
    Finally,
    Group,
    Misprint,
}

/// What ended a run of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ended {
    End,
    Finally,
    File,
}

struct Parser<'a> {
    file: &'a str,
    lines: Vec<&'a str>,
    next: usize,
    names: Names,
    header: Header,
    has_steps: bool,
}

impl<'a> Parser<'a> {
    /// Steps up to the end of the block that began in line `opened`, or of the file.
    fn steps(&mut self, place: Place, opened: usize) -> Result<(Vec<Step>, Ended), SyntaxError> {
        let mut steps: Vec<Step> = Vec::new();
        let mut span: Option<(Span, SyntaxError)> = None;
        while let Some(&text) = self.lines.get(self.next) {
            self.next += 1;
            let line = self.next;
            let trimmed = text.trim();
            if trimmed.is_empty() || trimmed.starts_with('#') {
                continue;
            }
            let mut cursor = Cursor::new(self.file, line, text);
            cursor.skip_blanks();
            let first = trimmed.split_whitespace().next().unwrap_or("");
            if place == Place::Group && !first.eq_ignore_ascii_case("end") {
                let pattern = self.expected_in_group(&mut cursor)?;
                let action = Action::Expect(vec![Expectation { line, pattern }], None);
                steps.push(Step {
                    line,
                    text: trimmed.to_owned(),
                    action,
                });
                continue;
            }
            let parsed = self.line(&mut cursor, place)?;
            let mut action = match parsed {
                Line::Header => continue,
                Line::Action(action) => action,
                Line::Span(next) => {
                    let unused = cursor.error(
                        text.len() - text.trim_start().len(),
                        "no expected frame follows this time limit",
                        "put it right before the frame, or remove it",
                    );
                    match span.replace((next, unused)) {
                        Some((_, unused)) => return Err(unused),
                        None => continue,
                    }
                }
                Line::End => return span.map_or(Ok((steps, Ended::End)), |(_, e)| Err(e)),
                Line::Finally => return span.map_or(Ok((steps, Ended::Finally)), |(_, e)| Err(e)),
            };
            self.has_steps = true;
            match (&mut action, span.take()) {
                (Action::Expect(_, own), Some((span, _))) => *own = Some(span),
                (_, Some((_, unused))) => return Err(unused),
                (_, None) => {}
            }
            steps.push(Step {
                line,
                text: trimmed.to_owned(),
                action,
            });
        }
        if let Some((_, unused)) = span {
            return Err(unused);
        }
        if matches!(place, Place::Group | Place::Misprint) {
            let text = self.lines.get(opened - 1).copied().unwrap_or("");
            let cursor = Cursor::new(self.file, opened, text);
            let at = text.len() - text.trim_start().len();
            return Err(cursor.error(at, "this block has no end", "add a line \"end\""));
        }
        Ok((steps, Ended::File))
    }

    fn line(&mut self, cursor: &mut Cursor<'a>, place: Place) -> Result<Line, SyntaxError> {
        if cursor.rest().starts_with(['>', '<', '0']) {
            let line = cursor.line;
            let (pattern, used) = self.frame_line(cursor)?;
            return Ok(Line::Action(match used {
                Use::Sent => Action::Send(pattern),
                _ => Action::Expect(vec![Expectation { line, pattern }], None),
            }));
        }
        strip(cursor)?;
        self.directive(cursor, place)
    }

    /// `>` sends, `<` expects; without either the identifier tells.
    fn frame_line(&mut self, cursor: &mut Cursor<'_>) -> Result<(Pattern, Use), SyntaxError> {
        let marked = match () {
            () if cursor.take(">") => Some(Use::Sent),
            () if cursor.take("<") => Some(Use::Expected),
            () => None,
        };
        let by_identifier = |pattern: &Pattern| {
            if pattern.is_masters() {
                Use::Sent
            } else {
                Use::Expected
            }
        };
        let used = |pattern: &Pattern| marked.unwrap_or_else(|| by_identifier(pattern));
        parse_frame::frame(cursor, used, &mut self.names)
    }

    fn expected_in_group(&mut self, cursor: &mut Cursor<'_>) -> Result<Pattern, SyntaxError> {
        let at = cursor.at();
        if cursor.rest().starts_with(['>', '<', '0']) {
            let (pattern, used) = self.frame_line(cursor)?;
            if used == Use::Expected {
                return Ok(pattern);
            }
        }
        Err(cursor.error(
            at,
            "not an expected frame",
            "between \"in any order\" and \"end\" put expected frames only (mark one with <)",
        ))
    }

    fn directive(&mut self, cursor: &mut Cursor<'_>, place: Place) -> Result<Line, SyntaxError> {
        let word = cursor.word();
        let keyword = word.text.to_ascii_lowercase();
        let action = match keyword.as_str() {
            "drive" | "nodes" | "node" | "settle" => {
                if self.has_steps {
                    return Err(cursor.error(
                        word.at,
                        format!("\"{keyword}\" after the first step"),
                        "put it at the head of the file",
                    ));
                }
                self.header_line(cursor, &keyword)?;
                return Ok(Line::Header);
            }
            "wait" => Action::Wait(finished(cursor, duration)?),
            "silence" => Action::Silence(finished(cursor, duration)?),
            "limit" => Action::Limit(finished(cursor, duration)?),
            "within" => {
                let to_ns = finished(cursor, duration)?;
                return Ok(Line::Span(Span { from_ns: 0, to_ns }));
            }
            "between" => return Ok(Line::Span(finished(cursor, between)?)),
            "ignore" => Action::Ignore(self.ignored(cursor)?),
            "let" => self.binding(cursor)?,
            "assert" => Action::Assert(finished(cursor, assertion)?),
            "in" => {
                expect_words(cursor, word.at, &["any", "order"])?;
                let (steps, _) = self.steps(Place::Group, cursor.line)?;
                let expected = steps.into_iter().filter_map(|step| match step.action {
                    Action::Expect(mut frames, _) => frames.pop(),
                    _ => None,
                });
                let expected: Vec<Expectation> = expected.collect();
                if expected.is_empty() {
                    return Err(cursor.error(word.at, "an empty group", "list the frames in it"));
                }
                Action::Expect(expected, None)
            }
            "misprint" if place == Place::Misprint => {
                return Err(cursor.error(
                    word.at,
                    "a misprint within a misprint",
                    "end the first block before the second",
                ));
            }
            "misprint" => Action::Misprint(self.misprint(cursor, word.at)?),
            "end" if place != Place::Misprint && place != Place::Group => {
                return Err(cursor.error(word.at, "\"end\" without a block", "remove it"));
            }
            "end" => {
                cursor.finish()?;
                return Ok(Line::End);
            }
            "finally" if place == Place::File => {
                cursor.finish()?;
                return Ok(Line::Finally);
            }
            "finally" => {
                return Err(cursor.error(
                    word.at,
                    "\"finally\" within a block",
                    "end the block first; a file has one \"finally\"",
                ));
            }
            _ => {
                return Err(cursor.error(
                    word.at,
                    format!("\"{}\" begins no line of a transcript", word.text),
                    "write a frame (0x601 4 40 41 60 00), one of drive, nodes, node, settle, limit, \
                     ignore, wait, silence, within, between, in any order, let, assert, misprint, \
                     end, finally, or a comment after #",
                ));
            }
        };
        Ok(Line::Action(action))
    }

    fn header_line(&mut self, cursor: &mut Cursor<'_>, keyword: &str) -> Result<(), SyntaxError> {
        match keyword {
            "drive" => {
                let name = cursor.word();
                if name.text.is_empty() {
                    let remedy = "name one, as in \"drive p3\"";
                    return Err(cursor.error(name.at, "no drive", remedy));
                }
                self.header.drive = Some(name.text.to_owned());
                cursor.finish()
            }
            "nodes" => {
                let mut word = cursor.word();
                loop {
                    self.new_node(cursor, word)?;
                    word = cursor.word();
                    if word.text.is_empty() {
                        return Ok(());
                    }
                }
            }
            "node" => {
                let word = cursor.word();
                let node = self.new_node(cursor, word)?;
                let equals = cursor.word();
                let name = cursor.word();
                if equals.text != "=" || name.text.is_empty() {
                    let remedy = format!("name it, as in \"node {node} = p3\"");
                    return Err(cursor.error(equals.at, "it does not say which drive", remedy));
                }
                self.header.named.push((node, name.text.to_owned()));
                cursor.finish()
            }
            _ => {
                self.header.settle_ns = Some(finished(cursor, duration)?);
                Ok(())
            }
        }
    }

    /// A node of the head, which is named once.
    fn new_node(&mut self, cursor: &Cursor<'_>, word: Word<'_>) -> Result<NodeId, SyntaxError> {
        let at = word.at;
        let node = node(cursor, word)?;
        if self.header.nodes.contains(&node) {
            let message = format!("node {node} is there already");
            return Err(cursor.error(at, message, "name every node once"));
        }
        self.header.nodes.push(node);
        Ok(node)
    }

    fn ignored(&mut self, cursor: &mut Cursor<'_>) -> Result<Ignored, SyntaxError> {
        cursor.skip_blanks();
        if cursor.rest().trim_end().eq_ignore_ascii_case("heartbeats") {
            return Ok(Ignored::Heartbeats);
        }
        let (pattern, _) = parse_frame::frame(cursor, |_| Use::Ignored, &mut self.names)?;
        Ok(Ignored::Frames(pattern))
    }

    /// `let $name = expression`
    fn binding(&mut self, cursor: &mut Cursor<'_>) -> Result<Action, SyntaxError> {
        cursor.skip_blanks();
        let at = cursor.at();
        let wanted = "write \"let $name = expression\"";
        if !cursor.take("$") {
            return Err(cursor.error(at, "no variable", wanted));
        }
        let name = expression::name(cursor)?;
        if self.names.contains_key(&name) {
            return Err(cursor.error(
                at,
                format!("${name} has a value already"),
                "choose another name; a variable is given its value once",
            ));
        }
        cursor.skip_blanks();
        if !cursor.take("=") {
            return Err(cursor.error(cursor.at(), "no =", wanted));
        }
        let names = &self.names;
        let expression = expression::parse(cursor, &|name| names.contains_key(name))?;
        cursor.finish()?;
        self.names.insert(name.clone(), 0);
        Ok(Action::Let(name, expression))
    }

    fn misprint(&mut self, cursor: &mut Cursor<'_>, at: usize) -> Result<Block, SyntaxError> {
        let reason = cursor.rest().trim().to_owned();
        if reason.is_empty() {
            return Err(cursor.error(
                at,
                "a misprint without a reason",
                "say where it is printed and what is wrong, as in \"misprint P3 l.324: …\"",
            ));
        }
        // What a misprinted line captures is not there afterwards: the line must fail.
        let before = self.names.clone();
        let (steps, _) = self.steps(Place::Misprint, cursor.line)?;
        self.names = before;
        let last = steps.last().map(|step| &step.action);
        if !matches!(
            last,
            Some(Action::Expect(..) | Action::Silence(_) | Action::Assert(_))
        ) {
            return Err(cursor.error(
                at,
                "a misprint that nothing shows to be one",
                "let the block end with what the manual expects and the drive does not do: an \
                 expected frame, a silence or an assertion",
            ));
        }
        Ok(Block { reason, steps })
    }
}

enum Line {
    Header,
    Action(Action),
    Span(Span),
    End,
    Finally,
}

/// Takes off a comment and the parentheses that manuals put around `(Wait 1 second)`; what follows
/// them is a description.
fn strip(cursor: &mut Cursor<'_>) -> Result<(), SyntaxError> {
    let at = cursor.at();
    if cursor.take("(") {
        let rest = cursor.rest();
        let Some(close) = rest.find(')') else {
            return Err(cursor.error(at, "this parenthesis is not closed", "add the ) it lacks"));
        };
        cursor.cut(close);
        cursor.skip_blanks();
        return Ok(());
    }
    let rest = cursor.rest();
    let keeps = rest
        .get(..8)
        .is_some_and(|word| word.eq_ignore_ascii_case("misprint"));
    if !keeps {
        let blank_before = |at: &usize| rest[..*at].ends_with(char::is_whitespace);
        let comment = rest.match_indices('#').map(|(at, _)| at).find(blank_before);
        if let Some(comment) = comment {
            cursor.cut(comment);
        }
    }
    Ok(())
}

fn expect_words(cursor: &mut Cursor<'_>, at: usize, words: &[&str]) -> Result<(), SyntaxError> {
    for wanted in words {
        if !cursor.word().text.eq_ignore_ascii_case(wanted) {
            return Err(cursor.error(at, "an unknown line", "write \"in any order\""));
        }
    }
    cursor.finish()
}
