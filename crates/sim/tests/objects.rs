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
