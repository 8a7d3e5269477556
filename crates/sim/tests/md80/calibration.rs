//! 0x2003,3 and 6: what is measured, and when that fails.

use crate::bench::*;
use plant::Phase;

#[test]
fn a_drive_out_of_the_box_shows_zeros_and_does_not_move() {
    let mut master = fresh(|_| {});
    for (index, sub) in [
        (0x2000, 1),
        (0x2000, 2),
        (0x2000, 3),
        (0x2000, 4),
        (0x6072, 0),
    ] {
        assert_eq!(master.read(NODE, index, sub), 0, "{index:04X},{sub}");
    }
    assert!(status_bit(&mut master, 3, 4), "set-up");
    assert!(status_bit(&mut master, 1, 2), "empty table");
    // It can be enabled, as a calibration after the maker's manner needs, but not moved.
    enable(&mut master, 0);
    master.log.clear();
    mode(&mut master, 3);
    master.run_ms(5);
    assert_eq!(master.state(NODE), FAULT);
    assert_eq!(master.emergency_codes(NODE), [0x6320]);
    // M12: without them there is no calibration.
    master.write_u16(NODE, 0x6040, 0, 0x80);
    calibrate(&mut master);
    master.run_ms(20);
    assert!(status_bit(&mut master, 1, 4), "failed");
    assert!(!booted(&master));
}

#[test]
fn a_calibration_measures_the_motor_keeps_it_and_starts_over() {
    let mut master = fresh(|settings| {
        settings.plant.encoder.zero_counts = 12_345;
        settings.plant.encoder.eccentricity_counts = 9.0;
        settings.plant.start_turns = 0.37;
    });
    configure(&mut master, 21);
    calibrate(&mut master);
    // Another command waits for its end.
    assert_eq!(master.try_write(NODE, 0x2003, 1, &[1]), Err(0x0800_0022));
    assert!(
        wait_for_boot(&mut master, 20),
        "{:x}",
        master.read(NODE, 0x2004, 1)
    );
    let resistance = real(&mut master, 0x2000, 4);
    let inductance = real(&mut master, 0x2000, 3);
    assert!((resistance / 0.085 - 1.0).abs() < 0.03, "{resistance}");
    assert!((inductance / 28.5e-6 - 1.0).abs() < 0.05, "{inductance}");
    assert_eq!(master.read(NODE, 0x2004, 1), 0);
    assert_eq!(master.read(NODE, 0x2004, 3), 0);
    // And with that it moves.
    master.write_u16(NODE, 0x2000, 12, 0);
    ramps(&mut master, 200);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, -60);
    master.run_ms(1500);
    let rpm = master.read(NODE, 0x606C, 0);
    assert!((rpm + 60).abs() <= 3, "{rpm}");
}

#[test]
fn a_motor_with_two_wires_exchanged_and_a_reversed_magnet_is_calibrated_all_the_same() {
    for (swapped, reversed) in [(true, false), (false, true)] {
        let mut master = fresh(|settings| {
            settings.plant.motor.wires_swapped = swapped;
            settings.plant.encoder.reversed = reversed;
        });
        configure(&mut master, 21);
        master.write(NODE, 0x2000, 9, &[u8::from(reversed)]);
        calibrate(&mut master);
        assert!(wait_for_boot(&mut master, 20));
        master.write_u16(NODE, 0x2000, 12, 0);
        ramps(&mut master, 200);
        enable(&mut master, 3);
        master.write_i32(NODE, 0x60FF, 0, 60);
        master.run_ms(1500);
        let rpm = master.read(NODE, 0x606C, 0);
        assert!((rpm - 60).abs() <= 3, "{rpm}");
    }
}

