//! Encoders that count the other way round than their calibration has found.

use crate::bench::*;

/// The encoder is turned round while the drive rests; then it moves.
#[test]
fn a_turned_encoder_is_found_by_the_rotors_own_voltage() {
    for (n, (begin, rpm)) in [(0.0, 100), (0.2, -100), (0.1, 100), (0.8, -100)]
        .into_iter()
        .enumerate()
    {
        let mut master = made(|plant| plant.start_turns = begin);
        let turned = n < 3;
        plant(&mut master).set_encoder_turned(turned);
        master.run_ms(20);
        velocity(&mut master, rpm);
        master.run_ms(500);
        assert_eq!(status_bit(&mut master, 1, 1), turned, "{begin} {rpm}");
        let wanted = if turned { FAULT } else { OPERATION_ENABLED };
        assert_eq!(master.state(NODE), wanted);
        if turned {
            // What helps is a calibration.
            plant(&mut master).set_load_torque_nm(0.0);
            master.write_u16(NODE, 0x6040, 0, 0);
            master.write_u16(NODE, 0x6040, 0, 0x80);
            master.run_ms(50);
            mode(&mut master, -1);
            master.log.clear();
            master.write(NODE, 0x2003, 3, &[1]);
            assert!(wait_for_boot(&mut master, 20));
            assert_eq!(master.read(NODE, 0x2004, 1), 0);
            master.write_u16(NODE, 0x2000, 12, 0);
            velocity(&mut master, rpm);
            master.run_ms(500);
            let shown = master.read(NODE, 0x606C, 0);
            assert!((shown - rpm).abs() < 4, "{shown}");
        }
    }
}

/// Nothing of it is found where nothing is wrong: a load that drives, brakes and swings, at any speed,
/// also of a motor whose wires are exchanged, and with a wrong torque constant.
#[test]
fn a_sound_encoder_is_never_taken_for_a_turned_one() {
    for (swapped, constant) in [
        (false, 0.091_f32),
        (true, 0.091),
        (false, 0.06),
        (false, 0.15),
    ] {
        let mut master = fresh(|settings| {
            settings.plant.motor.wires_swapped = swapped;
            settings.plant.bridge.dead_time_s = 200e-9;
            let encoder = &mut settings.plant.encoder;
            encoder.eccentricity_counts = 40.0;
            encoder.lag_s = 30e-6;
            encoder.noise_counts = 1.0;
            settings.plant.current_sensors.gain = [1.02, 0.98];
            settings.plant.current_sensors.noise_counts = 0.5;
        });
        configure(&mut master, 21);
        calibrate(&mut master);
        assert!(wait_for_boot(&mut master, 20));
        master.write_u16(NODE, 0x2000, 12, 0);
        master.write(NODE, 0x2000, 2, &constant.to_le_bytes());
        if swapped {
            // A winding that is not the one that was measured.
            master.write(NODE, 0x2000, 4, &0.13_f32.to_le_bytes());
            master.write(NODE, 0x2000, 3, &20e-6_f32.to_le_bytes());
        }
        ramps(&mut master, 3000);
        // At rest, against the shorted phases.
        for torque in [0.8, -0.8] {
            plant(&mut master).set_load_torque_nm(torque);
            master.run_ms(200);
        }
        plant(&mut master).set_load_torque_nm(0.0);
        enable(&mut master, 3);
        for (rpm, torque) in [
            (20, 0.0),
            (-300, 0.05),
            (600, -0.05),
            (10, 0.09),
            (-10, -0.09),
        ] {
            master.write_i32(NODE, 0x60FF, 0, rpm);
            plant(&mut master).set_load_torque_nm(torque);
            master.run_ms(600);
        }
        assert!(!status_bit(&mut master, 1, 1), "{swapped} {constant}");
        assert_eq!(master.state(NODE), OPERATION_ENABLED);
    }
}

#[test]
fn the_output_encoders_calibration_finds_a_turned_main_encoder() {
    let mut master = with_output(false, |_| {});
    plant(&mut master).set_encoder_turned(true);
    calibrated(&mut master, 4);
    assert!(status_bit(&mut master, 1, 1) && status_bit(&mut master, 2, 4));
    assert!(!status_bit(&mut master, 2, 1));
}

#[test]
fn a_turned_output_encoder_is_taken_by_a_calibration_of_its_direction() {
    let mut master = output();
    master.write_i32(NODE, 0x2005, 2, 1);
    plant(&mut master).set_output_encoder_turned(true);
    mode(&mut master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 4, &[1]);
    assert!(wait_for_boot(&mut master, 20));
    master.write_u16(NODE, 0x2000, 12, 0);
    velocity(&mut master, 60);
    master.run_ms(500);
    assert_eq!(master.read(NODE, 0x2004, 2), 0);
    assert!(real(&mut master, 0x2005, 5) > 5.0);
}

/// A rotor that a wrong angle locks at once tells nothing; most swing far enough.
#[test]
fn from_most_places_a_turned_encoder_is_found_as_soon_as_it_shall_move() {
    let mut found = [0, 0];
    for place in 0..20 {
        for turned in [false, true] {
            let mut master = made(|plant| plant.start_turns = f64::from(place) * 0.0274);
            plant(&mut master).set_encoder_turned(turned);
            master.run_ms(20);
            velocity(&mut master, 100);
            master.run_ms(300);
            found[usize::from(turned)] += i32::from(status_bit(&mut master, 1, 1));
        }
    }
    assert_eq!(found[0], 0);
    assert!(found[1] >= 12, "{found:?}");
}
