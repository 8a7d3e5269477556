//! Random numbers for the sensors: cheap, repeatable, and the same in a group of drives as alone.

use control::Real;

/// A linear congruential generator modulo 2³² (multiplier 1664525), of which the upper bits are
/// used. The state moves once per control period; what a sample draws follows from the state, so
/// reading the sensors twice gives the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise<R: Real> {
    state: R::Count,
}

/// The numbers of one sample, one after the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draws<R: Real> {
    state: R::Count,
}

const MULTIPLIER: i32 = 1_664_525;
const INCREMENT: i32 = 1_013_904_223;

/// Numbers of the stream that one control period uses at most.
const PER_PERIOD: u32 = 16;

/// What [`PER_PERIOD`] steps do at once: state · .0 + .1.
const LEAP: (i32, i32) = {
    let (mut multiplier, mut increment) = (1_i32, 0_i32);
    let mut n = 0;
    while n < PER_PERIOD {
        multiplier = multiplier.wrapping_mul(MULTIPLIER);
        increment = increment.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
        n += 1;
    }
    (multiplier, increment)
};

impl<R: Real> Noise<R> {
    /// The stream of a seed.
    pub(crate) fn new(seed: R::Count) -> Self {
        // Neighbouring seeds shall not give neighbouring streams. x(2x + 1) is a permutation modulo
        // 2³² and not a straight one, as the generator's own steps are.
        let mut noise = Self { state: seed };
        for _ in 0..4 {
            noise.advance();
            let twice = R::count_add(noise.state, noise.state);
            noise.state = R::count_mul(noise.state, R::count_add(twice, R::count(1)));
        }
        noise
    }

    /// On to the numbers of the next control period.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        let (multiplier, increment) = LEAP;
        let product = R::count_mul(self.state, R::count(multiplier));
        self.state = R::count_add(product, R::count(increment));
    }

    /// The numbers of this control period, from the first.
    #[inline(always)]
    pub(crate) fn draws(&self) -> Draws<R> {
        Draws { state: self.state }
    }
}

impl<R: Real> Draws<R> {
    /// Evenly spread between -1 and 1, in steps of 2⁻²³.
    #[inline(always)]
    pub(crate) fn even(&mut self) -> R {
        let product = R::count_mul(self.state, R::count(MULTIPLIER));
        self.state = R::count_add(product, R::count(INCREMENT));
        R::of_count(R::count_shift_right(self.state, 8)) * R::splat(1.0 / 8_388_608.0)
    }

    /// Of variance 1 and nearly normal: the sum of three even numbers, within ±3.
    #[inline(always)]
    pub(crate) fn normal(&mut self) -> R {
        self.even() + self.even() + self.even()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Noise, PER_PERIOD};

    #[test]
    fn a_leap_is_so_many_steps() {
        let mut leapt = Noise::<f32>::new(7);
        let mut walked = leapt.draws();
        for _ in 0..PER_PERIOD {
            walked.even();
        }
        leapt.advance();
        assert_eq!(leapt.draws().state, walked.state);
    }

    #[test]
    fn mean_variance_and_neighbours_are_those_of_noise() {
        for seed in [0, 1, 2, -5] {
            let mut noise = Noise::<f32>::new(seed);
            let (mut sum, mut square, mut fourth, mut with_next, mut with_sibling) =
                (0.0, 0.0, 0.0, 0.0, 0.0);
            let mut last = 0.0;
            let n = 200_000;
            for _ in 0..n {
                let mut draws = noise.draws();
                let (a, b) = (f64::from(draws.normal()), f64::from(draws.normal()));
                noise.advance();
                sum += a;
                square += a * a;
                fourth += a * a * a * a;
                with_next += a * last;
                with_sibling += a * b;
                last = a;
            }
            let of = |total: f64| total / f64::from(n);
            std::println!(
                "seed {seed}: mean {:.4}, variance {:.4}, kurtosis {:.3}, next {:.4}, sibling {:.4}",
                of(sum),
                of(square),
                of(fourth),
                of(with_next),
                of(with_sibling)
            );
            // Five standard errors; a sum of three even numbers has a kurtosis of 2.6.
            let five = 5.0 / f64::from(n).sqrt();
            assert!(of(sum).abs() < five && (of(square) - 1.0).abs() < 2.0 * five);
            assert!((of(fourth) - 2.6).abs() < 0.06);
            assert!(of(with_next).abs() < five && of(with_sibling).abs() < five);
        }
    }

    #[test]
    fn neighbouring_seeds_are_strangers() {
        let mut product = 0.0;
        for seed in 0..10_000 {
            let here = f64::from(Noise::<f32>::new(seed).draws().normal());
            let there = f64::from(Noise::<f32>::new(seed + 1).draws().normal());
            product += here * there;
        }
        assert!((product / 10_000.0).abs() < 0.05, "{product}");
    }
}
