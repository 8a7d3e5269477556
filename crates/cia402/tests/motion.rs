//! Profile velocity and torque, continuity of what is demanded, limits, windows.

mod rig;

use cia402::{Demand, Mode, Target, Targets, Window};
use rig::{P3, PERIOD_NS, Random, Rig, STANDARD};

const REACHED: u16 = 0x0400;
const LIMIT: u16 = 0x0800;
const BIT_12: u16 = 0x1000;
const FOLLOWING_ERROR: u16 = 0x2000;

#[test]
fn velocity_ramps() {
    // Acceleration 100,000, deceleration 200,000 counts/s².
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.velocity_threshold = 10.0;
    rig.run_ms(1);
    assert_eq!(
        rig.status() & (REACHED | BIT_12),
        REACHED | BIT_12,
        "at rest, as asked"
    );
    rig.targets.velocity = 5000;
    rig.receive(Target::Velocity);
    assert_eq!(rig.status() & REACHED, 0);
    let table = [
        // target, ms, velocity then, ms until it is reached, exactly
        (5000, 20, 2000.0, 50),
        (-3000, 30, -500.0, 55), // 25 ms to zero, 30 ms on
        (-1000, 4, -2200.0, 10),
        (0, 2, -600.0, 5),
        (50, 1, 50.0, 1), // 0.5 ms
    ];
    for (target, some, then, until) in table {
        rig.targets.velocity = target;
        rig.receive(Target::Velocity);
        rig.run_ms(some);
        assert!(
            (rig.sample().velocity - then).abs() < 1e-2,
            "{target}: {:?}",
            rig.sample()
        );
        rig.run_ms(until - some);
        assert_eq!(rig.status() & REACHED, 0, "{target}");
        assert!(
            (rig.sample().velocity - f64::from(target)).abs() < 1e-2,
            "{target}"
        );
        rig.run_ms(1);
        assert_eq!(rig.status() & REACHED, REACHED, "{target}");
        assert_eq!(rig.sample().velocity, f64::from(target));
        // The same target again changes nothing.
        rig.receive(Target::Velocity);
        assert_eq!(rig.status() & REACHED, REACHED, "{target}");
    }
    for pair in rig.trace.windows(2) {
        let (before, after) = (pair[0].velocity, pair[1].velocity);
        let rate = if after.abs() > before.abs() {
            100_000.0
        } else {
            200_000.0
        };
        assert!((after - before).abs() <= rate * 50e-6 + 1e-2, "{pair:?}");
    }
}

#[test]
fn speed_is_zero_has_a_threshold_and_a_time() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.velocity_threshold = 10.0;
    rig.configuration.velocity_threshold_time_ms = 3;
    rig.stuck = true;
    rig.run_ms(1);
    for (velocity, ms, zero) in [
        (10.0, 10, true),
        (-11.0, 4, true), // 0 to 3 ms
        (-11.0, 1, false),
        (-10.0, 1, true),
        (11.0, 3, true),
        (9.0, 1, true),
        (11.0, 4, true), // anew
        (11.0, 1, false),
    ] {
        rig.actual.velocity = velocity;
        rig.run_ms(ms);
        assert_eq!(rig.status() & BIT_12 != 0, zero, "{velocity} for {ms}");
    }
}

#[test]
fn velocity_reached_asks_the_motor() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.velocity_window = Some(Window {
        size: 100,
        time_ms: 5,
    });
    rig.stuck = true;
    rig.targets.velocity = 1000;
    rig.run_ms(100);
    assert_eq!(rig.status() & REACHED, 0);
    rig.actual.velocity = 901.0;
    rig.run_ms(5);
    assert_eq!(rig.status() & REACHED, 0);
    rig.run_ms(1);
    assert_eq!(rig.status() & REACHED, REACHED);
    rig.actual.velocity = 1101.0;
    rig.run_ms(1);
    assert_eq!(rig.status() & REACHED, 0);
}

