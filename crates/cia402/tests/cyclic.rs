//! Cyclic synchronous modes: linear interpolation, first set-point, late set-points, limits.

mod rig;

use cia402::{Demand, Mode, Target};
use rig::{P3, Rig, STANDARD};

const FOLLOWS: u16 = 0x1000;
const LIMIT: u16 = 0x0800;

fn enabled(mode: Mode, period_ns: u32) -> Rig {
    let mut rig = Rig::enabled(&P3, mode);
    rig.configuration.interpolation_period_ns = period_ns;
    rig
}

/// Runs control periods, with a tick each millisecond.
fn run_ns(rig: &mut Rig, ns: u64) {
    let end = rig.now_ns + ns;
    while rig.now_ns < end {
        if rig.now_ns.is_multiple_of(1_000_000) {
            rig.tick();
        }
        rig.period();
    }
}

#[test]
fn positions_are_interpolated_linearly() {
    let mut rig = enabled(Mode::CYCLIC_POSITION, 2_000_000);
    let set_points = [100, 250, 250, -400, -401, 3000];
    let mut before = 0.0;
    for target in set_points {
        rig.targets.position = target;
        rig.receive(Target::Position);
        rig.trace.clear();
        run_ns(&mut rig, 2_000_000);
        for (k, sample) in rig.trace.iter().enumerate() {
            // 40 control periods of 50 µs.
            let line = before + (f64::from(target) - before) * (k + 1) as f64 / 40.0;
            assert!(
                (sample.position - line).abs() < 1e-3,
                "{target}, {k}: {sample:?}, not {line}"
            );
        }
        before = f64::from(target);
    }
    assert_eq!(rig.status() & FOLLOWS, FOLLOWS);
}

#[test]
fn interpolation_follows_its_period() {
    for period_ns in [250_000, 1_000_000, 4_000_000, 10_000_000] {
        let mut rig = enabled(Mode::CYCLIC_POSITION, period_ns);
        rig.targets.position = 1000;
        rig.receive(Target::Position);
        run_ns(&mut rig, u64::from(period_ns) / 2);
        // Half the period in whole control periods of 50 µs.
        let half = (period_ns / 2).div_ceil(50_000) * 50_000;
        let line = 1000.0 * f64::from(half) / f64::from(period_ns);
        assert!(
            (rig.sample().position - line).abs() < 1e-3,
            "{period_ns}: {:?}",
            rig.sample()
        );
    }
}

#[test]
fn nothing_moves_before_the_first_set_point() {
    for stale in [5000, -7] {
        let mut rig = Rig::new(&P3);
        rig.place(1234);
        rig.targets.position = stale;
        rig.word(0x06);
        rig.word(0x0F);
        rig.mode(Mode::CYCLIC_POSITION).expect("mode 8");
        rig.run_ms(20);
        // Other targets are no set-points of this mode.
        rig.receive(Target::Velocity);
        rig.receive(Target::Torque);
        rig.run_ms(20);
        assert_eq!(rig.sample().position, 1234.0);
        assert_eq!(rig.status() & FOLLOWS, 0);
        rig.receive(Target::Position);
        rig.run_ms(1);
        assert_eq!(rig.sample().position, f64::from(stale));
        assert_eq!(rig.status() & FOLLOWS, FOLLOWS);
    }
}

#[test]
fn a_late_set_point_holds_the_last_one() {
    let mut rig = enabled(Mode::CYCLIC_POSITION, 1_000_000);
    rig.targets.position = 100;
    rig.receive(Target::Position);
    rig.run_ms(5);
    assert_eq!(rig.sample().position, 100.0);
    assert_eq!(rig.sample().velocity, 0.0);
    // An early one starts from where the interpolation stands.
    rig.targets.position = 200;
    rig.receive(Target::Position);
    run_ns(&mut rig, 500_000);
    rig.targets.position = 400;
    rig.receive(Target::Position);
    rig.trace.clear();
    run_ns(&mut rig, 500_000);
    // From 150, half of 250 on.
    assert!(
        (rig.trace[0].position - 162.5).abs() < 1e-3,
        "{:?}",
        rig.trace[0]
    );
    assert!(
        (rig.sample().position - 275.0).abs() < 1e-3,
        "{:?}",
        rig.sample()
    );
}

