//! Modes without a state machine, and what the motor does in them.

use crate::bench::{of, operational, quiet};
use crate::master::SAVE;

const PER_TURN: f64 = 4096.0;

#[test]
fn modes_are_chosen_without_a_state_machine() {
    let mut master = operational(&[1]);
    for mode in [1, 3, 4, 6, 7, 0] {
        master.write(1, 0x6060, 0, &[mode]);
        assert_eq!(master.read(1, 0x6061, 0), i32::from(mode));
        assert_eq!(master.read(1, 0x3F00, 8), i32::from(mode));
    }
    // 5 is reserved; the others are not listed.
    master.write(1, 0x6060, 0, &[1]);
    for mode in [2, 5, 8, 9, 10, 0xFF, 0x80] {
        assert_eq!(master.try_write(1, 0x6060, 0, &[mode]), Err(0x0609_0030));
        assert_eq!(master.try_write(1, 0x3F60, 0, &[mode]), Err(0x0609_0030));
        assert_eq!(master.read(1, 0x6061, 0), 1);
    }
}

/// A streamed position, in the low 16 bits of the objects, as the example has it (l.280).
#[test]
fn position_follows_at_once() {
    let mut master = operational(&[1]);
    for (index, sub, value) in [
        (0x1600, 1, &[0x10, 0x00, 0x7A, 0x60][..]),
        (0x1600, 0, &[1]),
        (0x1A00, 1, &[0x10, 0x00, 0x63, 0x60]),
        (0x1A00, 0, &[1]),
        (0x1800, 2, &[0]),
    ] {
        master.write(1, index, sub, value);
    }
    master.write_i32(1, 0x3F63, 0, 0);
    assert!(master.position(1).abs() <= 1);
    // The motor is free until a mode is chosen, whatever target comes.
    master.send(0x201, &[0x00, 0x10]);
    master.run_ms(100);
    assert!(master.position(1).abs() <= 2);
    master.write(1, 0x6060, 0, &[1]);
    master.run_ms(20);
    assert!(master.position(1).abs() <= 2, "nothing jumps");
    let mut target = 0i16;
    for (n, step) in [100; 20].into_iter().chain([-150; 30]).enumerate() {
        target += step;
        // J5: two bytes, or four.
        let [low, high] = target.to_le_bytes();
        let data = [low, high, 0x55, 0xAA];
        master.send(0x201, &data[..if n % 2 == 0 { 2 } else { 4 }]);
        master.run_ms(4);
    }
    assert_eq!(target, -2500);
    master.run_ms(300);
    assert!((master.position(1) - -2500).abs() <= 3, "sign extended");
    assert_eq!(master.read(1, 0x607A, 0), -2500);
    assert_eq!(master.read(1, 0x6062, 0), -2500);
    let frames = of(&mut master, 0x080, &[]);
    let [(0x181, data)] = frames.as_slice() else {
        panic!("{frames:02X?}")
    };
    let shown = i16::from_le_bytes([data[0], data[1]]);
    assert!((i32::from(shown) - -2500).abs() <= 3, "{shown}");
    // Held against the hand; idle lets go.
    master.drive(1).plant().set_load_torque_nm(0.01);
    master.run_ms(500);
    assert!((master.position(1) - -2500).abs() <= 60);
    master.write(1, 0x6060, 0, &[0]);
    master.run_ms(100);
    assert!((master.position(1) - -2500).abs() > 1000);
}