#[test]
fn torque_with_and_without_slope() {
    let mut rig = Rig::enabled(&P3, Mode::PROFILE_TORQUE);
    rig.targets.torque_pm = 100;
    rig.receive(Target::Torque);
    // Without a slope at once, before the next tick.
    let hold = |start_pm| Demand::Torque {
        start_pm,
        slope_pm_per_s: 0.0,
        duration_ns: 0,
    };
    assert_eq!(rig.demand, hold(100.0));
    assert_eq!(rig.status() & REACHED, REACHED);
    // 5000 per mille per second: 100 to −50 in 30 ms.
    rig.configuration.torque_slope_pm_per_s = Some(5000.0);
    rig.targets.torque_pm = -50;
    rig.receive(Target::Torque);
    assert_eq!(rig.status() & REACHED, 0);
    rig.run_ms(10);
    assert!(
        (rig.sample().torque_pm - 50.0).abs() < 1e-3,
        "{:?}",
        rig.sample()
    );
    rig.run_ms(20);
    assert_eq!(rig.status() & REACHED, 0);
    rig.run_ms(1);
    assert_eq!(rig.demand, hold(-50.0));
    assert_eq!(rig.status() & REACHED, REACHED);
    // The limit.
    rig.configuration.max_torque_pm = 40.0;
    rig.run_ms(3);
    assert_eq!(rig.demand, hold(-40.0));
    assert_eq!(rig.status() & LIMIT, LIMIT);
    assert!(rig.axis.conditions().torque_limited);
    // Out of operation nothing is limited, and the bridge is off.
    rig.word(0x06);
    assert_eq!(rig.demand, Demand::Off);
    assert_eq!(rig.status() & (LIMIT | REACHED), 0);
}

#[test]
fn limits_of_profile_moves() {
    let cases = [
        (Some(5000.0), None, None),
        (None, Some(50_000.0), None),
        (None, None, Some(50_000.0)),
        (None, None, None),
        (Some(10_000.0), Some(100_000.0), Some(200_000.0)), // met, not exceeded
    ];
    for (v, a, d) in cases {
        let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
        rig.configuration.max_velocity = v;
        rig.configuration.max_acceleration = a;
        rig.configuration.max_deceleration = d;
        rig.targets.position = 5000;
        rig.word(0x1F);
        rig.run_ms(10);
        let (v, a, d) = (v.unwrap_or(1e4), a.unwrap_or(1e5), d.unwrap_or(2e5));
        let conditions = rig.axis.conditions();
        assert_eq!(conditions.velocity_limited, v < 1e4);
        assert_eq!(conditions.acceleration_limited, a < 1e5 || d < 2e5);
        assert_eq!(rig.status() & LIMIT != 0, v < 1e4 || a < 1e5 || d < 2e5);
        // v/a + v/d + (5000 − v²/2a − v²/2d) / v, in whole ms, less the ten
        let v = f64::from(v);
        let (a, d) = (f64::from(a), f64::from(d));
        let seconds = v / a + v / d + (5000.0 - v * v / (2.0 * a) - v * v / (2.0 * d)) / v;
        rig.run_ms((seconds * 1000.0 - 1e-6).ceil() as u32 - 10);
        assert_eq!(rig.status() & REACHED, 0);
        rig.run_ms(1);
        assert_eq!(rig.status() & (REACHED | LIMIT), REACHED);
        assert_eq!(rig.sample().position, 5000.0);
    }
    // The target beyond the position limits: moved to the limit, and said so as long as it is.
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    rig.configuration.position_limits = Some((-100, 300));
    for (target, word, ends, limited) in [
        (301, 0x1F, 300, true),
        (300, 0x1F, 300, false),
        (-500, 0x5F, -100, true),
        (50, 0x5F, -50, false),
    ] {
        rig.targets.position = target;
        rig.word(word);
        rig.word(0x0F);
        rig.run_ms(300);
        assert_eq!(rig.sample().position, f64::from(ends));
        assert_eq!(rig.status() & LIMIT != 0, limited, "{target}");
        assert_eq!(
            rig.axis.conditions().position_limited(),
            limited,
            "{target}"
        );
    }
}