#[test]
fn a_calibration_fails_for_what_is_wrong() {
    // Sub-index and bit, what is wrong, pole pairs as written.
    type Wrong = fn(&mut Master);
    let cases: [(u8, u8, Wrong, u32); 4] = [
        (3, 3, |_| {}, 20),
        (
            3,
            3,
            |master| master.drive(NODE).plant().set_blocked(true),
            21,
        ),
        (
            3,
            0,
            |master| {
                master.write(NODE, 0x2000, 9, &[1]);
                master.drive(NODE).plant().set_blocked(true);
            },
            21,
        ),
        (
            3,
            1,
            |master| master.drive(NODE).plant().set_open_phase(Phase::A, true),
            21,
        ),
    ];
    for (sub, bit, wrong, pole_pairs) in cases {
        let mut master = fresh(|_| {});
        configure(&mut master, pole_pairs);
        wrong(&mut master);
        calibrate(&mut master);
        let booted = wait_for_boot(&mut master, 6);
        assert!(!booted, "{sub},{bit}");
        assert!(status_bit(&mut master, sub, bit), "{sub},{bit}");
        assert!(status_bit(&mut master, 1, 4), "{sub},{bit}");
        // Nothing of it was taken.
        assert_eq!(master.read(NODE, 0x2000, 4), 0);
    }
    // One that is stopped.
    let mut master = fresh(|_| {});
    configure(&mut master, 21);
    calibrate(&mut master);
    master.run_ms(500);
    mode(&mut master, 0);
    master.run_ms(5);
    assert!(status_bit(&mut master, 1, 4));
}

#[test]
fn the_current_controllers_gains_are_calibrated_alone() {
    let mut master = quiet();
    master.write(NODE, 0x2000, 4, &0.5_f32.to_le_bytes());
    mode(&mut master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 6, &[1]);
    master.run_ms(3000);
    assert!(!booted(&master));
    let resistance = real(&mut master, 0x2000, 4);
    assert!((resistance / 0.085 - 1.0).abs() < 0.03, "{resistance}");
}

/// How a commissioned drive runs: the true speed's deviation from its mean, parts of it (standard
/// deviation), and the greatest error of the position that it shows, degrees of the motor.
fn runs(master: &mut Master, direction: f64) -> (f64, f64) {
    master.write_u16(NODE, 0x2000, 12, 0);
    ramps(master, 300);
    enable(master, 3);
    master.write_i32(NODE, 0x60FF, 0, 40);
    master.run_ms(500);
    let mut speeds = Vec::new();
    let mut errors = Vec::new();
    // Three turns of the motor.
    for _ in 0..500 {
        master.run_ms(1);
        let truth = plant(master).truth();
        let shown = master.drive(NODE).core().expect("a drive").feedback();
        speeds.push(f64::from(truth.speed_rad_s));
        let shown = f64::from(shown.position) / f64::from(TURN);
        let turns = direction * truth.position_turns() - shown;
        errors.push(turns * 360.0);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let middle = mean(&speeds);
    let squares: Vec<f64> = speeds.iter().map(|s| (s / middle - 1.0).powi(2)).collect();
    let around = mean(&errors);
    let worst = errors
        .iter()
        .map(|error| (error - around).abs())
        .fold(
            0.0,
            |most: f64, error| if error > most { error } else { most },
        );
    master.write_u16(NODE, 0x6040, 0, 0);
    master.run_ms(300);
    (mean(&squares).sqrt(), worst)
}

#[test]
fn a_drive_with_an_eccentric_magnet_runs_better_after_its_calibration() {
    for reversed in [false, true] {
        // 100 of 16,384 counts are 2.2 degrees of the motor, and 46 of its electrical turn.
        let mut master = made(|plant| {
            plant.encoder.eccentricity_counts = 100.0;
            plant.encoder.eccentricity_phase_rad = 0.7;
        });
        let before = runs(&mut master, 1.0);
        plant(&mut master).set_encoder_turned(reversed);
        master.run_ms(50);
        mode(&mut master, -1);
        master.log.clear();
        master.write(NODE, 0x2003, 3, &[1]);
        assert!(wait_for_boot(&mut master, 20));
        // It is kept: this is the start after it. What it found is told.
        assert_eq!(master.read(NODE, 0x2004, 1), 1 << 30);
        let after = runs(&mut master, if reversed { -1.0 } else { 1.0 });
        assert!(before.0 > 0.02 && before.1 > 2.0, "{before:?}");
        assert!(after.0 < 0.1 * before.0, "{before:?} {after:?}");
        assert!(after.1 < 0.1, "{after:?}");
    }
}