/// J13: Q16.16 rad/s at the shaft, which turns as fast.
#[test]
fn velocity_in_radians() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    for rad_per_s in [100.0, -250.5] {
        let target = (rad_per_s * 65_536.0) as i32;
        master.write_i32(1, 0x60FF, 0, target);
        master.run_ms(800);
        let truth = f64::from(master.drive(1).plant().truth().speed_rad_s);
        assert!((truth - rad_per_s).abs() < 2.0, "{truth}");
        let demand = f64::from(master.read(1, 0x606B, 0)) / 65_536.0;
        assert!((demand - rad_per_s).abs() < 0.01, "{demand}");
        let shown = f64::from(master.read(1, 0x606C, 0)) / 65_536.0;
        assert!((shown - rad_per_s).abs() < 4.0, "{shown}");
        let counts = f64::from(master.read(1, 0x6069, 0));
        let expected = rad_per_s * PER_TURN / std::f64::consts::TAU;
        assert!((counts - expected).abs() < 2500.0, "{counts}");
        // Counts/ms, in two's complement.
        let property = master.read(1, 0x3F00, 44);
        assert!(
            (f64::from(property) - expected / 1000.0).abs() < 3.0,
            "{property}"
        );
    }
    // The ramp is 0x6083: 100,000 counts/s².
    master.write_i32(1, 0x60FF, 0, 0);
    master.run_ms(800);
    master.write_i32(1, 0x6083, 0, 100_000);
    master.write_i32(1, 0x60FF, 0, 100 << 16);
    master.run_ms(300);
    let turns = f64::from(master.drive(1).plant().truth().speed_rad_s) / std::f64::consts::TAU;
    let counts = turns * PER_TURN;
    assert!((counts - 30_000.0).abs() < 1500.0, "{counts}");
}

/// J15: 0x6074 drives mode 4. Per mille of 23 mNm on a rotor of 4.45 gcm².
#[test]
fn torque_accelerates() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[4]);
    for effort in [100i16, -200] {
        let before = f64::from(master.drive(1).plant().truth().speed_rad_s);
        master.write_i16(1, 0x6074, 0, effort);
        master.run_ms(50);
        let after = f64::from(master.drive(1).plant().truth().speed_rad_s);
        let expected = f64::from(effort) * 23e-6 / 4.45e-7 * 0.05;
        let gained = after - before;
        assert!(
            (gained - expected).abs() < 0.08 * expected.abs(),
            "{gained} {expected}"
        );
        let shown = master.read(1, 0x3F00, 42);
        assert!((shown - i32::from(effort)).abs() < 30, "{shown}");
    }
    master.write_i16(1, 0x6074, 0, 0);
    master.run_ms(5);
    assert!(master.read(1, 0x3F00, 22).abs() < 30, "mA");
}

/// MV, 900 counts/ms, cuts what 0x60FF asks for.
#[test]
fn no_demand_is_faster_than_mv() {
    const MOST: f64 = 900_000.0;
    let mut master = operational(&[1]);
    assert_eq!(master.read(1, 0x3F00, 45), 900);
    master.write(1, 0x6060, 0, &[3]);
    for sign in [1, -1] {
        master.write_i32(1, 0x60FF, 0, sign * (2000 << 16));
        master.run_ms(2500);
        let demand = f64::from(master.read(1, 0x606B, 0)) / 65_536.0;
        let most = f64::from(sign) * MOST / PER_TURN * std::f64::consts::TAU;
        assert!((demand - most).abs() < 0.1, "{demand} rad/s");
    }
}

/// J15: mode 7 goes to each written target by the trapezoid of 0x6083, 0x6084 and MV.
#[test]
fn the_trapezoid() {
    let mut master = operational(&[1]);
    master.write_i32(1, 0x3F63, 0, 0);
    // A target of before does not count.
    master.write_i32(1, 0x607A, 0, 20_000);
    master.write_i32(1, 0x6083, 0, 400_000);
    master.write_i32(1, 0x6084, 0, 400_000);
    master.write(1, 0x6060, 0, &[7]);
    master.run_ms(100);
    assert!(master.position(1).abs() <= 3);
    // 40,000 counts at 400,000 counts/s²: 2·√(40,000/400,000) = 632 ms, at most 126,491 counts/s.
    master.write_i32(1, 0x607A, 0, 40_000);
    let mut fastest = 0;
    let mut took = 0;
    while (master.position(1) - 40_000).abs() > 40 {
        fastest = fastest.max(master.read(1, 0x6069, 0));
        took += 1;
        master.run_ms(1);
        assert!(took < 2000);
    }
    println!("the way took {took} readings, fastest {fastest} counts/s");
    assert!((110_000..140_000).contains(&fastest), "{fastest}");
    master.run_ms(200);
    assert!(
        (master.position(1) - 40_000).abs() <= 5,
        "no overshoot left"
    );
    // The same target again changes nothing; another one in mid-way is gone to at once.
    master.write_i32(1, 0x607A, 0, 40_000);
    master.run_ms(100);
    assert!((master.position(1) - 40_000).abs() <= 5);
    master.write_i32(1, 0x607A, 0, 80_000);
    master.run_ms(200);
    master.write_i32(1, 0x607A, 0, 30_000);
    master.run_ms(1500);
    assert!((master.position(1) - 30_000).abs() <= 5);
    // Through position mode and back.
    master.write(1, 0x6060, 0, &[1]);
    master.write(1, 0x6060, 0, &[7]);
    master.write_i32(1, 0x607A, 0, 31_000);
    master.run_ms(500);
    assert!((master.position(1) - 31_000).abs() <= 5);
}

