//! I²t: peak current for a while, then continuous current.
//!
//! The P3's rule (l.610-616): Energy += (I² − Ic²)·dt with I the commanded current, and while the
//! energy exceeds a limit the command is held to the continuous current Ic. What the manual leaves
//! open is decided here:
//!
//! - I is the current after all limits. With the raw command the energy of a blocked axis would
//!   grow without end.
//! - The energy never falls below 0: rest does not earn credit.
//! - Once tripped, the limit stays until the energy has fallen to half its limit. A command above
//!   Ic is by then held to Ic, where the energy stands still, so the limit stays as long as the
//!   command does; after a rest, at least half of the peak time is available again. So the limit
//!   cannot chatter.
//!
//! The manual's energy limit is Ip·tp, in A s, where the energy is in A² s; at 3.5 A peak, 0.716 A
//! continuous and 0.5 s it trips after 0.149 s. [`I2t::literal`] chooses between that and the
//! dimensionally right limit (Ip² − Ic²)·tp, which lasts for the peak time.
//!
//! The sum is kept in integers of Ip²·(control period)·2⁻²⁴, so that nothing drifts: an `f32` sum
//! would stand still after a minute.

use crate::{Mask as _, Real};

/// Settings of the limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct I2t<R: Real> {
    /// Whether it acts at all. Its peak current limits also while it is cold.
    pub enabled: R::Mask,
    /// Whether the energy limit is the manual's Ip·tp, else (Ip² − Ic²)·tp.
    pub literal: R::Mask,
    /// Current that may flow for ever, A.
    pub continuous_a: R,
    /// Current that may flow for the peak time, A.
    pub peak_a: R,
    /// Peak time, s.
    pub peak_time_s: R,
}

/// The settings in the units of the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct I2tLimits<R: Real> {
    enabled: R::Mask,
    continuous_a: R,
    peak_a: R,
    continuous_square: R,
    /// 2²⁴/Ip².
    scale: R,
    /// Periods at Ip² that make the energy limit.
    limit: R,
}

/// Part of the energy limit at which a tripped limit releases.
pub const RELEASE: f32 = 0.5;

/// Units of the sum in Ip²·(control period).
const UNITS: f32 = 16_777_216.0;

impl<R: Real> I2tLimits<R> {
    /// For a control period in s.
    pub fn new(settings: &I2t<R>, period_s: R) -> Self {
        let peak_square = settings.peak_a * settings.peak_a;
        let continuous_square = settings.continuous_a * settings.continuous_a;
        let dimensional = (peak_square - continuous_square) * settings.peak_time_s;
        let literal = settings.peak_a * settings.peak_time_s;
        let energy = R::select(settings.literal, literal, dimensional);
        Self {
            enabled: settings.enabled,
            continuous_a: settings.continuous_a,
            peak_a: settings.peak_a,
            continuous_square,
            scale: R::splat(UNITS) / peak_square,
            limit: energy / (peak_square * period_s),
        }
    }
}

/// The sum and whether it has tripped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct I2tSum<R: Real> {
    /// Whole periods at Ip².
    periods: R::Count,
    /// The rest, 0 to 2²⁴ − 1.
    rest: R::Count,
    tripped: R::Mask,
}

impl<R: Real> I2tSum<R> {
    /// Cold.
    pub fn new() -> Self {
        Self {
            periods: R::count(0),
            rest: R::count(0),
            tripped: R::Mask::splat(false),
        }
    }

    /// The current that may be commanded now, A.
    #[inline(always)]
    pub fn limit(&self, limits: &I2tLimits<R>) -> R {
        let hot = R::select(self.tripped, limits.continuous_a, limits.peak_a);
        // A peak below the continuous current is the lower limit of the two.
        let allowed = hot.least(limits.peak_a);
        R::select(limits.enabled, allowed, R::splat(f32::MAX))
    }

    /// Whether the command is now held to the continuous current.
    #[inline(always)]
    pub fn active(&self) -> R::Mask {
        self.tripped
    }

    /// Adds one period at the square of a current, A².
    #[inline(always)]
    pub fn add(&mut self, limits: &I2tLimits<R>, square: R) {
        let bound = R::splat(UNITS * 16.0);
        let more = (square - limits.continuous_square) * limits.scale;
        let rest = R::count_add(self.rest, more.sane().within(bound).to_count());
        let carry = R::count_shift_right(rest, 24);
        let periods = R::count_add(self.periods, carry);
        let rest = R::count_sub(rest, R::count_mul(carry, R::count(1 << 24)));
        // Far above any limit, but far below wrapping.
        let full = R::splat(1e9).le(R::of_count(periods));
        let periods = R::count_select(full, self.periods, periods);
        let below = R::of_count(periods).lt(R::splat(0.0)) | !limits.enabled;
        self.periods = R::count_select(below, R::count(0), periods);
        self.rest = R::count_select(below, R::count(0), rest);

        let energy = R::of_count(self.periods) + R::of_count(self.rest) * R::splat(1.0 / UNITS);
        let over = limits.limit.lt(energy);
        let held = (limits.limit * R::splat(RELEASE)).lt(energy);
        self.tripped = limits.enabled & (over | (self.tripped & held));
    }
}

