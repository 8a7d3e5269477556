//! Means of angles.

use std::f64::consts::TAU;

/// Mean of values that are the same after `turn`, 0 to below `turn`, and how close they lie: 1 if
/// all are equal, 0 if they are all around.
pub(crate) fn circular_mean(values: impl IntoIterator<Item = f64>, turn: f64) -> (f64, f64) {
    let (mut sine, mut cosine, mut count) = (0.0, 0.0, 0.0);
    for value in values {
        let (s, c) = (value / turn * TAU).sin_cos();
        sine += s;
        cosine += c;
        count += 1.0;
    }
    let length = if count > 0.0 {
        sine.hypot(cosine) / count
    } else {
        0.0
    };
    ((sine.atan2(cosine) / TAU * turn).rem_euclid(turn), length)
}

#[cfg(test)]
mod tests {
    use super::circular_mean;

    #[test]
    fn the_mean_lies_between_across_the_wrap() {
        let (mean, length) = circular_mean([4090.0, 4.0, 4094.0], 4096.0);
        assert!((mean - 4094.67).abs() < 0.01, "{mean}");
        assert!(length > 0.999);
        let (_, length) = circular_mean([0.0, 1024.0, 2048.0, 3072.0], 4096.0);
        assert!(length < 1e-9);
    }
}
