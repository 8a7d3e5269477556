//! The arguments of an act: what is said of them in its row, and what a file gives.

use toml::de::DeValue;

use super::frames::{FramePattern, data_bytes, participant};
use super::problem::{Findings, any_of};
use super::quantity::Quantity;
use super::section::{Read, Section, Value, kind, read_quantity};
use crate::place::Place;
use crate::wire_act::{BitPlace, Participant, WhichFrames, WireAct};

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
    /// Which frames, by identifier and sender.
    Frames,
    /// Data bytes.
    Bytes,
    /// A bit of a frame.
    Bit,
    /// A drive, or the outside programs.
    Participant,
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
            Kind::Frames => "{ id, mask, extended, from }".to_owned(),
            Kind::Bytes => "\"01 FF\"".to_owned(),
            Kind::Bit => "0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to eof7, \
                          intermission1 to intermission3"
                .to_owned(),
            Kind::Participant => "1, \"u1\" or \"outside\"".to_owned(),
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
    Bit(BitPlace),
    Participant(Read<Participant>),
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

    /// Which frames; with `skip` and `count`, if it says these.
    pub(super) fn which(&self, key: &str) -> WhichFrames {
        let frames = match self.get(key) {
            Some(Given::Frames(pattern)) => pattern.which(),
            _ => WhichFrames::NEXT,
        };
        let number = |key, usual| self.maybe_number(key).map_or(usual, |number| number as u32);
        WhichFrames {
            skip: number("skip", 0),
            times: number("count", 1),
            ..frames
        }
    }

    /// A bit.
    pub(super) fn bit(&self, key: &str) -> BitPlace {
        match self.get(key) {
            Some(Given::Bit(bit)) => *bit,
            _ => BitPlace::Number(0),
        }
    }

    /// Who, if it says.
    pub(super) fn participant(&self, key: &str) -> Option<Participant> {
        match self.get(key) {
            Some(Given::Participant(read)) => Some(read.value),
            _ => None,
        }
    }

    /// The drives that it names, and where.
    pub(super) fn drives(&self) -> Vec<Read<Place>> {
        let drive = |(_, given): &(&str, Given)| match given {
            Given::Frames(pattern) => pattern.drive(),
            Given::Participant(read) => match read.value {
                Participant::Drive(value) => Some(Read {
                    value,
                    span: read.span.clone(),
                }),
                _ => None,
            },
            _ => None,
        };
        self.0.iter().filter_map(drive).collect()
    }

    /// Which of several things of one kind it is about: a phase, a switch, an input.
    pub(super) fn detail(&self) -> String {
        ["phase", "switch", "input"]
            .map(|key| self.word(key))
            .concat()
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
                Given::Frames(FramePattern::read(value, false, findings)?)
            }
            Kind::Bit => {
                let value = section.take(self.key)?;
                Given::Bit(bit(value, findings)?)
            }
            Kind::Participant => {
                let value = section.take(self.key)?;
                Given::Participant(participant(value, findings)?)
            }
            Kind::Bytes => Given::Bytes(data_bytes(self.key, section, findings)?),
        })
    }
}

fn bit(value: Value<'_>, findings: &mut Findings<'_>) -> Option<BitPlace> {
    let word = match value.get_ref() {
        DeValue::Integer(number) if number.radix() == 10 => number.as_str().to_owned(),
        DeValue::String(word) => word.to_string(),
        other => kind(other).to_owned(),
    };
    let bit = word.parse::<BitPlace>();
    let bit = bit.map_err(|error| error.to_string()).and_then(|bit| {
        let act = WireAct::Flip {
            frames: WhichFrames::NEXT,
            bit,
            seen_by: None,
        };
        act.check().map_err(|error| error.to_string()).map(|()| bit)
    });
    match bit {
        Ok(bit) => Some(bit),
        Err(why) => {
            let remedy = "write a number from 0 to 159, or a name as in \"ack-slot\" or \"eof7\"";
            findings.push(&value.span(), why, remedy);
            None
        }
    }
}

fn lower(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_lowercase().chain(characters).collect(),
        None => String::new(),
    }
}
