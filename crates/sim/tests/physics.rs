//! The simulated motor as an outside master sees it: everything here goes over the bus, but for the
//! hands that block the shaft.

mod master;
use master::*;

use std::f64::consts::TAU;

/// What a master knows of the motor, from the drive's own objects.
struct Figures {
    rated_torque_nm: f64,
    inertia_kgm2: f64,
    torque_constant: f64,
    counts: f64,
}

fn figures(master: &mut Master) -> Figures {
    Figures {
        rated_torque_nm: f64::from(master.read(1, 0x6076, 0)) * 1e-3,
        // gcm² · 2¹⁵
        inertia_kgm2: f64::from(master.read(1, 0x3011, 7)) / 32768.0 * 1e-7,
        torque_constant: f64::from(master.read(1, 0x3011, 4)) * 1e-3,
        counts: f64::from(master.read(1, 0x3013, 1)),
    }
}

/// Positions at SYNC, from TPDO1.
fn map_position(master: &mut Master) {
    master.write(1, 0x1A00, 0, &[0]);
    master.write(1, 0x1A00, 1, &[0x20, 0x00, 0x64, 0x60]);
    master.write(1, 0x1A00, 2, &[0x10, 0x00, 0x78, 0x60]);
    master.write(1, 0x1A00, 0, &[2]);
    master.write(1, 0x1800, 2, &[1]);
}

/// One SYNC each `ms`; position, counts, and current, mA, of each.
fn observe(master: &mut Master, samples: usize, ms: u64) -> Vec<(f64, f64)> {
    let mut seen = Vec::new();
    for _ in 0..samples {
        master.log.clear();
        master.send(0x80, &[]);
        master.run_ms(ms);
        let tpdo = master.log.iter().find(|t| t.frame.raw_id() == 0x181);
        let bytes = tpdo.unwrap().frame.bytes();
        let position = i32::from_le_bytes(bytes[..4].try_into().unwrap());
        let current = i16::from_le_bytes(bytes[4..6].try_into().unwrap());
        seen.push((f64::from(position), f64::from(current)));
    }
    seen
}

/// Acceleration in counts/s² from positions each `dt`: what the second half of the time adds to the
/// way of the first.
fn acceleration(positions: &[(f64, f64)], dt: f64) -> f64 {
    let m = (positions.len() - 1) / 2;
    let way = |from: usize| positions[from + m].0 - positions[from].0;
    (way(m) - way(0)) / (dt * dt * (m * m) as f64)
}

#[test]
fn torque_over_inertia_is_the_acceleration() {
    for permille in [100, -100, 300, 600, 1000, -1000] {
        let mut master = Master::new(&[1]);
        let own = figures(&mut master);
        map_position(&mut master);
        master.enable(1, 4);
        master.write_i16(1, 0x6071, 0, permille);
        master.run_ms(1);
        // At the rated torque the supply has no more voltage after 20 ms.
        let seen = observe(&mut master, 18, 1);
        let torque = own.rated_torque_nm * f64::from(permille) / 1000.0;
        let wanted = torque / own.inertia_kgm2 * own.counts / TAU;
        let got = acceleration(&seen, 1e-3);
        assert!(
            (got / wanted - 1.0).abs() < 0.05,
            "{permille}: {got} {wanted}"
        );
        let current = seen.iter().map(|s| s.1).sum::<f64>() / seen.len() as f64 * 1e-3;
        let by_current = current * own.torque_constant;
        assert!(
            (by_current / torque - 1.0).abs() < 0.03,
            "{by_current} {torque}"
        );
        // 0x6077 and 0x3023,1 say the same.
        assert!((master.read_i16(1, 0x6077, 0) - permille).abs() <= 20);
        assert_eq!(master.read_i16(1, 0x3023, 1), permille);
    }
}

