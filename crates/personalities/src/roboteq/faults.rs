//! What the controller announces. The document has no table of errors: codes are those of CiA 402 for
//! the fault flags of the controller's manual.

use canopen::Dictionary;

use crate::p3::scaled;
use crate::{Cause, FaultRow, Kind, States, Switch};

/// Own cause: the emergency stop, 0x200C.
pub(super) const EMERGENCY_STOP: u8 = 0;
/// Own cause: the closed loop error has lasted (^CLERD).
pub(super) const LOOP_ERROR: u8 = 1;

/// What the two are called.
pub(super) const OWN_CAUSES: &[&str] = &["emergency stop", "closed loop error"];

const fn row(
    cause: Cause,
    code: u16,
    register_bit: u8,
    states: States,
    switch: Switch,
) -> FaultRow {
    FaultRow {
        cause,
        code,
        kind: Kind::Fault,
        register_bit,
        status_bit: 32,
        states,
        switch,
    }
}

/// The table, by the bits of FF.
pub(super) const fn table<const N: usize>(objects: &Dictionary<N>) -> [FaultRow; 8] {
    use States::{All, OperationEnabled};
    use Switch::{Always, Object};
    [
        row(
            Cause::AmplifierTemperature,
            0x4210,
            3,
            All,
            Object(scaled(objects, 0x30F4, 3, 1.0)),
        ),
        row(
            Cause::BusOverVoltage,
            0x3210,
            2,
            All,
            Object(scaled(objects, 0x30F4, 1, 0.1)),
        ),
        row(
            Cause::BusUnderVoltage,
            0x3220,
            2,
            All,
            Object(scaled(objects, 0x30F4, 2, 0.1)),
        ),
        row(Cause::ShortCircuit, 0x2320, 1, OperationEnabled, Always),
        row(Cause::Own(EMERGENCY_STOP), 0x9000, 7, All, Always),
        row(Cause::EncoderFeedback, 0x7305, 5, All, Always),
        row(Cause::ParameterError, 0x5500, 0, All, Always),
        row(Cause::Own(LOOP_ERROR), 0x8400, 5, OperationEnabled, Always),
    ]
}
