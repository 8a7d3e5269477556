//! The figures at which a status bit of 0x2004 is set: just below it is not, just above it is.

use crate::bench::*;

/// What is done, and whether the bit is to be set then.
type Step = (fn(&mut Master), bool);

fn steps(sub: u8, bit: u8, steps: &[Step]) {
    let mut master = quiet();
    for (n, (act, is_set)) in steps.iter().enumerate() {
        act(&mut master);
        master.run_ms(100);
        assert_eq!(
            status_bit(&mut master, sub, bit),
            *is_set,
            "{sub}.{bit}: {n}"
        );
    }
}

fn supply(master: &mut Master, volts: f32) {
    master.drive(NODE).plant().set_supply_v(volts);
}

fn amplifier(master: &mut Master, celsius: f32) {
    let plant = master.drive(NODE).plant();
    plant.set_amplifier_temperature_c(celsius);
}

fn motor(master: &mut Master, celsius: f32) {
    master.drive(NODE).plant().set_motor_temperature_c(celsius);
}

#[test]
fn voltages_and_temperatures() {
    steps(
        5,
        1,
        &[(|m| supply(m, 55.5), false), (|m| supply(m, 56.5), true)],
    );
    steps(
        5,
        2,
        &[(|m| supply(m, 10.5), false), (|m| supply(m, 9.5), true)],
    );
    steps(
        5,
        4,
        &[
            (|m| amplifier(m, 99.0), false),
            (|m| amplifier(m, 102.0), true),
        ],
    );
    // 0x2000,7 is 80 with the sample motor.
    steps(
        5,
        3,
        &[(|m| motor(m, 79.0), false), (|m| motor(m, 81.0), true)],
    );
    steps(
        5,
        3,
        &[
            (|m| motor(m, 60.0), false),
            (|m| m.write(NODE, 0x2000, 7, &[59]), true),
        ],
    );
}

/// Ten degrees of the output beyond 0x607D: 455 of 16,384.
#[test]
fn a_position_outside_its_limits() {
    for (pushed, is_set) in [(400, false), (520, true)] {
        let mut master = quiet();
        let here = master.position(NODE);
        master.write_i32(NODE, 0x607D, 1, here - 2000);
        master.write_i32(NODE, 0x607D, 2, here + 2000);
        enable(&mut master, 8);
        master.run_ms(50);
        assert!(!status_bit(&mut master, 7, 0));
        // The limit moves, not the axis.
        master.write_i32(NODE, 0x607D, 2, here - pushed);
        master.run_us(1500);
        assert_eq!(status_bit(&mut master, 7, 0), is_set, "{pushed}");
    }
}

/// A fifth and ten RPM beyond 0x6080.
#[test]
fn a_velocity_outside_its_limits() {
    for (most, is_set) in [(80, false), (70, true)] {
        let mut master = quiet();
        ramps(&mut master, 600);
        enable(&mut master, 3);
        master.write_i32(NODE, 0x60FF, 0, 100);
        master.run_ms(1000);
        assert!(!status_bit(&mut master, 7, 1));
        // 100 RPM are within 80 × 1.2 + 10, and not within 70 × 1.2 + 10.
        master.write(NODE, 0x6080, 0, &u32::to_le_bytes(most));
        master.run_us(1500);
        assert_eq!(status_bit(&mut master, 7, 1), is_set, "{most}");
    }
}

/// A halt is reached when the output stands.
#[test]
fn a_halt_is_reached_at_rest() {
    let mut master = quiet();
    ramps(&mut master, 60);
    master.write_i32(NODE, 0x606D, 0, 5);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(1500);
    assert_eq!(master.status(NODE) & 0x400, 0x400, "at its speed");
    master.write_u16(NODE, 0x6040, 0, 0x010F);
    // A second is the whole way down.
    for _ in 0..8 {
        master.run_ms(100);
        assert!(master.read(NODE, 0x606C, 0).abs() > 3);
        assert_eq!(master.status(NODE) & 0x400, 0, "on its way");
    }
    master.run_ms(600);
    assert_eq!(master.read(NODE, 0x606C, 0), 0);
    assert_eq!(master.status(NODE) & 0x400, 0x400, "at rest");
}