#[test]
fn offsets_ride_along() {
    let mut rig = enabled(Mode::CYCLIC_POSITION, 1_000_000);
    rig.targets.position = 100;
    rig.targets.position_offset = 11;
    rig.targets.velocity_offset = -300;
    rig.targets.torque_offset_pm = 45;
    rig.receive(Target::Position);
    match rig.demand {
        Demand::Position {
            velocity,
            velocity_offset,
            torque_offset_pm,
            ..
        } => {
            assert_eq!(
                (velocity, velocity_offset, torque_offset_pm),
                (111_000.0, -300.0, 45.0)
            );
        }
        other => panic!("{other:?}"),
    }
    let mut rig = enabled(Mode::CYCLIC_VELOCITY, 1_000_000);
    rig.targets.velocity = 1000;
    rig.targets.velocity_offset = -300;
    rig.targets.torque_offset_pm = 45;
    rig.receive(Target::Velocity);
    assert_eq!(
        rig.demand,
        Demand::Velocity {
            start: 0.0,
            acceleration: 700_000.0,
            torque_offset_pm: 45.0,
            duration_ns: 1_000_000
        }
    );
    let mut rig = enabled(Mode::CYCLIC_TORQUE, 1_000_000);
    rig.targets.torque_pm = 100;
    rig.targets.torque_offset_pm = 45;
    rig.receive(Target::Torque);
    assert_eq!(
        rig.demand,
        Demand::Torque {
            start_pm: 0.0,
            slope_pm_per_s: 145_000.0,
            duration_ns: 1_000_000
        }
    );
}

#[test]
fn position_wraps_the_short_way() {
    let mut rig = Rig::new(&P3);
    rig.place(i32::MAX - 50);
    rig.word(0x06);
    rig.word(0x0F);
    rig.mode(Mode::CYCLIC_POSITION).expect("mode 8");
    rig.targets.position = i32::MIN + 49;
    rig.receive(Target::Position);
    rig.trace.clear();
    run_ns(&mut rig, 1_000_000);
    assert_eq!(rig.actual.demand_position, i32::MIN + 49);
    let ends = (rig.trace[0].position, rig.trace[19].position);
    assert!((ends.1 - ends.0 - 95.0).abs() < 1e-3, "{ends:?}");
}

#[test]
fn velocities_and_torques_are_interpolated_linearly() {
    let mut rig = enabled(Mode::CYCLIC_VELOCITY, 2_000_000);
    let mut before = 0.0;
    for target in [1000, -3000, -3000, 0] {
        rig.targets.velocity = target;
        rig.receive(Target::Velocity);
        rig.trace.clear();
        run_ns(&mut rig, 2_000_000);
        for (k, sample) in rig.trace.iter().enumerate() {
            let line = before + (f64::from(target) - before) * (k + 1) as f64 / 40.0;
            assert!(
                (sample.velocity - line).abs() < 1e-2,
                "{target}, {k}: {sample:?}"
            );
        }
        before = f64::from(target);
    }
    // Late: the last value stays.
    rig.targets.velocity = 500;
    rig.receive(Target::Velocity);
    rig.run_ms(10);
    assert!((rig.sample().velocity - 500.0).abs() < 1e-3);

    let mut rig = enabled(Mode::CYCLIC_TORQUE, 2_000_000);
    let mut before = 0.0;
    for target in [100_i16, -300, -300, 0] {
        rig.targets.torque_pm = target;
        rig.receive(Target::Torque);
        rig.trace.clear();
        run_ns(&mut rig, 2_000_000);
        for (k, sample) in rig.trace.iter().enumerate() {
            let line = before + (f64::from(target) - before) * (k + 1) as f64 / 40.0;
            assert!(
                (sample.torque_pm - line).abs() < 1e-3,
                "{target}, {k}: {sample:?}"
            );
        }
        before = f64::from(target);
    }
}

