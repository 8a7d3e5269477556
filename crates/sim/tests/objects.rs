//! Objects of the P3 that have no test file of their own: what each does, seen from the bus.

mod master;
use master::*;

const OUT_OF_RANGE: u32 = 0x0609_0030;

/// Limits beyond the hardware's are refused and change nothing.
#[test]
fn limits_beyond_the_hardware_are_refused() {
    let mut master = Master::new(&[1]);
    for (index, sub, most, bytes) in [
        (0x3001, 1, 100_000_i32, 4),
        (0x3001, 8, 3_500, 2),
        (0x3001, 9, 27_713, 2),
        (0x3011, 8, 3_500, 2),
        (0x3011, 9, 3_500, 2),
        (0x2110, 0, 350, 2),
        (0x2111, 0, 350, 2),
        (0x2384, 6, 560, 2),
        (0x2384, 7, 480, 2),
        (0x2384, 9, 85, 1),
        (0x220A, 0, 155, 1),
        (0x6072, 0, 1_000, 2),
        (0x3013, 5, 10_000, 4),
    ] {
        let before = master.read(1, index, sub);
        let too_much = (most + 1).to_le_bytes();
        let refused = master.try_write(1, index, sub, &too_much[..bytes]);
        assert_eq!(refused, Err(OUT_OF_RANGE), "{index:04X},{sub}");
        assert_eq!(master.read(1, index, sub), before);
        master.write(1, index, sub, &most.to_le_bytes()[..bytes]);
    }
    let refused = master.try_write(1, 0x3001, 1, &19_999_u32.to_le_bytes());
    assert_eq!(refused, Err(OUT_OF_RANGE));
}

/// 0x3001,9: at 6 V of phase amplitude the motor runs a quarter as fast as at 27.7 V.
#[test]
fn the_phase_voltage_limits_the_speed() {
    let run = |millivolts: u16| {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x3001, 9, millivolts);
        master.write_i32(1, 0x60C5, 0, 0);
        master.write_i32(1, 0x6083, 0, 20_000_000);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, 880_000);
        master.run_ms(1_500);
        assert_ne!(master.status(1) & 0x0800, 0, "internal limit");
        f64::from(master.read(1, 0x606C, 0))
    };
    // Flux linkage 21.04 mWb: 6 V at 285 rad/s, less what the current takes.
    let slow = run(6_000);
    let wanted = 6.0 / 0.02104 / std::f64::consts::TAU * 4096.0;
    assert!(slow < wanted && slow > 0.9 * wanted, "{slow} {wanted}");
    assert!(run(12_000) > 1.9 * slow);
}

/// 0x3001,8 and 0x3011,9: the lower one limits what flows.
#[test]
fn the_current_is_limited_by_amplifier_and_motor() {
    for (index, sub) in [(0x3001, 8), (0x3011, 9)] {
        let mut master = Master::new(&[1]);
        master.write_u16(1, index, sub, 300);
        master.drive(1).plant().set_blocked(true);
        master.enable(1, 4);
        master.write_i16(1, 0x6071, 0, 1_000);
        master.run_ms(100);
        let current = master.read_i16(1, 0x6078, 0);
        assert!(
            (current - 300).abs() < 15,
            "{index:04X},{sub}: {current} mA"
        );
    }
}

/// 0x3022 and 0x3010,3: the converters as they are; 0x3000: supply and temperature.
#[test]
fn converters_are_shown() {
    let mut master = Master::new(&[1]);
    let signals = master.drive(1).plant().signals();
    for (sub, adc) in [(1, signals.auxiliary_adc[0]), (2, signals.auxiliary_adc[1])] {
        let shown = f64::from(master.read(1, 0x3022, sub));
        assert!((shown - f64::from(adc)).abs() <= 1.0, "{shown} {adc}");
    }
    let shown = f64::from(master.read(1, 0x3010, 3));
    let adc = f64::from(signals.motor_temperature_adc);
    assert!((shown - adc).abs() <= 2.0, "{shown} {adc}");
    assert!((master.read(1, 0x3000, 1) - 480).abs() <= 3);
    master.drive(1).plant().set_amplifier_temperature_c(61.0);
    master.run_ms(200);
    assert!((master.read_i16(1, 0x3000, 2) - 61).abs() <= 1);
}

