//! The arguments of an act: what is said of them in its row, and what a file gives.

use super::frames::{FramePattern, data_bytes};
use super::problem::{Findings, any_of};
use super::quantity::Quantity;
use super::section::{Section, read_quantity};

/// What an argument may be.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// A quantity within limits, in its first unit.
    Number {
        quantity: Quantity,
        least: f64,
        most: f64,
    },
    /// A whole number within limits.
    Whole { least: u64, most: u64 },
    /// One of these words.
    Word(&'static [&'static str]),
    /// Which frames.
    Frames,
    /// Data bytes.
    Bytes,
}

pub(super) const fn number(quantity: Quantity, least: f64, most: f64) -> Kind {
    Kind::Number {
        quantity,
        least,
        most,
    }
}

/// An argument.
#[derive(Clone, Copy, Debug)]
pub(super) struct Argument {
    key: &'static str,
    kind: Kind,
    required: bool,
    what: &'static str,
}

pub(super) const fn required(key: &'static str, kind: Kind, what: &'static str) -> Argument {
    Argument {
        key,
        kind,
        required: true,
        what,
    }
}

pub(super) const fn optional(key: &'static str, kind: Kind, what: &'static str) -> Argument {
    Argument {
        key,
        kind,
        required: false,
        what,
    }
}

impl Argument {
    pub(super) fn key(&self) -> &'static str {
        self.key
    }

    /// Name, form, what it is.
    pub(super) fn shown(&self) -> [String; 3] {
        let form = match self.kind {
            Kind::Number {
                quantity,
                least,
                most,
            } => {
                let shown = |value| quantity.format(value);
                format!("{} to {}", shown(least), shown(most))
            }
            Kind::Whole { least, most } => format!("{least} to {most}"),
            Kind::Word(words) => any_of(words.iter().copied()),
            Kind::Frames => "{ id, mask, data, from }".to_owned(),
            Kind::Bytes => "\"01 FF\"".to_owned(),
        };
        let needed = if self.required { " Needed." } else { "" };
        [self.key.to_owned(), form, format!("{}{needed}", self.what)]
    }
}

/// An argument as a file gives it.
#[derive(Clone, Debug, PartialEq)]
enum Given {
    Number(f64),
    Word(&'static str),
    Frames(FramePattern),
    Bytes(Vec<u8>),
}

/// The arguments that a file gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Arguments(Vec<(&'static str, Given)>);

impl Arguments {
    /// Reads those of `list`; `None` if something is wrong.
    pub(super) fn read(
        list: &[Argument],
        act: &str,
        section: &mut Section<'_>,
        findings: &mut Findings<'_>,
    ) -> Option<Arguments> {
        let mut arguments = Arguments::default();
        let mut whole = true;
        for argument in list {
            if !section.has(argument.key) {
                section.take(argument.key);
                if argument.required {
                    let [key, form, what] = argument.shown();
                    let what = what.trim_end_matches(" Needed.").trim_end_matches('.');
                    let remedy = format!("add {key}, {form}: {}", lower(what));
                    findings.push(&section.span, format!("{act} needs '{key}'"), remedy);
                    whole = false;
                }
                continue;
            }
            match argument.give(section, findings) {
                Some(given) => arguments.0.push((argument.key, given)),
                None => whole = false,
            }
        }
        whole.then_some(arguments)
    }

    fn get(&self, key: &str) -> Option<&Given> {
        let given = self.0.iter().find(|(name, _)| *name == key);
        given.map(|(_, given)| given)
    }

    /// A number that the file must give.
    pub(super) fn number(&self, key: &str) -> f64 {
        self.maybe_number(key).unwrap_or(f64::NAN)
    }

    /// A number that it may give.
    pub(super) fn maybe_number(&self, key: &str) -> Option<f64> {
        match self.get(key) {
            Some(Given::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// A word.
    pub(super) fn word(&self, key: &str) -> &'static str {
        match self.get(key) {
            Some(Given::Word(word)) => word,
            _ => "",
        }
    }

    /// Which frames; all if it does not say.
    pub(super) fn frames(&self, key: &str) -> FramePattern {
        match self.get(key) {
            Some(Given::Frames(pattern)) => pattern.clone(),
            _ => FramePattern::default(),
        }
    }

    /// The frames that it speaks of, if it does.
    pub(super) fn some_frames(&self) -> Option<FramePattern> {
        self.0.iter().find_map(|(_, given)| match given {
            Given::Frames(pattern) => Some(pattern.clone()),
            _ => None,
        })
    }

    /// Data bytes.
    pub(super) fn bytes(&self, key: &str) -> Vec<u8> {
        match self.get(key) {
            Some(Given::Bytes(bytes)) => bytes.clone(),
            _ => Vec::new(),
        }
    }
}

impl Argument {
    fn give(&self, section: &mut Section<'_>, findings: &mut Findings<'_>) -> Option<Given> {
        Some(match self.kind {
            Kind::Number {
                quantity,
                least,
                most,
            } => {
                let value = section.take(self.key)?;
                Given::Number(read_quantity(value, quantity, least..=most, findings)?.value)
            }
            Kind::Whole { least, most } => {
                let read = section.whole(self.key, least..=most, findings)?;
                Given::Number(read.value as f64)
            }
            Kind::Word(words) => {
                let words: Vec<(&str, &'static str)> = words.iter().map(|w| (*w, *w)).collect();
                Given::Word(section.word(self.key, &words, findings)?.value)
            }
            Kind::Frames => {
                let value = section.take(self.key)?;
                Given::Frames(FramePattern::read(value, findings)?)
            }
            Kind::Bytes => Given::Bytes(data_bytes(self.key, section, findings)?),
        })
    }
}

fn lower(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_lowercase().chain(characters).collect(),
        None => String::new(),
    }
}
