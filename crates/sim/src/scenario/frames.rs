//! Frames that a scenario speaks of: identifier, mask, data, and who sent them.

use can::Frame;

use super::problem::Findings;
use super::section::{Read, Section, Value, text};
use crate::medium::Sender;
use crate::place::Place;
use crate::wire_act::{Participant, WhichFrames};

/// How data are written.
const DATA_FORM: &str =
    "write pairs of hexadecimal digits, with ?? for any byte, as in \"27 ?? 00\"";
const FROM_FORM: &str = "write a drive, as in 1 or \"u1\", or \"outside\"";

/// Which frames are meant; what it does not say may be anything.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct FramePattern {
    /// Identifier, and whether it has 29 bits.
    pub(super) id: Option<(u32, bool)>,
    /// Bits of the identifier that count.
    mask: u32,
    /// The first bytes; `None` is any.
    data: Vec<Option<u8>>,
    from: Option<Read<Participant>>,
}

impl FramePattern {
    /// Reads the inline table; `has_data` says whether it may speak of data.
    pub(super) fn read(
        value: Value<'_>,
        has_data: bool,
        findings: &mut Findings<'_>,
    ) -> Option<FramePattern> {
        let form = "write { id = 0x181 }, with mask or from if needed";
        let mut section = Section::of(value, "a frame", form, findings)?;
        let id = section.whole("id", 0..=0x1FFF_FFFF, findings);
        let extended = section.flag("extended", findings);
        let mask = section.whole("mask", 0..=0x1FFF_FFFF, findings);
        let data = match has_data {
            true => section.text("data", DATA_FORM, findings),
            false => None,
        };
        let from = section.take("from");
        let from = from.and_then(|value| participant(value, findings));
        if let (Some(mask), None) = (&mask, &id) {
            findings.push(
                &mask.span,
                "a mask needs an identifier",
                "add id, as in id = 0x180",
            );
        }
        let wide = id.as_ref().is_some_and(|id| id.value > 0x7FF);
        if let Some(extended) = &extended
            && !extended.value
            && wide
        {
            let what = "this identifier has 29 bits, and extended says that it has 11";
            findings.push(
                &extended.span,
                what,
                "leave extended out, or write an id up to 0x7FF",
            );
        }
        let data = match data {
            Some(data) => match pattern(data.value) {
                Some(bytes) => bytes,
                None => {
                    findings.push(
                        &data.span,
                        format!("'{}' is no data", data.value),
                        DATA_FORM,
                    );
                    return None;
                }
            },
            None => Vec::new(),
        };
        section.finish(&["data"], findings);
        let is_extended = wide || extended.is_some_and(|extended| extended.value);
        Some(FramePattern {
            id: id.map(|id| (id.value as u32, is_extended)),
            mask: mask.map_or(u32::MAX, |mask| mask.value as u32),
            data,
            from,
        })
    }

    /// The drive that it names, and where.
    pub(super) fn drive(&self) -> Option<Read<Place>> {
        let from = self.from.as_ref()?;
        match from.value {
            Participant::Drive(place) => Some(Read {
                value: place,
                span: from.span.clone(),
            }),
            Participant::Outside | Participant::Stranger => None,
        }
    }

    /// The same for the wire, which does not look at data.
    pub(super) fn which(&self) -> WhichFrames {
        const EXTENDED: u32 = 1 << 31;
        let (key, mask) = match self.id {
            // The layout of `Frame::key`: bit 31 tells the format.
            Some((id, true)) => (id | EXTENDED, self.mask & 0x1FFF_FFFF | EXTENDED),
            Some((id, false)) => (id, self.mask & 0x1FFF_FFFF | EXTENDED),
            None => (0, 0),
        };
        WhichFrames {
            key,
            mask,
            sender: self.from.as_ref().map(|from| from.value),
            ..WhichFrames::NEXT
        }
    }

    /// Whether a frame is meant, sent by all of `senders`.
    pub(crate) fn matches(&self, frame: &Frame, senders: &[Sender]) -> bool {
        let id = self.id.is_none_or(|(id, extended)| {
            extended == frame.is_extended() && (frame.raw_id() ^ id) & self.mask == 0
        });
        let bytes = frame.data();
        let data = self.data.len() <= bytes.len()
            && self
                .data
                .iter()
                .zip(bytes)
                .all(|(wanted, byte)| wanted.is_none_or(|wanted| wanted == *byte));
        let from = self.from.as_ref().is_none_or(|from| {
            senders.iter().any(|sender| match (from.value, sender) {
                (Participant::Drive(place), Sender::Drive(drive)) => place == *drive,
                (Participant::Outside, Sender::Outside(_)) => true,
                _ => false,
            })
        });
        id && data && from
    }
}

/// A drive, or `outside`.
pub(super) fn participant(
    value: Value<'_>,
    findings: &mut Findings<'_>,
) -> Option<Read<Participant>> {
    if let toml::de::DeValue::String(word) = value.get_ref()
        && word == "outside"
    {
        return Some(Read {
            value: Participant::Outside,
            span: value.span(),
        });
    }
    let place = place(value, FROM_FORM, findings)?;
    Some(place.map(Participant::Drive))
}

/// A drive: a number, or a text as in "u1".
pub(super) fn place(
    value: Value<'_>,
    form: &str,
    findings: &mut Findings<'_>,
) -> Option<Read<Place>> {
    let span = value.span();
    let word = match value.get_ref() {
        toml::de::DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
        _ => text(value, "drive", form, findings)?.value,
    };
    match word.parse() {
        Ok(value) => Some(Read { value, span }),
        Err(error) => {
            let error: crate::place::NoPlace = error;
            findings.push(&span, format!("'{word}' is no drive: {error}"), form);
            None
        }
    }
}

/// Data with wild bytes.
fn pattern(text: &str) -> Option<Vec<Option<u8>>> {
    let digits: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    if !digits.len().is_multiple_of(2) || digits.len() > 16 {
        return None;
    }
    let byte = |pair: &[char]| match pair {
        ['?', '?'] => Some(None),
        [high, low] => {
            let byte = high.to_digit(16)? << 4 | low.to_digit(16)?;
            Some(Some(byte as u8))
        }
        _ => None,
    };
    digits.chunks(2).map(byte).collect()
}

/// Data bytes without wild ones, up to eight.
pub(super) fn data_bytes(
    key: &'static str,
    section: &mut Section<'_>,
    findings: &mut Findings<'_>,
) -> Option<Vec<u8>> {
    let form = "write pairs of hexadecimal digits, as in \"01 FF\"";
    let data = section.text(key, form, findings)?;
    let bytes = pattern(data.value).and_then(|bytes| bytes.into_iter().collect());
    if bytes.is_none() {
        findings.push(&data.span, format!("'{}' is no data", data.value), form);
    }
    bytes
}
