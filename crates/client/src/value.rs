//! A value of an object, between bytes and text.

use std::fmt;

use canopen::DataType;

use crate::sdo::Data;

/// A value of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of an integer or boolean object.
    Integer(i64),
    /// Of a REAL32 object.
    Real(f32),
    /// Of a VISIBLE_STRING object.
    Text(String),
}

/// Why a text or a number is no value of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ValueError {
    /// The text is no number.
    NotANumber {
        /// The text.
        text: String,
        /// What was wanted.
        data_type: DataType,
    },
    /// The number does not fit the type.
    OutOfRange {
        /// The number.
        value: i64,
        /// The type.
        data_type: DataType,
        /// Smallest and greatest value of the type.
        bounds: (i64, i64),
    },
    /// A text too long for an expedited transfer, which carries four bytes.
    TooLong {
        /// Bytes that the text has.
        bytes: usize,
    },
}

impl fmt::Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ValueError::NotANumber { text, data_type } => {
                let form = match data_type {
                    DataType::F32 => "write it like 1.5",
                    DataType::Bool => "write 0 or 1",
                    _ => "write it like 100, -100 or 0x64",
                };
                write!(
                    f,
                    "\"{text}\" is not a number of type {}; {form}",
                    data_type.name()
                )
            }
            ValueError::OutOfRange {
                value,
                data_type,
                bounds: (low, high),
            } => write!(
                f,
                "{value} does not fit {}; give a value from {low} to {high}",
                data_type.name()
            ),
            ValueError::TooLong { bytes } => write!(
                f,
                "a text of {bytes} bytes does not fit an expedited transfer; give at most 4"
            ),
        }
    }
}

impl std::error::Error for ValueError {}

impl Value {
    /// Reads what a user typed as a value of type `data_type`: decimal, or hexadecimal after `0x`.
    /// For signed types a hexadecimal number is the bit pattern, so `0xFF` is −1 as INTEGER8.
    ///
    /// # Errors
    /// [`ValueError`].
    pub fn parse(text: &str, data_type: DataType) -> Result<Value, ValueError> {
        let text = text.trim();
        let not_a_number = || ValueError::NotANumber {
            text: text.to_owned(),
            data_type,
        };
        match data_type {
            DataType::Text => {
                return if text.len() <= 4 {
                    Ok(Value::Text(text.to_owned()))
                } else {
                    Err(ValueError::TooLong { bytes: text.len() })
                };
            }
            DataType::F32 => {
                return text.parse().map(Value::Real).map_err(|_| not_a_number());
            }
            _ => {}
        }
        let value = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
            Some(digits) if !digits.starts_with(['+', '-']) => {
                let raw = u32::from_str_radix(digits, 16).map_err(|_| not_a_number())?;
                let bits = 8 * u32::from(data_type.size());
                if bits < 32 && raw >> bits != 0 {
                    i64::from(raw)
                } else {
                    data_type.number(raw)
                }
            }
            Some(_) => return Err(not_a_number()),
            None => text.parse::<i64>().map_err(|_| not_a_number())?,
        };
        check(value, data_type)?;
        Ok(Value::Integer(value))
    }

    /// From little-endian bytes; `None` if there are fewer than the type has. Further bytes are
    /// padding (P2). Text ends at the first zero byte.
    pub fn decode(bytes: &[u8], data_type: DataType) -> Option<Value> {
        if data_type == DataType::Text {
            let end = bytes
                .iter()
                .position(|byte| *byte == 0)
                .unwrap_or(bytes.len());
            return Some(Value::Text(
                String::from_utf8_lossy(&bytes[..end]).into_owned(),
            ));
        }
        let size = usize::from(data_type.size());
        let mut raw = [0; 4];
        raw[..size].copy_from_slice(bytes.get(..size)?);
        let raw = u32::from_le_bytes(raw);
        Some(match data_type {
            DataType::F32 => Value::Real(f32::from_bits(raw)),
            _ => Value::Integer(data_type.number(raw)),
        })
    }

    /// The bytes that a download of this value into an object of type `data_type` carries.
    ///
    /// # Errors
    /// [`ValueError`].
    pub fn encode(&self, data_type: DataType) -> Result<Data, ValueError> {
        let raw = match (self, data_type) {
            (Value::Text(text), DataType::Text) => {
                return Data::sized(text.as_bytes())
                    .ok_or(ValueError::TooLong { bytes: text.len() });
            }
            (Value::Real(real), DataType::F32) => real.to_bits(),
            (Value::Integer(value), DataType::F32) => (*value as f32).to_bits(),
            (Value::Integer(value), data_type) if data_type != DataType::Text => {
                check(*value, data_type)?;
                *value as u32
            }
            _ => {
                return Err(ValueError::NotANumber {
                    text: self.to_string(),
                    data_type,
                });
            }
        };
        let bytes = raw.to_le_bytes();
        Ok(Data::sized(&bytes[..usize::from(data_type.size())]).unwrap_or(Data::EMPTY))
    }
}

fn check(value: i64, data_type: DataType) -> Result<(), ValueError> {
    match data_type.bounds() {
        Some((low, high)) if value < low || value > high => Err(ValueError::OutOfRange {
            value,
            data_type,
            bounds: (low, high),
        }),
        _ => Ok(()),
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Integer(value) => write!(f, "{value}"),
            Value::Real(value) => write!(f, "{value}"),
            Value::Text(text) => write!(f, "\"{}\"", text.escape_default()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_is_the_bit_pattern_of_a_signed_type() {
        assert_eq!(Value::parse("0xFF", DataType::I8), Ok(Value::Integer(-1)));
        assert_eq!(Value::parse("-1", DataType::I8), Ok(Value::Integer(-1)));
        assert_eq!(Value::parse("0x64", DataType::I16), Ok(Value::Integer(100)));
        assert_eq!(
            Value::parse("0xFFFFFFFF", DataType::U32),
            Ok(Value::Integer(0xFFFF_FFFF))
        );
    }

    #[test]
    fn what_does_not_fit_is_refused_with_the_range() {
        for (text, data_type) in [
            ("256", DataType::U8),
            ("0x100", DataType::U8),
            ("-129", DataType::I8),
        ] {
            let Err(ValueError::OutOfRange { bounds, .. }) = Value::parse(text, data_type) else {
                panic!("{text} was taken");
            };
            assert_eq!(Some(bounds), data_type.bounds());
        }
        assert!(Value::parse("0x-1", DataType::I16).is_err());
        assert!(Value::parse("fast", DataType::I16).is_err());
        assert_eq!(
            Value::parse("hello", DataType::Text),
            Err(ValueError::TooLong { bytes: 5 })
        );
    }

    #[test]
    fn bytes_and_values_agree() {
        assert_eq!(
            Value::decode(&[0x9C, 0xFF, 0, 0], DataType::I16),
            Some(Value::Integer(-100))
        );
        assert_eq!(Value::decode(&[0x9C], DataType::I16), None);
        assert_eq!(
            Value::decode(b"P3\0\0", DataType::Text),
            Some(Value::Text("P3".into()))
        );
        let data = Value::Integer(-100).encode(DataType::I16).unwrap();
        assert_eq!(data.bytes(), [0x9C, 0xFF]);
        assert!(Value::Text("x".into()).encode(DataType::U8).is_err());
    }
}
