//! A value in a file: its text, and what the text means for its data type.

use canopen::NodeId;

use crate::finding::Rule;
use crate::number::Number;
use crate::types::{DataType, Kind};

/// What a value's text means.
#[derive(Clone, Debug, PartialEq)]
pub enum Constant {
    /// Of a number type.
    Integer(i128),
    /// Of a number type: this plus the node ID.
    PlusNodeId(i128),
    /// Of a real type; finite.
    Real(f64),
    /// Of a string type.
    Text(String),
    /// Of an OCTET_STRING or DOMAIN.
    Bytes(Vec<u8>),
}

/// A default, a limit or a parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    text: String,
    constant: Option<Constant>,
}

impl Value {
    /// What `text` means for `data_type`; without one, a number if it is one, otherwise a text.
    pub fn new(text: &str, data_type: Option<DataType>) -> Value {
        Value::read(text, data_type).0
    }

    /// As [`Value::new`], and what is odd about it.
    pub(crate) fn read(text: &str, data_type: Option<DataType>) -> (Value, Vec<Rule>) {
        let text = text.trim();
        let kind = data_type.map_or(Kind::Other, DataType::kind);
        let (kept, constant, oddities) = match kind {
            Kind::Text => (text, Some(Constant::Text(text.to_owned())), Vec::new()),
            Kind::Bytes => match bytes(text) {
                Some(bytes) => (text, Some(Constant::Bytes(bytes)), Vec::new()),
                None => (text, None, vec![Rule::BadValue]),
            },
            Kind::Real32 | Kind::Real64 => real(text, kind),
            Kind::Boolean | Kind::Signed(_) | Kind::Unsigned(_) => integer(text, kind),
            Kind::Other => match Number::read(text) {
                Some(number) => (text, Some(constant(&number, number.base)), number.oddities),
                None => (text, Some(Constant::Text(text.to_owned())), Vec::new()),
            },
        };
        let value = Value {
            text: kept.to_owned(),
            constant,
        };
        (value, oddities)
    }

    /// The value that a device gave as `bytes` in an SDO, written like `like`: in hexadecimal where
    /// that is. `None` if they are no value of `data_type`, or a text that a file cannot hold: not
    /// UTF-8, with control characters, or with spaces around it.
    pub fn from_bytes(data_type: DataType, bytes: &[u8], like: Option<&Value>) -> Option<Value> {
        let kind = data_type.kind();
        let mut wide = [0; 8];
        if let Some(size) = kind.size() {
            wide.get_mut(..size)?.copy_from_slice(bytes.get(..size)?);
        }
        let raw = u64::from_le_bytes(wide);
        let text = match kind {
            Kind::Boolean => u8::from(raw != 0).to_string(),
            Kind::Signed(bits) => (((raw << (64 - bits)) as i64) >> (64 - bits)).to_string(),
            Kind::Unsigned(bits) => match like.is_some_and(Value::is_hexadecimal) {
                true => format!("0x{raw:0width$X}", width = usize::from(bits) / 4),
                false => raw.to_string(),
            },
            Kind::Real32 => finite(f32::from_bits(raw as u32).into())?.to_string(),
            Kind::Real64 => finite(f64::from_bits(raw))?.to_string(),
            Kind::Text => {
                let end = bytes
                    .iter()
                    .rposition(|&byte| byte != 0)
                    .map_or(0, |at| at + 1);
                let text = std::str::from_utf8(bytes.get(..end)?).ok()?;
                let is_kept = text == text.trim() && !text.contains(char::is_control);
                is_kept.then(|| text.to_owned())?
            }
            Kind::Bytes => hexadecimal(bytes),
            Kind::Other => return None,
        };
        Some(Value::new(&text, Some(data_type)))
    }

    /// The text in the file, without spaces around it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What it means; `None` if it is no value of the object's data type.
    pub fn constant(&self) -> Option<&Constant> {
        self.constant.as_ref()
    }

    /// Its meaning for a node: the node ID is added where the text says so.
    pub fn for_node(&self, node: NodeId) -> Option<Constant> {
        match self.constant.as_ref()? {
            Constant::PlusNodeId(base) => Some(Constant::Integer(base + i128::from(node.get()))),
            constant => Some(constant.clone()),
        }
    }

    /// The number for a node, if it is one.
    pub fn number(&self, node: NodeId) -> Option<i128> {
        match self.for_node(node)? {
            Constant::Integer(number) => Some(number),
            _ => None,
        }
    }

