//! The few operations on `f64` that `core` lacks, and the meaning of unusable numbers.

/// Above this, a speed (counts/s) or a rate (counts/s²) is "at once": 10⁶ counts/s within 1 µs.
pub(crate) const AT_ONCE: f64 = 1e12;

/// Square root, relative error below 3e-16; 0 for zero, negative numbers and NaN. Arguments of
/// the planner stay between 1e-40 and 1e40.
pub(crate) fn square_root(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 0.0;
    }
    // Halving the exponent gives a guess within 4 %; Heron's rule squares the error each time.
    let mut root = f64::from_bits((x.to_bits() >> 1).wrapping_add(0x1FF7_A3BE_A91D_9B1B));
    for _ in 0..5 {
        root = 0.5 * (root + x / root);
    }
    root
}

/// The smaller of two numbers, neither NaN.
pub(crate) fn least(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The greater of two numbers, neither NaN.
pub(crate) fn greatest(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// `x` within `low` to `high`.
pub(crate) fn within(x: f64, low: f64, high: f64) -> f64 {
    greatest(low, least(x, high))
}

/// 1, −1, or 0 for zero.
pub(crate) fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Whole counts (rounded down) and the fraction, 0 to below 1.
pub(crate) fn split(x: f64) -> (i64, f64) {
    let cut = x as i64;
    let floor = if (cut as f64) > x {
        cut.saturating_sub(1)
    } else {
        cut
    };
    let fraction = x - floor as f64;
    if (0.0..1.0).contains(&fraction) {
        (floor, fraction)
    } else if fraction >= 1.0 {
        // A little less than a whole number.
        (floor.saturating_add(1), 0.0)
    } else {
        (floor, 0.0)
    }
}

/// A configured speed or rate as a usable number: what is not positive (NaN included) is 0, and
/// nothing exceeds [`AT_ONCE`].
pub(crate) fn magnitude(x: f32) -> f64 {
    if x > 0.0 {
        least(f64::from(x), AT_ONCE)
    } else {
        0.0
    }
}

/// A measured value within ±[`AT_ONCE`]; NaN counts as 0.
pub(crate) fn measured(x: f32) -> f64 {
    if x.is_nan() {
        0.0
    } else {
        within(f64::from(x), -AT_ONCE, AT_ONCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_root_squares_back() {
        let mut x = 1e-40_f64;
        while x < 1e40 {
            let root = square_root(x);
            assert!((root * root / x - 1.0).abs() < 1e-15, "{x}: {root}");
            x *= 1.234_567;
        }
        assert_eq!(square_root(16.0), 4.0);
        assert_eq!(square_root(0.0), 0.0);
        assert_eq!(square_root(-1.0), 0.0);
        assert_eq!(square_root(f64::NAN), 0.0);
    }

    #[test]
    fn split_rounds_down() {
        assert_eq!(split(2.25), (2, 0.25));
        assert_eq!(split(-2.25), (-3, 0.75));
        assert_eq!(split(-2.0), (-2, 0.0));
        assert_eq!(split(f64::NAN), (0, 0.0));
        assert_eq!(split(1e300).1, 0.0);
        assert_eq!(split(-1e-30), (0, 0.0));
        assert_eq!(split(-5.0 - 1e-20), (-5, 0.0));
    }
}
