//! The MD80 on a simulated bus, with its sample motor: what its page says that tables do not tell.

mod master;

use master::*;
use personalities::md80::MD80;
use plant::{EncoderFault, OutputEncoder, Phase};
use sim::DriveSettings;

const NODE: u8 = 5;
const TURN: i32 = 16_384;

fn md80() -> DriveSettings {
    DriveSettings::new(id(NODE), &MD80)
}

/// A commissioned drive that has booted, without its bus's watchdog.
fn quiet() -> Master {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master
}

fn real(master: &mut Master, index: u16, sub: u8) -> f32 {
    f32::from_le_bytes(master.try_read(NODE, index, sub).expect("a value"))
}

fn mode(master: &mut Master, mode: i8) {
    master.write(NODE, 0x6060, 0, &[mode as u8]);
}

/// "To put the drive into operational mode": 6, then 15.
fn enable(master: &mut Master, in_mode: i8) {
    master.write_u16(NODE, 0x6040, 0, 6);
    master.write_u16(NODE, 0x6040, 0, 15);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    mode(master, in_mode);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, in_mode);
}

fn ramps(master: &mut Master, rpm_per_s: i32) {
    master.write_i32(NODE, 0x6083, 0, rpm_per_s);
    master.write_i32(NODE, 0x6084, 0, rpm_per_s);
}

/// A bit of a status word.
fn status_bit(master: &mut Master, sub: u8, bit: u8) -> bool {
    master.read(NODE, 0x2004, sub) as u32 & 1 << bit != 0
}

/// Whether the node has booted since the log was cleared.
fn booted(master: &Master) -> bool {
    let boot = 0x700 + u32::from(NODE);
    let mut frames = master.log.iter();
    frames.any(|t| t.frame.raw_id() == boot && t.frame.data() == [0])
}

/// Turns of the motor, as it really is.
fn motor_turns(master: &mut Master) -> f64 {
    master.drive(NODE).plant().truth().position_turns()
}

#[test]
fn it_boots_operational_with_short_states_and_its_heartbeat() {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(2100);
    let beats: Vec<_> = master
        .log
        .iter()
        .filter(|t| t.frame.raw_id() == 0x705)
        .map(|t| t.frame.data().to_vec())
        .collect();
    assert_eq!(beats, [[0x05], [0x05]]);
    // Neither voltage nor remote: the page names no such bits (M4).
    assert_eq!(master.status(NODE), 0x0040);
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.status(NODE), 0x0021);
    master.write_u16(NODE, 0x6040, 0, 7);
    assert_eq!(master.status(NODE), 0x0023);
    master.write_u16(NODE, 0x6040, 0, 15);
    assert_eq!(master.status(NODE), 0x0027);
    assert_eq!(master.read(NODE, 0x6502, 0), 647);
    assert_eq!(
        master.try_read(NODE, 0x0022, 0),
        Err(0x0602_0000),
        "not to be seen"
    );
    assert_eq!(master.try_write(NODE, 0x0022, 0, &[0]), Err(0x0602_0000));
}

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

#[test]
fn writes_that_are_padded_with_zeros_are_taken() {
    let mut master = quiet();
    // M19: four bytes for a UINT16, once with the size bits of four, once without.
    for command in [0x23, 0x22] {
        master.log.clear();
        master.send(0x605, &[command, 0x40, 0x60, 0, 6, 0, 0, 0]);
        master.run_ms(5);
        let last = master.log.last().expect("an answer").frame.data().to_vec();
        assert_eq!(last[0], 0x60, "{command:02X}");
    }
    assert_eq!(master.state(NODE), READY_TO_SWITCH_ON);
    master.log.clear();
    master.send(0x605, &[0x23, 0x40, 0x60, 0, 6, 0, 1, 0]);
    master.run_ms(5);
    let last = master.log.last().expect("an answer").frame.data().to_vec();
    assert_eq!(last[..4], [0x80, 0x40, 0x60, 0]);
    assert_eq!(last[4..], 0x0607_0012_u32.to_le_bytes());
}

