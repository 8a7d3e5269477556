//! Motion: tracking, limits, soft stops, switches, the end of the position's range.

use super::*;

/// The shaft is blocked, and a demand far away.
fn block(master: &mut Master) {
    master.drive(1).plant().set_blocked(true);
}

fn free(master: &mut Master) {
    master.drive(1).plant().set_blocked(false);
}

/// A velocity of 20,000 counts/s that a blocked shaft cannot have.
fn turn_blocked(master: &mut Master) {
    block(master);
    if master.state(1) == OPERATION_ENABLED {
        master.write(1, 0x6060, 0, &[3]);
    }
    master.write_i32(1, 0x60FF, 0, 20_000);
}

fn let_turn(master: &mut Master) {
    free(master);
    master.write_i32(1, 0x60FF, 0, 0);
}

/// A target 3,000 counts away that a blocked shaft does not reach.
fn go_blocked(master: &mut Master) {
    block(master);
    if master.state(1) != OPERATION_ENABLED {
        return;
    }
    master.write(1, 0x6060, 0, &[1]);
    let target = master.position(1) + 3_000;
    master.write_i32(1, 0x607A, 0, target);
    master.write_u16(1, 0x6040, 0, 0x1F);
    master.write_u16(1, 0x6040, 0, 0x0F);
}

fn tracking(master: &mut Master, windows: [(u16, u32); 2], mode: u8) {
    for (index, value) in windows {
        let is_long = matches!(index, 0x6065 | 0x2120);
        match is_long {
            true => master.write_i32(1, index, 0, value as i32),
            false => master.write_u16(1, index, 0, value as u16),
        }
    }
    enable(master, mode);
}

pub(super) const ROWS: &[Row] = &[
    Row {
        cause: Cause::VelocityTrackingFault,
        how: "the shaft is blocked, and 20,000 counts/s asked for",
        prepare: |master| tracking(master, [(0x2104, 10_000), (0x2105, 50)], 3),
        provoke: turn_blocked,
        cease: let_turn,
        within_ms: (50.0, 75.0),
        is_event: true,
    },
    Row {
        cause: Cause::PositionTrackingWarning,
        how: "the shaft is blocked, and a target 3,000 counts away given",
        prepare: |master| tracking(master, [(0x6065, 200), (0x6066, 50)], 1),
        provoke: go_blocked,
        cease: free,
        within_ms: (50.0, 100.0),
        is_event: false,
    },
    Row {
        cause: Cause::PositionTrackingFault,
        how: "the shaft is blocked, and a target 3,000 counts away given",
        prepare: |master| tracking(master, [(0x2120, 500), (0x2121, 50)], 1),
        provoke: go_blocked,
        cease: free,
        within_ms: (50.0, 120.0),
        is_event: false,
    },
    Row {
        cause: Cause::VelocityLimit,
        how: "40,000 counts/s are asked for where 30,000 are the limit",
        prepare: |master| {
            master.write_i32(1, 0x6046, 1, 30_000);
            enable(master, 3);
        },
        provoke: |master| master.write_i32(1, 0x60FF, 0, 40_000),
        cease: |master| master.write_i32(1, 0x60FF, 0, 10_000),
        within_ms: (5.0, 60.0),
        is_event: false,
    },
    Row {
        cause: Cause::AccelerationLimit,
        how: "a change of velocity is asked for faster than 0x60C5 allows",
        prepare: |master| {
            master.write_i32(1, 0x60C5, 0, 50_000);
            enable(master, 3);
        },
        provoke: |master| master.write_i32(1, 0x60FF, 0, 40_000),
        cease: |master| master.write_i32(1, 0x60FF, 0, 1_000),
        within_ms: (0.0, 20.0),
        is_event: false,
    },
    Row {
        cause: Cause::PositiveSoftStop,
        how: "a target beyond 0x607D,2 is given",
        prepare: |master| soft_stops(master, 9, 1),
        provoke: |master| go(master, 50_000),
        cease: |master| go(master, 0),
        within_ms: (0.0, 20.0),
        is_event: false,
    },
    Row {
        cause: Cause::NegativeSoftStop,
        how: "a target beyond 0x607D,1 is given",
        prepare: |master| soft_stops(master, 10, 1),
        provoke: |master| go(master, -50_000),
        cease: |master| go(master, 0),
        within_ms: (0.0, 20.0),
        is_event: false,
    },
    Row {
        cause: Cause::PositionWrapped,
        how: "the motor turns on where the position is 5,000 counts from the end of its 32 bits",
        prepare: |master| wrap(master, 1),
        provoke: |master| {
            if master.state(1) == OPERATION_ENABLED {
                master.write_i32(1, 0x60FF, 0, 50_000);
            }
        },
        cease: nothing,
        within_ms: (50.0, 200.0),
        is_event: true,
    },
    Row {
        cause: Cause::PositiveLimitSwitch,
        how: "the positive limit switch is pressed in profile velocity mode",
        prepare: |master| switch(master, 6, 1),
        provoke: |master| press(master, 1 << 1),
        cease: |master| master.drive(1).plant().set_inputs(0),
        within_ms: (0.0, 5.0),
        is_event: false,
    },
    Row {
        cause: Cause::NegativeLimitSwitch,
        how: "the negative limit switch is pressed in profile velocity mode",
        prepare: |master| switch(master, 7, 1),
        provoke: |master| press(master, 1),
        cease: |master| master.drive(1).plant().set_inputs(0),
        within_ms: (0.0, 5.0),
        is_event: false,
    },
    Row {
        cause: Cause::HomeSwitch,
        how: "the home switch is pressed in profile velocity mode",
        prepare: |master| switch(master, 8, 1),
        provoke: |master| press(master, 1 << 2),
        cease: |master| master.drive(1).plant().set_inputs(0),
        within_ms: (0.0, 5.0),
        is_event: false,
    },
    Row {
        cause: Cause::Homing,
        how: "both limit switches are pressed as homing begins",
        prepare: |master| homing(master, 1),
        // Both limit switches at once: one of them is broken.
        provoke: |master| {
            master.drive(1).plant().set_inputs(0b11);
            if master.state(1) != OPERATION_ENABLED {
                return;
            }
            master.write(1, 0x6060, 0, &[6]);
            master.write_u16(1, 0x6040, 0, 0x0F);
            master.write_u16(1, 0x6040, 0, 0x1F);
        },
        cease: |master| master.drive(1).plant().set_inputs(0),
        within_ms: (0.0, 10.0),
        is_event: true,
    },
    Row {
        cause: Cause::VelocityTrackingWarning,
        how: "the shaft is blocked, and 20,000 counts/s asked for",
        prepare: |master| tracking(master, [(0x606D, 2_000), (0x606E, 50)], 3),
        provoke: turn_blocked,
        cease: let_turn,
        within_ms: (50.0, 75.0),
        is_event: false,
    },
];

