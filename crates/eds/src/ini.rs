//! Lines to sections and keys, each with its place.

use std::collections::HashMap;

use crate::finding::{Findings, Place, Rule, quoted};
use crate::text;

/// The longest line that CiA 306 allows, in characters.
const LONGEST_LINE: usize = 255;

/// Sections that are read: far more than any device describes.
const MAX_SECTIONS: usize = 1 << 15;

/// A file cut into sections.
#[derive(Debug, Default)]
pub(crate) struct Raw<'t> {
    pub(crate) sections: Vec<RawSection<'t>>,
    /// Comments behind the last key.
    pub(crate) trailing: Vec<String>,
}

/// A section with its keys.
#[derive(Debug)]
pub(crate) struct RawSection<'t> {
    pub(crate) name: &'t str,
    pub(crate) at: Place,
    /// Comments in front of the section.
    pub(crate) comments: Vec<String>,
    /// Comments between its keys.
    pub(crate) inner: Vec<String>,
    pub(crate) keys: Vec<RawKey<'t>>,
}

/// `key=value`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawKey<'t> {
    pub(crate) key: &'t str,
    pub(crate) at: Place,
    pub(crate) value: &'t str,
    pub(crate) value_at: Place,
}

/// Where the next key goes.
enum Current {
    Nowhere,
    /// A section that is not used, because of a finding that was made.
    Dropped,
    Section(usize),
}

struct Parser<'t, 'f> {
    raw: Raw<'t>,
    current: Current,
    pending: Vec<String>,
    seen: HashMap<String, Place>,
    keys: HashMap<String, usize>,
    hash_seen: bool,
    is_full: bool,
    findings: &'f mut Findings,
}

/// Cuts a text into sections.
pub(crate) fn parse<'t>(text: &'t str, findings: &mut Findings) -> Raw<'t> {
    let mut parser = Parser {
        raw: Raw::default(),
        current: Current::Nowhere,
        pending: Vec::new(),
        seen: HashMap::new(),
        keys: HashMap::new(),
        hash_seen: false,
        is_full: false,
        findings,
    };
    for (number, line) in text::lines(text) {
        parser.line(number, line);
    }
    parser.raw.trailing = parser.pending;
    parser.raw
}

/// The place of `part`, which is a piece of `line`.
fn place(number: u32, line: &str, part: &str) -> Place {
    let offset = part.as_ptr() as usize - line.as_ptr() as usize;
    let before = line.char_indices().take_while(|(at, _)| *at < offset);
    Place {
        line: number,
        column: before.count() as u32 + 1,
    }
}

impl<'t> Parser<'t, '_> {
    fn line(&mut self, number: u32, line: &'t str) {
        let content = line.trim();
        let at = place(number, line, content);
        if line.len() > LONGEST_LINE && line.chars().count() > LONGEST_LINE {
            let place = Place {
                line: number,
                column: LONGEST_LINE as u32 + 1,
            };
            let what = format!("the line has more than {LONGEST_LINE} characters");
            self.findings.add(
                Rule::LongLine,
                place,
                what,
                "read whole; others may cut it off",
            );
        }
        if content.is_empty() {
        } else if let Some(comment) = content.strip_prefix([';', '#']) {
            if content.starts_with('#') && !self.hash_seen {
                self.hash_seen = true;
                let advice = "read as a comment; comments begin with ;";
                self.findings
                    .add(Rule::HashComment, at, "a line that begins with #", advice);
            }
            self.pending.push(comment.to_owned());
        } else if let Some(rest) = content.strip_prefix('[') {
            self.section(number, line, rest, at);
        } else {
            self.key(number, line, content, at);
        }
    }

    fn section(&mut self, number: u32, line: &'t str, rest: &'t str, at: Place) {
        let comments = std::mem::take(&mut self.pending);
        self.keys.clear();
        let name = match rest.split_once(']') {
            Some((name, after)) => {
                let after = after.trim();
                if !after.is_empty() && !after.starts_with(';') {
                    let at = place(number, line, after);
                    let what = format!("{} stands behind a section's name", quoted(after));
                    self.findings
                        .add(Rule::AfterSection, at, what, "it is passed over");
                }
                name.trim()
            }
            None => {
                let what = format!("the section [{rest} has no closing bracket");
                let advice = format!("read as [{}]", rest.trim());
                self.findings.add(Rule::UnclosedSection, at, what, advice);
                rest.trim()
            }
        };
        if name.is_empty() {
            self.current = Current::Dropped;
            let advice = "its keys are not used; give it a name";
            self.findings
                .add(Rule::EmptySection, at, "a section without a name", advice);
            return;
        }
        if let Some(first) = self.seen.get(&name.to_ascii_lowercase()) {
            self.current = Current::Dropped;
            let what = format!("the section [{name}] is in line {} already", first.line);
            let advice = "the second one is not used; remove or merge it";
            self.findings.add(Rule::DuplicateSection, at, what, advice);
            return;
        }
        if self.raw.sections.len() >= MAX_SECTIONS {
            if !self.is_full {
                let what = format!("the file has more than {MAX_SECTIONS} sections");
                let advice = "those from here on are not used; is it an EDS?";
                self.findings.add(Rule::TooLarge, at, what, advice);
            }
            self.is_full = true;
            self.current = Current::Dropped;
            return;
        }
        self.seen.insert(name.to_ascii_lowercase(), at);
        self.current = Current::Section(self.raw.sections.len());
        self.raw.sections.push(RawSection {
            name,
            at,
            comments,
            inner: Vec::new(),
            keys: Vec::new(),
        });
    }

    fn key(&mut self, number: u32, line: &'t str, content: &'t str, at: Place) {
        let Some((key, value)) = content.split_once('=') else {
            let what = format!("{} is no section, key or comment", quoted(content));
            let advice = "the line is not used; write KEY=VALUE";
            self.findings.add(Rule::NoKey, at, what, advice);
            return;
        };
        let (key, trimmed) = (key.trim(), value.trim());
        if key.is_empty() {
            let what = format!("{} has no key", quoted(content));
            let advice = "the line is not used; write KEY=VALUE";
            self.findings.add(Rule::NoKey, at, what, advice);
            return;
        }
        let section = match self.current {
            Current::Section(at) => self.raw.sections.get_mut(at),
            Current::Dropped => {
                self.pending.clear();
                return;
            }
            Current::Nowhere => None,
        };
        let Some(section) = section else {
            let what = format!(
                "the key {} stands in front of the first section",
                quoted(key)
            );
            let advice = "it is not used; put it into a section";
            self.findings.add(Rule::OutsideSection, at, what, advice);
            return;
        };
        section.inner.append(&mut self.pending);
        if let Some(first) = self.keys.get(&key.to_ascii_lowercase()) {
            let first = section.keys.get(*first);
            let same = first.is_some_and(|first| first.value == trimmed);
            let line = first.map_or(0, |first| first.at.line);
            let what = format!("the key {} is in line {line} already", quoted(key));
            let (rule, advice) = match same {
                true => (Rule::RepeatedKey, "the values are equal; remove one"),
                false => (Rule::DuplicateKey, "the first value is used; remove one"),
            };
            self.findings.add(rule, at, what, advice);
            return;
        }
        self.keys
            .insert(key.to_ascii_lowercase(), section.keys.len());
        section.keys.push(RawKey {
            key,
            at,
            value: trimmed,
            value_at: place(
                number,
                line,
                if trimmed.is_empty() { value } else { trimmed },
            ),
        });
    }
}