    /// The bytes that an SDO carries; `None` if the value does not fit `data_type`.
    pub fn bytes(&self, data_type: DataType, node: NodeId) -> Option<Vec<u8>> {
        let kind = data_type.kind();
        match (self.for_node(node)?, kind) {
            (Constant::Integer(number), kind) => {
                let (low, high) = kind.bounds()?;
                let fits = (low..=high).contains(&number);
                let all = number.to_le_bytes();
                all.get(..kind.size()?).filter(|_| fits).map(<[u8]>::to_vec)
            }
            (Constant::Real(real), Kind::Real32) => Some((real as f32).to_le_bytes().to_vec()),
            (Constant::Real(real), Kind::Real64) => Some(real.to_le_bytes().to_vec()),
            (Constant::Text(text), Kind::Text) => Some(text.into_bytes()),
            (Constant::Bytes(bytes), Kind::Bytes) => Some(bytes),
            _ => None,
        }
    }

    fn is_hexadecimal(&self) -> bool {
        self.text.contains("0x") || self.text.contains("0X")
    }

    /// The number without the node ID, for comparisons.
    pub(crate) fn base(&self) -> Option<i128> {
        match self.constant {
            Some(Constant::Integer(base) | Constant::PlusNodeId(base)) => Some(base),
            _ => None,
        }
    }

    /// As a real number, for comparisons.
    pub(crate) fn real(&self) -> Option<f64> {
        match self.constant {
            Some(Constant::Real(real)) => Some(real),
            _ => None,
        }
    }
}

/// Bytes as EDS files write them: `01 02 AB`.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    let pairs: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    pairs.join(" ")
}

fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u32> = text
        .chars()
        .filter(|c| !c.is_whitespace())
        .map(|c| c.to_digit(16))
        .collect::<Option<_>>()?;
    if !digits.len().is_multiple_of(2) {
        return None;
    }
    let byte = |pair: &[u32]| pair.iter().fold(0, |byte, digit| byte << 4 | digit) as u8;
    Some(digits.chunks(2).map(byte).collect())
}

fn finite(real: f64) -> Option<f64> {
    real.is_finite().then_some(real)
}

fn constant(number: &Number, base: i128) -> Constant {
    match number.plus_node_id {
        true => Constant::PlusNodeId(base),
        false => Constant::Integer(base),
    }
}

fn integer(text: &str, kind: Kind) -> (&str, Option<Constant>, Vec<Rule>) {
    let Some((number, kept)) = Number::read_commented(text) else {
        let word = match kind {
            Kind::Boolean if text.eq_ignore_ascii_case("true") => Some(1),
            Kind::Boolean if text.eq_ignore_ascii_case("false") => Some(0),
            _ => None,
        };
        return match word {
            Some(value) => (
                text,
                Some(Constant::Integer(value)),
                vec![Rule::BooleanWord],
            ),
            None => (text, None, vec![Rule::BadValue]),
        };
    };
    let mut base = number.base;
    // Hexadecimal numbers of a signed type are its bits.
    if let (Kind::Signed(bits), true) = (kind, number.is_hexadecimal)
        && base >= 1 << (bits - 1)
        && base < 1 << bits
    {
        base -= 1 << bits;
    }
    let constant = constant(&number, base);
    let mut oddities = number.oddities;
    if let Some((low, high)) = kind.bounds()
        && !(low..=high).contains(&base)
    {
        oddities.push(Rule::OutOfRange);
    }
    (kept, Some(constant), oddities)
}

