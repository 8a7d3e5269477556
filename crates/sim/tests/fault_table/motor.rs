//! The motor: what heats it, and how its field is oriented.

use super::*;

/// Half a turn, 2³² being a whole one.
const HALF_TURN: i32 = i32::MIN;

pub(super) const ROWS: &[Row] = &[
    Row {
        cause: Cause::CurrentLimit,
        how: "the shaft is blocked, and rated torque asked for: 0.73 A where 0.3 A are allowed for ever",
        prepare: |master| {
            // 0.3 A continuous, 1 A peak for 100 ms (P30: 1·0.1/(0.73² - 0.3²) = 0.226 s).
            master.write_u16(1, 0x2111, 0, 30);
            master.write_u16(1, 0x2110, 0, 100);
            master.write_u16(1, 0x2112, 0, 100);
            enable(master, 4);
            master.drive(1).plant().set_blocked(true);
        },
        provoke: |master| master.write_i16(1, 0x6071, 0, 1000),
        cease: |master| master.write_i16(1, 0x6071, 0, 0),
        within_ms: (200.0, 280.0),
        is_event: false,
    },
    Row {
        cause: Cause::MotorTemperature,
        how: "a motor of 80 degC, its shaft blocked, bears its rated current until the copper's heat has brought it to 85 degC",
        prepare: |master| {
            enable(master, 4);
            let plant = master.drive(1).plant();
            plant.set_blocked(true);
            plant.set_motor_temperature_c(80.0);
        },
        provoke: |master| {
            if master.state(1) == OPERATION_ENABLED {
                master.write(1, 0x6060, 0, &[4]);
            }
            master.write_i16(1, 0x6071, 0, 1000);
        },
        cease: |master| {
            master.write_i16(1, 0x6071, 0, 0);
            master.drive(1).plant().set_motor_temperature_c(25.0);
        },
        within_ms: (500.0, 20_000.0),
        is_event: true,
    },
    Row {
        cause: Cause::MotorPhasing,
        how: "the encoder's magnet slips half a turn on the shaft, so that a torque drives the rotor backwards",
        prepare: |master| {
            master.write(1, 0x2410, 5, &[1]);
            enable(master, 4);
        },
        // The magnet slips half a turn, an electrical half turn of this motor.
        provoke: |master| {
            master.drive(1).plant().slip_magnet(HALF_TURN);
            if master.state(1) != OPERATION_ENABLED {
                return;
            }
            master.write(1, 0x6060, 0, &[4]);
            master.write_i16(1, 0x6071, 0, 300);
        },
        cease: |master| {
            master.write_i16(1, 0x6071, 0, 0);
            master.drive(1).plant().slip_magnet(HALF_TURN);
        },
        within_ms: (10.0, 40.0),
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
fn a_rotor_that_swings_to_a_given_field_does_not_run_away() {
    let mut master = one(&P3_EXTENDED);
    master.write(1, 0x2410, 5, &[1]);
    enable(&mut master, 11);
    master.write_i16(1, 0x6071, 0, 300);
    master.log.clear();
    for angle in [0, 0x4000, 0x7FFF, -0x4000, 0, 0x6000, -0x6000] {
        master.write_i16(1, 0x60EA, 0, angle);
        master.run_ms(300);
    }
    assert!(master.emergency_codes(1).is_empty());
    assert_eq!(master.state(1), OPERATION_ENABLED);
}