#[test]
fn a_lower_torque_limit_slows_the_ramp_in_every_mode() {
    for mode in [1, 3, 4, 9] {
        let mut got = Vec::new();
        for limit in [600, 200] {
            let mut master = Master::new(&[1]);
            let own = figures(&mut master);
            map_position(&mut master);
            master.write_i16(1, 0x6072, 0, limit);
            for (object, rate) in [(0x6083, 1_000_000_000), (0x60C5, 0), (0x6081, 800_000)] {
                master.write_i32(1, object, 0, rate);
            }
            master.enable(1, mode);
            master.write_i16(1, 0x6071, 0, 1000);
            master.write_i32(1, 0x60FF, 0, 800_000);
            let to = master.position(1) + 10_000_000;
            master.write_i32(1, 0x607A, 0, to);
            master.write_u16(1, 0x6040, 0, 0x1F);
            master.run_ms(1);
            let seen = observe(&mut master, 15, 1);
            let torque = own.rated_torque_nm * f64::from(limit) / 1000.0;
            let wanted = torque / own.inertia_kgm2 * own.counts / TAU;
            let a = acceleration(&seen, 1e-3);
            assert!(
                (a / wanted - 1.0).abs() < 0.05,
                "mode {mode}, {limit}: {a} {wanted}"
            );
            // Internal limit active (bit 11).
            assert_ne!(master.status(1) & 0x0800, 0, "mode {mode}");
            got.push(a);
        }
        assert!((got[0] / got[1] - 3.0).abs() < 0.15, "{got:?}");
    }
}

#[test]
fn the_following_error_is_there_while_moving_and_gone_afterwards() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x6083, 0, 20_000_000);
    master.write_i32(1, 0x6084, 0, 20_000_000);
    master.write_i32(1, 0x6081, 0, 800_000);
    master.enable(1, 1);
    let to = master.position(1) + 200_000;
    master.write_i32(1, 0x607A, 0, to);
    master.write_u16(1, 0x6040, 0, 0x1F);
    let mut errors = Vec::new();
    for _ in 0..100 {
        master.run_ms(2);
        errors.push(master.read(1, 0x60F4, 0));
    }
    let moved = errors.iter().filter(|error| **error != 0).count();
    assert!(moved > 10, "{errors:?}");
    // Without acceleration feed-forward a critically damped velocity loop lags by (1 − (1 + ωt)e^−ωt)
    // a/ω² after a step of acceleration, before the position loop takes it back: at most 50.7 counts
    // for 2π·100 Hz.
    let most = errors.iter().map(|error| error.abs()).max().unwrap();
    assert!((10..51).contains(&most), "{errors:?}");
    master.run_ms(300);
    assert!(master.read(1, 0x60F4, 0).abs() <= 1);
    assert!((master.position(1) - to).abs() <= 1);
}

#[test]
fn a_blocked_shaft_heats_the_motor_until_i2t_limits() {
    let mut master = Master::new(&[1]);
    // 0.5 A for ever, 0.7 A for 100 ms. Literally summed: 0.7·0.1 = 0.07 of (0.49 − 0.25)/s, so the
    // limit acts after 0.292 s.
    master.write_u16(1, 0x2110, 0, 70);
    master.write_u16(1, 0x2111, 0, 50);
    master.write_u16(1, 0x2112, 0, 100);
    master.enable(1, 4);
    master.drive(1).plant().set_blocked(true);
    master.log.clear();
    // 0.7188 A asked for, cut at 0.7 A.
    master.write_i16(1, 0x6071, 0, 1000);
    let from = master.now();
    master.run_ms(20);
    assert!((master.read_i16(1, 0x6078, 0) - 700).abs() <= 10);
    assert_eq!(master.status(1) & 0x80, 0);
    master.run_ms(600);
    let warned = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x81)
        .unwrap();
    let seconds = warned.at.since_ns(from) as f64 * 1e-9;
    assert!((seconds - 0.07 / 0.24).abs() < 0.006, "{seconds}");
    assert_eq!(warned.frame.bytes(), [0x10, 0x23, 0x03, 0, 0, 0, 0, 0]);
    assert!((master.read_i16(1, 0x6078, 0) - 500).abs() <= 10);
    // A warning: still enabled, statusword bit 7, error objects.
    assert_eq!(master.state(1), OPERATION_ENABLED);
    assert_ne!(master.status(1) & 0x80, 0);
    assert_eq!(master.read(1, 0x1001, 0), 0x03);
    assert_eq!(master.read(1, 0x1002, 0), 1 << 4);
    assert_eq!(master.read(1, 0x603F, 0), 0x2310);
    assert_eq!(master.read(1, 0x1003, 1), 0x2310);
    // It ends by itself, and says so with the code in bytes 6 and 7.
    master.log.clear();
    master.write_i16(1, 0x6071, 0, 0);
    master.run_ms(600);
    assert_eq!(master.emergencies(1), [[0, 0, 0, 0, 0, 0, 0x10, 0x23]]);
    assert_eq!(master.status(1) & 0x80, 0);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    assert_eq!(master.read(1, 0x1002, 0), 0);
    // The last code stays in 0x603F (P17).
    assert_eq!(master.read(1, 0x603F, 0), 0x2310);
}

