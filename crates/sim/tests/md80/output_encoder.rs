//! 0x2005: the encoder on the output.

use crate::bench::*;
use plant::{Coupling, OutputEncoder};

#[test]
fn an_output_encoder_is_shown_and_calibrated() {
    let mut settings = md80();
    settings.plant.output_encoder = Some(OutputEncoder {
        zero_turns: 0.3,
        reversed: true,
        ..OutputEncoder::ideal(1.0 / 9.0)
    });
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x2005, 1, 1);
    // In REPORT it has no calibration (M29).
    master.write_i32(NODE, 0x2005, 3, 3);
    mode(&mut master, -1);
    assert!(!status_bit(&mut master, 2, 2));
    assert_eq!(master.try_write(NODE, 0x2003, 4, &[1]), Err(0x0800_0022));
    master.write_i32(NODE, 0x2005, 3, 1);
    master.run_ms(5);
    assert!(status_bit(&mut master, 2, 2), "not calibrated");
    mode(&mut master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 4, &[1]);
    let done = wait_for_boot(&mut master, 40);
    assert!(done, "{:x}", master.read(NODE, 0x2004, 2));
    assert_eq!(master.read(NODE, 0x2004, 2), 0);
    master.write_u16(NODE, 0x2000, 12, 0);
    // It agrees with the motor's encoder, also while that moves.
    ramps(&mut master, 200);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(1500);
    let velocity = real(&mut master, 0x2005, 5);
    assert!((velocity - std::f32::consts::TAU).abs() < 0.5, "{velocity}");
    master.write_i32(NODE, 0x60FF, 0, 0);
    master.run_ms(1500);
    let by_motor = master.position(NODE) as f32 / TURN as f32;
    let by_encoder = real(&mut master, 0x2005, 4) / std::f32::consts::TAU;
    assert!(
        (by_motor - by_encoder).abs() < 0.01,
        "{by_motor} {by_encoder}"
    );
}

#[test]
fn an_output_encoder_that_does_not_answer_is_a_fault() {
    let mut master = quiet();
    master.log.clear();
    master.write_i32(NODE, 0x2005, 1, 1);
    master.write_i32(NODE, 0x2005, 3, 3);
    master.run_ms(5);
    assert!(status_bit(&mut master, 2, 0) && status_bit(&mut master, 2, 6));
    assert_eq!(master.emergency_codes(NODE), [0x7306]);
    assert_eq!(master.state(NODE), FAULT);
}