#[test]
fn following_error_warns_and_faults() {
    for (mode, target) in [
        (Mode::CYCLIC_POSITION, Target::Position),
        (Mode::PROFILE_POSITION, Target::Position),
    ] {
        let mut rig = Rig::enabled(&STANDARD, mode);
        rig.configuration.following_warning = Some(Window {
            size: 100,
            time_ms: 5,
        });
        rig.configuration.following_fault = Some(Window {
            size: 500,
            time_ms: 10,
        });
        rig.targets.position = 0;
        rig.receive(target);
        for (lag, ms, warning, fault) in [
            (100, 20, false, false),
            (-101, 6, false, false),
            (-101, 1, true, false),
            (-100, 1, false, false),
            (600, 7, true, false),
            (600, 4, true, false),
            (600, 1, true, true),
            (0, 1, false, false),
        ] {
            rig.stuck = true;
            rig.actual.position = rig.actual.demand_position.wrapping_sub(lag);
            rig.run_ms(ms);
            let conditions = rig.axis.conditions();
            assert_eq!(conditions.following_warning, warning, "{lag} for {ms}");
            assert_eq!(conditions.following_fault, fault, "{lag} for {ms}");
            assert_eq!(
                rig.status() & FOLLOWING_ERROR != 0,
                warning || fault,
                "{lag} for {ms}"
            );
        }
    }
    // Bit 13 means nothing in the other modes, and no error is watched without a demand.
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_TORQUE);
    rig.configuration.following_warning = Some(Window {
        size: 0,
        time_ms: 0,
    });
    rig.actual.demand_position = 1000;
    rig.run_ms(3);
    assert_eq!(rig.status() & FOLLOWING_ERROR, 0);
    assert!(!rig.axis.conditions().following_warning);
}

#[test]
fn velocity_error_warns_and_faults() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.velocity_warning = Some(Window {
        size: 50,
        time_ms: 2,
    });
    rig.configuration.velocity_fault = Some(Window {
        size: 200,
        time_ms: 4,
    });
    rig.stuck = true;
    for (velocity, ms, warning, fault) in [
        (50.0, 9, false, false),
        (51.0, 4, true, false),
        (300.0, 6, true, true),
        (0.0, 1, false, false),
    ] {
        rig.actual.velocity = velocity;
        rig.run_ms(ms);
        let conditions = rig.axis.conditions();
        assert_eq!(conditions.velocity_warning, warning, "{velocity}");
        assert_eq!(conditions.velocity_fault, fault, "{velocity}");
    }
}

#[test]
fn enabling_starts_from_where_the_motor_is() {
    for mode in [Mode::PROFILE_POSITION, Mode::CYCLIC_POSITION] {
        let mut rig = Rig::new(&STANDARD);
        rig.mode(mode).expect("a position mode");
        rig.place(-4321);
        rig.actual.velocity = 900.0;
        rig.word(0x06);
        rig.word(0x0F);
        let held = Demand::Position {
            start: -4321,
            fraction: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            velocity_offset: 0.0,
            torque_offset_pm: 0.0,
            duration_ns: 0,
        };
        assert_eq!(rig.demand, held);
        rig.actual.velocity = 0.0;
        rig.run_ms(10);
        assert_eq!(rig.demand, held);
    }
    let mut rig = Rig::new(&STANDARD);
    rig.mode(Mode::PROFILE_VELOCITY).expect("mode 3");
    rig.actual.velocity = 900.0;
    rig.word(0x06);
    rig.word(0x0F);
    let zero = Demand::Velocity {
        start: 0.0,
        acceleration: 0.0,
        torque_offset_pm: 0.0,
        duration_ns: 0,
    };
    assert_eq!(rig.demand, zero);
}

/// Position and velocity of the demand over the whole of `trace` jump nowhere, whatever the modes
/// do: rates up to 400,000 counts/s², and whatever velocity the end of one millisecond left.
fn assert_continuous(rig: &Rig, what: &str) {
    let period = f64::from(PERIOD_NS) * 1e-9;
    for (k, pair) in rig.trace.windows(2).enumerate() {
        let (before, after) = (pair[0], pair[1]);
        let moved = after.position - before.position;
        let fastest = before.velocity.abs().max(after.velocity.abs());
        // A velocity may give way by a rate × 1 ms where a profile bends within a millisecond.
        // Where a position takes over from a velocity, it starts at a whole count.
        let quantum = if k == 0 { 1.0 } else { 1e-3 };
        let most = (fastest + 400.0) * period + quantum;
        assert!(
            moved.abs() <= most,
            "{what}, period {k}: {before:?} {after:?}"
        );
        let jump = (after.velocity - before.velocity).abs();
        assert!(
            jump <= 400_000.0 * (1e-3 + period) + 1.0,
            "{what}, period {k}: {before:?} {after:?}"
        );
    }
}

