//! 0x2004 bit by bit: each set by its physical cause, with what it does beside being shown.

use std::collections::BTreeSet;

use crate::bench::*;
use personalities::board::{Light, Lights};
use personalities::md80::{Effect, STATUS_BITS};
use plant::{EncoderFault, Phase, Plant, Short};

/// How a bit is brought about.
struct Case {
    sub: u8,
    bit: u8,
    /// The drive that it is done to.
    begin: fn() -> Master,
    /// The cause, and time enough.
    cause: fn(&mut Master),
    /// Ends the cause.
    end: fn(&mut Master),
}

/// What it leads to is a fault at once.
fn try_enable(master: &mut Master, in_mode: i8) {
    mode(master, in_mode);
    master.write_u16(NODE, 0x6040, 0, 6);
    master.write_u16(NODE, 0x6040, 0, 15);
}

fn configured() -> Master {
    let mut master = fresh(|_| {});
    configure(&mut master, 21);
    master
}

fn eccentric(counts: f32) -> Master {
    let mut master = fresh(|settings| settings.plant.encoder.eccentricity_counts = counts);
    configure(&mut master, 21);
    master
}

fn nothing(_: &mut Master) {}

/// The page names the words; the table of docs/md80.md has a line for each bit.
#[rustfmt::skip]
const CASES: &[Case] = &[
    Case { sub: 1, bit: 0, begin: quiet,
        cause: |m| { plant(m).set_encoder_fault(EncoderFault::BadParity); m.run_ms(20); },
        end: |m| plant(m).set_encoder_fault(EncoderFault::None) },
    // The shaft is turned by its load, against the shorted phases of a drive at rest.
    Case { sub: 1, bit: 1, begin: quiet,
        cause: |m| { plant(m).set_encoder_turned(true); plant(m).set_load_torque_nm(-0.8); m.run_ms(500); },
        end: |m| {
            plant(m).set_encoder_turned(false);
            plant(m).set_load_torque_nm(0.0);
            plant(m).set_motion(0, 0.0);
        } },
    Case { sub: 1, bit: 2, begin: || fresh(|_| {}), cause: nothing, end: nothing },
    Case { sub: 1, bit: 3, begin: || eccentric(300.0), cause: |m| calibrated(m, 3), end: nothing },
    Case { sub: 1, bit: 4, begin: configured,
        cause: |m| { plant(m).set_blocked(true); calibrated(m, 3); }, end: nothing },
    Case { sub: 1, bit: 5, begin: quiet,
        cause: |m| { plant(m).set_magnet_mm(2.5); m.run_ms(20); },
        end: |m| plant(m).set_magnet_mm(1.0) },
    Case { sub: 1, bit: 6, begin: quiet,
        cause: |m| { plant(m).set_encoder_fault(EncoderFault::NoAnswer); reset_node(m); },
        end: |m| plant(m).set_encoder_fault(EncoderFault::None) },
    Case { sub: 1, bit: 30, begin: || eccentric(80.0), cause: |m| calibrated(m, 3), end: nothing },
    Case { sub: 2, bit: 0, begin: output,
        cause: |m| { plant(m).set_output_encoder_silent(true); m.run_ms(20); },
        end: |m| plant(m).set_output_encoder_silent(false) },
    Case { sub: 2, bit: 1, begin: output,
        cause: |m| { plant(m).set_output_encoder_turned(true); m.run_ms(5); velocity(m, 60); m.run_ms(500); },
        end: |m| plant(m).set_output_encoder_turned(false) },
    Case { sub: 2, bit: 2, begin: || with_output(false, |_| {}), cause: nothing, end: nothing },
    Case { sub: 2, bit: 3, begin: || with_output(false, |encoder| encoder.eccentricity_turns = 0.02),
        cause: |m| calibrated(m, 4), end: nothing },
    Case { sub: 2, bit: 4, begin: || with_output(false, |_| {}),
        cause: |m| { plant(m).set_blocked(true); calibrated(m, 4); }, end: nothing },
    Case { sub: 2, bit: 5, begin: output,
        cause: |m| { plant(m).set_output_magnet_mm(0.1); m.run_ms(20); },
        end: |m| plant(m).set_output_magnet_mm(1.0) },
    Case { sub: 2, bit: 6, begin: || with_output(false, |_| {}),
        cause: |m| {
            mode(m, 0);
            m.write(NODE, 0x1010, 1, &SAVE);
            m.run_ms(300);
            plant(m).set_output_encoder_silent(true);
            reset_node(m);
        },
        end: |m| plant(m).set_output_encoder_silent(false) },
    Case { sub: 2, bit: 30, begin: || with_output(false, |encoder| encoder.eccentricity_turns = 0.005),
        cause: |m| calibrated(m, 4), end: nothing },
    Case { sub: 3, bit: 0, begin: configured,
        cause: |m| { m.write(NODE, 0x2000, 9, &[1]); plant(m).set_blocked(true); calibrated(m, 3); },
        end: nothing },
    Case { sub: 3, bit: 1, begin: configured,
        cause: |m| { plant(m).set_open_phase(Phase::A, true); calibrated(m, 3); }, end: nothing },
    Case { sub: 3, bit: 2,
        begin: || {
            let mut master = fresh(|settings| settings.plant.motor.phase_inductance_h = 0.2);
            configure(&mut master, 21);
            master
        },
        cause: |m| calibrated(m, 3), end: nothing },
    Case { sub: 3, bit: 3,
        begin: || { let mut master = fresh(|_| {}); configure(&mut master, 20); master },
        cause: |m| calibrated(m, 3), end: nothing },
    Case { sub: 3, bit: 4, begin: || fresh(|_| {}), cause: |m| { try_enable(m, 3); m.run_ms(5); },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
    Case { sub: 4, bit: 0, begin: quiet,
        cause: |m| { plant(m).set_gate_driver_silent(true); m.run_ms(20); },
        end: |m| plant(m).set_gate_driver_silent(false) },
    Case { sub: 4, bit: 1, begin: quiet,
        cause: |m| { velocity(m, 500); m.run_ms(300); plant(m).set_short(Some(Short::ToPositive(Phase::A))); m.run_ms(50); },
        end: |m| plant(m).set_short(None) },
    Case { sub: 4, bit: 2, begin: quiet,
        cause: |m| { plant(m).set_gate_supply_v(Some(6.0)); m.run_ms(20); },
        end: |m| plant(m).set_gate_supply_v(None) },
    // A shaft that is spun, with its phases shorted.
    Case { sub: 5, bit: 0, begin: quiet,
        cause: |m| { plant(m).set_motion(0, 600.0); m.run_ms(20); },
        end: |m| plant(m).set_motion(0, 0.0) },
    Case { sub: 5, bit: 1, begin: quiet,
        cause: |m| { plant(m).set_supply_v(57.0); m.run_ms(100); },
        end: |m| { plant(m).set_supply_v(48.0); m.run_ms(100); } },
    Case { sub: 5, bit: 2, begin: quiet,
        cause: |m| { plant(m).set_supply_v(9.0); m.run_ms(200); },
        end: |m| { plant(m).set_supply_v(48.0); m.run_ms(200); } },
    Case { sub: 5, bit: 3, begin: quiet,
        cause: |m| { plant(m).set_motor_temperature_c(82.0); m.run_ms(20); },
        end: |m| plant(m).set_motor_temperature_c(25.0) },
    Case { sub: 5, bit: 4, begin: quiet,
        cause: |m| { plant(m).set_amplifier_temperature_c(103.0); m.run_ms(100); },
        end: |m| { plant(m).set_amplifier_temperature_c(25.0); m.run_ms(100); } },
    // A board of which a current sensor drifted.
    Case { sub: 5, bit: 5, begin: || made(|plant| plant.current_zero_counts = [2200.0, 2048.0]),
        cause: nothing, end: nothing },
    Case { sub: 7, bit: 0, begin: quiet,
        cause: |m| {
            let here = m.position(NODE);
            m.write_i32(NODE, 0x607D, 1, here + TURN / 8);
            m.write_i32(NODE, 0x607D, 2, here + TURN);
            try_enable(m, 3);
            m.run_ms(5);
        },
        end: |m| { m.write_i32(NODE, 0x607D, 1, 0); m.write_i32(NODE, 0x607D, 2, 0); } },
    // A load that drives the motor faster than it may turn.
    Case { sub: 7, bit: 1, begin: quiet,
        cause: |m| {
            velocity(m, 60);
            m.run_ms(300);
            m.write_i32(NODE, 0x6080, 0, 60);
            plant(m).set_load_torque_nm(-0.5);
            m.run_ms(300);
        },
        end: |m| { plant(m).set_load_torque_nm(0.0); plant(m).set_motion(0, 0.0); } },
    Case { sub: 7, bit: 24, begin: quiet,
        cause: |m| { m.write_i32(NODE, 0x60C5, 0, 100); velocity(m, 60); m.run_ms(50); },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
    Case { sub: 7, bit: 25, begin: quiet,
        cause: |m| { m.write_u16(NODE, 0x6072, 0, 50); velocity(m, 60); m.run_ms(50); },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
    Case { sub: 7, bit: 26, begin: quiet,
        cause: |m| { m.write_i32(NODE, 0x6080, 0, 30); velocity(m, 60); m.run_ms(300); },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
    Case { sub: 7, bit: 27, begin: quiet,
        cause: |m| {
            let here = m.position(NODE);
            m.write_i32(NODE, 0x607D, 1, here - TURN);
            m.write_i32(NODE, 0x607D, 2, here + TURN / 8);
            ramps(m, 300);
            enable(m, 1);
            m.write_i32(NODE, 0x607A, 0, here + TURN);
            m.run_ms(50);
        },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
    Case { sub: 8, bit: 30, begin: quiet,
        cause: |m| { m.write_u16(NODE, 0x2000, 12, 100); velocity(m, 60); m.run_ms(500); },
        end: |m| m.write_u16(NODE, 0x6040, 0, 0) },
];

/// 0x2004 says so in [`LEVELS`]: they hold as long as it is so, whatever is reset.
const LEVELS: &[(u8, u8)] = &[(1, 2), (1, 30), (2, 2), (2, 30), (3, 4)];

fn red(master: &mut Master) -> Light {
    master.drive(NODE).lights().expect("lights").red
}

#[test]
fn every_bit_has_its_cause_and_its_effect() {
    let mut seen = BTreeSet::new();
    for case in CASES {
        let (sub, bit) = (case.sub, case.bit);
        let name = format!("{sub} bit {bit}");
        let row = STATUS_BITS
            .iter()
            .find(|row| (row.sub, row.bit) == (sub, bit));
        let row = row.unwrap_or_else(|| panic!("{name}: no such bit"));
        assert!(seen.insert((sub, bit)), "{name}: twice");
        let mut master = (case.begin)();
        let from_the_start = (sub, bit) == (5, 5);
        let is_set = status_bit(&mut master, sub, bit);
        let may = LEVELS.contains(&(sub, bit)) || from_the_start;
        assert!(!is_set || may, "{name}: set without its cause");
        if !from_the_start {
            master.log.clear();
        }
        (case.cause)(&mut master);
        assert!(status_bit(&mut master, sub, bit), "{name}");
        let codes = master.emergency_codes(NODE);
        let state = master.state(NODE);
        let register = master.read(NODE, 0x1001, 0);
        match row.effect {
            Effect::Fault(code) | Effect::Critical(code) => {
                // One that was there at the start had its emergency then.
                assert!(
                    codes.contains(&code) || from_the_start,
                    "{name}: {codes:04X?}"
                );
                assert_eq!((state, register), (FAULT, 1), "{name}");
            }
            Effect::Announced(code) => {
                assert_eq!(codes, [code], "{name}");
                assert_ne!(state, FAULT, "{name}");
                assert_eq!(register, 1, "{name}");
            }
            // Without a fault of its own; others may have come with it.
            Effect::Shown => {}
        }
        let is_error = bit < 16;
        let lit = matches!(red(&mut master), Light::On);
        assert!(lit || !is_error, "{name}: the red LED");

        (case.end)(&mut master);
        master.run_ms(10);
        master.write_u16(NODE, 0x6040, 0, 0);
        master.write_u16(NODE, 0x6040, 0, 0x80);
        master.run_ms(10);
        let stays = status_bit(&mut master, sub, bit);
        match row.effect {
            Effect::Critical(_) => {
                assert!(stays, "{name}: critical");
                assert_eq!(master.state(NODE), FAULT, "{name}");
                if !from_the_start {
                    reset_node(&mut master);
                    assert!(!status_bit(&mut master, sub, bit), "{name}: a reset");
                    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED, "{name}");
                }
            }
            _ if LEVELS.contains(&(sub, bit)) => assert!(stays, "{name}: it is still so"),
            _ => assert!(!stays, "{name}: a fault reset ends it"),
        }
        if let Effect::Fault(_) = row.effect {
            assert_eq!(master.state(NODE), SWITCH_ON_DISABLED, "{name}");
        }
    }
    let all: BTreeSet<(u8, u8)> = STATUS_BITS.iter().map(|row| (row.sub, row.bit)).collect();
    assert_eq!(seen, all);
}

#[test]
fn a_fault_whose_cause_stays_comes_again() {
    type Act = fn(&mut Plant<f32>);
    let causes: [(u8, u8, Act); 3] = [
        (4, 2, |plant| {
            plant.set_gate_driver_temperature_c(Some(180.0))
        }),
        (5, 1, |plant| plant.set_supply_v(60.0)),
        (5, 3, |plant| plant.set_motor_temperature_c(90.0)),
    ];
    for (sub, bit, act) in causes {
        let mut master = quiet();
        act(plant(&mut master));
        master.run_ms(100);
        assert_eq!(master.state(NODE), FAULT);
        master.write_u16(NODE, 0x6040, 0, 0x80);
        master.run_ms(10);
        assert_eq!(master.state(NODE), FAULT, "{sub} {bit}");
        assert!(status_bit(&mut master, sub, bit));
    }
}

#[test]
fn a_status_word_takes_zero_without_effect_and_nothing_else() {
    // M16.
    let mut master = fresh(|_| {});
    for sub in 1..=8 {
        let before = master.read(NODE, 0x2004, sub);
        assert_eq!(master.try_write(NODE, 0x2004, sub, &[0; 4]), Ok(()));
        let result = master.try_write(NODE, 0x2004, sub, &1u32.to_le_bytes());
        assert_eq!(result, Err(0x0609_0030));
        assert_eq!(master.read(NODE, 0x2004, sub), before);
    }
}

#[test]
fn the_lights_tell_of_errors_and_blink_on_command() {
    let mut master = quiet();
    assert_eq!(master.drive(NODE).lights(), Some(Lights::WELL));
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 1, &[1]);
    master.run_ms(5);
    let both = Light::Blinks { per_s: 10 };
    let blinking = Some(Lights {
        green: both,
        red: both,
    });
    assert_eq!(master.drive(NODE).lights(), blinking);
    master.run_ms(1900);
    assert_eq!(master.drive(NODE).lights(), blinking);
    master.run_ms(200);
    assert_eq!(master.drive(NODE).lights(), Some(Lights::WELL));
    plant(&mut master).set_supply_v(60.0);
    master.run_ms(100);
    let wrong = Lights {
        red: Light::On,
        ..Lights::WELL
    };
    assert_eq!(master.drive(NODE).lights(), Some(wrong));
    // Others have none.
    let mut master = Master::new(&[1]);
    assert_eq!(master.drive(1).lights(), None);
}
