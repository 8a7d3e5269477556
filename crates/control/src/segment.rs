//! The segment in force: where its demand stands, advanced every control period.

use crate::{Command, Real};

/// Periods for which the slope of a position demand still feeds forward when its segment has ended
/// and none follows, while the position rests at the segment's end. A set-point that comes a little
/// late, as SYNC and frames do, then makes no pulse of current.
const PATIENCE: i32 = 2;

/// Where the demand of a segment stands and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment<R: Real> {
    pub(crate) position: R::Count,
    pub(crate) fraction: R,
    pub(crate) velocity: R,
    pub(crate) current: R,
    /// Current for the acceleration, while it lasts.
    pub(crate) acceleration_current: R,
    acceleration: R,
    current_slope: R,
    /// Periods for which the slopes still hold; below 0, for how many they have not.
    left: R::Count,
    /// The velocity is the slope of a position demand.
    of_position: R::Mask,
}

impl<R: Real> Segment<R> {
    /// The start of a segment.
    pub(crate) fn of(command: &Command<R>) -> Self {
        let lasts = R::splat(0.0).lt(R::of_count(command.periods));
        let holds = command.position_loop & !lasts;
        let zero = R::splat(0.0);
        Self {
            position: command.position,
            fraction: command.fraction.sane(),
            velocity: R::select(holds, zero, command.velocity).sane(),
            current: command.current.sane(),
            acceleration_current: R::select(lasts, command.acceleration_current, zero).sane(),
            acceleration: command.acceleration.sane(),
            current_slope: command.current_slope.sane(),
            left: command.periods,
            of_position: command.position_loop,
        }
    }

    /// The position demand is the position itself where `mask` is true.
    #[inline(always)]
    pub(crate) fn follow(&mut self, mask: R::Mask, position: R::Count) {
        self.position = R::count_select(mask, position, self.position);
        self.fraction = R::select(mask, R::splat(0.0), self.fraction);
    }

    /// Goes on by one period of `period_s`, exactly on the parabola: the step of a period is
    /// v·Ts + a·Ts²/2. The sum is kept below one count, so it does not lose digits as the position
    /// grows; 20 periods at 880,000 counts/s end within 10⁻⁴ counts.
    #[inline(always)]
    pub(crate) fn advance(&mut self, period_s: R) {
        let zero = R::splat(0.0);
        let moving = zero.lt(R::of_count(self.left));
        let gain = R::select(moving, self.acceleration * period_s, zero);
        let mean = self.velocity + gain * R::splat(0.5);
        let step = R::select(moving & self.of_position, mean * period_s, zero);
        let sum = self.fraction + step;
        let whole = sum.floor();
        self.position = R::count_add(self.position, whole);
        // Just below a whole count the difference may round up to 1.
        const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
        let fraction = sum - R::of_count(whole);
        self.fraction = fraction.sane().least(R::splat(BELOW_ONE)).greatest(zero);
        self.current += R::select(moving, self.current_slope * period_s, zero);

        let goes_on = R::splat((1 - PATIENCE) as f32).lt(R::of_count(self.left));
        let left = R::count_sub(self.left, R::count(1));
        self.left = R::count_select(goes_on, left, self.left);
        self.velocity = R::select(self.of_position & !goes_on, zero, self.velocity + gain);
        self.acceleration_current = R::select(goes_on, self.acceleration_current, zero);
    }

    /// Periods for which the slopes still hold, not negative.
    pub(crate) fn periods_left(&self) -> R::Count {
        let moving = R::splat(0.0).lt(R::of_count(self.left));
        R::count_select(moving, self.left, R::count(0))
    }

    /// Turns the user's direction round where `mask` is true. To within a count: the whole counts
    /// of a negative position lie below it.
    pub(crate) fn reverse(&mut self, mask: R::Mask) {
        let turn = |value: R| R::select(mask, -value, value);
        self.velocity = turn(self.velocity);
        self.acceleration = turn(self.acceleration);
        self.current = turn(self.current);
        self.current_slope = turn(self.current_slope);
        self.acceleration_current = turn(self.acceleration_current);
        let zero = R::count(0);
        let turned = R::count_sub(zero, self.position);
        // −(n + f) = −n − 1 + (1 − f)
        let partial = mask & R::splat(0.0).lt(self.fraction);
        let below = R::count_sub(turned, R::count(1));
        let turned = R::count_select(partial, below, turned);
        self.position = R::count_select(mask, turned, self.position);
        self.fraction = R::select(partial, R::splat(1.0) - self.fraction, self.fraction);
    }

