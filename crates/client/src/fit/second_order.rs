//! Natural frequency and damping of a response to a step.

use super::fit;

/// What a step makes of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// ω² / (s² + 2ζωs + ω²), stepped: a new place.
    Step,
    /// s / (s² + 2ζωs + ω²), stepped: away and back.
    Pulse,
    /// ω / (s + ω), stepped: a new place without any swing; ζ has no meaning.
    Lag,
}

/// A fitted response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Order2 {
    /// Natural frequency, rad/s.
    pub(crate) omega: f64,
    /// Damping ratio.
    pub(crate) damping: f64,
    /// When the response begins, s.
    pub(crate) begins_s: f64,
    /// Size of the response, in units of the samples.
    pub(crate) size: f64,
    /// What the fit leaves, rms, in units of the samples.
    pub(crate) rms: f64,
}

impl Shape {
    /// The response at time `t` after the step: 1 in the end, or at most about 1 for a pulse.
    pub(crate) fn at(self, t: f64, omega: f64, damping: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        let x = omega * t;
        if self == Shape::Lag {
            return 1.0 - (-x).exp();
        }
        // sin(βx)/β and cos(βx), whatever the sign of β² = 1 − ζ²; with the decay.
        let square = 1.0 - damping * damping;
        let (sine, cosine) = if square > 1e-9 {
            let beta = square.sqrt();
            let (s, c) = (beta * x).sin_cos();
            let decay = (-damping * x).exp();
            (decay * s / beta, decay * c)
        } else if square < -1e-9 {
            let beta = (-square).sqrt();
            let (slow, fast) = ((-(damping - beta) * x).exp(), (-(damping + beta) * x).exp());
            ((slow - fast) / (2.0 * beta), 0.5 * (slow + fast))
        } else {
            let decay = (-damping * x).exp();
            (decay * x, decay)
        };
        match self {
            Shape::Pulse => sine,
            Shape::Step | Shape::Lag => 1.0 - cosine - damping * sine,
        }
    }
}

