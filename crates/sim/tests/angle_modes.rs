//! Modes 11 and 12 on the simulated motor, as an outside master sees them, and the encoder's lag.

mod master;
use master::*;

use std::f64::consts::TAU;

const D_VOLTAGE: u8 = 4;
const Q_VOLTAGE: u8 = 5;

fn angle(degrees: f64) -> i16 {
    (degrees / 360.0 * 65_536.0).round() as i64 as i16
}

/// The dialogue of the manual (l.290): the raw reading is the electrical zero, and the current is
/// that of the voltage.
#[test]
fn mode_12_stalls_the_rotor_under_the_given_angle() {
    let mut master = Master::new(&[1]);
    let zero = master.read_i16(1, 0x3011, 1);
    master.enable(1, 12);
    for degrees in [0.0, 90.0, -45.0, 170.0, 0.0] {
        master.write_i16(1, 0x60EA, 0, angle(degrees));
        master.write_i16(1, 0x3010, D_VOLTAGE, 2773); // P7
        assert_eq!(master.read_i16(1, 0x60EA, 0), angle(degrees));
        assert_eq!(master.read_i16(1, 0x3010, D_VOLTAGE), 2773);
        master.run_ms(1000);
        let raw = master.read_i16(1, 0x3012, 1);
        let off = (f64::from(raw - zero) - degrees / 360.0 * 4096.0).rem_euclid(4096.0);
        let off = if off > 2048.0 { off - 4096.0 } else { off };
        // Friction holds it a little before the angle.
        assert!(off.abs() < 20.0, "{degrees}: {off} counts");
        // 2¹⁵ is Vbus/√3 on half the terminal resistance.
        let wanted = 2773.0 / 32768.0 * 48.0 / 3_f64.sqrt() / 6.55 * 1e3;
        let d = f64::from(master.read_i16(1, 0x3010, 6));
        assert!((d / wanted - 1.0).abs() < 0.03, "{d} mA of {wanted}");
        assert!(master.read_i16(1, 0x6078, 0).abs() < 15);
        // No mode-specific bit.
        assert_eq!(master.status(1) & 0x3400, 0);
    }
    // Idle: no voltage; the mode entered again begins without.
    master.write(1, 0x6060, 0, &[0]);
    master.run_ms(5);
    assert!(master.read_i16(1, 0x3010, 6).abs() < 15);
    master.write(1, 0x6060, 0, &[12]);
    assert_eq!(master.read_i16(1, 0x3010, D_VOLTAGE), 0);
    assert_eq!(master.read_i16(1, 0x3010, Q_VOLTAGE), 0);
}

/// The greatest voltage would drive 4.2 A: the continuous current is all that I²t leaves, rated
/// torque's current (0x6072) what the application allows.
#[test]
fn mode_12_is_limited_as_every_mode() {
    let mut master = Master::new(&[1]);
    master.enable(1, 12);
    master.write_i16(1, 0x60EA, 0, 0);
    master.write_i16(1, 0x3010, D_VOLTAGE, i16::MAX);
    master.run_ms(500);
    // 23 mNm at 32 mNm/A.
    let d = master.read_i16(1, 0x3010, 6);
    assert!((700..740).contains(&d), "{d}");
    assert_ne!(master.status(1) & 0x0800, 0);
    master.write_i16(1, 0x6072, 0, 100);
    master.run_ms(200);
    let d = master.read_i16(1, 0x3010, 6);
    assert!((60..85).contains(&d), "{d}");
}

/// A field that turns pulls the rotor along: 40 steps of 9 degrees are one turn, either way.
#[test]
fn mode_11_turns_the_rotor_with_the_field() {
    let mut master = Master::new(&[1]);
    master.enable(1, 11);
    // The current flows a quarter turn before the angle: the rotor's d axis comes to rest there.
    master.write_i16(1, 0x60EA, 0, angle(-90.0));
    master.write_i16(1, 0x6071, 0, 400);
    master.run_ms(1000);
    let zero = master.read_i16(1, 0x3011, 1);
    let raw = master.read_i16(1, 0x3012, 1);
    assert!((raw - zero).abs() < 20, "{raw} {zero}");
    assert_ne!(master.status(1) & 0x1000, 0, "follows");
    let start = master.position(1);
    for n in 1..=40 {
        master.write_i16(1, 0x60EA, 0, angle(-90.0 + 9.0 * f64::from(n)));
        master.run_ms(40);
    }
    // A controlled current does not damp: friction alone ends the swinging.
    master.run_ms(2000);
    let turned = master.position(1) - start;
    assert!((turned - 4096).abs() < 20, "{turned}");
    // 400 per mille of 23 mNm at 32 mNm/A.
    let q = f64::from(master.read_i16(1, 0x6078, 0));
    assert!((q - 287.5).abs() < 20.0, "{q}");
    for n in 1..=80 {
        master.write_i16(1, 0x60EA, 0, angle(-90.0 - 9.0 * f64::from(n)));
        master.run_ms(40);
    }
    // A controlled current does not damp: friction alone ends the swinging.
    master.run_ms(2000);
    let turned = master.position(1) - start;
    assert!((turned + 4096).abs() < 20, "{turned}");
}

