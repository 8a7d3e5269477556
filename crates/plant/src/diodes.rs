//! The bridge with all six switches open: only its free-wheeling diodes conduct.

use control::Real;

use crate::Vector;

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
    let [a, b, c] = shorted.phases();
    let pull = bus_current * R::splat(0.5);
    let highest = a.greatest(b).greatest(c);
    let lowest = a.least(b).least(c);
    let middle = -(highest + lowest);
    // The middle phase floats while |middle| <= 2/3 pull; beyond that it conducts as well.
    let shift = (middle * R::splat(0.5)).within(pull * R::splat(1.0 / 3.0));
    let toward_zero = |current: R| {
        let shifted = current + shift;
        shifted - shifted.within(pull)
    };
    Vector::of_phases([toward_zero(a), toward_zero(b), toward_zero(c)])
}

#[cfg(test)]
mod tests {
    use super::conduct;
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
}
