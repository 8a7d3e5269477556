//! Position over many turns and velocity, from an encoder that is absolute within one.
//!
//! The difference of two readings divided by the period is a coarse velocity: one count in 50 µs is
//! 20,000 counts/s. A first-order low-pass filter smooths it, whose cutoff is proportional to the
//! present velocity between a floor and a ceiling (P3 l.622: "Fc … proportional to the present
//! velocity"; the manual gives no constant). Fast motion gives many counts and needs little
//! smoothing; slow motion gives few.
//!
//! There are two such filters. The reported one may be slow. The loop's own must not be: a velocity
//! loop of bandwidth ω and ζ = 1 crosses over at 2.06 ω with 76° of phase margin (its open loop is
//! (2ωs + ω²)/s²), and the filter takes atan(f crossover / f cutoff) of it. With the floor of
//! [`Cutoff::LOOP`], 500 Hz, a 60 Hz loop keeps 62° and a 100 Hz loop 54°, of which the current loop
//! and the sampling take another 10°. One count then moves the estimate by 2,900 counts/s, which
//! the default gains of an EC-max 22 turn into 79 mA, 11 % of its continuous current.

use crate::{Mask as _, Real};

/// The cutoff frequency of a velocity filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutoff<R: Real> {
    /// Never below this, Hz.
    pub floor_hz: R,
    /// Never above this, Hz. The control rate over 2π is the highest that has an effect.
    pub ceiling_hz: R,
    /// In between: Hz for each turn per second.
    pub hz_per_turn_per_s: R,
}

impl Cutoff<f32> {
    /// Fit for closing a velocity loop of up to 100 Hz.
    pub const LOOP: Self = Self {
        floor_hz: 500.0,
        ceiling_hz: 2_000.0,
        hz_per_turn_per_s: 10.0,
    };
    /// Fit for reporting: 0.13 rpm of noise at 10 rpm, 2.6 rpm at 600 rpm (4,096 counts, 20 kHz).
    pub const REPORTED: Self = Self {
        floor_hz: 5.0,
        ceiling_hz: 1_000.0,
        hz_per_turn_per_s: 10.0,
    };
}

/// 1 − exp(−x) for x between 0 and 1, within 0.0024: the part of the way that a low-pass filter of
/// cutoff ω goes in a period Ts = x/ω. A cubic, so that nothing is looked up or divided.
#[inline(always)]
fn approach<R: Real>(x: R) -> R {
    let one = R::splat(1.0);
    x * (one - x * (R::splat(0.5) - x * R::splat(0.1344)))
}

/// A [`Cutoff`] in the units of the period: 2π·f·Ts. Floor and ceiling are held between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Steps<R: Real> {
    floor: R,
    ceiling: R,
    per_count_per_s: R,
}

impl<R: Real> Steps<R> {
    fn of(cutoff: &Cutoff<R>, period_s: R, counts_per_turn: R) -> Self {
        let omega_period = R::splat(core::f32::consts::TAU) * period_s;
        let bound = |x: R| x.least(R::splat(1.0)).greatest(R::splat(0.0));
        Self {
            floor: bound(cutoff.floor_hz * omega_period),
            ceiling: bound(cutoff.ceiling_hz * omega_period),
            per_count_per_s: cutoff.hz_per_turn_per_s * omega_period / counts_per_turn,
        }
    }

    /// The part of the way at a speed.
    #[inline(always)]
    fn at(&self, speed: R) -> R {
        let x = speed * self.per_count_per_s;
        approach(x.greatest(self.floor).least(self.ceiling))
    }
}

/// What the [`Tracker`] needs of the encoder, computed once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder<R: Real> {
    counts_per_turn: R::Count,
    half_turn: R,
    /// User direction: 1 or −1.
    polarity: R::Count,
    rate_hz: R,
    period_s: R,
    in_loop: Steps<R>,
    reported: Steps<R>,
}

impl<R: Real> Encoder<R> {
    /// An encoder of so many counts per turn, read every `period_s`; `polarity` is 1, or −1 where
    /// the user's positive direction is the encoder's negative one (object 0x607E).
    pub fn new(
        counts_per_turn: R::Count,
        polarity: R::Count,
        period_s: R,
        in_loop: &Cutoff<R>,
        reported: &Cutoff<R>,
    ) -> Self {
        let counts = R::of_count(counts_per_turn);
        Self {
            counts_per_turn,
            half_turn: counts * R::splat(0.5),
            polarity,
            rate_hz: R::splat(1.0) / period_s,
            period_s,
            in_loop: Steps::of(in_loop, period_s, counts),
            reported: Steps::of(reported, period_s, counts),
        }
    }
}

