//! Modes of motion: units, limits, ramps, and rest.

use crate::bench::*;

#[test]
fn a_profile_position_is_moved_to_as_soon_as_it_is_written() {
    let mut master = quiet();
    ramps(&mut master, 300);
    master.write_i32(NODE, 0x6067, 0, 100);
    enable(&mut master, 1);
    let before = motor_turns(&mut master);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, start + TURN);
    assert_eq!(master.status(NODE) & 0x0400, 0);
    // A turn at 191 RPM takes a third of a second, ramps as much again and more.
    master.run_ms(2500);
    assert_ne!(master.status(NODE) & 0x0400, 0, "reached");
    let error = master.position(NODE) - (start + TURN);
    assert!(error.abs() < 100, "{error}");
    // One turn of the output is nine of the motor.
    let turned = motor_turns(&mut master) - before;
    assert!((turned - 9.0).abs() < 0.1, "{turned}");
    // The same target again changes nothing.
    master.write_i32(NODE, 0x607A, 0, start + TURN);
    assert_ne!(master.status(NODE) & 0x0400, 0, "still reached");
}

#[test]
fn velocities_are_the_outputs_rpm() {
    for in_mode in [3, 9] {
        let mut master = quiet();
        ramps(&mut master, 300);
        master.write_i32(NODE, 0x606D, 0, 5);
        enable(&mut master, in_mode);
        master.write_i32(NODE, 0x60FF, 0, 100);
        master.run_ms(1500);
        let shown = master.read(NODE, 0x606C, 0);
        assert!((shown - 100).abs() <= 3, "{shown}");
        assert_eq!(master.read(NODE, 0x606B, 0), 100);
        // Cyclic modes have no target to reach (CiA 402).
        let reached = master.status(NODE) & 0x0400 != 0;
        assert_eq!(reached, in_mode == 3);
        let truth = master.drive(NODE).plant().truth().speed_rad_s;
        let rpm = truth * 60.0 / std::f32::consts::TAU / 9.0;
        assert!((rpm - 100.0).abs() < 3.0, "{rpm}");
        // The quick stop's ramp leads to "switch on disabled".
        master.write_u16(NODE, 0x6040, 0, 2);
        assert_eq!(master.state(NODE), QUICK_STOP_ACTIVE);
        master.run_ms(300);
        assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
        let speed = master.drive(NODE).plant().truth().speed_rad_s;
        assert!(speed.abs() < 5.0, "{speed}");
    }
}

#[test]
fn cyclic_position_follows() {
    let mut master = quiet();
    enable(&mut master, 8);
    let start = master.position(NODE);
    for step in 1..=200 {
        master.write_i32(NODE, 0x607A, 0, start + 40 * step);
        master.run_ms(4);
    }
    master.run_ms(300);
    let error = master.position(NODE) - (start + 8000);
    assert!(error.abs() < 60, "{error}");
}

#[test]
fn limits_clip_and_are_told_of() {
    let mut master = quiet();
    ramps(&mut master, 2000);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607D, 1, start - TURN);
    master.write_i32(NODE, 0x607D, 2, start + TURN / 2);
    master.write_i32(NODE, 0x6080, 0, 60);
    master.write_i32(NODE, 0x60C5, 0, 500);
    enable(&mut master, 1);
    master.write_i32(NODE, 0x607A, 0, start + 3 * TURN);
    master.run_ms(50);
    // Acceleration, velocity (191 RPM are asked for) and position.
    for bit in [24, 26, 27] {
        assert!(status_bit(&mut master, 7, bit), "{bit}");
    }
    master.run_ms(3000);
    let error = master.position(NODE) - (start + TURN / 2);
    assert!(error.abs() < 100, "{error}");
    // Bit 11 tells of this power-up (M22), also when nothing is limited any more.
    master.write_i32(NODE, 0x607A, 0, start);
    master.run_ms(3000);
    assert_ne!(master.status(NODE) & 0x0800, 0);
    // A fault reset ends warnings.
    master.write_u16(NODE, 0x6040, 0, 0);
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert_eq!(master.read(NODE, 0x2004, 7), 0);
    assert_ne!(master.status(NODE) & 0x0800, 0);
}

/// Time until a motor that turned at 100 RPM of the output has lost half of that, ms.
fn coasting(free: bool) -> u32 {
    let mut master = quiet();
    ramps(&mut master, 300);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 100);
    master.run_ms(1500);
    let before = master.drive(NODE).plant().truth().speed_rad_s;
    if free {
        // Nothing holds the bridge of a drive in reset.
        master.send(0, &[0x81, NODE]);
    } else {
        mode(&mut master, 0);
    }
    for ms in 0..40 {
        let now = master.drive(NODE).plant().truth().speed_rad_s;
        if now < 0.5 * before {
            return ms;
        }
        master.run_ms(1);
    }
    40
}

#[test]
fn idle_shorts_the_phases_which_brakes() {
    // Shorted, the motor of 61 µkgm² brakes with up to 3/2·p²ψ²/R = 65 mNms/rad: a time constant of
    // about a millisecond at low speed. Free, it coasts for seconds.
    let shorted = coasting(false);
    let free = coasting(true);
    assert!(shorted < 15, "{shorted} ms");
    assert_eq!(free, 40);
}

/// Turns at `rpm`, with a load of `torque_nm` at the motor's shaft.
fn loaded(rpm: i32, torque_nm: f32) -> Master {
    let mut master = quiet();
    ramps(&mut master, 300);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, rpm);
    master.run_ms(800);
    master.drive(NODE).plant().set_load_torque_nm(torque_nm);
    master.run_ms(600);
    master
}