impl<R: Real> Default for I2tSum<R> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 50e-6;

    fn settings(literal: bool, peak_a: f32, peak_time_s: f32) -> I2t<f32> {
        I2t {
            enabled: true,
            literal,
            continuous_a: 0.716,
            peak_a,
            peak_time_s,
        }
    }

    /// Periods from cold until the limit trips under a constant command.
    fn trip(limits: &I2tLimits<f32>, command_a: f32) -> Option<u32> {
        let mut sum = I2tSum::new();
        for period in 1..=400_000 {
            let current = command_a.within(sum.limit(limits));
            sum.add(limits, current * current);
            if sum.active() {
                return Some(period);
            }
        }
        None
    }

    #[test]
    fn trip_times_are_exact_to_one_period() {
        // Literal: t = Ip·tp/(I² − Ic²); dimensional: t = (Ip² − Ic²)·tp/(I² − Ic²).
        for (literal, peak, time, command, seconds) in [
            (true, 3.5, 0.5, 3.5, 1.75 / (12.25 - 0.512_656)), // 0.1491 s, P3 l.610
            (true, 2.0, 1.0, 2.0, 2.0 / (4.0 - 0.512_656)),    // 0.5735 s
            (true, 3.5, 0.5, 9.0, 1.75 / (12.25 - 0.512_656)), // held at the peak
            (true, 3.5, 0.5, 1.0, 1.75 / (1.0 - 0.512_656)),
            (false, 3.5, 0.5, 3.5, 0.5),
            (false, 3.5, 0.5, -3.5, 0.5),
            (false, 2.0, 1.0, 1.0, (4.0 - 0.512_656) / (1.0 - 0.512_656)),
        ] {
            let limits = I2tLimits::new(&settings(literal, peak, time), PERIOD_S);
            let periods = trip(&limits, command).unwrap();
            let exact = seconds / 50e-6_f64;
            assert!(
                (f64::from(periods) - exact).abs() <= 1.0 + 2e-6 * exact,
                "{command} A of {peak} A: {periods} periods, exactly {exact}"
            );
        }
    }

    #[test]
    fn continuous_current_never_trips_and_peak_is_never_exceeded() {
        for literal in [true, false] {
            let limits = I2tLimits::new(&settings(literal, 3.5, 0.5), PERIOD_S);
            assert_eq!(trip(&limits, 0.716), None);
            assert_eq!(I2tSum::new().limit(&limits), 3.5);
        }
    }

    #[test]
    fn nothing_drifts_in_an_hour_of_alternation() {
        // 1 A and 0.1775… A in turn average exactly Ic² when their squares do.
        let limits = I2tLimits::new(&settings(true, 3.5, 0.5), PERIOD_S);
        let low_square = 2.0 * 0.512_656 - 1.0;
        let mut sum = I2tSum::<f32>::new();
        for _ in 0..36_000_000 {
            sum.add(&limits, 1.0);
            sum.add(&limits, low_square);
        }
        // Rounding each addition to 2⁻²⁴ may leave at most one unit each: 72·10⁶/2²⁴ periods.
        assert!(sum.periods <= 5, "{sum:?}");
        assert!(!sum.active());
    }

    #[test]
    fn the_limit_stays_until_half_the_energy_has_gone() {
        let limits = I2tLimits::new(&settings(false, 2.0, 1.0), PERIOD_S);
        let mut sum = I2tSum::<f32>::new();
        let mut changes = 0;
        let mut last = false;
        // The command stays at 2 A for five seconds: one trip, no release.
        for _ in 0..100_000 {
            let current = 2.0_f32.within(sum.limit(&limits));
            sum.add(&limits, current * current);
            changes += u32::from(sum.active() != last);
            last = sum.active();
        }
        assert_eq!((changes, last), (1, true));
        assert_eq!(sum.limit(&limits), 0.716);
        // At rest the energy falls by Ic² a second: half of (4 − 0.5127) A²s takes 3.401 s.
        let mut rest = 0_u32;
        while sum.active() {
            sum.add(&limits, 0.0);
            rest += 1;
        }
        let exact = 0.5 * (4.0 - 0.512_656) / 0.512_656 / 50e-6;
        // The last period at the peak may have overshot by 4 A², which takes eight to cool.
        assert!((f64::from(rest) - exact).abs() <= 9.0, "{rest} {exact}");
        // Then the peak lasts for half its time.
        let mut again = 0;
        while !sum.active() {
            sum.add(&limits, 4.0);
            again += 1;
        }
        assert!((again - 10_000_i32).abs() <= 1, "{again}");
    }

    #[test]
    fn rest_earns_no_credit_and_off_is_off() {
        let limits = I2tLimits::new(&settings(false, 3.5, 0.5), PERIOD_S);
        let mut sum = I2tSum::<f32>::new();
        for _ in 0..1_000_000 {
            sum.add(&limits, 0.0);
        }
        assert_eq!(sum, I2tSum::new());
        let off = I2tLimits::new(
            &I2t {
                enabled: false,
                ..settings(true, 3.5, 0.5)
            },
            PERIOD_S,
        );
        assert_eq!(trip(&off, 100.0), None);
        assert!(I2tSum::<f32>::new().limit(&off) > 1e30);
    }

    #[test]
    fn broken_numbers_do_not_wedge_it() {
        for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            let limits = I2tLimits::new(&settings(true, bad, bad), PERIOD_S);
            let mut sum = I2tSum::<f32>::new();
            for square in [bad, 1.0, f32::MAX, 0.0] {
                sum.add(&limits, square);
            }
        }
        let limits = I2tLimits::new(&settings(true, 3.5, 0.5), PERIOD_S);
        let mut sum = I2tSum::<f32>::new();
        sum.add(&limits, f32::NAN);
        sum.add(&limits, f32::INFINITY);
        for _ in 0..1_000_000 {
            sum.add(&limits, 0.0);
        }
        assert_eq!(sum, I2tSum::new());
    }
}