/// 0x3011,2 and 0x607E: the wrong order of phases cannot be driven, the user's direction is a matter
/// of names.
#[test]
fn polarities() {
    let run = |electrical: i8, user: i8| {
        let mut master = Master::new(&[1]);
        master.write(1, 0x3011, 2, &[electrical as u8]);
        master.write(1, 0x607E, 0, &[user as u8]);
        let raw = i64::from(master.read_i16(1, 0x3012, 1));
        master.enable(1, 4);
        master.write_i16(1, 0x6071, 0, 100);
        master.run_ms(10);
        let shown = master.read(1, 0x606C, 0);
        let turned = i64::from(master.read_i16(1, 0x3012, 1)) - raw;
        (shown, (turned + 2048).rem_euclid(4096) - 2048)
    };
    let (shown, turned) = run(1, 1);
    assert!(shown > 1_000 && turned > 0, "{shown} {turned}");
    let (shown, turned) = run(1, -1);
    assert!(shown > 1_000 && turned < 0, "{shown} {turned}");
    let (shown, _) = run(-1, 1);
    assert!(shown < 0, "{shown}");
    let mut master = Master::new(&[1]);
    for index in [(0x3011, 2), (0x607E, 0)] {
        assert_eq!(
            master.try_write(1, index.0, index.1, &[0]),
            Err(OUT_OF_RANGE)
        );
    }
}

/// 0x60B0: a cyclic position with an offset; 0x607D: the target is cut to its limits.
#[test]
fn a_position_offset_moves_the_target_and_limits_cut_it() {
    let mut master = Master::new(&[1]);
    master.enable(1, 8);
    let start = master.position(1);
    master.write_i32(1, 0x60B0, 0, 300);
    master.write_i32(1, 0x607A, 0, start);
    master.run_ms(500);
    assert!((master.position(1) - start - 300).abs() <= 3);
    master.write_i32(1, 0x607D, 1, start - 100);
    master.write_i32(1, 0x607D, 2, start + 200);
    master.write_i32(1, 0x607A, 0, start);
    master.run_ms(500);
    assert!((master.position(1) - start - 200).abs() <= 3);
    assert_ne!(master.status(1) & 0x0800, 0);
    master.write_i32(1, 0x607A, 0, start - 2_000);
    master.run_ms(500);
    assert!((master.position(1) - start + 100).abs() <= 3);
}

/// 0x60C2: a cyclic velocity runs to its target for as long as the period says.
#[test]
fn the_interpolation_period_is_the_time_of_a_set_point() {
    let demand = |value: u8, scale: i8, ms: u64| {
        let mut master = Master::new(&[1]);
        master.write(1, 0x60C2, 1, &[value]);
        master.write(1, 0x60C2, 2, &[scale as u8]);
        master.enable(1, 9);
        master.write_i32(1, 0x60FF, 0, 100_000);
        master.run_ms(ms);
        master.read(1, 0x6043, 0)
    };
    for (value, scale) in [(20, -3), (2, -2)] {
        let half = demand(value, scale, 10);
        assert!((half - 50_000).abs() < 8_000, "{value}e{scale}: {half}");
        assert_eq!(demand(value, scale, 25), 100_000);
    }
    let mut master = Master::new(&[1]);
    assert_eq!(master.try_write(1, 0x60C2, 2, &[1]), Err(OUT_OF_RANGE));
}

/// 0x3011,1 and 3, 0x3012, 0x3013,1: they make the electrical angle of a reading.
#[test]
fn zero_poles_and_resolution_make_the_angle() {
    let mut master = Master::new(&[1]);
    master.drive(1).plant().set_blocked(true);
    for (zero, poles, counts) in [
        (0x0DF8_i32, 2, 4096),
        (100, 2, 4096),
        (100, 4, 4096),
        (100, 14, 4096),
        (100, 4, 8192),
    ] {
        master.write_i16(1, 0x3011, 1, zero as i16);
        master.write(1, 0x3011, 3, &[poles as u8]);
        master.write_i32(1, 0x3013, 1, counts);
        master.run_ms(2);
        let raw = i32::from(master.read_i16(1, 0x3012, 1));
        let turns = f64::from((raw - zero) * poles / 2) / f64::from(counts);
        let shown = f64::from(master.read_i16(1, 0x60EA, 0)) / 65_536.0;
        let off = (turns - shown + 0.5).rem_euclid(1.0) - 0.5;
        assert!(off.abs() < 1e-3, "{zero} {poles} {counts}: {shown} {turns}");
    }
    for poles in [0, 1, 127] {
        let refused = master.try_write(1, 0x3011, 3, &[poles]);
        assert_eq!(refused, Err(OUT_OF_RANGE));
    }
}

