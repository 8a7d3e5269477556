//! A table of a scenario being read: its known keys, and complaints about the others.

use std::ops::RangeInclusive;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problem::{Findings, Span, any_of, nearest};
use super::quantity::{Quantity, Wrong};

/// A value and its place.
pub(super) type Value<'t> = &'t Spanned<DeValue<'t>>;

/// A value read, and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Read<T> {
    pub(super) value: T,
    pub(super) span: Span,
}

impl<T> Read<T> {
    /// The same place with another value.
    pub(super) fn map<U>(self, change: impl FnOnce(T) -> U) -> Read<U> {
        Read {
            value: change(self.value),
            span: self.span,
        }
    }
}

/// A table, and which of its keys have been asked for.
#[derive(Debug)]
pub(super) struct Section<'t> {
    table: &'t DeTable<'t>,
    /// Its header, or the whole of an inline table.
    pub(super) span: Span,
    /// What it is, for messages: `an event`.
    what: &'static str,
    known: Vec<&'static str>,
}

impl<'t> Section<'t> {
    pub(super) fn new(table: &'t DeTable<'t>, span: Span, what: &'static str) -> Section<'t> {
        Section {
            table,
            span,
            what,
            known: Vec::new(),
        }
    }

    /// The table that `value` must be.
    pub(super) fn of(
        value: Value<'t>,
        what: &'static str,
        form: &str,
        findings: &mut Findings<'_>,
    ) -> Option<Section<'t>> {
        match value.get_ref() {
            DeValue::Table(table) => Some(Section::new(table, value.span(), what)),
            other => {
                let found = kind(other);
                findings.push(&value.span(), format!("{what} cannot be {found}"), form);
                None
            }
        }
    }

    /// The keys in the order of the text.
    pub(super) fn entries(&self) -> Vec<(&'t str, Span, Value<'t>)> {
        let mut entries: Vec<_> = self
            .table
            .iter()
            .map(|(key, value)| (key.get_ref().as_ref(), key.span(), value))
            .collect();
        entries.sort_by_key(|(_, span, _)| span.start);
        entries
    }

    /// The value of a key, which is known from now on.
    pub(super) fn take(&mut self, key: &'static str) -> Option<Value<'t>> {
        self.known.push(key);
        self.table.get(key)
    }

    /// Where the key is.
    pub(super) fn key_span(&self, wanted: &str) -> Option<Span> {
        let keys = self.table.keys();
        let key = keys.rev().find(|key| key.get_ref() == wanted);
        key.map(Spanned::span)
    }

    /// Whether a key is there; it is not known because of that.
    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Complains of every key that nobody has asked for. `elsewhere` are keys that exist, but not
    /// with what else is there.
    pub(super) fn finish(self, elsewhere: &[&str], findings: &mut Findings<'_>) {
        for (key, span, _) in self.entries() {
            if self.known.contains(&key) {
                continue;
            }
            let known = self.known.iter().copied();
            let (what, remedy) = if elsewhere.contains(&key) {
                (
                    format!("'{key}' has no meaning here"),
                    format!("{} of this kind takes {}", self.what, any_of(known)),
                )
            } else {
                let remedy = match nearest(key, known.clone()) {
                    Some(word) => format!("did you mean '{word}'?"),
                    None => format!("{} takes {}", self.what, any_of(known)),
                };
                (format!("{} has no '{key}'", self.what), remedy)
            };
            findings.push(&span, what, remedy);
        }
    }

    /// The text of a key.
    pub(super) fn text(
        &mut self,
        key: &'static str,
        form: &str,
        findings: &mut Findings<'_>,
    ) -> Option<Read<&'t str>> {
        let value = self.take(key)?;
        text(value, key, form, findings)
    }

    /// A quantity within limits, in its first unit.
    pub(super) fn quantity(
        &mut self,
        key: &'static str,
        quantity: Quantity,
        range: RangeInclusive<f64>,
        findings: &mut Findings<'_>,
    ) -> Option<Read<f64>> {
        let value = self.take(key)?;
        read_quantity(value, quantity, range, findings)
    }

    /// A time in nanoseconds, from `least_ns` to an hour times a thousand.
    pub(super) fn time_ns(
        &mut self,
        key: &'static str,
        least_ns: u64,
        findings: &mut Findings<'_>,
    ) -> Option<Read<u64>> {
        let least = least_ns as f64 * 1e-9;
        let read = self.quantity(key, Quantity::Time, least..=3.6e6, findings)?;
        // To the nanosecond nearest to what was written.
        Some(read.map(|seconds| (seconds * 1e9).round() as u64))
    }

    /// A whole number within limits.
    pub(super) fn whole(
        &mut self,
        key: &'static str,
        range: RangeInclusive<u64>,
        findings: &mut Findings<'_>,
    ) -> Option<Read<u64>> {
        let value = self.take(key)?;
        read_whole(value, range, findings)
    }