#[test]
fn every_mode_moves_the_motor_as_commanded() {
    let mut master = Master::new(&[1]);
    // 1: to a position, absolute and relative.
    master.enable(1, 1);
    let from = master.position(1);
    master.write_i32(1, 0x607A, 0, from - 20_000);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(400);
    assert!((master.position(1) - (from - 20_000)).abs() <= 1);
    assert_ne!(master.status(1) & 0x0400, 0);
    master.write_u16(1, 0x6040, 0, 0x0F);
    master.write_i32(1, 0x607A, 0, 5_000);
    master.write_u16(1, 0x6040, 0, 0x5F);
    master.run_ms(300);
    assert!((master.position(1) - (from - 15_000)).abs() <= 1);
    // 3: a velocity.
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, -100_000);
    master.run_ms(300);
    let velocity = master.read(1, 0x606C, 0);
    assert!((velocity + 100_000).abs() < 1_500, "{velocity}");
    assert_ne!(master.status(1) & 0x0400, 0);
    let before = master.position(1);
    master.run_ms(100);
    let moved = master.position(1) - before;
    assert!((moved + 10_000).abs() < 100, "{moved}");
    // 9: a velocity, cyclically.
    master.write(1, 0x6060, 0, &[9]);
    for _ in 0..300 {
        master.write_i32(1, 0x60FF, 0, 50_000);
        master.run_us(700);
    }
    let velocity = master.read(1, 0x606C, 0);
    assert!((velocity - 50_000).abs() < 1_000, "{velocity}");
    // 8: from motion to rest, then a position, cyclically.
    master.write(1, 0x6060, 0, &[8]);
    master.run_ms(300);
    let rest = master.position(1);
    master.run_ms(100);
    assert!((master.position(1) - rest).abs() <= 1);
    for step in 1..=200 {
        master.write_i32(1, 0x607A, 0, rest + step * 100);
        master.run_us(700);
    }
    master.run_ms(50);
    assert!((master.position(1) - rest - 20_000).abs() <= 1);
    assert_eq!(master.read(1, 0x60FC, 0), rest + 20_000);
    // 10: a torque, cyclically: it speeds up.
    master.write(1, 0x6060, 0, &[10]);
    master.write_i16(1, 0x6071, 0, 50);
    master.run_ms(50);
    let velocity = master.read(1, 0x606C, 0);
    assert!(velocity > 50_000, "{velocity}");
    assert!((master.read_i16(1, 0x6077, 0) - 50).abs() <= 20);
    // 0: no torque, so it hardly slows down.
    master.write(1, 0x6060, 0, &[0]);
    master.run_ms(20);
    assert!(master.read_i16(1, 0x6078, 0).abs() <= 10);
    let coasting = master.read(1, 0x606C, 0);
    assert!((f64::from(coasting) / f64::from(velocity) - 1.0).abs() < 0.1);
    assert_eq!(master.state(1), OPERATION_ENABLED);
    // 4 against the motion, down to its speed limit on the other side.
    master.write_i32(1, 0x6080, 0, 60_000);
    master.write(1, 0x6060, 0, &[4]);
    master.write_i16(1, 0x6071, 0, -100);
    master.run_ms(400);
    let velocity = master.read(1, 0x606C, 0);
    assert!((velocity + 60_000).abs() < 1_500, "{velocity}");
    assert_ne!(master.status(1) & 0x0800, 0, "internal limit active");
    // The step from one velocity to another met the acceleration limit 0x60C5 (a warning).
    let codes = master.emergency_codes(1);
    assert!(
        codes.iter().all(|code| [0, 0x8480].contains(code)),
        "{codes:04X?}"
    );
}