#[test]
fn mode_changes_in_motion_do_not_jump() {
    let moving = [
        Mode::PROFILE_POSITION,
        Mode::PROFILE_VELOCITY,
        Mode::CYCLIC_POSITION,
        Mode::CYCLIC_VELOCITY,
    ];
    for from in moving {
        for to in moving.into_iter().filter(|&to| to != from) {
            // Halfway through a millisecond, too.
            for periods in [0, 7, 19] {
                let mut rig = Rig::enabled(&STANDARD, from);
                let what = format!("{from} to {to} after {periods}");
                rig.targets = Targets {
                    position: 3000,
                    velocity: 9000,
                    ..Targets::default()
                };
                rig.word(0x1F);
                let mut set_point = 0;
                for ms in 0..150 {
                    // The cyclic modes are led along a ramp of 90 counts/s per ms.
                    set_point += ms * 9 / 100;
                    rig.targets.position = if from == Mode::CYCLIC_POSITION {
                        set_point
                    } else {
                        3000
                    };
                    rig.targets.velocity = if from == Mode::CYCLIC_VELOCITY {
                        ms * 60
                    } else {
                        9000
                    };
                    rig.receive(Target::Position);
                    rig.receive(Target::Velocity);
                    rig.run_ms(1);
                }
                rig.tick();
                for _ in 0..periods {
                    rig.period();
                }
                if from == Mode::CYCLIC_POSITION {
                    // Where the last segment still runs.
                    rig.targets.position = set_point + 13;
                    rig.receive(Target::Position);
                    for _ in 0..periods {
                        rig.period();
                    }
                }
                let before = rig.sample();
                assert!(before.velocity > 1000.0, "{what}: {before:?}");
                rig.trace.clear();
                rig.period();
                assert_eq!(rig.mode(to), Ok(()));
                assert_eq!(rig.status() & 0x3400, 0, "{what}");
                // The new mode's targets have not come; velocity follows its object.
                rig.targets.velocity = 0;
                while !rig.now_ns.is_multiple_of(1_000_000) {
                    rig.period();
                }
                rig.run_ms(400);
                assert!(
                    rig.sample().velocity.abs() < 1.0,
                    "{what}: {:?}",
                    rig.sample()
                );
                assert_continuous(&rig, &what);
            }
        }
    }
}

#[test]
fn random_set_points_do_not_jump() {
    let mut random = Random(7);
    for case in 0..200 {
        let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
        rig.configuration.acceleration = random.scaled(1000.0, 400_000.0) as f32;
        rig.configuration.deceleration = random.scaled(1000.0, 400_000.0) as f32;
        for _ in 0..30 {
            rig.configuration.profile_velocity = random.scaled(10.0, 50_000.0) as f32;
            rig.targets.position = (random.sign() * random.scaled(1.0, 20_000.0)) as i32;
            rig.word(0x0F);
            rig.word([0x1F, 0x3F, 0x5F, 0x7F, 0x21F, 0x25F][random.below(6) as usize]);
            rig.run_ms(random.below(60) as u32);
        }
        // Bit 4 low, last target absolute: it ends there exactly.
        rig.word(0x0F);
        rig.targets.position = 123;
        rig.configuration.profile_velocity = 100_000.0;
        rig.configuration.acceleration = 400_000.0;
        rig.configuration.deceleration = 400_000.0;
        rig.word(0x3F);
        rig.run_ms(10_000);
        assert_eq!(rig.sample().position, 123.0);
        assert_eq!(rig.status() & REACHED, REACHED);
        assert_continuous(&rig, &format!("case {case}"));
        // Neither limit is exceeded anywhere in the demand.
        let fastest = rig
            .trace
            .iter()
            .map(|sample| sample.velocity.abs())
            .fold(0.0, f64::max);
        assert!(fastest <= 100_000.0 * 1.000_001, "{fastest}");
        let rate = rig
            .trace
            .iter()
            .map(|sample| sample.acceleration.abs())
            .fold(0.0, f64::max);
        assert!(rate <= 400_000.0 * 1.000_1, "{rate}");
    }
}