/// A switch that is a fault while the axis moves, in profile velocity mode.
fn switch(master: &mut Master, which: u8, on: u8) {
    master.write(1, 0x2410, which, &[on]);
    enable(master, 3);
}

fn press(master: &mut Master, inputs: u32) {
    master.drive(1).plant().set_inputs(inputs);
    if master.state(1) == OPERATION_ENABLED {
        // Idle and homing ignore the switches.
        master.write(1, 0x6060, 0, &[3]);
    }
}

/// Ready for homing to the negative limit switch.
fn homing(master: &mut Master, on: u8) {
    master.write(1, 0x2410, 12, &[on]);
    master.write(1, 0x6098, 0, &[17]);
    enable(master, 6);
}

fn soft_stops(master: &mut Master, switch: u8, on: u8) {
    master.write(1, 0x2410, switch, &[on]);
    master.write_i32(1, 0x6064, 0, 0);
    master.write_i32(1, 0x607D, 1, -20_000);
    master.write_i32(1, 0x607D, 2, 20_000);
    enable(master, 1);
}

fn go(master: &mut Master, target: i32) {
    master.write_i32(1, 0x607A, 0, target);
    master.write_u16(1, 0x6040, 0, 0x3F);
    master.write_u16(1, 0x6040, 0, 0x2F);
}

/// Near the end of the 32 bits.
fn wrap(master: &mut Master, on: u8) {
    master.write(1, 0x2410, 11, &[on]);
    master.write_i32(1, 0x6064, 0, i32::MAX - 5_000);
    enable(master, 3);
}

#[test]
fn p3() {
    prove_all(&P3, ROWS);
}

#[test]
fn p3_extended() {
    prove_all(&P3_EXTENDED, ROWS);
}