#[test]
fn limits_hold_back_and_say_so() {
    // Velocity: 1000 counts at 50,000 counts/s take 20 ms instead of 1.
    let mut rig = enabled(Mode::CYCLIC_POSITION, 1_000_000);
    rig.configuration.max_velocity = Some(50_000.0);
    rig.targets.position = -1000;
    rig.receive(Target::Position);
    assert_eq!(rig.status() & LIMIT, LIMIT);
    assert!(rig.axis.conditions().velocity_limited);
    rig.trace.clear();
    rig.run_ms(19);
    assert_eq!(rig.status() & LIMIT, LIMIT);
    rig.run_ms(2);
    assert_eq!(rig.status() & LIMIT, 0);
    assert!(
        (rig.sample().position + 1000.0).abs() < 1e-3,
        "{:?}",
        rig.sample()
    );
    for pair in rig.trace.windows(2) {
        assert!(
            (pair[1].position - pair[0].position).abs() < 2.5 + 1e-3,
            "{pair:?}"
        );
    }
    // It arrives even if that takes longer than a segment can last.
    rig.configuration.max_velocity = Some(100.0);
    rig.targets.position = 0;
    rig.receive(Target::Position);
    rig.run_ms(10_002);
    assert!(rig.sample().position.abs() < 1e-2, "{:?}", rig.sample());
    assert_eq!(rig.status() & LIMIT, 0);

    // Position.
    let mut rig = enabled(Mode::CYCLIC_POSITION, 1_000_000);
    rig.configuration.position_limits = Some((-500, 800));
    for (target, ends, limited) in [
        (801, 800, true),
        (800, 800, false),
        (-9999, -500, true),
        (3, 3, false),
    ] {
        rig.targets.position = target;
        rig.receive(Target::Position);
        rig.run_ms(1);
        assert!(
            (rig.sample().position - f64::from(ends)).abs() < 1e-3,
            "{target}"
        );
        assert_eq!(rig.status() & LIMIT != 0, limited, "{target}");
        assert_eq!(
            rig.axis.conditions().position_limited(),
            limited,
            "{target}"
        );
    }

    // Velocity and acceleration in velocity mode: 0 to 1000 at 100,000 counts/s² takes 10 ms.
    let mut rig = enabled(Mode::CYCLIC_VELOCITY, 1_000_000);
    rig.configuration.max_velocity = Some(1000.0);
    rig.configuration.max_acceleration = Some(100_000.0);
    rig.targets.velocity = 5000;
    rig.receive(Target::Velocity);
    rig.trace.clear();
    rig.run_ms(5);
    assert!(
        (rig.sample().velocity - 500.0).abs() < 1e-2,
        "{:?}",
        rig.sample()
    );
    let conditions = rig.axis.conditions();
    assert!(conditions.velocity_limited && conditions.acceleration_limited);
    rig.run_ms(7);
    assert!(
        (rig.sample().velocity - 1000.0).abs() < 1e-2,
        "{:?}",
        rig.sample()
    );
    let conditions = rig.axis.conditions();
    assert!(conditions.velocity_limited && !conditions.acceleration_limited);
    assert_eq!(rig.status() & LIMIT, LIMIT);
    // Slowing down has no limit here.
    rig.targets.velocity = 10;
    rig.receive(Target::Velocity);
    rig.run_ms(1);
    assert!(
        (rig.sample().velocity - 10.0).abs() < 1e-2,
        "{:?}",
        rig.sample()
    );
    assert_eq!(rig.status() & LIMIT, 0);

    // Torque.
    let mut rig = enabled(Mode::CYCLIC_TORQUE, 1_000_000);
    rig.configuration.max_torque_pm = 200.0;
    for (target, ends, limited) in [
        (300, 200.0, true),
        (-201, -200.0, true),
        (200, 200.0, false),
    ] {
        rig.targets.torque_pm = target;
        rig.receive(Target::Torque);
        rig.run_ms(1);
        assert!((rig.sample().torque_pm - ends).abs() < 1e-3, "{target}");
        assert_eq!(rig.status() & LIMIT != 0, limited, "{target}");
        assert_eq!(rig.axis.conditions().torque_limited, limited, "{target}");
    }
    // What the controllers say counts too.
    rig.actual.limited = true;
    rig.run_ms(1);
    assert_eq!(rig.status() & LIMIT, LIMIT);
}