/// 0x3011,4 and 0x6076: the current of a target torque.
#[test]
fn torque_constant_and_rated_torque_make_the_current() {
    for (constant, rated) in [(32_u16, 23_i32), (64, 23), (32, 10)] {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x3011, 4, constant);
        master.write_i32(1, 0x6076, 0, rated);
        master.drive(1).plant().set_blocked(true);
        master.enable(1, 4);
        master.write_i16(1, 0x6071, 0, 500);
        master.run_ms(50);
        let wanted = 500.0 * f64::from(rated) / f64::from(constant);
        let got = f64::from(master.read_i16(1, 0x6078, 0));
        assert!((got - wanted).abs() < 12.0, "{got} {wanted}");
        assert!((master.read_i16(1, 0x6077, 0) - 500).abs() < 20);
    }
}

/// 0x3011,5 and 6, 0x3019,1 to 4: Kp = 2ζωL − R must not be negative.
#[test]
fn a_current_controller_that_cannot_be_is_a_parameter_error() {
    let cases: [(u16, u8, u16); 6] = [
        (0x3011, 5, 2_000),
        (0x3011, 6, 40),
        (0x3019, 1, 1_000),
        (0x3019, 2, 128),
        (0x3019, 3, 1_000),
        (0x3019, 4, 128),
    ];
    for (index, sub, value) in cases {
        let mut master = Master::new(&[1]);
        let good = master.read(1, index, sub) as u16;
        master.write_u16(1, index, sub, value);
        master.run_ms(3);
        assert_eq!(master.emergency_codes(1), [0x6320], "{index:04X},{sub}");
        assert_eq!(master.state(1), FAULT);
        master.write_u16(1, index, sub, good);
        master.write_u16(1, 0x6040, 0, 0x80);
        master.run_ms(3);
        assert_eq!(master.state(1), SWITCH_ON_DISABLED);
    }
}

/// 0x3011,10 and 0x2112: how long the peak current may last.
#[test]
fn the_peak_time_sets_when_i2t_limits() {
    let limited_after_ms = |set: fn(&mut Master)| {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x2111, 0, 50);
        set(&mut master);
        master.drive(1).plant().set_blocked(true);
        master.enable(1, 4);
        master.write_i16(1, 0x6071, 0, 1_000);
        let mut ms = 0;
        while !master.emergency_codes(1).contains(&0x2310) {
            master.run_ms(10);
            ms += 10;
            assert!(ms < 20_000);
        }
        f64::from(ms)
    };
    let motor = limited_after_ms(|master| master.write_i16(1, 0x3011, 10, 400));
    let longer = limited_after_ms(|master| master.write_i16(1, 0x3011, 10, 800));
    let user = limited_after_ms(|master| master.write_u16(1, 0x2112, 0, 400));
    assert!((longer / motor - 2.0).abs() < 0.1, "{motor} {longer}");
    assert!((user / motor - 1.0).abs() < 0.1, "{motor} {user}");
}

/// What says who the drive is.
#[test]
fn identity_and_constants() {
    let mut master = Master::new(&[1]);
    for (index, sub, value) in [
        (0x1000, 0, 0x0002_0192),
        (0x1005, 0, 0x80),
        (0x1006, 0, 0),
        (0x1018, 1, 0x408),
        (0x1018, 2, 0x5033),
        (0x1018, 3, 0x0001_0000),
        (0x1200, 1, 0x601),
        (0x1200, 2, 0x581),
        (0x6502, 0, 0x07AD),
    ] {
        assert_eq!(master.read(1, index, sub), value, "{index:04X},{sub}");
    }
    let serial = master.read(1, 0x1018, 4) as u32;
    assert_eq!(serial, master.drive(1).serial());
    // Four characters are what an expedited answer takes.
    for (index, text) in [(0x1008, "P3"), (0x1009, "sim"), (0x100A, "0.1")] {
        let bytes = master.try_read(1, index, 0).unwrap();
        let shown: Vec<u8> = bytes.into_iter().take_while(|byte| *byte != 0).collect();
        assert_eq!(shown, text.as_bytes());
    }
}

/// Objects that the drive only keeps, as its page says: written, read back, stored.
#[test]
fn what_is_only_kept_is_kept() {
    let kept: [(u16, u8); 7] = [
        (0x1015, 0),
        (0x1800, 3),
        (0x1801, 3),
        (0x1802, 3),
        (0x1803, 3),
        (0x1800, 5),
        (0x1803, 5),
    ];
    let mut master = Master::new(&[1]);
    for (n, (index, sub)) in kept.into_iter().enumerate() {
        master.write_u16(1, index, sub, 0x0101 + n as u16);
    }
    master.write(1, 0x1010, 1, &SAVE);
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    for (n, (index, sub)) in kept.into_iter().enumerate() {
        let value = master.read(1, index, sub);
        assert_eq!(value, 0x0101 + n as i32, "{index:04X},{sub}");
    }
    assert_eq!(master.read(1, 0x1800, 4), 0);
    assert!(master.try_write(1, 0x1800, 4, &[1]).is_err());
}
