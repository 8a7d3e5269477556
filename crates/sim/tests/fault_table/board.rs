//! The board: encoder, bridge, amplifier, processor.

use plant::{EncoderFault, Phase, Short};

use super::*;

pub(super) const ROWS: &[Row] = &[
    Row {
        cause: Cause::WatchdogReset,
        how: "the processor hangs; 20 ms later the watchdog resets it",
        prepare: nothing,
        provoke: |master| {
            let now = master.now();
            master.drive(1).hang(now);
        },
        cease: nothing,
        // 20 ms until the watchdog bites, and the boot.
        within_ms: (20.0, 100.0),
        is_event: true,
    },
    Row {
        cause: Cause::ParameterError,
        how: "a pole count of 3 is written, which no motor has",
        prepare: nothing,
        // No motor has an odd number of poles; the range of the object does not know.
        provoke: |master| master.write(1, 0x3011, 3, &[3]),
        cease: |master| master.write(1, 0x3011, 3, &[2]),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::EncoderFeedback,
        how: "every answer of the encoder has a wrong check sum",
        prepare: |master| enable(master, 3),
        provoke: |master| {
            let plant = master.drive(1).plant();
            plant.set_encoder_fault(EncoderFault::BadParity);
        },
        cease: |master| {
            let plant = master.drive(1).plant();
            plant.set_encoder_fault(EncoderFault::None);
        },
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::MagnetDistance,
        how: "the magnet is moved from 1 mm to 2.5 mm, and in another test to 0.1 mm",
        prepare: |master| master.write(1, 0x2403, 0, &[1]),
        // Too far away for a good field, near enough for an angle.
        provoke: |master| master.drive(1).plant().set_magnet_mm(2.5),
        cease: |master| master.drive(1).plant().set_magnet_mm(1.0),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::ShortCircuit,
        how: "phase B touches the negative rail while the motor turns; in another test phase A the negative, phase C the positive, and B touches C",
        prepare: |master| {
            enable(master, 3);
            master.write_i32(1, 0x60FF, 0, 20_000);
            master.run_ms(100);
        },
        provoke: |master| {
            let plant = master.drive(1).plant();
            plant.set_short(Some(Short::ToNegative(Phase::B)));
            // An idle drive's bridge is open.
            if master.state(1) == OPERATION_ENABLED {
                master.write(1, 0x6060, 0, &[3]);
            }
        },
        cease: |master| master.drive(1).plant().set_short(None),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::AmplifierTemperature,
        how: "the amplifier is heated from 25 degC to 100 degC at once",
        prepare: |master| enable(master, 3),
        // 25 to 100 degC at once: the 18 Hz filter passes 85 degC after ln(75/15)/(2π·18) = 14.2 ms.
        provoke: |master| master.drive(1).plant().set_amplifier_temperature_c(100.0),
        cease: |master| master.drive(1).plant().set_amplifier_temperature_c(25.0),
        within_ms: (13.5, 16.5),
        is_event: false,
    },
    Row {
        cause: Cause::TorqueOff,
        how: "safe torque off is asked for while the motor turns",
        prepare: |master| {
            master.write(1, 0x2433, 1, &[1]);
            enable(master, 3);
            master.write_i32(1, 0x60FF, 0, 20_000);
            master.run_ms(100);
        },
        provoke: |master| master.drive(1).plant().set_torque_off(true),
        cease: |master| master.drive(1).plant().set_torque_off(false),
        within_ms: (0.0, 3.0),
        is_event: true,
    },
];

#[test]
fn p3() {
    prove_all(&P3, ROWS);
}

#[test]
fn p3_extended() {
    prove_all(&P3_EXTENDED, ROWS);
}

#[test]
fn a_magnet_that_is_too_near_is_the_same_error() {
    let mut master = one(&P3);
    master.write(1, 0x2403, 0, &[1]);
    master.log.clear();
    master.drive(1).plant().set_magnet_mm(0.1);
    master.run_ms(5);
    assert_eq!(master.emergencies(1), [[0x21, 0x73, 0x01, 0, 0, 0, 0, 0]]);
}

#[test]
fn every_short_circuit_opens_the_bridge_by_itself() {
    for short in [
        Short::BesidePhase(Phase::A),
        Short::ToNegative(Phase::A),
        Short::ToPositive(Phase::C),
    ] {
        let mut master = one(&P3);
        enable(&mut master, 3);
        master.write_i32(1, 0x60FF, 0, 30_000);
        master.run_ms(200);
        master.drive(1).plant().set_short(Some(short));
        master.log.clear();
        master.run_ms(10);
        assert_eq!(master.emergency_codes(1), [0x2320], "{short:?}");
        assert_eq!(master.state(1), FAULT, "{short:?}");
    }
}

#[test]
fn an_index_is_none_where_the_encoder_did_not_answer() {
    let mut master = one(&P3_EXTENDED);
    // A missing answer is no fault here, and reads as the index itself.
    master.write(1, 0x2410, 3, &[0]);
    master.write(1, 0x6098, 0, &[34]);
    enable(&mut master, 6);
    master.write_u16(1, 0x6040, 0, 0x1F);
    for _ in 0..400 {
        let plant = master.drive(1).plant();
        plant.set_encoder_fault(EncoderFault::NoAnswer);
        master.run_us(50);
        master
            .drive(1)
            .plant()
            .set_encoder_fault(EncoderFault::None);
        master.run_us(2_450);
    }
    master.run_ms(2_000);
    assert_eq!(master.status(1) & 0x3400, 0x1400, "homing done");
    // The home point is the index: position and reading within a turn count from the same place.
    let raw = i32::from(master.read_i16(1, 0x3012, 1));
    let away = (master.position(1) - raw).rem_euclid(4096);
    assert!(away <= 2 || away >= 4094, "{away}");
}