#[test]
fn the_standard_follows_from_the_first_set_point_after_enabling() {
    let mut rig = Rig::new(&STANDARD);
    rig.mode(Mode::CYCLIC_POSITION).expect("mode 8");
    rig.place(77);
    rig.targets.position = 1000;
    rig.receive(Target::Position); // not enabled: no set-point
    rig.word(0x06);
    rig.word(0x0F);
    rig.run_ms(5);
    assert_eq!(rig.sample().position, 77.0);
    rig.receive(Target::Position);
    rig.run_ms(1);
    assert_eq!(rig.sample().position, 1000.0);
}

#[test]
fn several_writes_may_come_before_the_demand_is_taken() {
    // One RPDO with controlword, mode and target: what the control half said of its demand is old.
    let mut axis = cia402::Axis::new(&P3);
    axis.initialised();
    let configuration = cia402::Configuration::default();
    let targets = cia402::Targets {
        position: 1100,
        ..Default::default()
    };
    let actual = cia402::Actual {
        position: 1000,
        demand_position: -777,
        demand_fraction: 0.5,
        demand_velocity: 1e6,
        ..Default::default()
    };
    axis.write_controlword(0x06, &configuration, &targets, &actual);
    axis.write_controlword(0x0F, &configuration, &targets, &actual);
    axis.write_mode(8, &configuration, &targets, &actual)
        .expect("mode 8");
    axis.set_point(Target::Position, &configuration, &targets, &actual);
    let expected = Demand::Position {
        start: 1000,
        fraction: 0.0,
        velocity: 100_000.0,
        acceleration: 0.0,
        velocity_offset: 0.0,
        torque_offset_pm: 0.0,
        duration_ns: 1_000_000,
    };
    assert_eq!(axis.take_demand(), Some(expected));
    assert_eq!(axis.take_demand(), None);
}

#[test]
fn the_slope_stays_the_masters_when_set_points_jitter() {
    // Each millisecond 100 counts; every third set-point is handled 50 µs early. The one before
    // then has a control period left, which is added to its own: the speed does not change.
    let mut rig = enabled(Mode::CYCLIC_POSITION, 1_000_000);
    let mut target = 0;
    let mut early = 0;
    for n in 0..30u64 {
        target += 100;
        rig.targets.position = target;
        let left_ns = if n % 3 == 2 { 50_000 } else { 0 };
        run_ns(&mut rig, 1_000_000 + early - left_ns);
        early = left_ns;
        rig.actual.demand_left_ns = left_ns as u32;
        rig.receive(Target::Position);
        let Demand::Position { velocity, .. } = *rig.axis.demand() else {
            panic!("a position demand");
        };
        if n > 0 {
            assert!((velocity - 100_000.0).abs() < 1.0, "{n}: {velocity}");
        }
    }
    // More than a quarter of the period is not jitter: the last segment is cut short.
    run_ns(&mut rig, 500_000);
    rig.actual.demand_left_ns = 500_000;
    rig.targets.position = target + 100;
    rig.receive(Target::Position);
    let Demand::Position {
        velocity,
        duration_ns,
        ..
    } = *rig.axis.demand()
    else {
        panic!("a position demand");
    };
    assert_eq!(duration_ns, 1_000_000);
    assert!((velocity - 150_000.0).abs() < 6_000.0, "{velocity}");
}