    /// One of several words.
    pub(super) fn word<T: Copy>(
        &mut self,
        key: &'static str,
        words: &[(&str, T)],
        findings: &mut Findings<'_>,
    ) -> Option<Read<T>> {
        let form = format!("write {}", any_of(words.iter().map(|(word, _)| *word)));
        let value = self.take(key)?;
        let read = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => Read {
                value: number.as_str(),
                span: value.span(),
            },
            _ => text(value, key, &form, findings)?,
        };
        let found = words.iter().find(|(word, _)| *word == read.value);
        let Some((_, value)) = found else {
            let remedy = match nearest(read.value, words.iter().map(|(word, _)| *word)) {
                Some(word) => format!("did you mean '{word}'?"),
                None => form,
            };
            findings.push(
                &read.span,
                format!("'{}' is nothing that '{key}' can be", read.value),
                remedy,
            );
            return None;
        };
        Some(Read {
            value: *value,
            span: read.span,
        })
    }

    /// `true` or `false`.
    pub(super) fn flag(
        &mut self,
        key: &'static str,
        findings: &mut Findings<'_>,
    ) -> Option<Read<bool>> {
        let value = self.take(key)?;
        let read = read_quantity(value, Quantity::Flag, 0.0..=1.0, findings)?;
        Some(read.map(|value| value != 0.0))
    }
}

/// The text that a value must be.
pub(super) fn text<'t>(
    value: Value<'t>,
    what: &str,
    form: &str,
    findings: &mut Findings<'_>,
) -> Option<Read<&'t str>> {
    let span = value.span();
    match value.get_ref() {
        DeValue::String(text) => Some(Read { value: text, span }),
        other => {
            let what = format!("'{what}' cannot be {}", kind(other));
            findings.push(&span, what, form);
            None
        }
    }
}

/// A quantity within limits, in its first unit.
pub(super) fn read_quantity(
    value: Value<'_>,
    quantity: Quantity,
    range: RangeInclusive<f64>,
    findings: &mut Findings<'_>,
) -> Option<Read<f64>> {
    let span = value.span();
    let number = match (value.get_ref(), quantity) {
        (DeValue::Boolean(flag), Quantity::Flag) => f64::from(u8::from(*flag)),
        (DeValue::Integer(_), Quantity::Number | Quantity::Whole) => match integer(value) {
            Some(number) => number as f64,
            None => {
                findings.push(&span, "this number is too large", quantity.form());
                return None;
            }
        },
        (DeValue::Float(number), Quantity::Number) => {
            number.as_str().replace('_', "").parse().unwrap_or(f64::NAN)
        }
        (DeValue::String(text), _) if !quantity.units().is_empty() => match quantity.parse(text) {
            Ok(number) => number,
            Err(wrong) => {
                let what = match wrong {
                    Wrong::NoNumber => format!("'{text}' is not {}", quantity.name()),
                    Wrong::NoUnit => format!("'{text}' has no unit"),
                    Wrong::Unit(unit) => {
                        format!("'{unit}' is no unit of {}", quantity.name())
                    }
                };
                findings.push(&span, what, quantity.form());
                return None;
            }
        },
        (DeValue::Integer(_) | DeValue::Float(_), _) if !quantity.units().is_empty() => {
            findings.push(&span, "the unit is missing", quantity.form());
            return None;
        }
        (other, _) => {
            let what = format!("{} is expected, not {}", quantity.name(), kind(other));
            findings.push(&span, what, quantity.form());
            return None;
        }
    };
    if !range.contains(&number) {
        let shown = |value: f64| quantity.format(value);
        let what = format!("{} is out of range", shown(number));
        let (least, most) = (*range.start(), *range.end());
        let remedy = match (least.is_finite(), most.is_finite()) {
            (true, true) => format!("write {} to {}", shown(least), shown(most)),
            (true, false) => format!("write {} or more", shown(least)),
            (false, true) => format!("write {} or less", shown(most)),
            (false, false) => quantity.form(),
        };
        findings.push(&span, what, remedy);
        return None;
    }
    Some(Read {
        value: number,
        span,
    })
}

/// A whole number within limits.
pub(super) fn read_whole(
    value: Value<'_>,
    range: RangeInclusive<u64>,
    findings: &mut Findings<'_>,
) -> Option<Read<u64>> {
    let (least, most) = (*range.start(), *range.end());
    let remedy = match most {
        u64::MAX => format!("write a whole number, {least} or more"),
        _ => format!("write a whole number from {least} to {most}"),
    };
    let span = value.span();
    let DeValue::Integer(_) = value.get_ref() else {
        let what = format!("a whole number is expected, not {}", kind(value.get_ref()));
        findings.push(&span, what, remedy);
        return None;
    };
    let number = integer(value).and_then(|number| u64::try_from(number).ok());
    match number.filter(|number| range.contains(number)) {
        Some(value) => Some(Read { value, span }),
        None => {
            findings.push(&span, "this number is out of range", remedy);
            None
        }
    }
}

fn integer(value: Value<'_>) -> Option<i128> {
    let DeValue::Integer(number) = value.get_ref() else {
        return None;
    };
    i128::from_str_radix(&number.as_str().replace('_', ""), number.radix()).ok()
}

/// What a value is, with an article.
pub(super) fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a decimal number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}