#[test]
fn system_commands_want_the_service_mode() {
    const STATE: Result<(), u32> = Err(0x0800_0022);
    let mut master = quiet();
    for sub in 1..=6 {
        assert_eq!(master.try_write(NODE, 0x2003, sub, &[1]), STATE, "{sub}");
    }
    // As the maker's tool does it: 8, 6, 15, then −2, which shows as −1 (M3, M4).
    for word in [8, 6, 15] {
        master.write_u16(NODE, 0x6040, 0, word);
    }
    mode(&mut master, -2);
    assert_eq!(master.read(NODE, 0x6060, 0) as i8, -2);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, -1);
    // It writes a 6 here, too, before it saves.
    mode(&mut master, 6);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, -1);
    assert_eq!(master.try_write(NODE, 0x6060, 0, &[4]), Err(0x0609_0030));
    master.write(NODE, 0x2003, 1, &[1]);
    master.write(NODE, 0x2003, 3, &[0]);
    // Not in "ready to switch on".
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.try_write(NODE, 0x2003, 1, &[1]), STATE);
    // As the page says it.
    master.write_u16(NODE, 0x6040, 0, 0);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 5, &[1]);
    master.run_ms(3);
    assert_eq!(master.position(NODE), 0);
    // There is no output encoder.
    assert_eq!(master.try_write(NODE, 0x2003, 4, &[1]), STATE);
    master.log.clear();
    master.write(NODE, 0x2003, 2, &[1]);
    master.run_ms(100);
    assert!(booted(&master), "reset");
}

#[test]
fn a_save_wants_switch_on_disabled_and_ends_in_a_reset() {
    let mut master = quiet();
    master.write(NODE, 0x2001, 1, &1.5_f32.to_le_bytes());
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Err(0x0800_0022));
    master.write_u16(NODE, 0x6040, 0, 0);
    assert_eq!(master.try_write(NODE, 0x1010, 1, b"evas"), Err(0x0800_0020));
    master.log.clear();
    assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Ok(()));
    assert!(!booted(&master), "the acknowledge comes first");
    master.run_ms(200);
    assert!(booted(&master));
    assert_eq!(real(&mut master, 0x2001, 1), 1.5);
    assert_eq!(master.read(NODE, 0x2000, 10), i32::from(NODE));
}

#[test]
fn a_position_set_to_zero_and_saved_is_there_after_the_start() {
    let mut master = quiet();
    ramps(&mut master, 600);
    enable(&mut master, 1);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, start + 500);
    master.run_ms(1500);
    master.write_u16(NODE, 0x6040, 0, 0);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 5, &[1]);
    master.run_ms(5);
    assert!(master.position(NODE).abs() <= 1);
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(300);
    assert!(
        master.position(NODE).abs() <= 1,
        "{}",
        master.position(NODE)
    );
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

#[test]
fn a_bus_that_is_silent_stops_it() {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(50);
    assert_eq!(master.read(NODE, 0x2000, 12), 250);
    ramps(&mut master, 300);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 100);
    for _ in 0..20 {
        master.run_ms(200);
        // A SYNC is enough.
        master.send(0x80, &[]);
    }
    master.run_ms(10);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    master.log.clear();
    master.run_ms(600);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert!(status_bit(&mut master, 8, 30));
    assert_eq!(master.emergency_codes(NODE), [0x8130]);
    assert_eq!(master.read(NODE, 0x1001, 0), 1);
    // A fault reset ends the warning.
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert!(!status_bit(&mut master, 8, 30));
    assert_eq!(master.emergency_codes(NODE), [0x8130, 0]);
    // Without a mode of motion it does not matter.
    master.write_u16(NODE, 0x6040, 0, 0);
    enable(&mut master, 0);
    master.run_ms(600);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
}

#[test]
fn a_reset_clears_faults_but_not_critical_ones() {
    let mut master = quiet();
    enable(&mut master, 3);
    master.log.clear();
    master.drive(NODE).plant().set_supply_v(60.0);
    master.run_ms(100);
    assert_eq!(master.state(NODE), FAULT);
    assert!(status_bit(&mut master, 5, 1));
    assert_eq!(master.emergency_codes(NODE), [0x3210]);
    master.drive(NODE).plant().set_supply_v(48.0);
    master.run_ms(100);
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert!(!status_bit(&mut master, 5, 1));

    let fault = EncoderFault::NoAnswer;
    master.write_u16(NODE, 0x6040, 0, 0);
    master.log.clear();
    master.drive(NODE).plant().set_encoder_fault(fault);
    master.run_ms(20);
    assert_eq!(master.state(NODE), FAULT);
    assert_eq!(master.emergency_codes(NODE), [0x7305]);
    let fault = EncoderFault::None;
    master.drive(NODE).plant().set_encoder_fault(fault);
    master.run_ms(5);
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert_eq!(master.state(NODE), FAULT, "critical");
    assert!(status_bit(&mut master, 1, 0));
    master.send(0, &[0x81, NODE]);
    master.run_ms(100);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert_eq!(master.read(NODE, 0x2004, 1), 0);
}

