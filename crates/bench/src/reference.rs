//! The figures of a program in another language, measured by a script of its own.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde_json::Value;

use crate::period::PeriodTime;

/// The column's name.
pub const MOTULATOR: &str = "motulator";

/// Why figures cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The file cannot be read.
    #[error("{0}: {1}")]
    File(PathBuf, io::Error),
    /// It does not hold two times.
    #[error("{0}: expected one object with the positive numbers best_ns and median_ns")]
    Content(PathBuf),
}

/// Reads the time of a control period: a JSON object with `best_ns` and `median_ns`.
///
/// # Errors
/// [`ReferenceError`] if the file does not hold that.
pub fn read(path: &Path) -> Result<PeriodTime, ReferenceError> {
    let text = fs::read_to_string(path);
    let text = text.map_err(|error| ReferenceError::File(path.to_owned(), error))?;
    parse(&text).ok_or_else(|| ReferenceError::Content(path.to_owned()))
}

fn parse(text: &str) -> Option<PeriodTime> {
    let value: Value = serde_json::from_str(text).ok()?;
    let time = |name: &str| value.get(name)?.as_f64().filter(|&ns| ns > 0.0);
    Some(PeriodTime {
        best_ns: time("best_ns")?,
        median_ns: time("median_ns")?,
    })
}

#[cfg(test)]
mod tests {
    use super::{PeriodTime, parse};

    #[test]
    fn two_positive_times_or_nothing() {
        let good = r#"{"subject": "motulator 0.5.0", "best_ns": 345824.8, "median_ns": 347180}"#;
        let expected = PeriodTime {
            best_ns: 345_824.8,
            median_ns: 347_180.0,
        };
        assert_eq!(parse(good), Some(expected));
        for bad in [
            "",
            "[]",
            r#"{"best_ns": 1}"#,
            r#"{"best_ns": 1, "median_ns": -2}"#,
            r#"{"best_ns": "1", "median_ns": 2}"#,
        ] {
            assert_eq!(parse(bad), None, "{bad}");
        }
    }
}