#[test]
fn velocity_limits_hold_and_say_so() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x607F, 0, 30_000);
    for mode in [3, 9] {
        master.enable(1, mode);
        for _ in 0..300 {
            master.write_i32(1, 0x60FF, 0, 90_000);
            master.run_us(700);
        }
        let velocity = master.read(1, 0x606C, 0);
        assert!((velocity - 30_000).abs() < 800, "mode {mode}: {velocity}");
        assert_eq!(master.read(1, 0x6043, 0), 30_000);
        assert_ne!(master.status(1) & 0x0800, 0, "mode {mode}");
        for _ in 0..300 {
            master.write_i32(1, 0x60FF, 0, 10_000);
            master.run_us(700);
        }
        assert_eq!(master.status(1) & 0x0800, 0, "mode {mode}");
    }
}

#[test]
fn the_position_can_be_renamed_while_it_is_held() {
    let mut master = Master::new(&[1]);
    master.enable(1, 1);
    master.run_ms(50);
    let turns = master.drive(1).plant().truth().position_turns();
    master.write_i32(1, 0x6064, 0, 1_000_000);
    master.run_ms(200);
    assert!((master.position(1) - 1_000_000).abs() <= 1);
    assert!(master.read(1, 0x60F4, 0).abs() <= 1);
    assert!((master.drive(1).plant().truth().position_turns() - turns).abs() < 1e-3);
    master.write_i32(1, 0x607A, 0, 1_004_096);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(300);
    assert!((master.position(1) - 1_004_096).abs() <= 1);
    let moved = master.drive(1).plant().truth().position_turns() - turns;
    assert!((moved - 1.0).abs() < 1e-3, "{moved}");
}

#[test]
fn the_position_can_be_renamed_in_the_middle_of_a_move() {
    let mut master = Master::new(&[1]);
    master.enable(1, 1);
    let from = master.position(1);
    let turns = master.drive(1).plant().truth().position_turns();
    master.write_i32(1, 0x607A, 0, from + 40_960);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(150);
    master.drive(1).take_extremes();
    master.write_i32(1, 0x6064, 0, -500_000);
    master.run_ms(20);
    assert!(master.position(1) < -490_000);
    // The motion goes on as if nothing had happened, to the same place.
    let extremes = master.drive(1).take_extremes();
    assert!(extremes.current_a < 0.1, "{extremes:?}");
    assert!(extremes.following_error_counts < 10.0, "{extremes:?}");
    master.run_ms(300);
    assert_ne!(master.status(1) & 0x0400, 0);
    let moved = master.drive(1).plant().truth().position_turns() - turns;
    assert!((moved - 10.0).abs() < 2e-3, "{moved}");
}

