//! Numbers as CiA 306 writes them: decimal, hexadecimal after `0x`, octal after `0`, and sums with
//! `$NODEID`.

use crate::finding::Rule;

/// A number, perhaps plus the node ID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Number {
    pub(crate) base: i128,
    pub(crate) plus_node_id: bool,
    /// Some term was hexadecimal, so the sign of signed types is a bit.
    pub(crate) is_hexadecimal: bool,
    /// What was strange about its form.
    pub(crate) oddities: Vec<Rule>,
}

const NODE_ID: &str = "$NODEID";

/// Terms of a sum that are read.
const MAX_TERMS: usize = 8;

impl Number {
    /// Reads a number or a sum; `None` if it is neither.
    pub(crate) fn read(text: &str) -> Option<Number> {
        let mut number = Number {
            base: 0,
            plus_node_id: false,
            is_hexadecimal: false,
            oddities: Vec::new(),
        };
        if text.split('+').count() > MAX_TERMS {
            return None;
        }
        let mut has_number = false;
        for term in text.split('+').map(str::trim) {
            if term.eq_ignore_ascii_case(NODE_ID) {
                if number.plus_node_id {
                    return None;
                }
                number.plus_node_id = true;
            } else {
                number.base += number.literal(term)?;
                has_number = true;
            }
        }
        if number.plus_node_id && !is_usual_form(text, has_number) {
            number.oddities.push(Rule::NodeIdForm);
        }
        Some(number)
    }

    /// Reads a number behind which a comment may stand.
    pub(crate) fn read_commented(text: &str) -> Option<(Number, &str)> {
        if let Some(number) = Number::read(text) {
            return Some((number, text));
        }
        let (before, _) = text.split_once(';')?;
        let before = before.trim();
        let mut number = Number::read(before)?;
        number.oddities.push(Rule::InlineComment);
        Some((number, before))
    }

    /// Reads one term, and notes what is odd about it.
    fn literal(&mut self, text: &str) -> Option<i128> {
        let (negative, digits) = match text.strip_prefix('-') {
            Some(digits) => (true, digits),
            None => (false, text),
        };
        let hexadecimal = digits
            .strip_prefix("0x")
            .or_else(|| digits.strip_prefix("0X"));
        let (digits, radix) = match hexadecimal {
            Some(digits) => (digits, 16),
            None => (digits, 10),
        };
        if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return None;
        }
        self.is_hexadecimal |= radix == 16;
        let zero_led = radix == 10 && digits.starts_with('0');
        let significant = digits.trim_start_matches('0');
        let radix = match zero_led && significant.len() > 1 {
            true if digits.bytes().all(|digit| digit < b'8') => {
                self.oddities.push(Rule::OctalNumber);
                8
            }
            true => {
                self.oddities.push(Rule::LeadingZero);
                10
            }
            false => radix,
        };
        let magnitude = match significant {
            "" => 0,
            digits => u64::from_str_radix(digits, radix).ok()?,
        };
        let magnitude = i128::from(magnitude);
        Some(if negative { -magnitude } else { magnitude })
    }
}

/// `$NODEID+0x180` as the standard writes it, or `$NODEID` alone.
fn is_usual_form(text: &str, has_number: bool) -> bool {
    match text.strip_prefix(NODE_ID) {
        Some("") => !has_number,
        Some(rest) => rest.starts_with('+') && !rest.contains(char::is_whitespace),
        None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<(i128, bool, Vec<Rule>)> {
        Number::read(text).map(|number| (number.base, number.plus_node_id, number.oddities))
    }

    #[test]
    fn numbers() {
        let table: &[(&str, i128, bool, &[Rule])] = &[
            ("0", 0, false, &[]),
            ("00", 0, false, &[]),
            ("07", 7, false, &[]),
            ("-128", -128, false, &[]),
            ("0x1a", 26, false, &[]),
            ("0X1A", 26, false, &[]),
            ("-0x10", -16, false, &[]),
            ("0x0010", 16, false, &[]),
            ("18446744073709551615", u64::MAX as i128, false, &[]),
            ("0100", 64, false, &[Rule::OctalNumber]),
            ("0128", 128, false, &[Rule::LeadingZero]),
            ("$NODEID", 0, true, &[]),
            ("$NODEID+0x180", 0x180, true, &[]),
            ("$NODEID+384", 0x180, true, &[]),
            ("$NODEID+0x80+0x80000000", 0x8000_0080, true, &[]),
            ("$NODEID + 0x180", 0x180, true, &[Rule::NodeIdForm]),
            ("$NodeID+0x180", 0x180, true, &[Rule::NodeIdForm]),
            ("0x180+$NODEID", 0x180, true, &[Rule::NodeIdForm]),
            (" 0x180 + $nodeid ", 0x180, true, &[Rule::NodeIdForm]),
        ];
        for (text, base, node, oddities) in table {
            assert_eq!(
                read(text),
                Some((*base, *node, oddities.to_vec())),
                "{text}"
            );
        }
    }

    #[test]
    fn no_numbers() {
        for text in [
            "",
            "x",
            "0x",
            "12a",
            "1 2",
            "+",
            "5+",
            "+5",
            "$NODEID+$NODEID",
            "--1",
            "-",
            "0x-1",
            "$NODEID-1",
            "0x10000000000000000",
            "1.5",
            "1+1+1+1+1+1+1+1+1",
            "ff",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
        assert!(Number::read_commented("5 ; five").is_some_and(|(_, text)| text == "5"));
        assert!(Number::read_commented("; five").is_none());
    }
}