#[test]
fn heat_is_shown_and_too_much_is_a_fault() {
    let mut master = quiet();
    let motor = real(&mut master, 0x2006, 1);
    let mosfet = real(&mut master, 0x2006, 2);
    assert!(
        (motor - 25.0).abs() < 1.0 && (mosfet - 25.0).abs() < 6.0,
        "{motor} {mosfet}"
    );
    master.drive(NODE).plant().set_motor_temperature_c(81.0);
    master.run_ms(10);
    assert!(status_bit(&mut master, 5, 3));
    assert_eq!(master.state(NODE), FAULT);
    let volts = master.read(NODE, 0x6079, 0);
    assert!((volts - 48_000).abs() < 100, "{volts}");
}

#[test]
fn reals_and_strings_keep_to_their_ranges() {
    let mut master = quiet();
    for (sub, value, code) in [
        (3, 1e-9_f32, 0x0609_0032),
        (3, 0.2, 0x0609_0031),
        (4, f32::NAN, 0x0609_0030),
        (4, 21.0, 0x0609_0031),
        (8, 0.0, 0x0609_0032),
    ] {
        let result = master.try_write(NODE, 0x2000, sub, &value.to_le_bytes());
        assert_eq!(result, Err(code), "{sub} {value}");
    }
    for (sub, value) in [(1, 1_u32), (1, 256), (10, 0), (10, 32)] {
        let result = master.try_write(NODE, 0x2000, sub, &value.to_le_bytes());
        assert!(result.is_err(), "{sub} {value}");
    }
    assert!((real(&mut master, 0x2000, 8) - 0.111_11).abs() < 1e-7);
    // A name of six characters comes in segments.
    master.log.clear();
    master.send(0x605, &[0x40, 0x00, 0x20, 6, 0, 0, 0, 0]);
    master.run_ms(5);
    assert_eq!(master.log.last().expect("it").frame.data()[0] & 0xE2, 0x40);
    master.send(0x605, &[0x60, 0, 0, 0, 0, 0, 0, 0]);
    master.run_ms(5);
    assert_eq!(
        &master.log.last().expect("it").frame.data()[1..7],
        b"AK80_9"
    );
}

/// A drive out of the box, with what its calibration needs.
fn fresh(change: impl FnOnce(&mut DriveSettings)) -> Master {
    let mut settings = md80().factory();
    change(&mut settings);
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master
}

fn configure(master: &mut Master, pole_pairs: u32) {
    master.write(NODE, 0x2000, 1, &pole_pairs.to_le_bytes());
    master.write(NODE, 0x2000, 2, &0.091_f32.to_le_bytes());
    master.write_u16(NODE, 0x2000, 5, 500);
    master.write(NODE, 0x2000, 7, &[80]);
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x6075, 0, 1000);
    master.write_u16(NODE, 0x6073, 0, 20_000);
    master.write_i32(NODE, 0x6076, 0, 1000);
    master.write_u16(NODE, 0x6072, 0, 1000);
    master.write_i32(NODE, 0x6081, 0, 100);
    for (index, sub, value) in [
        (0x2001, 1, 2.0_f32),
        (0x2001, 2, 0.5),
        (0x2001, 4, 0.1),
        (0x2002, 1, 30.0),
        (0x2002, 2, 0.5),
        (0x2002, 4, 1.0),
    ] {
        master.write(NODE, index, sub, &value.to_le_bytes());
    }
}

fn calibrate(master: &mut Master) {
    mode(master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 3, &[1]);
}

/// Runs until it has booted or `s` seconds are over.
fn wait_for_boot(master: &mut Master, s: u64) -> bool {
    for _ in 0..s * 10 {
        master.run_ms(100);
        if booted(master) {
            master.run_ms(100);
            return true;
        }
    }
    false
}

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
    master.write_i32(NODE, 0x2005, 3, 3);
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
