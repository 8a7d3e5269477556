//! 0x1001: what sets its bits, and what ends them.

use crate::bench::{answers, of, operational, quiet};

/// J16, J17: no emergency; 0x1001 keeps a temperature error until a reset, and the motor stays free.
#[test]
fn a_temperature_error_lasts_until_a_reset() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 50 << 16);
    master.run_ms(300);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    let warm = master.read(1, 0x2202, 0);
    assert!((20 * 256..40 * 256).contains(&warm), "Q8.8: {warm}");
    master.log.clear();
    master.drive(1).plant().set_amplifier_temperature_c(95.0);
    master.run_ms(500);
    assert_eq!(answers(&master), [], "no emergency");
    // The manual's example (l.316).
    let read = of(&mut master, 0x601, &[0x40, 0x01, 0x10, 0x00, 0x00]);
    assert_eq!(read, [(0x581, vec![0x42, 0x01, 0x10, 0x00, 0x09, 0, 0, 0])]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    assert_eq!(master.try_write(1, 0x6060, 0, &[1]), Err(0x0800_0022));
    assert_eq!(master.try_write(1, 0x6060, 0, &[0]), Ok(()));
    // It cools, and nothing changes.
    master.drive(1).plant().set_amplifier_temperature_c(25.0);
    master.run_ms(1000);
    assert_eq!(master.read(1, 0x1001, 0), 0x09);
    assert!(master.read(1, 0x3F00, 10) > 85 * 256, "PTEMP");
    of(&mut master, 0, &[0x82, 1]);
    assert_eq!(master.read(1, 0x1001, 0), 0x09, "nor with communication");
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    master.write(1, 0x6060, 0, &[1]);
    assert_eq!(master.read(1, 0x6061, 0), 1);
    // The motor's winding counts, too.
    master.drive(1).plant().set_motor_temperature_c(120.0);
    master.run_ms(300);
    assert_eq!(master.read(1, 0x1001, 0), 0x09);
}

/// The over-current bit: while I²t holds the current back, and latched after a short circuit.
#[test]
fn over_current() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[4]);
    master.drive(1).plant().set_blocked(true);
    // Twice rated torque: MT.
    master.write_i16(1, 0x6074, 0, 2000);
    master.run_ms(100);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    master.run_ms(2000);
    assert_eq!(master.read(1, 0x1001, 0), 0x03);
    assert_eq!(master.read(1, 0x3F00, 4), 0x03, "ERROR");
    let current = master.read(1, 0x3F00, 22);
    assert!((650..790).contains(&current), "{current} mA are left");
    master.write_i16(1, 0x6074, 0, 0);
    master.run_ms(5000);
    assert_eq!(master.read(1, 0x1001, 0), 0, "it ends with its cause");
    assert_eq!(master.read(1, 0x6061, 0), 4);
    assert_eq!(master.emergencies(1), [[0; 8]; 0]);

    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 100 << 16);
    master.run_ms(300);
    master
        .drive(1)
        .plant()
        .set_short(Some(plant::Short::ToNegative(plant::Phase::A)));
    master.run_ms(50);
    assert_eq!(master.read(1, 0x1001, 0), 0x03);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    master.drive(1).plant().set_short(None);
    master.run_ms(500);
    assert_eq!(master.read(1, 0x1001, 0), 0x03, "latched");
}

/// A drive that an error has stopped does not take its default mode, now or later.
#[test]
fn no_default_mode_in_an_error() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x80, 1]);
    master.write(1, 0x3F60, 0, &[1]);
    master.drive(1).plant().set_amplifier_temperature_c(95.0);
    master.run_ms(500);
    assert_eq!(master.read(1, 0x1001, 0), 0x09);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    assert_eq!(master.read(1, 0x6060, 0), 0, "nothing was chosen");
    let core = master.drive(1).core().expect("it has booted");
    assert!(!core.comms().axis().is_powered());
}
