//! Errors and warnings over the bus: emergency frames, error objects, statusword, and the way back.

mod master;
use master::*;

/// The objects that tell of errors: 0x1001, 0x1002, 0x603F and the newest of 0x1003.
fn error_objects(master: &mut Master) -> (i32, i32, i32, i32) {
    (
        master.read(1, 0x1001, 0),
        master.read(1, 0x1002, 0),
        master.read(1, 0x603F, 0),
        master.read(1, 0x1003, 1),
    )
}

/// Fault reset and on to operation enabled, as the manual has it (l.244).
#[track_caller]
fn recover(master: &mut Master, code: u16) {
    assert_eq!(master.state(1), FAULT);
    master.log.clear();
    master.write_u16(1, 0x6040, 0, 0);
    master.write_u16(1, 0x6040, 0, 0x86);
    assert_eq!(master.state(1), READY_TO_SWITCH_ON);
    let [low, high] = code.to_le_bytes();
    assert_eq!(master.emergencies(1), [[0, 0, 0, 0, 0, 0, low, high]]);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    assert_eq!(master.read(1, 0x1002, 0), 0);
    master.write_u16(1, 0x6040, 0, 0x0F);
    assert_eq!(master.state(1), OPERATION_ENABLED);
    master.log.clear();
}

#[test]
fn a_supply_that_is_cut_is_a_fault_after_450_ms_and_the_node_lives_on() {
    let mut master = Master::new(&[1]);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 10_000);
    master.run_ms(50);
    assert_ne!(master.status(1) & 0x10, 0, "voltage enabled");
    assert!((master.read(1, 0x3000, 1) - 480).abs() <= 1);
    master.drive(1).plant().set_supply_v(0.0);
    let cut = master.now();
    master.log.clear();
    master.run_ms(600);
    let frame = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x81)
        .unwrap();
    // 18 Hz of smoothing come before the 450 ms.
    let ms = frame.at.since_ns(cut) as f64 * 1e-6;
    assert!((450.0..475.0).contains(&ms), "{ms}");
    assert_eq!(frame.frame.bytes(), [0x20, 0x32, 0x05, 0, 0, 0, 0, 0]);
    assert_eq!(master.status(1) & 0x5F, 0x08, "fault, no voltage");
    assert_eq!(error_objects(&mut master), (0x05, 1 << 7, 0x3220, 0x3220));
    let position = master.position(1);
    // A reset while the supply is away leads back to the fault.
    master.write_u16(1, 0x6040, 0, 0);
    master.write_u16(1, 0x6040, 0, 0x86);
    // It has lasted for long enough, so the next millisecond brings it back.
    master.run_ms(3);
    assert_eq!(master.state(1), FAULT);
    master.run_ms(500);
    assert_eq!(master.emergency_codes(1), [0x3220, 0, 0x3220]);
    master.drive(1).plant().set_supply_v(48.0);
    master.run_ms(200);
    assert!((master.position(1) - position).abs() < 6_000);
    recover(&mut master, 0x3220);
}

#[test]
fn too_high_a_supply_is_a_fault_and_a_short_dip_is_none() {
    let mut master = Master::new(&[1]);
    master.drive(1).plant().set_supply_v(10.0);
    master.run_ms(400);
    master.drive(1).plant().set_supply_v(60.0);
    master.run_ms(400);
    master.drive(1).plant().set_supply_v(48.0);
    master.run_ms(100);
    assert!(master.emergencies(1).is_empty());
    master.drive(1).plant().set_supply_v(60.0);
    master.run_ms(400);
    // Switched off and on, the time begins anew.
    master.write_u16(1, 0x2384, 6, 0);
    master.run_ms(10);
    master.write_u16(1, 0x2384, 6, 520);
    master.run_ms(400);
    assert!(master.emergencies(1).is_empty());
    master.run_ms(100);
    assert_eq!(master.emergency_codes(1), [0x3210]);
    assert_eq!(error_objects(&mut master), (0x05, 1 << 6, 0x3210, 0x3210));
    master.drive(1).plant().set_supply_v(48.0);
    master.run_ms(100);
    recover(&mut master, 0x3210);
}

