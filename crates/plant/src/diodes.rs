//! The bridge with all six switches open: only its free-wheeling diodes conduct.

use control::Real;

use crate::Vector;
use crate::vector::INVERSE_SQRT_3;

/// Current at the end of a period in which only the diodes conduct.
///
/// `shorted` is the current that the winding would have at the end of the period with no voltage at
/// its terminals ([`crate::Winding::shorted`]), and `bus_current` the amperes by which the bus
/// voltage, two diode drops included, changes a current in one period (gain · voltage).
///
/// A phase whose current flows into the motor hangs on the negative rail through its lower diode, a
/// phase whose current flows out hangs on the positive rail through its upper one, and a phase
/// without current floats wherever it must between the rails. Of these states the one is taken that
/// is consistent with the currents at the *end* of the period (implicit step). This covers
/// free-wheeling (the currents run down against the bus and reach zero in finite time), the open
/// circuit (nothing flows while the EMF between two lines is below the bus), and rectification
/// (above it). A diode therefore opens at the end of the period in which its current ends, and none
/// ever takes more out of the winding than is there.
///
/// The consistent state is the minimum of ½|i - i_shorted|² + t (|i_a| + |i_b| + |i_c|) with
/// t = bus_current/2 and i_a + i_b + i_c = 0: every phase is pulled toward zero by t around a
/// common star-point shift, which follows from the middle one of the three currents.
#[inline(always)]
pub fn conduct<R: Real>(shorted: Vector<R>, bus_current: R) -> Vector<R> {
    pulled(shorted, bus_current * R::splat(0.5)).current
}

/// Currents at the end of a period in which diodes had a part, and what they did to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulled<R: Real> {
    /// Current at the end of the period.
    pub current: Vector<R>,
    /// What the diodes have taken off the current of each phase, A, but for a common part: the mean
    /// voltage that they put against it, times the gain of the winding.
    pub taken: [R; 3],
}

impl<R: Real> Pulled<R> {
    /// `a` where `mask` is true, else `b`.
    #[inline(always)]
    pub fn select(mask: R::Mask, a: Self, b: Self) -> Self {
        let ([a0, a1, a2], [b0, b1, b2]) = (a.taken, b.taken);
        Self {
            current: Vector::select(mask, a.current, b.current),
            taken: [
                R::select(mask, a0, b0),
                R::select(mask, a1, b1),
                R::select(mask, a2, b2),
            ],
        }
    }
}

/// Current at the end of a period in which every phase is pulled toward zero by up to `pull`, A: the
/// minimum of [`conduct`]'s sum for t = `pull`.
#[inline(always)]
pub fn pulled<R: Real>(shorted: Vector<R>, pull: R) -> Pulled<R> {
    let [a, b, c] = shorted.phases();
    let highest = a.greatest(b).greatest(c);
    let lowest = a.least(b).least(c);
    let middle = -(highest + lowest);
    // The middle phase floats while |middle| <= 2/3 pull; beyond that it conducts as well.
    let shift = (middle * R::splat(0.5)).within(pull * R::splat(1.0 / 3.0));
    let (a, b, c) = (a + shift, b + shift, c + shift);
    let taken = [a.within(pull), b.within(pull), c.within(pull)];
    let [taken_a, taken_b, taken_c] = taken;
    // Their sum is zero: the shift has seen to that.
    Pulled {
        current: Vector {
            alpha: a - taken_a,
            beta: ((b - taken_b) - (c - taken_c)) * R::splat(INVERSE_SQRT_3),
        },
        taken,
    }
}

/// The bits of [`pulled`] where all three phases conduct, each on its way since `before`, and whether
/// they do. The directions are known before `shorted` is, so that less has to wait for it.
#[inline(always)]
pub fn pulled_on<R: Real>(before: Vector<R>, shorted: Vector<R>, pull: R) -> (Pulled<R>, R::Mask) {
    let zero = R::splat(0.0);
    let taken = before
        .phases()
        .map(|current| R::select(current.lt(zero), -pull, pull));
    let [taken_a, taken_b, taken_c] = taken;
    // Two of them have one sign, and the middle one is of the two.
    let shift = (taken_a + taken_b + taken_c) * R::splat(1.0 / 3.0);
    let [a, b, c] = shorted.phases();
    let left = |current: R, taken: R| (current + shift) - taken;
    let (a, b, c) = (left(a, taken_a), left(b, taken_b), left(c, taken_c));
    let on = |current: R, taken: R| zero.lt(current * taken);
    let conduct = on(a, taken_a) & on(b, taken_b) & on(c, taken_c);
    let current = Vector {
        alpha: a,
        beta: (b - c) * R::splat(INVERSE_SQRT_3),
    };
    (Pulled { current, taken }, conduct)
}

/// How far a phase is pulled, A: down while its current is positive, and up while it is negative. It
/// floats in between. `down` may be negative as long as it is not less than minus `up`; a phase that
/// hangs on a fixed potential has `down` = -`up`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull<R: Real> {
    /// Taken off a current into the motor, A.
    pub down: R,
    /// Added to a current out of the motor, A.
    pub up: R,
}