/// Position and velocity in the user's direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracker<R: Real> {
    started: R::Mask,
    named: R::Mask,
    raw: R::Count,
    position: R::Count,
    velocity: R,
    part: R,
    reported: R,
    /// The last reading came from the encoder; else it was foretold.
    seen: R::Mask,
    /// What a foretold position is off the whole count, counts.
    fraction: R,
}

impl<R: Real> Tracker<R> {
    /// Before the first reading, which becomes the position (in the user's direction) unless
    /// [`preset`](Self::preset) named another.
    pub fn new() -> Self {
        Self {
            started: R::Mask::splat(false),
            named: R::Mask::splat(false),
            raw: R::count(0),
            position: R::count(0),
            velocity: R::splat(0.0),
            part: R::splat(0.0),
            reported: R::splat(0.0),
            seen: R::Mask::splat(true),
            fraction: R::splat(0.0),
        }
    }

    /// Takes the encoder's reading, 0 to counts per turn − 1, if it is valid. Between two readings
    /// the shaft moves by less than half a turn.
    ///
    /// In place of an invalid reading stands the one that the last velocity leads to; the velocity
    /// stays. The next valid reading corrects the position, and the velocity follows from the one
    /// after, so what the prediction was off by is not taken for motion.
    #[inline(always)]
    pub fn update(&mut self, encoder: &Encoder<R>, raw: R::Count, valid: R::Mask) {
        let unseen = !(valid & self.seen);
        // A shortcut that changes no bit.
        if unseen.any() {
            let raw = R::count_select(valid, raw, self.foretell(encoder, valid));
            let (velocity, reported) = (self.velocity, self.reported);
            let started = self.started | valid;
            self.take(encoder, raw);
            self.velocity = R::select(unseen, velocity, self.velocity);
            self.reported = R::select(unseen, reported, self.reported);
            self.started = started;
            self.seen = valid;
        } else {
            self.take(encoder, raw);
        }
    }

    /// The reading that the velocity leads to, where there is no valid one.
    fn foretell(&mut self, encoder: &Encoder<R>, valid: R::Mask) -> R::Count {
        let ahead = self.velocity * encoder.period_s + self.fraction;
        let moved = (ahead + R::splat(0.5)).floor();
        self.fraction = R::select(valid, R::splat(0.0), ahead - R::of_count(moved)).sane();
        let raw = R::count_add(self.raw, R::count_mul(moved, encoder.polarity));
        let (turn, beyond) = (encoder.counts_per_turn, R::of_count(raw));
        let above = R::of_count(turn).le(beyond);
        let raw = R::count_select(above, R::count_sub(raw, turn), raw);
        let below = beyond.lt(R::splat(0.0));
        R::count_select(below, R::count_add(raw, turn), raw)
    }

    #[inline(always)]
    fn take(&mut self, encoder: &Encoder<R>, raw: R::Count) {
        let jump = R::count_sub(raw, self.raw);
        // Exact: readings are far below 2²⁴.
        let size = R::of_count(jump);
        let over = encoder.half_turn.le(size);
        let under = size.lt(-encoder.half_turn);
        let short = R::count_select(over, R::count_sub(jump, encoder.counts_per_turn), jump);
        let moved = R::count_select(under, R::count_add(jump, encoder.counts_per_turn), short);
        let within_turn = R::count_mul(raw, encoder.polarity);
        let first = R::count_select(self.named, self.position, within_turn);
        let moved = R::count_mul(moved, encoder.polarity);
        let next = R::count_add(self.position, moved);
        self.position = R::count_select(self.started, next, first);
        let moved = R::count_select(self.started, moved, R::count(0));
        self.raw = raw;
        self.started = R::Mask::splat(true);

        let coarse = R::of_count(moved) * encoder.rate_hz;
        self.part = encoder.in_loop.at(self.velocity.abs());
        self.velocity = (self.velocity + self.part * (coarse - self.velocity)).sane();
        // The cutoff follows the filter's own output. Following the livelier estimate would open
        // the filter just when a count arrives and so read 40 % too fast at 10 rpm.
        let part = encoder.reported.at(self.reported.abs());
        self.reported = (self.reported + part * (coarse - self.reported)).sane();
    }