fn real(text: &str, kind: Kind) -> (&str, Option<Constant>, Vec<Rule>) {
    let mut oddities = Vec::new();
    let kept = match text.split_once(';') {
        Some((before, _)) => {
            oddities.push(Rule::InlineComment);
            before.trim()
        }
        None => text,
    };
    let bits = kept.strip_prefix("0x").or_else(|| kept.strip_prefix("0X"));
    let real = match bits {
        Some(digits) => {
            oddities.push(Rule::RealBits);
            match kind {
                Kind::Real32 => u32::from_str_radix(digits, 16)
                    .ok()
                    .map(|bits| f32::from_bits(bits).into()),
                _ => u64::from_str_radix(digits, 16).ok().map(f64::from_bits),
            }
        }
        None => kept.parse().ok(),
    };
    match real.and_then(finite) {
        Some(real) => (kept, Some(Constant::Real(real)), oddities),
        None => (text, None, vec![Rule::BadValue]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: NodeId = match NodeId::new(1) {
        Some(node) => node,
        None => panic!(),
    };

    #[test]
    fn by_type() {
        let number = |text, data_type| Value::new(text, Some(data_type)).number(ONE);
        assert_eq!(number("0x80000000", DataType::INTEGER32), Some(-(1 << 31)));
        assert_eq!(number("-2147483648", DataType::INTEGER32), Some(-(1 << 31)));
        assert_eq!(number("0x80000000", DataType::UNSIGNED32), Some(1 << 31));
        assert_eq!(number("$NODEID+0x180", DataType::UNSIGNED32), Some(0x181));
        assert_eq!(number("fast", DataType::UNSIGNED32), None);
        assert_eq!(number("true", DataType::BOOLEAN), Some(1));
        let value = Value::new("1.5", Some(DataType::REAL32));
        assert_eq!(value.constant(), Some(&Constant::Real(1.5)));
        let value = Value::new("0x3FC00000", Some(DataType::REAL32));
        assert_eq!(value.constant(), Some(&Constant::Real(1.5)));
        assert_eq!(Value::new("nan", Some(DataType::REAL32)).constant(), None);
        let value = Value::new("01 aB", Some(DataType::OCTET_STRING));
        assert_eq!(value.constant(), Some(&Constant::Bytes(vec![1, 0xAB])));
        assert_eq!(
            Value::new("1", Some(DataType::OCTET_STRING)).constant(),
            None
        );
        let value = Value::new("P3 ; x", Some(DataType::VISIBLE_STRING));
        assert_eq!(value.constant(), Some(&Constant::Text("P3 ; x".into())));
    }

    #[test]
    fn bytes_and_back() {
        let table: &[(DataType, &[u8], &str)] = &[
            (DataType::INTEGER8, &[0xFF], "-1"),
            (
                DataType::INTEGER64,
                &[0, 0, 0, 0, 0, 0, 0, 0x80],
                "-9223372036854775808",
            ),
            (DataType::UNSIGNED16, &[0x34, 0x12], "4660"),
            (DataType::UNSIGNED64, &[0xFF; 8], "18446744073709551615"),
            (DataType::REAL32, &[0, 0, 0xC0, 0x3F], "1.5"),
            (DataType::VISIBLE_STRING, b"P3", "P3"),
            (DataType::OCTET_STRING, &[1, 0xAB], "01 AB"),
            (DataType(0x10), &[0xFE, 0xFF, 0xFF], "-2"),
        ];
        for (data_type, bytes, text) in table {
            let value = Value::from_bytes(*data_type, bytes, None).unwrap();
            assert_eq!(value.text(), *text);
            assert_eq!(
                value.bytes(*data_type, ONE).as_deref(),
                Some(*bytes),
                "{text}"
            );
        }
        let like = Value::new("$NODEID+0x180", Some(DataType::UNSIGNED32));
        let value = Value::from_bytes(DataType::UNSIGNED32, &[0x81, 1, 0, 0], Some(&like));
        assert_eq!(value.unwrap().text(), "0x00000181");
        assert_eq!(Value::from_bytes(DataType::UNSIGNED32, &[1, 2], None), None);
    }

    /// What a file would give back as other bytes is no value.
    #[test]
    fn texts_that_no_file_can_hold() {
        let text = |bytes| Value::from_bytes(DataType::VISIBLE_STRING, bytes, None);
        let strange: [&[u8]; 9] = [
            b" P3",
            b"P3 ",
            b"  ",
            b"P\r\n3",
            b"P3\t",
            b"P\x003",
            b"P3\x7F",
            b"Pr\xE4zision",
            "\u{A0}P3".as_bytes(),
        ];
        for bytes in strange {
            assert_eq!(text(bytes), None, "{bytes:02X?}");
        }
        // Those that can are kept, without the zeros that fill the object up.
        let kept: [(&[u8], &str); 4] = [
            (b"", ""),
            (b"P3\0\0", "P3"),
            (b"P3  ; \"x\"=1", "P3  ; \"x\"=1"),
            ("Pr\u{E4}zision".as_bytes(), "Pr\u{E4}zision"),
        ];
        for (bytes, expected) in kept {
            let value = text(bytes).unwrap();
            assert_eq!(value.text(), expected);
            let again = Value::new(value.text(), Some(DataType::VISIBLE_STRING));
            let written = again.bytes(DataType::VISIBLE_STRING, ONE);
            assert_eq!(written.as_deref(), Some(expected.as_bytes()));
        }
    }
}