/// As [`pulled`], with a pull of its own for each phase and sense. Slow: for the rare moments in
/// which the phases differ.
///
/// The common shift λ is where the sum of the three currents, each continuous, rising and straight
/// between its two corners, is zero: all six corners are tried, and λ lies between two of them or
/// beyond the last on a known slope.
pub fn pulled_unequally<R: Real>(shorted: Vector<R>, pulls: [Pull<R>; 3]) -> Pulled<R> {
    let currents = shorted.phases();
    let [i_a, i_b, i_c] = currents;
    let [pull_a, pull_b, pull_c] = pulls;
    let zero = R::splat(0.0);
    let rest = |current: R, pull: Pull<R>| {
        let above = pull.down.lt(current);
        let below = current.lt(-pull.up);
        let sinking = R::select(below, current + pull.up, zero);
        R::select(above, current - pull.down, sinking)
    };
    let sum = |shift: R| {
        rest(i_a + shift, pull_a) + rest(i_b + shift, pull_b) + rest(i_c + shift, pull_c)
    };
    let corners = [
        pull_a.down - i_a,
        -pull_a.up - i_a,
        pull_b.down - i_b,
        -pull_b.up - i_b,
        pull_c.down - i_c,
        -pull_c.up - i_c,
    ];
    // The corners next to the root: the highest with a sum up to zero, the lowest with one from zero.
    let far = R::splat(1e30);
    let (mut low, mut low_sum, mut high, mut high_sum) = (-far, zero, far, zero);
    for corner in corners {
        let at = sum(corner);
        let lower = at.le(zero) & low.le(corner);
        low = R::select(lower, corner, low);
        low_sum = R::select(lower, at, low_sum);
        let higher = zero.le(at) & corner.le(high);
        high = R::select(higher, corner, high);
        high_sum = R::select(higher, at, high_sum);
    }
    // Beyond the last corner all three conduct.
    let third = R::splat(1.0 / 3.0);
    let no_low = low.le(-far);
    let no_high = far.le(high);
    let rise = high_sum - low_sum;
    let flat = rise.le(zero);
    let part = (high - low) / R::select(flat, R::splat(1.0), rise);
    // From the end with the smaller sum, where less is rounded.
    let from_high = high - high_sum * part;
    let from_low = low - low_sum * part;
    let between = R::select(high_sum.lt(-low_sum), from_high, from_low);
    let between = R::select(flat, low, between);
    let shift = R::select(no_low, high - high_sum * third, between);
    let shift = R::select(no_high, low - low_sum * third, shift);
    let [a, b, c] = [
        rest(i_a + shift, pull_a),
        rest(i_b + shift, pull_b),
        rest(i_c + shift, pull_c),
    ];
    Pulled {
        current: Vector::of_phases([a, b, c]),
        taken: [i_a + shift - a, i_b + shift - b, i_c + shift - c],
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Pull, conduct, pulled, pulled_on, pulled_unequally};
    use crate::Vector;

    fn phases(shorted: [f32; 3], bus_current: f32) -> [f32; 3] {
        conduct(Vector::of_phases(shorted), bus_current).phases()
    }

    fn assert_close(actual: [f32; 3], expected: [f32; 3]) {
        for (a, e) in actual.into_iter().zip(expected) {
            assert!((a - e).abs() < 2e-6, "{actual:?}, expected {expected:?}");
        }
    }

    #[test]
    fn three_conducting_phases_see_thirds_of_the_bus() {
        // A flows in (lower diode: 0 V); B and C flow out (upper diodes: V). Phase voltages are
        // -2/3 V, +1/3 V, +1/3 V.
        assert_close(
            phases([3.0, -1.0, -2.0], 0.6),
            [3.0 - 0.4, -1.0 + 0.2, -2.0 + 0.2],
        );
        assert_close(
            phases([-3.0, 1.0, 2.0], 0.6),
            [-3.0 + 0.4, 1.0 - 0.2, 2.0 - 0.2],
        );
    }

    #[test]
    fn two_conducting_phases_share_the_bus_and_the_third_floats() {
        assert_close(phases([2.0, -2.0, 0.0], 0.6), [1.7, -1.7, 0.0]);
        assert_close(phases([-1.95, -0.05, 2.0], 0.6), [-1.675, 0.0, 1.675]);
    }

    #[test]
    fn nothing_flows_below_the_bus() {
        assert_close(phases([0.29, -0.29, 0.0], 0.6), [0.0; 3]);
        assert_close(phases([0.3, -0.15, -0.15], 0.6), [0.0; 3]);
        assert_eq!(phases([0.3, -0.1, -0.2], 1e9), [0.0; 3]);
    }

    #[test]
    fn the_chosen_state_obeys_every_diode() {
        // For a grid of currents: recover the terminal voltages from the change of the currents and
        // check each diode's law against the rails (in amperes: 0 and bus_current).
        let bus = 0.5_f32;
        for i in -20..=20 {
            for k in -20..=20 {
                let (a, b) = (i as f32 * 0.07, k as f32 * 0.07);
                let before = [a, b, -a - b];
                let after = phases(before, bus);
                let change: [f32; 3] = core::array::from_fn(|n| after[n] - before[n]);
                // Terminal = change + star point. The star point is fixed by a conducting phase.
                let flowing = (0..3).find(|&n| after[n].abs() > 1e-5);
                let Some(n) = flowing else {
                    let spread = before
                        .iter()
                        .fold(f32::MIN, |m, &x| if x > m { x } else { m })
                        - before
                            .iter()
                            .fold(f32::MAX, |m, &x| if x < m { x } else { m });
                    assert!(spread <= bus + 1e-5);
                    continue;
                };
                let star = if after[n] > 0.0 {
                    -change[n]
                } else {
                    bus - change[n]
                };
                for n in 0..3 {
                    let terminal = change[n] + star;
                    if after[n] > 1e-5 {
                        assert!(terminal.abs() < 1e-5, "{before:?} {after:?}");
                    } else if after[n] < -1e-5 {
                        assert!((terminal - bus).abs() < 1e-5, "{before:?} {after:?}");
                    } else {
                        assert!(
                            terminal > -1e-5 && terminal < bus + 1e-5,
                            "{before:?} {after:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn equal_pulls_are_the_same_either_way() {
        for i in -20..=20 {
            for k in -20..=20 {
                let (a, b) = (i as f32 * 0.07, k as f32 * 0.07);
                let before = Vector::of_phases([a, b, -a - b]);
                let quick = pulled(before, 0.25);
                let slow = pulled_unequally(
                    before,
                    [Pull {
                        down: 0.25,
                        up: 0.25,
                    }; 3],
                );
                assert_close(quick.current.phases(), slow.current.phases());
                assert_close(quick.current.phases(), conduct(before, 0.5).phases());
                let line = |taken: [f32; 3]| [taken[0] - taken[1], taken[1] - taken[2], 0.0];
                assert_close(line(quick.taken), line(slow.taken));
            }
        }
    }

    /// The sum that the unequal pulls minimise, in f64.
    fn cost(before: [f64; 3], after: [f64; 3], pulls: [(f64, f64); 3]) -> f64 {
        (0..3)
            .map(|n| {
                let square = (after[n] - before[n]).powi(2) / 2.0;
                let (down, up) = pulls[n];
                // A rounded zero is a zero, however steep it is beside it.
                let after = if after[n].abs() < 1e-6 { 0.0 } else { after[n] };
                square + if after > 0.0 { down } else { -up } * after
            })
            .sum()
    }

    #[test]
    fn unequal_pulls_find_the_minimum() {
        // Rails and narrow pulses; a phase on a rail with the bus there and without (1e6 A).
        let cases = [
            [(0.2, 0.2), (0.0, 0.2), (0.2, 0.1)],
            [(0.0, 0.0), (0.2, 0.2), (0.2, 0.2)],
            [(0.0, 0.0), (0.0, 0.5), (0.0, 0.5)],
            [(0.5, 0.0), (0.0, 0.0), (0.5, 0.0)],
            [(0.0, 0.0), (0.0, 1e6), (0.0, 1e6)],
            [(0.3, -0.3), (0.3, 0.3), (0.3, 0.3)],
        ];
        for pulls in cases {
            for i in -12..=12 {
                for k in -12..=12 {
                    let (a, b) = (i as f32 * 0.11, k as f32 * 0.11);
                    let before = [a, b, -a - b];
                    let limits = pulls.map(|(down, up): (f64, f64)| Pull {
                        down: down as f32,
                        up: up as f32,
                    });
                    let got = pulled_unequally(Vector::of_phases(before), limits);
                    let after = got.current.phases().map(f64::from);
                    let before = before.map(f64::from);
                    let best = cost(before, after, pulls);
                    // No neighbour of sum zero is lower.
                    for step in [1e-3, -1e-3, 0.1, -0.1] {
                        for (up, down) in [(0, 1), (1, 2), (2, 0)] {
                            let mut other = after;
                            other[up] += step;
                            other[down] -= step;
                            let there = cost(before, other, pulls);
                            assert!(best <= there + 2e-6, "{pulls:?} {before:?} {after:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn where_all_conduct_the_short_way_has_the_same_bits() {
        let (mut conducting, mut others) = (0, 0);
        let mut random = 1_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 8_388_608.0 - 1.0
        };
        for _ in 0..100_000 {
            let (before, driven) = ([next(), next(), next()], [next(), next(), next()]);
            let (before, driven) = (Vector::of_phases(before), Vector::of_phases(driven));
            let pull = 0.2 * next().abs();
            let (on, conduct) = pulled_on(before, driven, pull);
            if conduct {
                conducting += 1;
                assert_eq!(on, pulled(driven, pull), "{before:?} {driven:?} {pull}");
            } else {
                others += 1;
            }
        }
        // A direction of six, but where a current is about zero.
        assert!(conducting > 10_000 && others > 50_000, "{conducting}");
    }
}