/// Mode 7 takes a target that is written after it was chosen, also where both come with one SYNC: RPDO 1 is
/// applied before RPDO 2.
#[test]
fn a_mode_forgets_the_target_that_came_before_it() {
    const MODE: [u8; 4] = [8, 0, 0x60, 0x60];
    const TARGET: [u8; 4] = [32, 0, 0x7A, 0x60];
    for (first, second, goes_to) in [(TARGET, MODE, 0), (MODE, TARGET, 5000)] {
        let mut master = operational(&[1]);
        for (n, entry) in [(0, first), (1, second)] {
            master.write(1, 0x1600 + n, 1, &entry);
            master.write(1, 0x1600 + n, 0, &[1]);
            master.write(1, 0x1400 + n, 2, &[1]);
        }
        master.write_i32(1, 0x3F63, 0, 0);
        master.write(1, 0x6060, 0, &[7]);
        master.run_ms(20);
        for (id, entry) in [(0x201, first), (0x301, second)] {
            match entry {
                TARGET => master.send(id, &5000_i32.to_le_bytes()),
                _ => master.send(id, &[7]),
            }
        }
        master.send(0x080, &[]);
        master.run_ms(1000);
        assert_eq!(master.read(1, 0x607A, 0), 5000);
        let place = master.position(1);
        assert!((place - goes_to).abs() <= 5, "{place}");
    }
}

/// 0x3F60 is taken with the first start, saved or not; what the master chooses stays.
#[test]
fn default_mode() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x80, 1]);
    master.write(1, 0x3F60, 0, &[1]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 1);
    assert_eq!(master.read(1, 0x6060, 0), 1);
    // Not anew.
    master.write(1, 0x6060, 0, &[0]);
    of(&mut master, 0, &[0x80, 1]);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    // A mode chosen before operational stays.
    assert_eq!(master.try_write(1, 0x1010, 1, &SAVE), Ok(()));
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x80, 1]);
    assert_eq!(master.read(1, 0x3F60, 0), 1, "it was saved");
    master.write(1, 0x6060, 0, &[3]);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 3);
}

/// From every mode to every mode, turning: the motor is free in 0 and 6 and under power in the others.
#[test]
fn every_mode_from_every_mode() {
    const MODES: [u8; 6] = [0, 1, 3, 4, 6, 7];
    for from in MODES {
        for to in MODES {
            let mut master = operational(&[1]);
            master.write_i32(1, 0x60FF, 0, 30 << 16);
            master.write_i16(1, 0x6074, 0, 30);
            master.write(1, 0x6060, 0, &[from]);
            master.run_ms(100);
            let before = f64::from(master.drive(1).plant().truth().speed_rad_s);
            master.write(1, 0x6060, 0, &[to]);
            assert_eq!(master.read(1, 0x6061, 0), i32::from(to));
            assert_eq!(master.read(1, 0x6060, 0), i32::from(to));
            let core = master.drive(1).core().expect("it has booted");
            let is_free = matches!(to, 0 | 6);
            assert_eq!(core.comms().axis().is_powered(), !is_free, "{from} {to}");
            master.run_ms(200);
            let after = f64::from(master.drive(1).plant().truth().speed_rad_s);
            match to {
                // It coasts.
                0 | 6 => assert!(after.abs() <= before.abs() + 0.5, "{from} {to}: {after}"),
                // It stands, where no target has come.
                1 | 7 => assert!(after.abs() < 2.0, "{from} {to}: {after}"),
                3 => assert!((after - 30.0).abs() < 2.0, "{from} {to}: {after}"),
                _ => assert!(after > before.min(29.0), "{from} {to}: {after}"),
            }
        }
    }
}
