//! The trapezoid: closed forms by hand, and properties for random moves.

mod rig;

use cia402::{Profile, ProfileLimits};
use rig::Random;

fn limits(velocity: f64, acceleration: f64, deceleration: f64) -> ProfileLimits {
    ProfileLimits {
        velocity,
        acceleration,
        deceleration,
    }
}

#[test]
fn durations_are_the_closed_form() {
    // distance, start velocity, v, a, d, seconds, where the seconds come from
    let table = [
        (
            1000.0,
            0.0,
            100.0,
            100.0,
            100.0,
            11.0,
            "1 s up, 9 s at 100, 1 s down",
        ),
        (
            -1000.0,
            0.0,
            100.0,
            100.0,
            100.0,
            11.0,
            "the same backwards",
        ),
        (
            100.0,
            0.0,
            100.0,
            100.0,
            100.0,
            2.0,
            "triangle that just reaches 100",
        ),
        (25.0, 0.0, 100.0, 100.0, 100.0, 1.0, "triangle to 50"),
        (
            1000.0,
            0.0,
            100.0,
            200.0,
            50.0,
            11.25,
            "0.5 s (25), 2 s (100), 875 at 100",
        ),
        (
            60.0,
            0.0,
            1000.0,
            40.0,
            20.0,
            3.0,
            "triangle, v² = 2·60·40·20/60 = 1600: 40/40 + 40/20",
        ),
        (
            1000.0,
            100.0,
            100.0,
            100.0,
            100.0,
            10.5,
            "at speed: 950 cruising, 1 s down",
        ),
        (
            1000.0,
            200.0,
            100.0,
            100.0,
            100.0,
            10.0,
            "1 s (150) down to 100, 800 cruising, 1 s (50)",
        ),
        (
            -1000.0,
            100.0,
            100.0,
            100.0,
            100.0,
            12.5,
            "1 s (50) to rest, then 1050 back: 11.5 s",
        ),
        (
            0.0,
            100.0,
            100.0,
            100.0,
            100.0,
            1.0 + 2.0 * 0.5f64.sqrt(),
            "50 over, triangle of 50 back",
        ),
        (
            20.0,
            100.0,
            100.0,
            100.0,
            100.0,
            1.0 + 2.0 * 0.3f64.sqrt(),
            "30 over, triangle of 30 back",
        ),
        (
            50.0,
            100.0,
            100.0,
            100.0,
            100.0,
            1.0,
            "exactly the way to stop",
        ),
        (0.0, 0.0, 100.0, 100.0, 100.0, 0.0, "nothing"),
        (
            1000.0,
            0.0,
            100.0,
            100.0,
            0.0,
            11.0,
            "deceleration 0: the acceleration",
        ),
        (
            1000.0,
            0.0,
            100.0,
            f64::INFINITY,
            f64::INFINITY,
            10.0,
            "no ramps",
        ),
        (
            1000.0,
            50.0,
            100.0,
            0.0,
            100.0,
            20.25,
            "cannot speed up: 987.5 at 50, 0.5 s down",
        ),
    ];
    for (distance, start, v, a, d, seconds, why) in table {
        let profile = Profile::new(distance, start, limits(v, a, d));
        let error = (profile.duration_s() - seconds).abs();
        assert!(
            error < 1e-9,
            "{why}: {} s, not {seconds}",
            profile.duration_s()
        );
        assert!(profile.arrives(), "{why}");
        assert_eq!(profile.at(profile.duration_s()), (distance, 0.0), "{why}");
        assert_eq!(profile.at(1e9), (distance, 0.0), "{why}");
    }
}

#[test]
fn without_means_there_is_no_move() {
    for (v, a) in [
        (0.0, 100.0),
        (100.0, 0.0),
        (f64::NAN, 100.0),
        (100.0, -1.0),
        (-5.0, 100.0),
    ] {
        let profile = Profile::new(1000.0, 0.0, limits(v, a, 100.0));
        assert!(!profile.arrives());
        assert_eq!(profile.duration_s(), 0.0);
        assert_eq!(profile.at(10.0), (0.0, 0.0));
    }
    // In motion the axis still comes to rest: 100²/(2·100).
    let profile = Profile::new(1000.0, 100.0, limits(0.0, 100.0, 100.0));
    assert!(!profile.arrives());
    assert_eq!(profile.at(10.0), (50.0, 0.0));
    // Without any rate it stops at once.
    let profile = Profile::new(1000.0, 100.0, limits(0.0, 0.0, f64::NAN));
    assert!(profile.duration_s() < 1e-9);
    // Nonsense numbers are no motion either.
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (p, v) = Profile::new(x, x, limits(x, x, x)).at(1.0);
        assert_eq!((p, v), (0.0, 0.0));
    }
}

