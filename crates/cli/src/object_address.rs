//! Objects as people write them: `0x6041`, `0x3008,1`.

use canopen::{Address, DataType};

/// An index, with its sub-index if that was written, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ObjectName {
    index: u16,
    sub: Option<u8>,
}

const FORM: &str =
    "write the index in hexadecimal and the sub-index behind a comma, as in 0x3008,1";

/// Reads `0x6041` or `0x3008,1`.
///
/// # Errors
/// What is wrong and what to write.
pub(crate) fn parse(text: &str) -> Result<ObjectName, String> {
    let (index, sub) = match text.split_once(',') {
        Some((index, sub)) => (index, Some(parse_sub(sub)?)),
        None => (text, None),
    };
    let digits = hexadecimal(index).ok_or_else(|| format!("'{index}' is no index; {FORM}"))?;
    let index = u16::from_str_radix(digits, 16)
        .map_err(|_| format!("'{index}' is no index from 0x0000 to 0xFFFF; {FORM}"))?;
    Ok(ObjectName { index, sub })
}

/// The digits after `0x`.
fn hexadecimal(text: &str) -> Option<&str> {
    let digits = text
        .strip_prefix("0x")
        .or_else(|| text.strip_prefix("0X"))?;
    let valid = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    valid.then_some(digits)
}

/// Reads a sub-index, decimal or hexadecimal.
///
/// # Errors
/// What is wrong and what to write.
pub(crate) fn parse_sub(text: &str) -> Result<u8, String> {
    let number = match hexadecimal(text) {
        Some(digits) => u8::from_str_radix(digits, 16).ok(),
        None if text.starts_with('+') => None,
        None => text.parse().ok(),
    };
    number.ok_or_else(|| format!("'{text}' is no sub-index; write a number from 0 to 255"))
}

impl ObjectName {
    /// The object, its sub-index taken from `beside` if it was not written behind a comma; 0 if
    /// it was written nowhere.
    ///
    /// # Errors
    /// The sub-index was written twice.
    pub(crate) fn address(self, beside: Option<u8>) -> Result<Address, String> {
        match (self.sub, beside) {
            (Some(_), Some(_)) => Err(format!(
                "the sub-index of 0x{:04X} is there twice; write it once",
                self.index
            )),
            (sub, beside) => Ok(Address::new(self.index, sub.or(beside).unwrap_or(0))),
        }
    }

    /// Whether the sub-index was written behind a comma.
    pub(crate) fn has_sub(self) -> bool {
        self.sub.is_some()
    }
}

const TYPES: [(&str, DataType); 9] = [
    ("bool", DataType::Bool),
    ("i8", DataType::I8),
    ("i16", DataType::I16),
    ("i32", DataType::I32),
    ("u8", DataType::U8),
    ("u16", DataType::U16),
    ("u32", DataType::U32),
    ("f32", DataType::F32),
    ("text", DataType::Text),
];

/// Reads a type: `u16`, or the standard's `UNSIGNED16`.
///
/// # Errors
/// The types there are.
pub(crate) fn parse_type(text: &str) -> Result<DataType, String> {
    let found = TYPES.iter().find(|(short, data_type)| {
        text.eq_ignore_ascii_case(short) || text.eq_ignore_ascii_case(data_type.name())
    });
    found.map(|(_, data_type)| *data_type).ok_or_else(|| {
        let names: Vec<&str> = TYPES.iter().map(|(short, _)| *short).collect();
        format!("there is no such type; there are: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_with_and_without_sub_index() {
        let read = |text, beside| parse(text).and_then(|name| name.address(beside));
        assert_eq!(read("0x6041", None), Ok(Address::new(0x6041, 0)));
        assert_eq!(read("0x3008,1", None), Ok(Address::new(0x3008, 1)));
        assert_eq!(read("0x3008,0x10", None), Ok(Address::new(0x3008, 16)));
        assert_eq!(read("0x3008", Some(2)), Ok(Address::new(0x3008, 2)));
        assert!(read("0x3008,1", Some(2)).unwrap_err().contains("twice"));
        // 6041 without 0x could be meant either way.
        for wrong in [
            "6041",
            "0x",
            "0x12345",
            "0x+12",
            "",
            "0x3008,",
            "0x3008,256",
            "0x3008,+1",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn types_by_both_names() {
        assert_eq!(parse_type("u16"), Ok(DataType::U16));
        assert_eq!(parse_type("unsigned16"), Ok(DataType::U16));
        assert!(parse_type("word").unwrap_err().contains("u16"));
    }
}
