//! Frame lines: `0x601 8 22 10 10 04 00 B0 21 00  Save the new ID`.

use super::expression::{self, Values};
use super::pattern::{Element, Pattern};
use super::source::{Cursor, SyntaxError, Word, integer};

/// Which frame line is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// To be sent: nothing may be left open.
    Sent,
    /// Expected: wildcards, and variables that take a value.
    Expected,
    /// After `ignore`: wildcards, but no variables; length and data may be missing.
    Ignored,
}

/// Names of variables that have a value; in a fresh frame they are added.
pub(super) type Names = Values;

/// Reads identifier, length and data; what follows two blanks or a tab is a description. `used`
/// decides by the pattern's identifier what the line is for.
pub(super) fn frame(
    cursor: &mut Cursor<'_>,
    used: impl Fn(&Pattern) -> Use,
    names: &mut Names,
) -> Result<(Pattern, Use), SyntaxError> {
    cursor.skip_blanks();
    let begin = cursor.at();
    let mut pattern = identifier(cursor)?;
    let used = used(&pattern);
    if pattern.id_mask != full_mask(pattern.is_extended) && used != Use::Ignored {
        return Err(cursor.error(
            begin,
            "a mask on the identifier",
            "only \"ignore\" takes one; write the identifier alone",
        ));
    }
    let length = cursor.word();
    if length.text.is_empty() && used == Use::Ignored {
        pattern.elements.push(Element::Rest);
        return Ok((pattern, used));
    }
    pattern.length = data_length(cursor, length)?;
    if pattern.length == Some(0) {
        return Ok((pattern, used));
    }
    // Data may stand in the next column, any blanks away.
    cursor.skip_blanks();
    data(cursor, &mut pattern, used, names)?;
    if used == Use::Ignored && pattern.elements.is_empty() {
        pattern.elements.push(Element::Rest);
    }
    check_length(cursor, &pattern, length)?;
    if used == Use::Sent && pattern.length.is_none() {
        return Err(cursor.error(
            length.at,
            "a sent frame of any length",
            "write its length, 0 to 8",
        ));
    }
    Ok((pattern, used))
}

fn full_mask(is_extended: bool) -> u32 {
    if is_extended { 0x1FFF_FFFF } else { 0x7FF }
}

fn identifier(cursor: &mut Cursor<'_>) -> Result<Pattern, SyntaxError> {
    let word = cursor.word();
    let (id, mask) = match word.text.split_once('/') {
        Some((id, mask)) => (id, Some(mask)),
        None => (word.text, None),
    };
    let wrong = |text: &str| {
        cursor.error(
            word.at,
            format!("\"{text}\" is not an identifier"),
            "write 0x and three hexadecimal digits up to 0x7FF, or eight for a 29-bit identifier",
        )
    };
    let hexadecimal = |text: &str| {
        let has_prefix = text.starts_with("0x") || text.starts_with("0X");
        let number = integer(text).filter(|_| has_prefix)?;
        u32::try_from(number).ok()
    };
    let is_extended = id.len() == 10;
    let most = full_mask(is_extended);
    let number = hexadecimal(id)
        .filter(|number| *number <= most)
        .ok_or_else(|| wrong(id))?;
    let id_mask = match mask {
        Some(mask) => hexadecimal(mask)
            .filter(|m| *m <= most)
            .ok_or_else(|| wrong(mask))?,
        None => most,
    };
    Ok(Pattern {
        id: number,
        id_mask,
        is_extended,
        length: None,
        elements: Vec::new(),
    })
}

fn data_length(cursor: &Cursor<'_>, word: Word<'_>) -> Result<Option<u8>, SyntaxError> {
    if word.text == "?" {
        return Ok(None);
    }
    let length = word.text.parse::<u8>().ok().filter(|length| *length <= 8);
    length.map(Some).ok_or_else(|| {
        let message = match word.text {
            "" => "the length is missing".to_owned(),
            text => format!("\"{text}\" is not a length"),
        };
        cursor.error(
            word.at,
            message,
            "write the number of data bytes, 0 to 8, or ? for any",
        )
    })
}

/// Words one blank apart, until two blanks, a tab, or the end.
fn data(
    cursor: &mut Cursor<'_>,
    pattern: &mut Pattern,
    used: Use,
    names: &mut Names,
) -> Result<(), SyntaxError> {
    loop {
        let word = cursor.until(char::is_whitespace);
        if word.text.is_empty() {
            return Ok(());
        }
        let element = element(cursor, word, used, names)?;
        if pattern.elements.contains(&Element::Rest) {
            return Err(cursor.error(word.at, "data after ..", "let .. be the last"));
        }
        pattern.elements.push(element);
        let rest = cursor.rest();
        let description =
            rest.starts_with("  ") || rest.starts_with('\t') || rest.starts_with(" \t");
        if description || !cursor.take(" ") {
            return Ok(());
        }
    }
}

