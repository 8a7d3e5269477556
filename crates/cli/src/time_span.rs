//! Durations as people write them: `10s`, `500ms`, `2m`, `1h 30m`.

use std::time::Duration;

/// Reads a duration above 0.
///
/// # Errors
/// What is wrong and what to write.
pub(crate) fn parse(text: &str) -> Result<Duration, String> {
    const FORM: &str = "write a number and its unit, as in 10s, 500ms or 2m";
    if text.trim().parse::<f64>().is_ok() {
        return Err(format!("the unit is missing; {FORM}"));
    }
    let duration = humantime::parse_duration(text).map_err(|error| format!("{error}; {FORM}"))?;
    if duration.is_zero() {
        return Err(format!("it must be above 0; {FORM}"));
    }
    if u64::try_from(duration.as_nanos()).is_err() {
        return Err(format!("that is more than 584 years; {FORM}"));
    }
    Ok(duration)
}

/// Nanoseconds of a duration that [`parse`] gave.
pub(crate) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Whole milliseconds, at least 1.
pub(crate) fn milliseconds(duration: Duration) -> u64 {
    nanoseconds(duration).div_ceil(1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_needed_and_zero_is_refused() {
        assert_eq!(parse("10s"), Ok(Duration::from_secs(10)));
        assert_eq!(parse("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(parse("2m"), Ok(Duration::from_secs(120)));
        assert_eq!(parse("1s 250us"), Ok(Duration::from_micros(1_000_250)));
        for wrong in ["10", "0s", "", "s", "-1s", "ten s", "1 fortnight", "600y"] {
            let message = parse(wrong).unwrap_err();
            assert!(message.contains("as in 10s"), "{wrong}: {message}");
        }
        assert_eq!(milliseconds(Duration::from_micros(1)), 1);
    }
}
