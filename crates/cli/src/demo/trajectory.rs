//! The trajectory that the master streams: smooth moves from point to point.

/// A move and the rest after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    /// Where it goes, turns from the start of the trajectory.
    pub(super) to_turns: f64,
    /// How long it takes, s.
    pub(super) duration_s: f64,
    /// How long it rests there, s.
    pub(super) rest_s: f64,
}

/// The set-point at `time_s` after the start of `legs`, turns: each leg is the path of least jerk
/// between rest and rest, d (10 s³ − 15 s⁴ + 6 s⁵) with s from 0 to 1.
pub(super) fn position_turns(legs: &[Leg], time_s: f64) -> f64 {
    let (mut from, mut time) = (0.0, time_s);
    for leg in legs {
        if time < leg.duration_s {
            let s = time.max(0.0) / leg.duration_s;
            return from + (leg.to_turns - from) * s * s * s * (10.0 + s * (6.0 * s - 15.0));
        }
        from = leg.to_turns;
        time -= leg.duration_s;
        if time < leg.rest_s {
            break;
        }
        time -= leg.rest_s;
    }
    from
}

/// How long `legs` take, without the last rest, s.
pub(super) fn duration_s(legs: &[Leg]) -> f64 {
    let all: f64 = legs.iter().map(|leg| leg.duration_s + leg.rest_s).sum();
    all - legs.last().map_or(0.0, |leg| leg.rest_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEGS: [Leg; 2] = [
        Leg {
            to_turns: 8.0,
            duration_s: 0.4,
            rest_s: 0.1,
        },
        Leg {
            to_turns: -2.0,
            duration_s: 0.5,
            rest_s: 0.1,
        },
    ];

    #[test]
    fn it_begins_rests_and_ends_where_it_is_said() {
        let at = |time_s| position_turns(&LEGS, time_s);
        assert_eq!(at(0.0), 0.0);
        // The path of least jerk is symmetrical.
        assert!((at(0.2) - 4.0).abs() < 1e-12);
        assert_eq!(at(0.45), 8.0);
        assert!((at(0.75) - 3.0).abs() < 1e-12);
        assert_eq!(at(1.05), -2.0);
        assert_eq!(at(9.0), -2.0);
        assert!((duration_s(&LEGS) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn its_greatest_speed_is_that_of_least_jerk() {
        // 15/8 of the mean speed, 20 turns/s.
        let step = 1e-4;
        let fastest = (0..4000)
            .map(|n| f64::from(n) * step)
            .map(|t| (position_turns(&LEGS, t + step) - position_turns(&LEGS, t)) / step)
            .fold(0.0, f64::max);
        assert!((fastest - 37.5).abs() < 1e-3, "{fastest}");
    }
}
