//! Simulated time per real time.

use std::str::FromStr;

/// How fast simulated time runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Speed {
    /// So many times as fast as real time.
    Times(f64),
    /// As fast as the machine can.
    Max,
}

const SLOWEST: f64 = 0.001;
const FASTEST: f64 = 1000.0;

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Speed, String> {
        if text == "max" {
            return Ok(Speed::Max);
        }
        let speed = text.parse::<f64>().ok();
        speed
            .filter(|speed| (SLOWEST..=FASTEST).contains(speed))
            .map(Speed::Times)
            .ok_or_else(|| format!("write a number from {SLOWEST} to {FASTEST}, or max"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_that_move_time() {
        assert_eq!("0.5".parse(), Ok(Speed::Times(0.5)));
        assert_eq!("max".parse(), Ok(Speed::Max));
        for wrong in ["0", "-1", "NaN", "inf", "1e9", "fast", ""] {
            assert!(wrong.parse::<Speed>().is_err(), "{wrong}");
        }
    }
}
