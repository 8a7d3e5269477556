//! The motor supply.

use super::*;

pub(super) const ROWS: &[Row] = &[
    Row {
        cause: Cause::BusOverVoltage,
        how: "the motor supply rises from 48 V to 60 V",
        prepare: nothing,
        provoke: |master| master.drive(1).plant().set_supply_v(60.0),
        cease: |master| master.drive(1).plant().set_supply_v(48.0),
        // "for more than 450 ms" (P3 l.1043), behind the smoothing of the reading.
        within_ms: (450.0, 475.0),
        is_event: false,
    },
    Row {
        cause: Cause::BusUnderVoltage,
        how: "the motor supply falls from 48 V to 12 V",
        prepare: nothing,
        provoke: |master| master.drive(1).plant().set_supply_v(12.0),
        cease: |master| master.drive(1).plant().set_supply_v(48.0),
        within_ms: (450.0, 475.0),
        is_event: false,
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