    /// Position, counts, wrapping.
    #[inline(always)]
    pub fn position(&self) -> R::Count {
        self.position
    }

    /// Velocity for closing a loop, counts/s.
    #[inline(always)]
    pub fn velocity(&self) -> R {
        self.velocity
    }

    /// The part of the way that the loops' filter went in the last period. A demand that goes
    /// through the same filter is as late as the velocity, and can be compared with it.
    #[inline(always)]
    pub fn part(&self) -> R {
        self.part
    }

    /// Velocity for reporting, counts/s.
    pub fn reported(&self) -> R {
        self.reported
    }

    /// The last reading, or what stands in its place.
    #[inline(always)]
    pub fn raw(&self) -> R::Count {
        self.raw
    }

    /// Renames the present position (0x6064 of a P3 is writable).
    pub fn preset(&mut self, position: R::Count) {
        self.position = position;
        self.named = R::Mask::splat(true);
    }

    /// Turns the user's direction round where `mask` is true.
    pub(crate) fn reverse(&mut self, mask: R::Mask) {
        let turned = R::count_sub(R::count(0), self.position);
        self.position = R::count_select(mask, turned, self.position);
        self.velocity = R::select(mask, -self.velocity, self.velocity);
        self.reported = R::select(mask, -self.reported, self.reported);
    }
}