/// The greatest difference of the shown position from the true one over a turn of the output, turns.
fn worst_error(master: &mut Master) -> f64 {
    ramps(master, 200);
    enable(master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(500);
    let mut errors = Vec::new();
    for _ in 0..60 {
        master.run_ms(20);
        let shown = real(master, 0x2005, 4) / std::f32::consts::TAU;
        let truth = plant(master).truth().load_position_turns() / 9.0;
        errors.push(truth - f64::from(shown));
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let off = |error: &f64| (error - mean).abs();
    errors
        .iter()
        .map(off)
        .fold(0.0, |most, error| if error > most { error } else { most })
}

#[test]
fn an_eccentric_output_encoder_is_corrected_by_a_whole_turn_and_not_by_a_quarter() {
    let mut worst = Vec::new();
    for calibration_mode in [1, 0] {
        let mut master = with_output(false, |encoder| encoder.eccentricity_turns = 0.005);
        master.write_i32(NODE, 0x2005, 2, calibration_mode);
        mode(&mut master, -1);
        master.log.clear();
        master.write(NODE, 0x2003, 4, &[1]);
        assert!(wait_for_boot(&mut master, 40));
        // It is 1.8 degrees: a warning, if all of a turn was seen.
        let warned = status_bit(&mut master, 2, 30);
        assert_eq!(warned, calibration_mode == 0);
        master.write_u16(NODE, 0x2000, 12, 0);
        worst.push(worst_error(&mut master));
    }
    assert!(worst[0] > 0.004, "{worst:?}");
    // A read takes up to half a millisecond more or less: 0.0005 turns at 60 RPM.
    assert!(worst[1] < 0.001, "{worst:?}");
}

#[test]
fn the_off_axis_encoder_wants_a_whole_turn() {
    let mut master = with_output(false, |_| {});
    master.write_i32(NODE, 0x2005, 1, 2);
    master.write_i32(NODE, 0x2005, 2, 1);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 4, &[1]);
    master.run_ms(50);
    assert!(status_bit(&mut master, 2, 4));
}

#[test]
fn where_the_position_of_a_start_comes_from_depends_on_the_mode() {
    // Half a turn of the output from its zero: 4.5 turns of the motor.
    for (in_mode, from_output) in [(1, true), (2, true), (3, false)] {
        let mut master = output();
        master.write_i32(NODE, 0x2005, 3, in_mode);
        master.write(NODE, 0x1010, 1, &SAVE);
        master.run_ms(300);
        plant(&mut master).set_motion(0, 0.0);
        reset_node(&mut master);
        let zero = master.position(NODE);
        master.write_u16(NODE, 0x2000, 12, 0);
        enable(&mut master, 3);
        ramps(&mut master, 300);
        master.write_i32(NODE, 0x60FF, 0, 60);
        master.run_ms(700);
        master.write_i32(NODE, 0x60FF, 0, 0);
        master.run_ms(500);
        master.write_u16(NODE, 0x6040, 0, 0);
        let gone = master.position(NODE) - zero;
        assert!((TURN / 4..TURN).contains(&gone), "{gone}");
        reset_node(&mut master);
        let after = master.position(NODE) - zero;
        let kept = (after - gone).rem_euclid(TURN);
        let kept = kept.min(TURN - kept) < 100;
        assert_eq!(kept, from_output, "{in_mode}: {gone}, {after}");
    }
}

#[test]
fn a_zero_that_is_set_is_the_output_encoders_too() {
    let mut master = output();
    enable(&mut master, 3);
    ramps(&mut master, 300);
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(400);
    master.write_u16(NODE, 0x6040, 0, 0);
    master.run_ms(200);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 5, &[1]);
    master.run_ms(5);
    assert!(master.position(NODE).abs() <= 1);
    assert!(real(&mut master, 0x2005, 4).abs() < 1e-3);
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(300);
    assert!(
        master.position(NODE).abs() <= 2,
        "{}",
        master.position(NODE)
    );
    assert!(real(&mut master, 0x2005, 4).abs() < 1e-3);
}

/// A drive whose output hangs on its motor with play, and a load with friction behind it; the output encoder is
/// calibrated, and used so.
fn with_play(in_mode: i32) -> Master {
    let mut settings = md80();
    settings.plant.output_encoder = Some(OutputEncoder::ideal(1.0 / 9.0));
    let load = &mut settings.plant.load;
    load.inertia_kgm2 = 60e-6;
    load.coulomb_friction_nm = 0.01;
    load.viscous_friction_nms = 0.5e-3;
    load.coupling = Some(Coupling {
        stiffness_nm_per_rad: 20.0,
        damping_nms: 5e-3,
        // 0.2 rad of the motor are 58 increments of the output.
        backlash_rad: 0.2,
    });
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x2005, 1, 1);
    master.write_i32(NODE, 0x2005, 3, 1);
    mode(&mut master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 4, &[1]);
    assert!(wait_for_boot(&mut master, 40));
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write_i32(NODE, 0x2005, 3, in_mode);
    master.run_ms(50);
    master
}

/// The output's true position, increments.
fn output_truth(master: &mut Master) -> f64 {
    plant(master).truth().load_position_turns() / 9.0 * f64::from(TURN)
}