/// Fits a response, a constant and (but for a lag) a slope to samples of (time, value). The step is at time 0 and
/// may take `latest_s` to act; `guess` is a natural frequency to begin with, rad/s.
pub(crate) fn fit_step(
    samples: &[(f64, f64)],
    shape: Shape,
    guess: f64,
    latest_s: f64,
) -> Option<Order2> {
    let evaluate = |point: [f64; 3]| -> Option<Order2> {
        let [log_omega, log_damping, begins] = point;
        let (omega, damping) = (log_omega.exp(), log_damping.exp());
        let begins_s = begins.clamp(0.0, 1.0) * latest_s;
        let rows: Vec<_> = samples
            .iter()
            .map(|(t, y)| {
                let response = shape.at(t - begins_s, omega, damping);
                match shape {
                    // A slope and a slow lag would be hard to tell apart.
                    Shape::Lag => (vec![1.0, response], *y),
                    Shape::Step | Shape::Pulse => (vec![1.0, response, t + 1.0], *y),
                }
            })
            .collect();
        let found = fit(&rows)?;
        Some(Order2 {
            omega,
            damping,
            begins_s,
            size: found.coefficients[1],
            rms: found.rms,
        })
    };
    let cost = |point: [f64; 3]| {
        let [log_omega, log_damping, begins] = point;
        let outside = (begins - begins.clamp(0.0, 1.0)).abs()
            + (log_damping.abs() - 2.5).max(0.0)
            + ((log_omega - guess.ln()).abs() - 2.0).max(0.0);
        evaluate(point).map_or(f64::MAX, |found| found.rms * (1.0 + outside))
    };
    // From several places, since a bad beginning may lead into a hollow beside the valley.
    let best = [(0.7, 0.5), (1.0, 1.0), (1.4, 0.7), (1.0, 1.8)]
        .into_iter()
        .map(|(share, damping): (f64, f64)| {
            descend([(guess * share).ln(), damping.ln(), 0.3], cost)
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    evaluate(best.0)
}

/// The simplex of Nelder and Mead in three dimensions: the lowest place found, and its cost.
fn descend(from: [f64; 3], cost: impl Fn([f64; 3]) -> f64) -> ([f64; 3], f64) {
    let mut corners: Vec<([f64; 3], f64)> = vec![(from, cost(from))];
    for (axis, step) in [0.2, 0.3, 0.3].into_iter().enumerate() {
        let mut corner = from;
        corner[axis] += step;
        corners.push((corner, cost(corner)));
    }
    let between =
        |a: [f64; 3], b: [f64; 3], part: f64| [0, 1, 2].map(|n| a[n] + part * (b[n] - a[n]));
    for _ in 0..150 {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (corners[0], corners[3]);
        if worst.1 - best.1 <= 1e-9 * best.1.abs() {
            break;
        }
        let middle = [0, 1, 2].map(|n| corners[..3].iter().map(|c| c.0[n]).sum::<f64>() / 3.0);
        let tried = |part: f64| {
            let place = between(middle, worst.0, part);
            (place, cost(place))
        };
        let mirrored = tried(-1.0);
        if mirrored.1 < best.1 {
            let further = tried(-2.0);
            corners[3] = if further.1 < mirrored.1 {
                further
            } else {
                mirrored
            };
        } else if mirrored.1 < corners[2].1 {
            corners[3] = mirrored;
        } else {
            let nearer = tried(if mirrored.1 < worst.1 { -0.5 } else { 0.5 });
            if nearer.1 < worst.1.min(mirrored.1) {
                corners[3] = nearer;
            } else {
                for corner in &mut corners[1..] {
                    let place = between(best.0, corner.0, 0.5);
                    *corner = (place, cost(place));
                }
            }
        }
    }
    corners.sort_by(|a, b| a.1.total_cmp(&b.1));
    corners[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(shape: Shape, omega: f64, damping: f64) -> Vec<(f64, f64)> {
        (-10..80)
            .map(|n| {
                let t = f64::from(n) * 1e-3;
                let slope = if shape == Shape::Lag { 0.0 } else { 30.0 };
                let y = 4.0 + slope * t + 50.0 * shape.at(t - 0.4e-3, omega, damping);
                // Noise of a quarter of a count, always the same.
                (t, y + 0.25 * f64::from((n * 7919) % 13 - 6) / 6.0)
            })
            .collect()
    }

    #[test]
    fn frequency_and_damping_are_found_again() {
        for shape in [Shape::Step, Shape::Pulse] {
            for hz in [15.0, 40.0, 100.0] {
                for damping in [0.4, 0.7, 1.0, 1.3] {
                    let omega = hz * std::f64::consts::TAU;
                    let all = samples(shape, omega, damping);
                    let found = fit_step(&all, shape, omega * 1.5, 1.5e-3).unwrap();
                    let off = found.omega / omega - 1.0;
                    assert!(off.abs() < 0.05, "{shape:?} {hz} {damping}: {found:?}");
                    assert!((found.damping / damping - 1.0).abs() < 0.08, "{found:?}");
                    assert!(found.rms < 0.25);
                }
            }
        }
    }

    #[test]
    fn a_lag_has_a_frequency_only() {
        let all = samples(Shape::Lag, 90.0, 1.0);
        let found = fit_step(&all, Shape::Lag, 60.0, 1.5e-3).unwrap();
        assert!((found.omega / 90.0 - 1.0).abs() < 0.03, "{found:?}");
    }

    #[test]
    fn the_shapes_meet_where_the_damping_passes_one() {
        for shape in [Shape::Step, Shape::Pulse] {
            for n in 1..50 {
                let t = f64::from(n) * 1e-3;
                let around = [0.9999, 1.0, 1.0001].map(|z| shape.at(t, 200.0, z));
                assert!((around[0] - around[1]).abs() < 2e-4);
                assert!((around[2] - around[1]).abs() < 2e-4);
            }
        }
    }
}