    /// Renames the position: it grows by `offset`.
    pub(crate) fn shift(&mut self, offset: R::Count) {
        self.position = R::count_add(self.position, offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 50e-6;

    fn exact(command: &Command<f32>, periods: u32) -> f64 {
        let t = f64::from(periods) * 50e-6;
        f64::from(command.position)
            + f64::from(command.fraction)
            + f64::from(command.velocity) * t
            + f64::from(command.acceleration) * t * t / 2.0
    }

    #[test]
    fn a_millisecond_ends_within_a_ten_thousandth_count() {
        for (velocity, acceleration) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (-1.0, 3.0),
            (12_345.678, -2e6),
            (880_640.0, 2e6),
            (-880_640.0, -2e6),
            (-333.3, 4e7),
        ] {
            let command = Command::<f32> {
                position_loop: true,
                position: 2_000_000_000,
                fraction: 0.25,
                velocity,
                acceleration,
                periods: 20,
                ..Command::idle()
            };
            let mut segment = Segment::of(&command);
            for period in 0..=25 {
                let got = f64::from(segment.position) + f64::from(segment.fraction);
                let wanted = exact(&command, period.min(20));
                assert!((got - wanted).abs() < 1e-4, "{got} {wanted}");
                assert!((0.0..1.0).contains(&segment.fraction));
                // The slope still feeds forward for the two periods after the end.
                if period >= 22 {
                    assert_eq!(segment.velocity, 0.0);
                } else {
                    let period = period.min(20);
                    let slope =
                        f64::from(velocity) + f64::from(acceleration) * 50e-6 * f64::from(period);
                    assert!((f64::from(segment.velocity) - slope).abs() < 1.0);
                }
                segment.advance(PERIOD_S);
            }
        }
    }

    #[test]
    fn position_wraps() {
        let command = Command::<f32> {
            position_loop: true,
            position: i32::MAX,
            fraction: 0.5,
            velocity: 20_000.0,
            periods: 1,
            ..Command::idle()
        };
        let mut segment = Segment::of(&command);
        segment.advance(PERIOD_S);
        assert_eq!(segment.position, i32::MIN);
        assert!((segment.fraction - 0.5).abs() < 1e-6);
    }

    #[test]
    fn velocity_and_current_demands_stay_when_their_slopes_end() {
        let command = Command::<f32> {
            velocity_loop: true,
            velocity: 100.0,
            acceleration: 1e6,
            current: 0.5,
            current_slope: -1000.0,
            acceleration_current: 0.25,
            periods: 4,
            ..Command::idle()
        };
        let mut segment = Segment::of(&command);
        for period in 0..10 {
            // That of the acceleration ends two periods after it.
            let wanted = if period < 6 { 0.25 } else { 0.0 };
            assert_eq!(segment.acceleration_current, wanted);
            segment.advance(PERIOD_S);
        }
        assert!((segment.velocity - 300.0).abs() < 1e-3);
        assert!((segment.current - 0.3).abs() < 1e-6);
        assert_eq!(segment.position, 0);
    }

    #[test]
    fn a_segment_of_no_periods_stands_still() {
        let command = Command::<f32> {
            position_loop: true,
            position: 7,
            velocity: 1e6,
            acceleration: 1e9,
            ..Command::idle()
        };
        let mut segment = Segment::of(&command);
        segment.advance(PERIOD_S);
        assert_eq!(
            (segment.position, segment.fraction, segment.velocity),
            (7, 0.0, 0.0)
        );
    }

    #[test]
    fn reversal_negates() {
        let mut segment = Segment::of(&Command::<f32> {
            position_loop: true,
            position: 3,
            fraction: 0.25,
            velocity: 2.0,
            periods: 5,
            ..Command::idle()
        });
        segment.reverse(true);
        assert_eq!((segment.position, segment.fraction), (-4, 0.75));
        assert_eq!(segment.velocity, -2.0);
    }
}