/// How far the output stands from where it was sent, after moves forth and back by half a turn; increments.
fn misses(in_mode: i32, motion: i8) -> Vec<f64> {
    let mut master = with_play(in_mode);
    ramps(&mut master, 200);
    master.write_i32(NODE, 0x6081, 0, 30);
    // Where the shown position has its zero in truth.
    let here = output_truth(&mut master) - f64::from(master.position(NODE));
    enable(&mut master, motion);
    let mut misses = Vec::new();
    let mut from = master.position(NODE);
    for target in [TURN / 2, 0, TURN / 4] {
        if motion == 8 {
            let step = 20 * (target - from).signum();
            while from != target {
                from = if (target - from).abs() > 20 {
                    from + step
                } else {
                    target
                };
                master.write_i32(NODE, 0x607A, 0, from);
                master.run_ms(2);
            }
        } else {
            master.write_i32(NODE, 0x607A, 0, target);
        }
        master.run_ms(2500);
        from = target;
        misses.push(output_truth(&mut master) - here - f64::from(target));
        if in_mode == 2 {
            let shown = master.position(NODE);
            // What the loops themselves leave, against the friction.
            assert!((shown - target).abs() <= 6, "{shown}, not {target}");
            let demand = master.read(NODE, 0x6062, 0);
            assert!((demand - target).abs() <= 1, "{demand}, not {target}");
        }
    }
    misses
}

#[test]
fn in_motion_mode_the_output_stands_where_it_was_sent_in_spite_of_play() {
    for motion in [1, 8] {
        let startup = misses(1, motion);
        let closed = misses(2, motion);
        let spread = |misses: &[f64]| (misses[0] - misses[1]).abs();
        // Forth and back differ by the play.
        assert!(spread(&startup) > 30.0, "{startup:?}");
        for miss in closed {
            assert!(miss.abs() <= 6.0, "{startup:?} {miss}");
        }
    }
}

#[test]
fn in_motion_mode_velocity_limits_and_errors_are_the_outputs() {
    let mut master = with_play(2);
    ramps(&mut master, 300);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(1500);
    let truth = plant(&mut master).truth().load_speed_rad_s / 9.0 * 60.0 / std::f32::consts::TAU;
    let shown = master.read(NODE, 0x606C, 0) as f32;
    assert!(
        (shown - 60.0).abs() <= 3.0 && (truth - 60.0).abs() <= 3.0,
        "{shown} {truth}"
    );
    master.write_u16(NODE, 0x6040, 0, 0);
    master.run_ms(500);
    // A target beyond the limit is clipped to it, by what the output's encoder says.
    let here = master.position(NODE);
    let limit = here + TURN / 8;
    master.write_i32(NODE, 0x607D, 1, here - TURN);
    master.write_i32(NODE, 0x607D, 2, limit);
    enable(&mut master, 1);
    master.write_i32(NODE, 0x607A, 0, here + TURN);
    master.run_ms(3000);
    let off = master.position(NODE) - limit;
    assert!(off.abs() < 40, "{off}");
    // It does not answer: a fault, as in any mode that uses it.
    plant(&mut master).set_output_encoder_silent(true);
    master.run_ms(20);
    assert_eq!(master.state(NODE), FAULT);
    assert!(status_bit(&mut master, 2, 0));
}

#[test]
fn a_drive_in_motion_mode_does_not_move_before_it_is_told_to() {
    let mut master = with_play(2);
    for in_mode in [1, 8] {
        enable(&mut master, in_mode);
        let before = output_truth(&mut master);
        // The play is gone through, so that there is something to correct.
        plant(&mut master).set_load_torque_nm(0.05);
        master.run_ms(500);
        plant(&mut master).set_load_torque_nm(-0.05);
        master.run_ms(500);
        plant(&mut master).set_load_torque_nm(0.0);
        master.run_ms(300);
        let moved = output_truth(&mut master) - before;
        // No more than the play.
        assert!(moved.abs() < 70.0, "{in_mode}: {moved}");
        master.write_u16(NODE, 0x6040, 0, 0);
    }
}
