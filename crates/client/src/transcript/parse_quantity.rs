//! Durations, nodes, numbers and assertions in directives.

use canopen::NodeId;

use super::source::{Cursor, SyntaxError, Word};
use super::step::{Assertion, Comparison, Span};

/// Reads with `read`, and nothing may follow.
pub(super) fn finished<T>(
    cursor: &mut Cursor<'_>,
    read: impl Fn(&mut Cursor<'_>) -> Result<T, SyntaxError>,
) -> Result<T, SyntaxError> {
    let value = read(cursor)?;
    cursor.finish()?;
    Ok(value)
}

/// Nanoseconds in a unit.
const UNITS: &[(&[&str], f64)] = &[
    (&["us", "microsecond", "microseconds"], 1e3),
    (&["ms", "millisecond", "milliseconds"], 1e6),
    (&["s", "sec", "second", "seconds"], 1e9),
    (&["min", "minute", "minutes"], 60e9),
];

/// `20 ms`, `1 second`, `0.5 s`: nanoseconds, up to an hour.
pub(super) fn duration(cursor: &mut Cursor<'_>) -> Result<u64, SyntaxError> {
    cursor.skip_blanks();
    let number = cursor.until(|c: char| !(c.is_ascii_digit() || c == '.'));
    cursor.skip_blanks();
    let unit = cursor.until(|c: char| !c.is_alphabetic());
    let names = |names: &[&str]| {
        names
            .iter()
            .any(|name| unit.text.eq_ignore_ascii_case(name))
    };
    let factor = UNITS
        .iter()
        .find(|(known, _)| names(known))
        .map(|(_, factor)| *factor);
    let remedy = "write a number and us, ms, s or min, as in 20 ms; at most an hour";
    let Ok(value) = number.text.parse::<f64>() else {
        return Err(cursor.error(number.at, "no duration", remedy));
    };
    let Some(factor) = factor else {
        return Err(cursor.error(unit.at, "no unit of time", remedy));
    };
    let ns = value * factor;
    if ns > 3600e9 {
        return Err(cursor.error(number.at, "a duration of more than an hour", remedy));
    }
    Ok(ns.round() as u64)
}

/// `90 ms and 110 ms`
pub(super) fn between(cursor: &mut Cursor<'_>) -> Result<Span, SyntaxError> {
    let from_ns = duration(cursor)?;
    let word = cursor.word();
    if !word.text.eq_ignore_ascii_case("and") {
        let remedy = "write \"between 90 ms and 110 ms\"";
        return Err(cursor.error(word.at, "no second duration", remedy));
    }
    let to_ns = duration(cursor)?;
    if to_ns < from_ns {
        return Err(cursor.error(word.at, "the end lies before the begin", "swap the two"));
    }
    Ok(Span { from_ns, to_ns })
}

pub(super) fn node(cursor: &Cursor<'_>, word: Word<'_>) -> Result<NodeId, SyntaxError> {
    word.text.parse().ok().and_then(NodeId::new).ok_or_else(|| {
        let message = format!("\"{}\" is not a node ID", word.text);
        cursor.error(word.at, message, "write a number from 1 to 127")
    })
}

/// `node 1 position > 100 counts`
pub(super) fn assertion(cursor: &mut Cursor<'_>) -> Result<Assertion, SyntaxError> {
    let word = cursor.word();
    let form = "write \"assert node 1 position > 100 counts\"";
    if !word.text.eq_ignore_ascii_case("node") {
        return Err(cursor.error(word.at, "no node", form));
    }
    let word = cursor.word();
    let node = node(cursor, word)?;
    let quantity = cursor.word();
    if !quantity.text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err(cursor.error(quantity.at, "no quantity", form));
    }
    let sign = cursor.word();
    let compare: fn(f64) -> Comparison = match sign.text {
        ">" => Comparison::Above,
        ">=" => Comparison::AtLeast,
        "<" => Comparison::Below,
        "<=" => Comparison::AtMost,
        "=" => |value| Comparison::Near {
            value,
            tolerance: 0.0,
        },
        _ => {
            let message = format!("\"{}\" is not a comparison", sign.text);
            return Err(cursor.error(sign.at, message, "write >, >=, <, <= or = with +-"));
        }
    };
    let mut comparison = compare(number(cursor)?);
    if let Comparison::Near { tolerance, .. } = &mut comparison {
        let word = cursor.word();
        if word.text != "+-" {
            return Err(cursor.error(
                word.at,
                "no tolerance",
                "a measured value is never exact: write \"= 48 +- 0.1 V\"",
            ));
        }
        *tolerance = number(cursor)?;
    }
    Ok(Assertion {
        node,
        quantity: quantity.text.to_ascii_lowercase(),
        comparison,
        unit: cursor.word().text.to_owned(),
    })
}

fn number(cursor: &mut Cursor<'_>) -> Result<f64, SyntaxError> {
    let word = cursor.word();
    let number = word
        .text
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite());
    number.ok_or_else(|| {
        let message = format!("\"{}\" is not a number", word.text);
        cursor.error(word.at, message, "write one like 100 or -0.5")
    })
}
