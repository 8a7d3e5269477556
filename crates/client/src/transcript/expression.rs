//! The arithmetic of `let`: integers, `+ - * / % << >> & |` and parentheses.

use std::collections::BTreeMap;

use super::source::{Cursor, SyntaxError, integer};

/// Values of named variables.
pub(super) type Values = BTreeMap<String, i64>;

/// An expression.
#[derive(Clone, Debug)]
pub(super) enum Expression {
    Number(i64),
    Variable(String),
    Operation(Operator, Box<Expression>, Box<Expression>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    ShiftLeft,
    ShiftRight,
    And,
    Or,
}

/// Sign, meaning, and how tightly it binds.
const OPERATORS: &[(&str, Operator, u8)] = &[
    ("|", Operator::Or, 0),
    ("&", Operator::And, 1),
    ("<<", Operator::ShiftLeft, 2),
    (">>", Operator::ShiftRight, 2),
    ("+", Operator::Add, 3),
    ("-", Operator::Subtract, 3),
    ("*", Operator::Multiply, 4),
    ("/", Operator::Divide, 4),
    ("%", Operator::Remainder, 4),
];

/// Parentheses within parentheses that are followed.
const DEEPEST: u8 = 16;

/// The name of a variable after its `$`.
pub(super) fn name(cursor: &mut Cursor<'_>) -> Result<String, SyntaxError> {
    let word = cursor.until(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    if word.text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Ok(word.text.to_owned());
    }
    Err(cursor.error(
        word.at,
        "a variable has no name",
        "write $ and a letter, then letters, digits or _, as in $raw",
    ))
}

/// Reads an expression; `known` says which variables have a value.
pub(super) fn parse(
    cursor: &mut Cursor<'_>,
    known: &dyn Fn(&str) -> bool,
) -> Result<Expression, SyntaxError> {
    sum(cursor, known, 0, 0)
}

fn sum(
    cursor: &mut Cursor<'_>,
    known: &dyn Fn(&str) -> bool,
    weakest: u8,
    depth: u8,
) -> Result<Expression, SyntaxError> {
    let mut left = operand(cursor, known, depth)?;
    loop {
        cursor.skip_blanks();
        let found = OPERATORS
            .iter()
            .find(|(sign, _, binds)| *binds >= weakest && cursor.rest().starts_with(sign));
        let Some(&(sign, operator, binds)) = found else {
            return Ok(left);
        };
        cursor.take(sign);
        // Operators of one rank group from the left.
        let right = sum(cursor, known, binds + 1, depth)?;
        left = Expression::Operation(operator, Box::new(left), Box::new(right));
    }
}

fn operand(
    cursor: &mut Cursor<'_>,
    known: &dyn Fn(&str) -> bool,
    depth: u8,
) -> Result<Expression, SyntaxError> {
    cursor.skip_blanks();
    let at = cursor.at();
    if cursor.take("$") {
        let name = name(cursor)?;
        if !known(&name) {
            return Err(unknown_variable(cursor, at, &name));
        }
        return Ok(Expression::Variable(name));
    }
    if cursor.take("(") {
        if depth == DEEPEST {
            return Err(cursor.error(at, "parentheses too deep", "split the line into two lets"));
        }
        let inner = sum(cursor, known, 0, depth + 1)?;
        cursor.skip_blanks();
        if !cursor.take(")") {
            return Err(cursor.error(at, "this parenthesis is not closed", "add the ) it lacks"));
        }
        return Ok(inner);
    }
    let word = cursor.until(|c: char| !c.is_ascii_alphanumeric());
    integer(word.text).map(Expression::Number).ok_or_else(|| {
        let message = match word.text {
            "" => "a number is missing".to_owned(),
            text => format!("\"{text}\" is not a number"),
        };
        cursor.error(
            word.at,
            message,
            "write a number like 16 or 0x10, or a variable like $raw",
        )
    })
}

/// The error for a variable that is used before it has a value.
pub(super) fn unknown_variable(cursor: &Cursor<'_>, at: usize, name: &str) -> SyntaxError {
    cursor.error(
        at,
        format!("${name} has no value here"),
        format!("capture it in an expected frame above, or give it one with \"let ${name} = …\""),
    )
}

impl Expression {
    /// The value. A variable without one counts as an error too, although the parser lets none pass.
    ///
    /// # Errors
    /// What went wrong, in words.
    pub(super) fn value(&self, values: &Values) -> Result<i64, String> {
        match self {
            Expression::Number(number) => Ok(*number),
            Expression::Variable(name) => values
                .get(name)
                .copied()
                .ok_or_else(|| format!("${name} has no value")),
            Expression::Operation(operator, left, right) => {
                let (left, right) = (left.value(values)?, right.value(values)?);
                let shift = || u32::try_from(right).ok().filter(|places| *places < 64);
                let result = match operator {
                    Operator::Add => left.checked_add(right),
                    Operator::Subtract => left.checked_sub(right),
                    Operator::Multiply => left.checked_mul(right),
                    Operator::Divide if right == 0 => return Err("division by zero".to_owned()),
                    Operator::Divide => left.checked_div(right),
                    Operator::Remainder if right == 0 => return Err("division by zero".to_owned()),
                    Operator::Remainder => left.checked_rem(right),
                    Operator::ShiftLeft => {
                        let shifted = shift().map(|places| left.wrapping_shl(places));
                        // Nothing may be shifted out at the top.
                        shifted.filter(|s| shift().map(|places| s >> places) == Some(left))
                    }
                    Operator::ShiftRight => shift().map(|places| left >> places),
                    Operator::And => Some(left & right),
                    Operator::Or => Some(left | right),
                };
                result.ok_or_else(|| "the result exceeds 64 bits".to_owned())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<i64, String> {
        let mut cursor = Cursor::new("t", 1, text);
        let values = Values::from([("raw".to_owned(), 0x7296)]);
        let expression = parse(&mut cursor, &|name| name == "raw").map_err(|e| e.to_string())?;
        cursor.finish().map_err(|e| e.to_string())?;
        expression.value(&values)
    }

    #[test]
    fn operators_bind_as_in_rust() {
        assert_eq!(value("$raw / 16"), Ok(0x0729));
        assert_eq!(value("($raw + 8) >> 4"), Ok(0x0729));
        assert_eq!(value("2 + 3 * 4"), Ok(14));
        assert_eq!(value("20 - 5 - 3"), Ok(12));
        assert_eq!(value("0x10 | 1 << 3 & 0xF"), Ok(0x18));
        assert_eq!(value("17 % 5"), Ok(2));
    }

    #[test]
    fn what_cannot_be_computed_is_said() {
        assert_eq!(value("1 / 0"), Err("division by zero".into()));
        assert_eq!(value("1 << 64"), Err("the result exceeds 64 bits".into()));
        assert_eq!(
            value("0x7FFFFFFFFFFFFFFF + 1"),
            Err("the result exceeds 64 bits".into())
        );
        assert_eq!(
            value("1 << 63 >> 63"),
            Err("the result exceeds 64 bits".into())
        );
    }

    #[test]
    fn deep_nesting_is_refused_not_followed() {
        let text = "(".repeat(100_000);
        assert!(value(&text).unwrap_err().contains("too deep"));
    }
}
