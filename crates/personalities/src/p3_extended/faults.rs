//! The P3's table of errors with an object for each that the manual gives none, and the errors of
//! communication that CiA 301 knows and the P3 does not notice.

use canopen::row::u8;
use canopen::{Dictionary, Row};

use crate::p3::faults::{COUNT, UnnamedSwitches, row, table as p3_table, threshold};
use crate::p3::plain;
use crate::{Cause, FaultRow, Kind, States, Switch};

/// 0x2410: 1 looks for the error, 0 does not. At first those are on that the faithful drive has
/// always on (P46).
#[rustfmt::skip]
pub(super) const ENABLE_ROWS: &[Row] = &[
    enable(1, "Watchdog reset fault").default(1),
    enable(2, "Parameter error fault").default(1),
    enable(3, "Encoder feedback fault").default(1),
    enable(4, "Short circuit fault").default(1),
    enable(5, "Motor phasing fault"),
    enable(6, "Positive limit switch fault"),
    enable(7, "Negative limit switch fault"),
    enable(8, "Home switch fault"),
    enable(9, "Positive soft stop warning"),
    enable(10, "Negative soft stop warning"),
    enable(11, "Position wrapped fault"),
    enable(12, "Homing error fault"),
];

const fn enable(sub: u8, name: &'static str) -> Row {
    threshold(u8(0x2410, sub, name).range(0, 1))
}

/// A warning of communication. The manufacturer status register has no room for a bit each: both
/// wrong lengths of a PDO share one.
const fn communication(cause: Cause, code: u16, status_bit: u8) -> FaultRow {
    row(
        cause,
        code,
        Kind::Warning,
        4,
        status_bit,
        States::All,
        Switch::Always,
    )
}

/// Rows of this table.
const ROWS: usize = COUNT + 7;

/// The manual's table in its order, then communication.
pub(super) const fn table<const N: usize>(objects: &Dictionary<N>) -> [FaultRow; ROWS] {
    let by = UnnamedSwitches {
        watchdog_reset: Switch::Object(plain(objects, 0x2410, 1)),
        parameter_error: Switch::Object(plain(objects, 0x2410, 2)),
        encoder_feedback: Switch::Object(plain(objects, 0x2410, 3)),
        short_circuit: Switch::Object(plain(objects, 0x2410, 4)),
        motor_phasing: Switch::Object(plain(objects, 0x2410, 5)),
        positive_limit_switch: Switch::Object(plain(objects, 0x2410, 6)),
        negative_limit_switch: Switch::Object(plain(objects, 0x2410, 7)),
        home_switch: Switch::Object(plain(objects, 0x2410, 8)),
        positive_soft_stop: Switch::Object(plain(objects, 0x2410, 9)),
        negative_soft_stop: Switch::Object(plain(objects, 0x2410, 10)),
        position_wrapped: Switch::Object(plain(objects, 0x2410, 11)),
        homing: Switch::Object(plain(objects, 0x2410, 12)),
    };
    // CiA 301 7.2.7.1, table 26.
    let communication = [
        communication(Cause::HeartbeatLost, 0x8130, 27),
        communication(Cause::PdoTooShort, 0x8210, 28),
        communication(Cause::PdoTooLong, 0x8220, 28),
        communication(Cause::SyncLength, 0x8240, 29),
        communication(Cause::RpdoTimeout, 0x8250, 30),
        communication(Cause::ErrorPassive, 0x8120, 31),
        // An error from outside, the axis being under power. The status register is full.
        row(
            Cause::TorqueOff,
            0x9000,
            Kind::Fault,
            7,
            32,
            States::All,
            Switch::Object(plain(objects, 0x2433, 1)),
        ),
    ];
    joined(&p3_table(objects, by), &communication)
}

#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
const fn joined<const N: usize>(first: &[FaultRow], second: &[FaultRow]) -> [FaultRow; N] {
    assert!(first.len() + second.len() == N, "N is the sum of both");
    let mut all = [first[0]; N];
    let mut i = 0;
    while i < N {
        all[i] = if i < first.len() {
            first[i]
        } else {
            second[i - first.len()]
        };
        i += 1;
    }
    all
}