impl<R: Real> Default for Tracker<R> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 50e-6;

    fn encoder(polarity: i32) -> Encoder<f32> {
        Encoder::new(4096, polarity, PERIOD_S, &Cutoff::LOOP, &Cutoff::REPORTED)
    }

    /// Turns at a constant speed for a time; the mean and the deviation of both estimates over the
    /// second half, counts/s.
    fn run(speed: f64, seconds: f64) -> [(f64, f64); 2] {
        let encoder = encoder(1);
        let mut tracker = Tracker::<f32>::new();
        let periods = (seconds / 50e-6) as usize;
        let mut sums = [(0.0, 0.0); 2];
        for period in 0..periods {
            let angle = 0.37 + speed * 50e-6 * period as f64;
            tracker.update(&encoder, angle.rem_euclid(4096.0) as i32, true);
            if period >= periods / 2 {
                for (sum, value) in sums
                    .iter_mut()
                    .zip([tracker.velocity(), tracker.reported()])
                {
                    let off = f64::from(value) - speed;
                    *sum = (sum.0 + off, sum.1 + off * off);
                }
            }
        }
        let n = (periods - periods / 2) as f64;
        sums.map(|(sum, squares)| (sum / n, (squares / n).sqrt()))
    }

    #[test]
    fn approach_is_close_to_the_exponential() {
        for step in 0..=1000 {
            let x = step as f32 / 1000.0;
            let exact = 1.0 - f64::from(-x).exp();
            assert!((f64::from(approach(x)) - exact).abs() < 0.0024, "{x}");
            assert!(step < 50 || (f64::from(approach(x)) / exact - 1.0).abs() < 0.005);
        }
    }

    #[test]
    fn no_cutoff_makes_a_filter_overshoot() {
        for bad in [f32::NAN, f32::INFINITY, -1.0, 1e9] {
            let cutoff = Cutoff {
                floor_hz: bad,
                ceiling_hz: bad,
                hz_per_turn_per_s: bad,
            };
            let steps = Steps::of(&cutoff, PERIOD_S, 4096.0);
            for speed in [0.0, 1e6, f32::NAN] {
                assert!((0.0..=1.0).contains(&steps.at(speed)), "{bad}");
            }
        }
    }

    #[test]
    fn estimates_are_unbiased_and_as_quiet_as_stated() {
        let rpm = 4096.0 / 60.0;
        // Speed, then the deviations allowed to the reported and to the loop's estimate, all in rpm.
        for (speed, reported_rpm, loop_rpm) in [
            (10.0, 0.14, 12.0),
            (-10.0, 0.14, 12.0),
            (600.0, 2.7, 13.0),
            (6000.0, 25.0, 25.0),
            (-12_900.0, 30.0, 50.0),
        ] {
            let [fast, slow] = run(speed * rpm, 2.0);
            let got = [fast.0, fast.1, slow.0, slow.1].map(|value| value / rpm);
            std::println!("{speed} rpm: loop mean, sd, reported mean, sd: {got:.3?}");
            let bias = 0.1 + 1e-4 * speed.abs();
            assert!(
                got[0].abs() < bias && got[2].abs() < bias,
                "{speed}: {got:?}"
            );
            assert!(
                got[1] < loop_rpm && got[3] < reported_rpm,
                "{speed}: {got:?}"
            );
        }
    }

    #[test]
    fn position_counts_turns_both_ways_and_wraps() {
        let encoder = encoder(1);
        let mut tracker = Tracker::<f32>::new();
        tracker.update(&encoder, 4000, true);
        assert_eq!((tracker.position(), tracker.velocity()), (4000, 0.0));
        for (raw, position) in [
            (100, 4196),
            (2147, 6243), // half a turn less one forward
            (100, 4196),  // and back
            (4090, 4090), // backward over the turn's end
            (2042, 2042),
            (4089, 4089),
        ] {
            tracker.update(&encoder, raw, true);
            assert_eq!(tracker.position(), position, "at {raw}");
        }
        tracker.preset(i32::MAX);
        tracker.update(&encoder, 4090, true);
        assert_eq!(tracker.position(), i32::MIN);
    }

    #[test]
    fn a_reversed_user_direction_reverses_everything() {
        let reversed = encoder(-1);
        let mut tracker = Tracker::<f32>::new();
        tracker.update(&reversed, 10, true);
        tracker.update(&reversed, 13, true);
        assert_eq!((tracker.position(), tracker.raw()), (-13, 13));
        assert!(tracker.velocity() < 0.0 && tracker.reported() < 0.0);
        let before = tracker.velocity();
        tracker.reverse(true);
        assert_eq!((tracker.position(), tracker.velocity()), (13, -before));
    }

    #[test]
    fn invalid_readings_are_foretold_and_do_not_jerk() {
        for polarity in [1, -1] {
            for speed in [3_000.0, -880_000.0] {
                let encoder = encoder(polarity);
                let mut tracker = Tracker::<f32>::new();
                let angle = |period: i32| speed * 50e-6 * f64::from(period) + 0.5;
                let (mut worst, mut jerk) = (0.0_f64, 0.0_f32);
                for period in 0..4_000 {
                    // Every other ms blind, after the estimate has settled.
                    let valid = period < 2_000 || period % 40 < 20;
                    let raw = if valid {
                        angle(period).floor().rem_euclid(4096.0) as i32
                    } else {
                        1_234
                    };
                    let before = tracker.velocity();
                    tracker.update(&encoder, raw, valid);
                    assert!((0..4096).contains(&tracker.raw()));
                    if period >= 2_000 {
                        let off = f64::from(tracker.position())
                            - f64::from(polarity) * (angle(period) - angle(0));
                        worst = if off.abs() > worst { off.abs() } else { worst };
                        if !valid {
                            assert_eq!(tracker.velocity(), before);
                        }
                        jerk = jerk.greatest((tracker.velocity() - before).abs());
                    }
                }
                std::println!("{speed} counts/s: {worst:.1} counts off, jerk {jerk:.0} counts/s");
                // A ms at what the estimate is off by, and two roundings.
                assert!(worst < 6.0, "{worst}");
                assert!(jerk < 6_000.0, "{jerk}");
            }
        }
    }

    #[test]
    fn without_a_first_reading_nothing_moves() {
        let encoder = encoder(1);
        let mut tracker = Tracker::<f32>::new();
        for _ in 0..10 {
            tracker.update(&encoder, 77, false);
            assert_eq!((tracker.position(), tracker.velocity()), (0, 0.0));
        }
        tracker.update(&encoder, 3_000, true);
        assert_eq!((tracker.position(), tracker.velocity()), (3_000, 0.0));
        tracker.update(&encoder, 3_001, true);
        assert_eq!(tracker.position(), 3_001);
        assert!(tracker.velocity() > 0.0);
    }

    #[test]
    fn a_preset_before_the_first_reading_holds() {
        let encoder = encoder(1);
        let mut tracker = Tracker::<f32>::new();
        tracker.preset(-70_000);
        tracker.update(&encoder, 3333, true);
        assert_eq!((tracker.position(), tracker.velocity()), (-70_000, 0.0));
        tracker.update(&encoder, 3330, true);
        assert_eq!(tracker.position(), -70_003);
    }
}