fn element(
    cursor: &Cursor<'_>,
    word: Word<'_>,
    used: Use,
    names: &mut Names,
) -> Result<Element, SyntaxError> {
    if let Some(rest) = word.text.strip_prefix('$') {
        return variable(cursor, word, rest, used, names);
    }
    if word.text == ".." {
        return match used {
            Use::Sent => Err(open(cursor, word)),
            _ => Ok(Element::Rest),
        };
    }
    let wrong = || {
        cursor.error(
            word.at,
            format!("\"{}\" is not a byte", word.text),
            match used {
                Use::Sent => "write two hexadecimal digits or a variable, and set a description off by two blanks",
                _ => "write two hexadecimal digits, ??, value/mask, .. or a variable, and set a description off by two blanks",
            },
        )
    };
    let (value, mask) = match word.text.split_once('/') {
        Some((value, mask)) => {
            let (value, _) = byte(value)
                .filter(|(_, mask)| *mask == 0xFF)
                .ok_or_else(wrong)?;
            let (mask, _) = byte(mask)
                .filter(|(_, mask)| *mask == 0xFF)
                .ok_or_else(wrong)?;
            if value & !mask != 0 {
                return Err(cursor.error(
                    word.at,
                    format!("{} asks for bits outside its mask", word.text),
                    format!("write {:02X}/{mask:02X}, or widen the mask", value & mask),
                ));
            }
            (value, mask)
        }
        None => byte(word.text).ok_or_else(wrong)?,
    };
    if used == Use::Sent && mask != 0xFF {
        return Err(open(cursor, word));
    }
    Ok(Element::Byte { value, mask })
}

/// Value and mask of two hexadecimal digits, either of which may be `?`.
fn byte(text: &str) -> Option<(u8, u8)> {
    let &[high, low] = text.as_bytes() else {
        return None;
    };
    let digit = |byte: u8| match byte {
        b'?' => Some((0, 0)),
        _ => char::from(byte)
            .to_digit(16)
            .map(|digit| (digit as u8, 0xF)),
    };
    let ((high, high_mask), (low, low_mask)) = (digit(high)?, digit(low)?);
    Some((high << 4 | low, high_mask << 4 | low_mask))
}

/// `$name` or `$name:bytes`.
fn variable(
    cursor: &Cursor<'_>,
    word: Word<'_>,
    text: &str,
    used: Use,
    names: &mut Names,
) -> Result<Element, SyntaxError> {
    if used == Use::Ignored {
        return Err(cursor.error(
            word.at,
            "a variable in an ignore rule",
            "write ?? for any byte",
        ));
    }
    let (name, bytes) = match text.split_once(':') {
        Some((name, bytes)) => (name, bytes.parse().ok().filter(|n| (1..=4).contains(n))),
        None => (text, Some(1)),
    };
    let Some(bytes) = bytes else {
        return Err(cursor.error(
            word.at,
            format!("\"{}\" has no size", word.text),
            format!("write ${name}:2 for two bytes; 1 to 4 are possible"),
        ));
    };
    let mut inner = Cursor::new(cursor.file, cursor.line, name);
    let plain = expression::name(&mut inner).is_ok_and(|read| read == name);
    if !plain {
        return Err(cursor.error(
            word.at,
            format!("\"{}\" is not a variable", word.text),
            "write $ and a letter, then letters, digits or _, then :size for more than one byte",
        ));
    }
    if !names.contains_key(name) {
        if used == Use::Sent {
            return Err(expression::unknown_variable(cursor, word.at, name));
        }
        names.insert(name.to_owned(), 0);
    }
    Ok(Element::Variable {
        name: name.to_owned(),
        bytes,
    })
}

fn open(cursor: &Cursor<'_>, word: Word<'_>) -> SyntaxError {
    cursor.error(
        word.at,
        format!("{} in a frame that is sent", word.text),
        "write the byte; only expected frames may leave some open (mark one with <)",
    )
}

/// The data must be as long as the length says.
fn check_length(
    cursor: &Cursor<'_>,
    pattern: &Pattern,
    length: Word<'_>,
) -> Result<(), SyntaxError> {
    let sized = pattern
        .elements
        .iter()
        .filter_map(Element::bytes)
        .map(u32::from)
        .sum::<u32>();
    let is_open = pattern.elements.contains(&Element::Rest);
    let most = u32::from(pattern.length.unwrap_or(8));
    let fits = match (pattern.length, is_open) {
        (Some(length), false) => sized == u32::from(length),
        _ => sized <= most,
    };
    if fits {
        return Ok(());
    }
    let bytes = if sized == 1 {
        "byte follows"
    } else {
        "bytes follow"
    };
    Err(cursor.error(
        length.at,
        format!("the length is {}, but {sized} {bytes}", length.text),
        "correct one of the two; a description begins after two blanks or a tab",
    ))
}
