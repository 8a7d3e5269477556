//! Profiles with limited jerk: closed forms, and properties for random moves.

mod rig;

use cia402::{JerkProfile, ProfileLimits};
use rig::Random;

fn limits(velocity: f64, acceleration: f64, deceleration: f64) -> ProfileLimits {
    ProfileLimits {
        velocity,
        acceleration,
        deceleration,
    }
}

/// From rest.
fn planned(distance: f64, limits: ProfileLimits, jerk: f32) -> JerkProfile {
    JerkProfile::new(distance, 0.0, 0.0, limits, jerk).expect("usable limits")
}

#[test]
fn durations_from_rest_are_the_closed_form() {
    // Symmetric: T by the textbook, for which of velocity and acceleration are reached.
    let table = [
        // distance, v, a, jerk, seconds
        // Both: L/v + v/a + a/j = 10 + 1 + 0.5.
        (1000.0, 100.0, 100.0, 200.0, 11.5),
        (-1000.0, 100.0, 100.0, 200.0, 11.5),
        // Neither: 4·(L/2j)^⅓ = 4·(2/2)^⅓.
        (2.0, 100.0, 100.0, 1.0, 4.0),
        // The acceleration alone: a/j + √(a²/j² + 4L/a) = 1 + √(1 + 8).
        (200.0, 1000.0, 100.0, 100.0, 4.0),
        // The velocity alone: L/v + 2·√(v/j) = 10 + 2·√(100/4).
        (1000.0, 100.0, 1000.0, 4.0, 20.0),
        (0.0, 100.0, 100.0, 100.0, 0.0),
    ];
    for (distance, v, a, jerk, seconds) in table {
        let profile = planned(distance, limits(v, a, a), jerk);
        let got = profile.duration_s();
        assert!((got - seconds).abs() <= 1e-6 * seconds, "{distance}: {got}");
        assert!(profile.arrives());
        assert_eq!(profile.at(got), (distance, 0.0, 0.0));
        assert_eq!(profile.at(1e9), (distance, 0.0, 0.0));
    }
    // Asymmetric, both reached: L/v + v/2·(1/a + 1/d) + (a + d)/2j
    // = 10 + 50·(0.01 + 0.02) + 150/400.
    let profile = planned(1000.0, limits(100.0, 100.0, 50.0), 200.0);
    assert!((profile.duration_s() - 11.875).abs() < 1e-9);
}

#[test]
fn phases_from_rest_are_the_textbooks() {
    // 0.5 s of jerk 200 to 100 counts/s² and 25 counts/s; 0.5 s on; 0.5 s back: 100 counts/s.
    let profile = planned(1000.0, limits(100.0, 100.0, 100.0), 200.0);
    for (t, p, v, a) in [
        (0.5, 200.0 / 48.0, 25.0, 100.0),
        (1.0, 200.0 / 48.0 + 25.0, 75.0, 100.0),
        (1.5, 75.0, 100.0, 0.0),
        (5.0, 425.0, 100.0, 0.0),
        (10.0, 925.0, 100.0, 0.0),
        (10.5, 1000.0 - 25.0 - 200.0 / 48.0, 75.0, -100.0),
        (11.0, 1000.0 - 200.0 / 48.0, 25.0, -100.0),
    ] {
        let got = profile.at(t);
        for (got, expected) in [(got.0, p), (got.1, v), (got.2, a)] {
            assert!((got - expected).abs() < 1e-9, "{t}: {got}, not {expected}");
        }
    }
}

#[test]
fn starts_in_motion() {
    let limits = limits(100.0, 100.0, 100.0);
    let duration = |distance, velocity, acceleration| {
        let profile = JerkProfile::new(distance, velocity, acceleration, limits, 200.0);
        profile.expect("usable limits").duration_s()
    };
    // At speed: only the fall of 1.5 s and 75 counts at the end.
    assert!((duration(1000.0, 100.0, 0.0) - 10.75).abs() < 1e-6);
    // In the midst of the rise, as it would have gone on.
    assert!((duration(1000.0 - 200.0 / 48.0, 25.0, 100.0) - 11.0).abs() < 1e-6);
    // In the midst of the fall, exactly in time.
    assert!((duration(200.0 / 48.0, 25.0, -100.0) - 0.5).abs() < 1e-3);
    // Away from the target: symmetric limits need no stop in between.
    let away = duration(-1000.0, 100.0, 0.0);
    // 200 counts/s of change: 2.5 s and no way; then 9.25 s and 925 counts, then 75 in 1.5 s.
    assert!((away - (2.5 + 9.25 + 1.5)).abs() < 1e-6, "{away}");
}