#[test]
fn torque_is_the_outputs_in_permille_of_the_rated_one() {
    // 0.05 Nm at the motor are 0.45 Nm at the output of 9:1, of 1 Nm rated.
    let mut master = loaded(60, 0.05);
    let torque = master.read_i16(NODE, 0x6077, 0);
    assert!((torque - 450).abs() < 30, "{torque}");
    // Of 2 Nm it is half as much.
    master.write_i32(NODE, 0x6076, 0, 2000);
    master.run_ms(200);
    let torque = master.read_i16(NODE, 0x6077, 0);
    assert!((torque - 225).abs() < 20, "{torque}");
}

#[test]
fn torque_and_current_are_limited_and_it_is_told() {
    // Per mille of 1 Nm, and of 1 A at 0.091 Nm/A and 9:1. A converter's step is 41 of them.
    for (index, value, greatest) in [(0x6072, 1500, 1500), (0x6073, 2000, 1638)] {
        let mut master = loaded(60, 0.02);
        master.write_u16(NODE, 0x6072, 0, 5000);
        assert!(!status_bit(&mut master, 7, 25), "torque clipped");
        master.write_u16(NODE, index, 0, value);
        // More than that torque can hold.
        master.drive(NODE).plant().set_load_torque_nm(0.25);
        master.run_ms(40);
        let read = |_| i32::from(master.read_i16(NODE, 0x6077, 0));
        let torque = (0..16).map(read).sum::<i32>() / 16;
        assert!((torque - greatest).abs() < 60, "{index:04X}: {torque}");
        assert!(status_bit(&mut master, 7, 25), "torque clipped");
        assert_ne!(master.status(NODE) & 0x0800, 0);
    }
}

#[test]
fn demands_are_shown_after_their_limits() {
    let mut master = quiet();
    ramps(&mut master, 2000);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607D, 1, start - TURN);
    master.write_i32(NODE, 0x607D, 2, start + TURN / 2);
    enable(&mut master, 8);
    for step in 1..=300 {
        master.write_i32(NODE, 0x607A, 0, start + 40 * step);
        master.run_ms(4);
    }
    assert_eq!(master.read(NODE, 0x6062, 0), start + TURN / 2);
    assert!(status_bit(&mut master, 7, 27), "position clipped");
    master.write_i32(NODE, 0x6080, 0, 40);
    mode(&mut master, 9);
    master.write_i32(NODE, 0x60FF, 0, -90);
    master.run_ms(300);
    assert_eq!(master.read(NODE, 0x606B, 0), -40);
    assert!(status_bit(&mut master, 7, 26), "velocity clipped");
}

#[test]
fn windows_say_when_a_target_is_reached() {
    let mut master = quiet();
    ramps(&mut master, 300);
    enable(&mut master, 3);
    // 0x606D, for velocities: outside first.
    master.write_i32(NODE, 0x606D, 0, 5);
    master.write_i32(NODE, 0x60FF, 0, 100);
    master.run_ms(100);
    assert_eq!(master.status(NODE) & 0x0400, 0, "on the way");
    master.run_ms(900);
    assert_ne!(master.status(NODE) & 0x0400, 0);
    // More load than the controller bears: out of the window.
    master.write_u16(NODE, 0x6072, 0, 200);
    master.drive(NODE).plant().set_load_torque_nm(0.05);
    master.run_ms(300);
    assert_eq!(master.status(NODE) & 0x0400, 0, "left");
}

#[test]
fn profiles_speed_up_and_slow_down_at_the_rates_that_are_written() {
    let mut master = quiet();
    master.write_i32(NODE, 0x6083, 0, 200);
    master.write_i32(NODE, 0x6084, 0, 100);
    enable(&mut master, 3);
    // Without a target it stands; the default of the mode is idle.
    assert_eq!(master.read(NODE, 0x606B, 0), 0);
    master.write_i32(NODE, 0x60FF, 0, 150);
    for (ms, rpm) in [(250, 50), (250, 100), (500, 150)] {
        master.run_ms(ms);
        let demand = master.read(NODE, 0x606B, 0);
        assert!((demand - rpm).abs() <= 3, "{demand}, not {rpm}");
    }
    master.write_i32(NODE, 0x60FF, 0, 0);
    for (ms, rpm) in [(500, 100), (500, 50), (700, 0)] {
        master.run_ms(ms);
        let demand = master.read(NODE, 0x606B, 0);
        assert!((demand - rpm).abs() <= 3, "{demand}, not {rpm}");
    }
    // A position: up to 0x6081 on one ramp, down on the other.
    master.write_i32(NODE, 0x6081, 0, 100);
    mode(&mut master, 1);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, start + 3 * TURN);
    master.run_ms(250);
    let speed = master.read(NODE, 0x606C, 0);
    assert!((speed - 50).abs() <= 4, "{speed}");
    master.run_ms(750);
    let speed = master.read(NODE, 0x606C, 0);
    assert!((speed - 100).abs() <= 4, "{speed}");
    // 3 turns: 0.5 s and 0.42 turns up, 1 s and 0.83 turns down, 1.05 s between.
    master.run_ms(1050);
    let speed = master.read(NODE, 0x606C, 0);
    assert!((speed - 50).abs() <= 6, "{speed}");
    master.run_ms(900);
    assert!((master.position(NODE) - start - 3 * TURN).abs() < 60);
}