#[test]
fn angle_and_voltage_are_refused_where_they_are_not_used() {
    const NOT_NOW: u32 = 0x0800_0022;
    let mut master = Master::new(&[1]);
    let at = |master: &mut Master, angle: Result<(), u32>, voltage: Result<(), u32>| {
        assert_eq!(master.try_write(1, 0x60EA, 0, &[1, 0]), angle);
        for sub in [D_VOLTAGE, Q_VOLTAGE] {
            assert_eq!(master.try_write(1, 0x3010, sub, &[1, 0]), voltage);
        }
    };
    at(&mut master, Err(NOT_NOW), Err(NOT_NOW));
    for mode in [0, 1, 3, 4, 8, 9, 10] {
        master.enable(1, mode);
        at(&mut master, Err(NOT_NOW), Err(NOT_NOW));
    }
    master.enable(1, 11);
    at(&mut master, Ok(()), Err(NOT_NOW));
    master.enable(1, 12);
    at(&mut master, Ok(()), Ok(()));
    // Enabled no longer.
    master.write_u16(1, 0x6040, 0, 0x07);
    at(&mut master, Err(NOT_NOW), Err(NOT_NOW));
}

/// Outside modes 11 and 12 the angle is the rotor's: it grows with the position, and with the lag
/// by which the drive looks ahead.
#[test]
fn the_angle_shown_is_the_rotors_and_looks_ahead_by_the_lag() {
    let mut ahead = Vec::new();
    for (lag_us, velocity) in [(0, 400_000), (100, 400_000), (100, -400_000)] {
        let mut master = Master::new(&[1]);
        master.write_i32(1, 0x3013, 5, lag_us);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, velocity);
        master.run_ms(600);
        let feedback = master.drive(1).core().unwrap().feedback();
        let shown = f64::from(feedback.electrical_angle >> 16) / 65_536.0;
        let zero = master.read_i16(1, 0x3011, 1);
        let rotor = f64::from(feedback.encoder - i32::from(zero)) / 4096.0;
        let difference = (shown - rotor + 0.5).rem_euclid(1.0) - 0.5;
        ahead.push(difference * TAU);
    }
    // 400,000 counts/s are 613.6 rad/s; a duty acts half a control and a PWM period, 35 µs, later.
    for (seen, wanted) in ahead.iter().zip([35e-6, 135e-6, -135e-6]) {
        let wanted = wanted * 400_000.0 / 4096.0 * TAU;
        assert!((seen - wanted).abs() < 0.003, "{ahead:?} {wanted}");
    }
}

/// 0x3013,5 takes away what an encoder's lag does: at speed the back-EMF lies in the q axis again.
/// Too little of it leaves a part in the d axis, too much the same part the other way round.
#[test]
fn the_lag_object_turns_the_field_back_to_the_rotor() {
    let d_axis_volts = |lag_us: i32, velocity: i32| {
        let mut settings = p3(1);
        settings.plant.encoder.lag_s = 200e-6;
        let mut master = Master::with(vec![settings]);
        master.write_i32(1, 0x3013, 5, lag_us);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, velocity);
        master.run_ms(800);
        assert!((master.read(1, 0x606C, 0) - velocity).abs() < 5_000);
        let mut sum = 0.0;
        for _ in 0..50 {
            sum += f64::from(master.read_i16(1, 0x3010, D_VOLTAGE));
            master.run_ms(1);
        }
        sum / 50.0 / 32_768.0 * 48.0 / 3_f64.sqrt()
    };
    // 400,000 counts/s are 613.6 rad/s, 12.9 V of back-EMF; 200 µs are 7.0 degrees, 1.58 V.
    let electromotive_v = 0.021_04 * 400_000.0 / 4096.0 * TAU;
    let part = electromotive_v * (200e-6 * 400_000.0 / 4096.0 * TAU).sin();
    let seen = [0, 100, 200, 300, 400].map(|lag| d_axis_volts(lag, 400_000));
    println!("{part:.2} V, {seen:.2?}");
    for (n, volts) in seen.into_iter().enumerate() {
        let wanted = seen[2] + part * (2.0 - n as f64) / 2.0 * (seen[0] - seen[2]).signum();
        assert!((volts - wanted).abs() < 0.1, "{seen:?}");
    }
    assert!(seen[2].abs() < 0.25, "{seen:?}");
    // The same backwards.
    assert!(d_axis_volts(200, -400_000).abs() < 0.25);
    assert!((d_axis_volts(0, -400_000).abs() - part).abs() < 0.25);
}