#[test]
fn without_limits_there_is_none() {
    let good = [100.0, 100.0, 100.0, 100.0];
    for place in 0..4 {
        for odd in [0.0, -1.0, f64::NAN] {
            let mut given = good;
            given[place] = odd;
            let [v, a, d, jerk] = given;
            let profile = JerkProfile::new(10.0, 0.0, 0.0, limits(v, a, d), jerk as f32);
            assert!(profile.is_none(), "{given:?}");
        }
    }
    assert!(JerkProfile::stop(10.0, 0.0, 0.0, 10.0).is_none());
    assert!(JerkProfile::stop(10.0, 0.0, 10.0, f32::NAN).is_none());
}

#[test]
fn stopping_takes_the_closed_form() {
    // 100 counts/s at 100 and 200: 1.5 s and 75 counts.
    let profile = JerkProfile::stop(100.0, 0.0, 100.0, 200.0).expect("a stop");
    assert!(!profile.arrives());
    assert!((profile.duration_s() - 1.5).abs() < 1e-12);
    assert!((profile.at(2.0).0 - 75.0).abs() < 1e-9);
    // Still speeding up: 0.5 s more and 25 counts/s until the acceleration is gone.
    let profile = JerkProfile::stop(75.0, 100.0, 100.0, 200.0).expect("a stop");
    assert!((profile.duration_s() - 2.0).abs() < 1e-12);
}

/// Walks through a profile and judges every step.
fn judge(
    profile: &JerkProfile,
    distance: f64,
    start: (f64, f64),
    limits: ProfileLimits,
    jerk: f32,
) {
    let jerk = f64::from(jerk);
    let case = format!("{distance} from {start:?} within {limits:?}, {jerk}: {profile:?}");
    let duration = profile.duration_s();
    assert!(duration.is_finite() && duration >= 0.0, "{case}");
    assert!(profile.arrives(), "{case}");
    let (v0, a0) = start;
    let rate = limits.acceleration.max(limits.deceleration);
    // What was too fast at the start, or becomes so while the acceleration falls, comes down.
    let begun = v0.abs().max((v0 + a0 * a0.abs() / (2.0 * jerk)).abs());
    let fastest = limits.velocity.max(begun);
    let hardest = rate.max(a0.abs());
    let steps = 2000;
    let dt = duration / f64::from(steps);
    let mut before = profile.at(0.0);
    assert_eq!(
        before,
        if duration == 0.0 {
            (distance, 0.0, 0.0)
        } else {
            (0.0, v0, a0)
        }
    );
    for step in 1..=steps {
        let t = dt * f64::from(step);
        let now = profile.at(t);
        let (p, v, a) = now;
        let slack = 1.0 + 1e-6;
        assert!(
            v.abs() <= fastest * slack + 1e-6,
            "velocity {v} at {t}: {case}"
        );
        assert!(
            a.abs() <= hardest * slack + 1e-6,
            "acceleration {a} at {t}: {case}"
        );
        let jerked = (a - before.2).abs();
        assert!(
            jerked <= jerk * dt * slack + 1e-6 * hardest,
            "jerk at {t}: {case}"
        );
        // Position and velocity are the integrals.
        let sum = before.1 + 0.5 * (a + before.2) * dt;
        let rounding = 1e-9 * (fastest + hardest * dt);
        // The trapezoidal rule is off by at most jerk·dt²/8 where the jerk changes.
        assert!(
            (v - sum).abs() <= jerk * dt * dt / 4.0 * slack + rounding,
            "{v} is not {sum} at {t}: {case}"
        );
        let way = before.0 + 0.5 * (v + before.1) * dt;
        let curved = (hardest + jerk * dt) * dt * dt / 4.0;
        assert!(
            (p - way).abs() <= curved * slack + 1e-9 * (distance.abs() + fastest * dt) + 1e-6,
            "{p} is not {way} at {t}: {case}"
        );
        before = now;
    }
    assert_eq!(profile.at(duration), (distance, 0.0, 0.0), "{case}");
    // And it comes there by itself, not by a jump at the end.
    let near = profile.at(duration * (1.0 - 1e-9)).0;
    let jump = 1e-9 * duration * fastest + 1e-9 * distance.abs() + 1e-4;
    assert!((near - distance).abs() <= jump, "{near}: {case}");
}

