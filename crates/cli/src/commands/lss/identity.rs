//! Identities as people write them: `0x408:3:0x10002:3004`.

use canopen::lss::Identity;
use serde::Serialize;

/// Reads four numbers, decimal or after 0x hexadecimal.
///
/// # Errors
/// What is wrong and what to write.
pub(super) fn parse(text: &str) -> Result<Identity, String> {
    let numbers: Vec<u32> = text.split(':').map(number).collect::<Result<_, _>>()?;
    match numbers[..] {
        [vendor, product, revision, serial] => Ok(Identity {
            vendor,
            product,
            revision,
            serial,
        }),
        _ => Err(format!(
            "an identity has four numbers, these are {}; write VENDOR:PRODUCT:REVISION:SERIAL, as \
             in 0x408:3:0x10002:3004",
            numbers.len()
        )),
    }
}

/// Reads one number of 32 bits.
///
/// # Errors
/// What is wrong and what to write.
pub(super) fn number(text: &str) -> Result<u32, String> {
    let text = text.trim();
    let read = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) if digits.starts_with('+') => None,
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None if text.starts_with('+') => None,
        None => text.parse().ok(),
    };
    read.ok_or_else(|| format!("'{text}' is no number of 32 bits; write it as in 1032 or 0x408"))
}

/// An identity for programs.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    vendor: u32,
    product: u32,
    revision: u32,
    serial: u32,
}

impl From<Identity> for Row {
    fn from(identity: Identity) -> Row {
        Row {
            vendor: identity.vendor,
            product: identity.product,
            revision: identity.revision,
            serial: identity.serial,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities_are_read_as_they_are_printed() {
        let identity = parse("0x408:3:0X10002:3004").unwrap();
        assert_eq!(
            identity.to_string(),
            "0x00000408:0x00000003:0x00010002:0x00000BBC"
        );
        assert_eq!(parse(&identity.to_string()), Ok(identity));
        for (wrong, why) in [
            ("", "'' is no number"),
            ("1:2:3", "these are 3"),
            ("1:2:3:4:5", "these are 5"),
            ("1:2:3:", "'' is no number"),
            ("1:2:3:4294967296", "'4294967296' is no number"),
            ("1:2:3:-4", "'-4' is no number"),
            ("1:2:3:+4", "'+4' is no number"),
            ("1:2:3:0x+4", "'0x+4' is no number"),
            ("1:2:3:0x", "'0x' is no number"),
            ("a:2:3:4", "'a' is no number"),
        ] {
            let message = parse(wrong).unwrap_err();
            assert!(message.contains(why), "{wrong}: {message}");
        }
    }
}