#[test]
fn a_spinning_motor_is_taken_over_in_motion() {
    // From mode 0 with 5000 counts/s: 200,000 counts/s² stop it in 25 ms and 62.5 counts.
    for mode in [Mode::CYCLIC_POSITION, Mode::PROFILE_POSITION] {
        let mut rig = Rig::enabled(&P3, Mode::IDLE);
        rig.place(1000);
        rig.actual.velocity = 5000.0;
        rig.mode(mode).expect("a position mode");
        assert_eq!(rig.sample().velocity, 5000.0);
        rig.trace.clear();
        for _ in 0..10 {
            rig.period(); // half a millisecond until the tick: 2.5 counts
        }
        rig.run_ms(26);
        assert!(
            (rig.sample().position - 1065.0).abs() < 1e-3,
            "{:?}",
            rig.sample()
        );
        assert_continuous(&rig, "spinning");
    }
    // Below the threshold of standstill the axis just holds.
    let mut rig = Rig::enabled(&P3, Mode::IDLE);
    rig.configuration.velocity_threshold = 100.0;
    rig.place(1000);
    rig.actual.velocity = 99.0;
    rig.mode(Mode::CYCLIC_POSITION).expect("mode 8");
    rig.run_ms(3);
    assert_eq!(rig.sample().position, 1000.0);
}

#[test]
fn an_axis_is_small() {
    // Part of the 3 KiB a node may take.
    assert!(
        core::mem::size_of::<cia402::Axis>() <= 480,
        "{}",
        core::mem::size_of::<cia402::Axis>()
    );
}

#[test]
fn segments_keep_the_limits_where_the_profile_bends() {
    let mut random = Random(402);
    for case in 0..300 {
        let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
        let v = random.scaled(100.0, 50_000.0) as f32;
        let (a, d) = (
            random.scaled(5e4, 5e7) as f32,
            random.scaled(5e4, 5e7) as f32,
        );
        rig.configuration.profile_velocity = v;
        rig.configuration.acceleration = a;
        rig.configuration.deceleration = d;
        let target = (random.sign() * random.scaled(1.0, 3000.0)) as i32;
        rig.targets.position = target;
        rig.word(0x1F);
        let (mut ends, mut before) = (0, Demand::Off);
        while rig.status() & REACHED == 0 && ends < 40_000 {
            rig.run_ms(1);
            ends += 1;
            if let (
                Demand::Position { .. },
                Demand::Position {
                    velocity,
                    acceleration,
                    ..
                },
            ) = (before, rig.demand)
            {
                let start = f64::from(velocity);
                let end = start + f64::from(acceleration) * 1e-3;
                let top = f64::from(v) * 1.000_001 + 1e-3;
                assert!(
                    start.abs() <= top && end.abs() <= top,
                    "case {case}: {:?}",
                    rig.demand
                );
                // Never back, and never a rate beyond both.
                let sign = f64::from(target.signum());
                assert!(
                    start * sign >= -1e-2 && end * sign >= -1e-2,
                    "case {case}: {:?}",
                    rig.demand
                );
                let rate = f64::from(a).max(f64::from(d)) * 1.000_001 + 1.0;
                assert!(
                    f64::from(acceleration).abs() <= rate,
                    "case {case}: {:?}",
                    rig.demand
                );
            }
            before = rig.demand;
        }
        assert_eq!(rig.sample().position, f64::from(target), "case {case}");
    }
}

#[test]
fn a_mode_change_clears_the_mode_specific_bits_at_once() {
    // P3 l.474: 10, 12 and 13.
    let mut rig = Rig::enabled(&P3, Mode::CYCLIC_POSITION);
    rig.configuration.following_warning = Some(Window {
        size: 10,
        time_ms: 0,
    });
    rig.lag = 11;
    rig.targets.position = 50;
    rig.receive(Target::Position);
    rig.run_ms(3);
    assert_eq!(rig.status() & 0x3400, FOLLOWING_ERROR | BIT_12);
    rig.mode(Mode::PROFILE_POSITION).expect("mode 1");
    assert_eq!(rig.status() & 0x3400, 0);
    assert!(!rig.axis.conditions().following_warning);
    rig.run_ms(1);
    assert_eq!(rig.status() & 0x3400, FOLLOWING_ERROR);
    rig.lag = 0;
    rig.word(0x1F);
    rig.run_ms(3);
    assert_eq!(rig.status() & 0x3400, REACHED | BIT_12);
    rig.mode(Mode::IDLE).expect("mode 0");
    assert_eq!(rig.status() & 0x3400, 0);
    assert_eq!(rig.demand, Demand::Idle);
}