#[test]
fn random_moves_keep_every_limit_and_arrive() {
    let mut random = Random(2024);
    for number in 0..20_000 {
        let v = random.scaled(1.0, 1e6);
        let a = random.scaled(1.0, 1e8);
        let d = if random.below(3) == 0 {
            a
        } else {
            random.scaled(1.0, 1e8)
        };
        let jerk = random.scaled(1.0, 1e10) as f32;
        let limits = limits(v, a, d);
        let distance = random.sign() * random.scaled(1e-3, 1e9);
        let start = match number % 4 {
            0 => (0.0, 0.0),
            1 => (random.sign() * random.scaled(1e-3, 2.0 * v), 0.0),
            // An acceleration that makes ten times the velocity limit at most before it is gone.
            _ => {
                let hardest = (2.0 * a.max(d))
                    .min((20.0 * v * f64::from(jerk)).sqrt())
                    .max(2e-3);
                (
                    random.sign() * random.scaled(1e-3, 2.0 * v),
                    random.sign() * random.scaled(1e-3, hardest),
                )
            }
        };
        let profile = JerkProfile::new(distance, start.0, start.1, limits, jerk).expect("limits");
        judge(&profile, distance, start, limits, jerk);
        // On the way, on to somewhere else.
        let (p, v, a) = profile.at(random.unit() * profile.duration_s());
        let further = distance - p + random.sign() * random.scaled(1e-3, 1e6);
        let next = JerkProfile::new(further, v, a, limits, jerk).expect("limits");
        judge(&next, further, (v, a), limits, jerk);
    }
}

#[test]
fn a_plan_made_anew_for_the_same_target_takes_no_longer() {
    let mut random = Random(7);
    for _ in 0..5_000 {
        let v = random.scaled(1e3, 1e6);
        let a = random.scaled(1e4, 1e8);
        let jerk = random.scaled(1e6, 1e10) as f32;
        let limits = limits(v, a, a);
        let distance = random.scaled(10.0, 1e7);
        let whole = planned(distance, limits, jerk);
        let t = random.unit() * whole.duration_s();
        let (p, velocity, acceleration) = whole.at(t);
        let rest = JerkProfile::new(distance - p, velocity, acceleration, limits, jerk)
            .expect("usable limits");
        let both = t + rest.duration_s();
        // Where it brakes already, the rounding of what is left may cost a creeping end.
        let allowed = 1.02 * whole.duration_s() + 0.01;
        assert!(
            both <= allowed,
            "{both} s, not {}: {limits:?} {jerk}",
            whole.duration_s()
        );
    }
}

#[test]
fn no_move_from_rest_is_quicker() {
    // A trapezoid with the same limits is a lower bound, and with much jerk the same.
    let mut random = Random(11);
    for _ in 0..2_000 {
        let limits = limits(
            random.scaled(1e3, 1e6),
            random.scaled(1e4, 1e8),
            random.scaled(1e4, 1e8),
        );
        let distance = random.scaled(10.0, 1e7);
        let linear = cia402::Profile::new(distance, 0.0, limits).duration_s();
        let soft = planned(distance, limits, random.scaled(1e6, 1e10) as f32).duration_s();
        assert!(soft >= linear * (1.0 - 1e-9), "{soft} {linear}");
        let hard = planned(distance, limits, 1e12).duration_s();
        assert!(hard - linear < 0.01 * linear + 1e-3, "{hard} {linear}");
    }
}