#[test]
fn a_cyclic_position_does_not_jump_when_sync_jitters() {
    let mut master = Master::new(&[1]);
    master.write(1, 0x1600, 1, &[0x20, 0x00, 0x7A, 0x60]);
    master.write(1, 0x1600, 0, &[1]);
    master.write(1, 0x1400, 2, &[0]);
    master.enable(1, 8);
    let from = master.position(1);
    // 100,000 counts/s: 5 counts a control period of 50 µs.
    let begin = master.now().0 / 50_000 * 50 + 1_000;
    let mut last = None;
    let (mut largest, mut least_velocity, mut current) = (0.0_f64, f64::MAX, 0.0_f64);
    let mut random = 1_u64;
    for k in 0..500_u64 {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let at = begin + k * 1_000 + (random >> 40) % 41 - 20;
        loop {
            let now = master.now().0 / 1_000;
            let boundary = (now / 50 + 1) * 50;
            master.run_us(boundary.min(at) - now);
            if boundary > at {
                break;
            }
            let seen = master.drive(1).core().unwrap().feedback();
            let demand = f64::from(seen.demand_position) + f64::from(seen.demand_fraction);
            if k > 100 {
                largest = largest.max(demand - last.unwrap_or(demand));
                least_velocity = least_velocity.min(f64::from(seen.demand_velocity));
                current = current.max(f64::from(seen.current_q_a).abs());
            }
            last = Some(demand);
        }
        let target = from + (k * 100) as i32;
        master.send(0x201, &target.to_le_bytes());
        master.send(0x80, &[]);
    }
    // The motor's share is an encoder count now and then.
    assert!((4.99..5.01).contains(&largest), "{largest}");
    assert!(least_velocity > 99_000.0, "{least_velocity}");
    assert!(current < 0.15, "{current}");
}

#[test]
fn another_pwm_frequency_is_another_control_rate_and_the_same_motion() {
    for hz in [20_000_u32, 40_000, 80_000, 100_000] {
        let mut master = Master::new(&[1]);
        map_position(&mut master);
        // Slower control needs slower loops.
        for sub in [1, 3] {
            master.write_u16(1, 0x3019, sub, 15_000);
        }
        master.write_u16(1, 0x3019, 10, 400);
        master.write(1, 0x3001, 1, &hz.to_le_bytes());
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, 50_000);
        master.run_ms(400);
        let seen = observe(&mut master, 101, 1);
        let moved = seen[100].0 - seen[0].0;
        assert!((moved - 5_000.0).abs() < 50.0, "{hz} Hz: {moved}");
        let timing = master.drive(1).core().unwrap().timing();
        assert_eq!((timing.frequency_hz, timing.periods_per_control), (hz, 5));
        let period = master.drive(1).plant().parameters().pwm_period_s;
        assert!((period * f64::from(hz) - 1.0).abs() < 1e-9);
        // And while moving, there and back.
        master.write(1, 0x3001, 1, &100_000_u32.to_le_bytes());
        master.run_ms(50);
        let seen = observe(&mut master, 101, 1);
        let moved = seen[100].0 - seen[0].0;
        assert!((moved - 5_000.0).abs() < 50.0, "back from {hz} Hz: {moved}");
        assert!(master.emergencies(1).is_empty());
    }
}

#[test]
fn a_single_cyclic_velocity_leaves_no_feed_forward_behind() {
    let mut master = Master::new(&[1]);
    master.enable(1, 9);
    master.write_i32(1, 0x60FF, 0, 100_000);
    let mut most = 0;
    for _ in 0..40 {
        master.run_ms(5);
        most = most.max(master.read(1, 0x606C, 0));
    }
    // The loop's own overshoot, not the current of an acceleration that is over.
    assert!(most < 106_000, "{most}");
    assert!((master.read(1, 0x606C, 0) - 100_000).abs() < 1_000);
    assert!(master.read_i16(1, 0x6078, 0).abs() < 60);
}

#[test]
fn a_velocity_that_is_reached_stays_reached_at_every_speed() {
    for velocity in [10_000, -50_000, 100_000, -270_000, 500_000, 800_000] {
        let mut master = Master::new(&[1]);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, velocity);
        master.run_ms(1_500);
        for _ in 0..1_000 {
            master.run_us(700);
            assert_ne!(master.status(1) & 0x0400, 0, "{velocity} counts/s");
        }
        // And not before: half of it is far away.
        master.drive(1).plant().set_blocked(true);
        master.run_ms(50);
        assert_eq!(master.status(1) & 0x0400, 0, "{velocity} counts/s, blocked");
    }
}