#[test]
fn sync_loss_counts_from_when_it_is_switched_on() {
    let mut master = Master::new(&[1]);
    master.send(0x80, &[]);
    master.run_ms(1_000);
    master.write_u16(1, 0x2406, 0, 50);
    let on = master.now();
    master.run_ms(40);
    assert!(master.emergencies(1).is_empty());
    for _ in 0..10 {
        master.send(0x80, &[]);
        master.run_ms(45);
    }
    assert!(
        master.emergencies(1).is_empty(),
        "{}",
        master.now().since_ns(on)
    );
    master.log.clear();
    master.send(0x80, &[]);
    let last = master.now();
    master.run_ms(60);
    let frame = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x81)
        .unwrap();
    let ms = frame.at.since_ns(last) as f64 * 1e-6;
    assert!((50.0..52.0).contains(&ms), "{ms}");
    assert_eq!(frame.frame.bytes(), [0x80, 0x81, 0x11, 0, 0, 0, 0, 0]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(error_objects(&mut master), (0x11, 1 << 11, 0x8180, 0x8180));
    // Off and on again does not remember the old SYNC.
    master.write_u16(1, 0x2406, 0, 0);
    master.run_ms(100);
    recover(&mut master, 0x8180);
    master.write_u16(1, 0x2406, 0, 50);
    master.run_ms(30);
    assert!(master.emergencies(1).is_empty());
    master.run_ms(30);
    assert_eq!(master.emergency_codes(1), [0x8180]);
}

#[test]
fn following_errors_warn_and_then_stop() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x6065, 0, 200);
    master.write_u16(1, 0x6066, 0, 20);
    master.write_i32(1, 0x2120, 0, 2_000);
    master.write_u16(1, 0x2121, 0, 50);
    master.enable(1, 1);
    let from = master.position(1);
    // A move that keeps within the windows.
    master.write_i32(1, 0x607A, 0, from + 4_096);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(300);
    assert!(master.emergencies(1).is_empty());
    master.write_u16(1, 0x6040, 0, 0x0F);
    // A blocked shaft, and a demand 1,000 counts away: the warning alone.
    master.drive(1).plant().set_blocked(true);
    master.write_i32(1, 0x607A, 0, from + 5_096);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(500);
    assert_eq!(master.emergencies(1), [[0x11, 0x86, 0x81, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), OPERATION_ENABLED);
    let status = master.status(1);
    assert_eq!(
        status & 0x2080,
        0x2080,
        "{status:04X}: following error, warning"
    );
    assert_eq!(error_objects(&mut master), (0x81, 1 << 24, 0x8611, 0x8611));
    // It goes when the shaft is free again.
    master.log.clear();
    master.drive(1).plant().set_blocked(false);
    master.run_ms(200);
    assert_eq!(master.emergencies(1), [[0, 0, 0, 0, 0, 0, 0x11, 0x86]]);
    assert_eq!(master.status(1) & 0x2080, 0);
    master.write_u16(1, 0x6040, 0, 0x0F);
    // Far away: the fault, after its time.
    master.log.clear();
    master.drive(1).plant().set_blocked(true);
    master.write_i32(1, 0x607A, 0, from + 40_000);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.run_ms(500);
    // The warning ends with the enabled state.
    assert_eq!(master.emergency_codes(1), [0x8611, 0x8614, 0]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(error_objects(&mut master), (0x81, 1 << 26, 0x8614, 0x8614));
    assert_eq!(master.read(1, 0x1003, 2), 0x8611);
    assert!(
        master.read_i16(1, 0x6078, 0).abs() <= 10,
        "the bridge is off"
    );
    master.drive(1).plant().set_blocked(false);
    recover(&mut master, 0x8614);
}

#[test]
fn velocity_errors_warn_and_then_stop() {
    let mut master = Master::new(&[1]);
    master.write_u16(1, 0x606D, 0, 2_000);
    master.write_u16(1, 0x606E, 0, 20);
    master.enable(1, 3);
    master.drive(1).plant().set_blocked(true);
    master.write_i32(1, 0x60FF, 0, 20_000);
    master.run_ms(200);
    assert_eq!(master.emergencies(1), [[0x11, 0x84, 0x81, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), OPERATION_ENABLED);
    master.write_u16(1, 0x2105, 0, 50);
    master.write_u16(1, 0x2104, 0, 10_000);
    master.run_ms(100);
    assert_eq!(master.emergency_codes(1)[..2], [0x8411, 0x8414]);
    assert_eq!(master.state(1), FAULT);
}

#[test]
fn limits_of_speed_and_acceleration_warn() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x6046, 1, 30_000);
    master.write_i32(1, 0x6046, 2, 5_000);
    master.enable(1, 3);
    master.run_ms(20);
    // Standing is below the least velocity.
    assert_eq!(master.emergency_codes(1), [0x8418]);
    assert_eq!(master.read(1, 0x1002, 0), 1 << 22);
    for (velocity, codes) in [
        (-15_000, vec![0]),
        (40_000, vec![0x8418, 0, 0x8418]),
        (15_000, vec![0]),
    ] {
        master.log.clear();
        master.write_i32(1, 0x60FF, 0, velocity);
        master.run_ms(300);
        assert_eq!(master.emergency_codes(1), codes, "{velocity}");
    }
    master.log.clear();
    master.write_i32(1, 0x60C5, 0, 100_000);
    master.write_i32(1, 0x60FF, 0, 25_000);
    master.run_ms(20);
    assert_eq!(master.emergency_codes(1), [0x8480]);
    master.run_ms(300);
    assert_eq!(master.emergency_codes(1), [0x8480, 0]);
}

