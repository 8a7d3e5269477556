//! Exponential decay for coefficients, computed once and never inside a step.

use control::Real;

/// `1 - exp(-x)` for `x >= 0`, to about 1e-15 relative, also for the smallest `x`; 0 for a negative
/// or undefined `x`.
///
/// Halves `x` until a short series is exact enough, then doubles back with
/// `1 - e^-2y = (1 - e^-y) (1 + e^-y)`, which loses nothing to cancellation.
pub(crate) fn decayed_fraction(x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 0.0;
    }
    if x > 64.0 {
        return 1.0;
    }
    let mut y = x;
    let mut doublings = 0;
    while y > 0.0625 {
        y *= 0.5;
        doublings += 1;
    }
    // y - y²/2! + y³/3! - … to y⁹, by Horner from the far end; the rest is below 1e-18.
    let mut series = 0.0;
    let mut order = 9.0;
    while order > 0.0 {
        series = y / order * (1.0 - series);
        order -= 1.0;
    }
    let mut fraction = series;
    for _ in 0..doublings {
        fraction *= 2.0 - fraction;
    }
    fraction
}

/// The same in `R`, for coefficients that follow a temperature; to about 3e-7 relative.
pub(crate) fn decayed<R: Real>(x: R) -> R {
    // Beyond 16, 1 - e^-x is 1 in an f32.
    let y = x.greatest(R::splat(0.0)).least(R::splat(16.0)) * R::splat(1.0 / 256.0);
    let mut series = R::splat(0.0);
    for order in [6.0_f32, 5.0, 4.0, 3.0, 2.0, 1.0] {
        series = y * R::splat(1.0 / order) * (R::splat(1.0) - series);
    }
    for _ in 0..8 {
        series = series * (R::splat(2.0) - series);
    }
    series
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{decayed, decayed_fraction};

    #[test]
    fn the_short_one_agrees_with_the_long_one() {
        for exponent in -120..20 {
            let x = 1.25_f32.powi(exponent);
            let expected = decayed_fraction(x.into());
            let error = (f64::from(decayed(x)) / expected - 1.0).abs();
            assert!(error < 4e-7, "x = {x}: relative error {error}");
        }
        assert_eq!((decayed(0.0_f32), decayed(-1.0_f32)), (0.0, 0.0));
        assert_eq!(decayed(f32::NAN), 0.0);
        assert!((decayed(f32::INFINITY) - 1.0).abs() < 2e-7);
    }

    #[test]
    fn agrees_with_the_host_library() {
        for exponent in -300..30 {
            let x = 1.25_f64.powi(exponent);
            let expected = -(-x).exp_m1();
            let error = (decayed_fraction(x) / expected - 1.0).abs();
            assert!(error < 3e-15, "x = {x}: relative error {error}");
        }
    }

    #[test]
    fn has_sane_ends() {
        assert_eq!(decayed_fraction(0.0), 0.0);
        assert_eq!(decayed_fraction(-1.0), 0.0);
        assert_eq!(decayed_fraction(f64::NAN), 0.0);
        assert_eq!(decayed_fraction(f64::INFINITY), 1.0);
    }
}