/// The least time, found without the planner's formulas: bisection of the peak velocity over the
/// distance it covers.
fn least_time(distance: f64, start: f64, v: f64, a: f64, d: f64) -> f64 {
    let stop = start * start / (2.0 * d);
    if start * distance < 0.0 || stop > distance.abs() * (1.0 + 1e-12) {
        let rest = distance - start.signum() * stop;
        return start.abs() / d + least_time(rest, 0.0, v, a, d);
    }
    let (distance, start) = (distance.abs(), start.abs());
    let ramps = |peak: f64| {
        let (up, rate) = if peak >= start {
            (peak - start, a)
        } else {
            (start - peak, d)
        };
        (
            0.5 * (start + peak) * up / rate + 0.5 * peak * peak / d,
            up / rate + peak / d,
        )
    };
    if start > v || ramps(v).0 <= distance {
        let (covered, time) = ramps(v);
        return time + (distance - covered) / v;
    }
    let (mut low, mut high) = (start, v);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if ramps(middle).0 <= distance {
            low = middle
        } else {
            high = middle
        }
    }
    ramps(low).1
}

#[test]
fn random_moves_keep_the_limits_and_end_exactly() {
    let mut random = Random(0x5EED);
    for case in 0..20_000 {
        let distance = random.sign() * random.scaled(0.01, 4e9);
        let v = random.scaled(1.0, 1e7);
        let a = random.scaled(10.0, 1e9);
        let d = random.scaled(10.0, 1e9);
        let start = match random.below(3) {
            0 => 0.0,
            1 => random.sign() * v * random.unit(),
            _ => random.sign() * random.scaled(1.0, 1e7),
        };
        let profile = Profile::new(distance, start, limits(v, a, d));
        let total = profile.duration_s();
        let what = || format!("case {case}: {distance} from {start} with {v} {a} {d}");

        assert!(profile.arrives(), "{}", what());
        assert_eq!(profile.at(total), (distance, 0.0), "{}", what());
        let least = least_time(distance, start, v, a, d);
        assert!(
            (total - least).abs() <= 1e-6 * least + 1e-9,
            "{}: {total} {least}",
            what()
        );

        // Never faster than the limit or the start, never a rate beyond the limits, no jumps.
        let steps = 200;
        let (mut p0, mut v0) = profile.at(0.0);
        assert_eq!((p0, v0), (0.0, start));
        let step = total / f64::from(steps);
        let top = v.max(start.abs()) * (1.0 + 1e-9);
        for i in 1..=steps {
            let t = step * f64::from(i);
            let (p1, v1) = profile.at(t);
            assert!(v1.abs() <= top, "{}: {v1} at {t}", what());
            let rate = if v1.abs() > v0.abs() && v0 * v1 >= 0.0 {
                a
            } else {
                a.max(d)
            };
            let slack = 1e-6 * top + 1e-6 * rate * step;
            assert!(
                (v1 - v0).abs() <= rate * step + slack,
                "{}: {v0} {v1} at {t}",
                what()
            );
            let most = top * step * (1.0 + 1e-6) + 1e-9 * distance.abs() + 1e-9;
            assert!((p1 - p0).abs() <= most, "{}: {p0} {p1} at {t}", what());
            (p0, v0) = (p1, v1);
        }
        // Just before the end it is just before the target, at rest but for what is left.
        let before = total * (1.0 - 1e-9);
        let (p, v) = profile.at(before);
        let scale = distance.abs() + start * start / d;
        assert!(
            (p - distance).abs() <= 1e-6 * scale + 1e-6,
            "{}: {p}",
            what()
        );
        assert!(
            v.abs() <= d * (total - before) + 1e-6 * top,
            "{}: {v}",
            what()
        );
    }
}