#[test]
fn heat_is_a_fault_while_enabled() {
    let mut master = Master::new(&[1]);
    master.drive(1).plant().set_amplifier_temperature_c(90.0);
    master.run_ms(200);
    assert!(
        master.emergencies(1).is_empty(),
        "looked for in operation enabled only"
    );
    assert_eq!(master.read_i16(1, 0x3000, 2), 90);
    master.write_u16(1, 0x6040, 0, 0x06);
    master.write_u16(1, 0x6040, 0, 0x0F);
    master.run_ms(5);
    assert_eq!(master.emergencies(1), [[0x10, 0x42, 0x09, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), FAULT);
    master.drive(1).plant().set_amplifier_temperature_c(25.0);
    master.run_ms(200);
    recover(&mut master, 0x4210);
}

#[test]
fn gains_that_come_out_negative_are_a_parameter_error_and_the_old_ones_stay() {
    let mut master = Master::new(&[1]);
    master.enable(1, 3);
    let before = *master.drive(1).core().unwrap().cascade();
    // 100 Hz with a damping of 1: 2ζωL − R is negative.
    master.write_u16(1, 0x3019, 3, 1_000);
    master.run_ms(5);
    assert_eq!(master.emergencies(1), [[0x20, 0x63, 0x01, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(error_objects(&mut master), (0x01, 1 << 1, 0x6320, 0x6320));
    let core = master.drive(1).core().unwrap();
    assert!(core.comms().parameter_error().is_some());
    assert!(core.cascade().is_tuned_like(&before));
    // A reset alone does not help.
    master.write_u16(1, 0x6040, 0, 0);
    master.write_u16(1, 0x6040, 0, 0x86);
    master.run_ms(3);
    assert_eq!(master.state(1), FAULT);
    // Correction and reset do.
    master.write_u16(1, 0x3019, 3, 15_000);
    recover(&mut master, 0x6320);
    let core = master.drive(1).core().unwrap();
    assert!(!core.cascade().is_tuned_like(&before));
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 20_000);
    master.run_ms(300);
    assert!((master.read(1, 0x606C, 0) - 20_000).abs() < 500);
    assert!(master.emergencies(1).is_empty());
}

#[test]
fn quick_stop_frees_or_holds() {
    for (option, stays) in [
        (0_u16, false),
        (1, false),
        (2, false),
        (4, false),
        (5, true),
        (6, true),
        (8, true),
    ] {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x605A, 0, option);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, 20_000);
        master.run_ms(200);
        master.write_u16(1, 0x6040, 0, 0x0B);
        let place = master.position(1);
        if stays {
            assert_eq!(master.state(1), QUICK_STOP_ACTIVE, "option {option}");
            master.run_ms(300);
            let away = master.position(1) - place;
            assert!(away.abs() < 60, "option {option}: {away}");
            // And back (transition 16).
            master.write_u16(1, 0x6040, 0, 0x0F);
            assert_eq!(master.state(1), OPERATION_ENABLED);
        } else {
            assert_eq!(master.state(1), SWITCH_ON_DISABLED, "option {option}");
            master.run_ms(100);
            assert!(master.position(1) - place > 1_000, "the motor runs out");
        }
    }
    let mut master = Master::new(&[1]);
    assert_eq!(master.try_write(1, 0x605A, 0, &[9, 0]), Err(0x0609_0030));
}

#[test]
fn modes_are_refused_outside_operation_enabled_and_when_there_are_none() {
    let mut master = Master::new(&[1]);
    assert_eq!(master.try_write(1, 0x6060, 0, &[1]), Err(0x0800_0022));
    assert_eq!(master.try_write(1, 0x6060, 0, &[0]), Ok(()));
    master.write_u16(1, 0x6040, 0, 0x06);
    assert_eq!(master.try_write(1, 0x6060, 0, &[3]), Err(0x0800_0022));
    master.write_u16(1, 0x6040, 0, 0x0F);
    for mode in [2_u8, 5, 7, 13, 0xFF, 0x80] {
        assert_eq!(
            master.try_write(1, 0x6060, 0, &[mode]),
            Err(0x0609_0030),
            "mode {mode}"
        );
    }
    master.write(1, 0x6060, 0, &[3]);
    assert_eq!(master.read(1, 0x6061, 0), 3);
    // Entering operation enabled again clears it.
    master.write_u16(1, 0x6040, 0, 0x07);
    master.write_u16(1, 0x6040, 0, 0x0F);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    // Not while under power.
    assert_eq!(master.try_write(1, 0x607E, 0, &[0xFF]), Err(0x0800_0022));
    assert_eq!(master.try_write(1, 0x60EA, 0, &[0, 0]), Err(0x0800_0022));
    master.write_u16(1, 0x6040, 0, 0);
    assert_eq!(master.try_write(1, 0x607E, 0, &[0]), Err(0x0609_0030));
    let position = master.position(1);
    master.write(1, 0x607E, 0, &[0xFF]);
    master.run_ms(2);
    assert_eq!(master.position(1), -position);
}

#[test]
fn the_history_keeps_the_newest_first() {
    let mut master = Master::new(&[1]);
    assert_eq!(master.read(1, 0x1003, 0), 0);
    master.write_u16(1, 0x2384, 6, 400);
    master.run_ms(500);
    master.write_u16(1, 0x3019, 3, 1_000);
    master.run_ms(5);
    assert_eq!(
        master.emergencies(1),
        [
            [0x10, 0x32, 0x05, 0, 0, 0, 0, 0],
            [0x20, 0x63, 0x05, 0, 0, 0, 0, 0],
        ]
    );
    assert_eq!(master.read(1, 0x1003, 0), 2);
    assert_eq!(master.read(1, 0x1003, 1), 0x6320);
    assert_eq!(master.read(1, 0x1003, 2), 0x3210);
    assert_eq!(master.read(1, 0x1002, 0), 1 << 6 | 1 << 1);
    // The reset announces both ends; the register is empty with both.
    master.write_u16(1, 0x2384, 6, 520);
    master.write_u16(1, 0x3019, 3, 20_000);
    master.log.clear();
    master.write_u16(1, 0x6040, 0, 0x86);
    master.run_ms(3);
    assert_eq!(
        master.emergencies(1),
        [
            [0, 0, 0, 0, 0, 0, 0x20, 0x63],
            [0, 0, 0, 0, 0, 0, 0x10, 0x32],
        ]
    );
    assert_eq!(master.read(1, 0x1003, 0), 2);
}
