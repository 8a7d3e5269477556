//! 0x2004: the status words bit by bit, and which of them are errors that stop the drive.
//!
//! The page names the words; their bits are those of the maker's own tools. Emergency codes of the
//! drive are not known: they are the standard's (CiA 402 table of error codes).

use canopen::Address;

use crate::{Cause, FaultRow, Kind, States, Switch};

/// What a status bit does beside being shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// An error that leads to the fault state and ends with a fault reset once its cause is gone. An
    /// emergency with this code tells of it.
    Fault(u16),
    /// An error that only a reset of the controller ends.
    Critical(u16),
    /// A warning of which an emergency tells.
    Announced(u16),
    /// Shown only: the error of an action, which the next one ends, or a warning, which stays until a
    /// fault reset.
    Shown,
}

/// One bit of a status word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusBit {
    /// Sub-index of 0x2004.
    pub sub: u8,
    /// Bit: errors 0 to 15, warnings 16 to 31.
    pub bit: u8,
    /// Its name.
    pub name: &'static str,
    /// What it does.
    pub effect: Effect,
    /// When it is set.
    pub when: &'static str,
}

const fn bit(
    sub: u8,
    bit: u8,
    name: &'static str,
    effect: Effect,
    when: &'static str,
) -> StatusBit {
    StatusBit {
        sub,
        bit,
        name,
        effect,
        when,
    }
}

use Effect::{Announced, Critical, Fault, Shown};

/// Index of the status words.
pub(super) const STATUS: u16 = 0x2004;
/// How many there are.
pub(super) const WORDS: usize = 8;

/// Every bit, in the order of words and bits.
#[rustfmt::skip]
pub const STATUS_BITS: &[StatusBit] = &[
    bit(1, 0, "main encoder: communication", Critical(0x7305), "the encoder does not answer, or with a wrong check sum, for 5 ms"),
    bit(1, 1, "main encoder: wrong direction", Fault(0x7305), "the rotor's own voltage turns the other way than the encoder counts, or it counts against a calibration's field; calibrate anew"),
    bit(1, 2, "main encoder: empty table", Shown, "the drive was not calibrated"),
    bit(1, 3, "main encoder: faulty table", Shown, "a calibration found readings off by more than 5 degrees of a turn"),
    bit(1, 4, "main encoder: calibration failed", Shown, "the last calibration did not end well"),
    bit(1, 5, "main encoder: position invalid", Critical(0x7305), "the encoder's magnet is too near or too far"),
    bit(1, 6, "main encoder: initialisation", Critical(0x7305), "the encoder did not answer at the start"),
    bit(1, 30, "main encoder: low accuracy", Shown, "a calibration found readings off by more than 1 degree of a turn"),
    bit(2, 0, "output encoder: communication", Fault(0x7306), "one is configured and does not answer"),
    bit(2, 1, "output encoder: wrong direction", Fault(0x7306), "in motion it goes the other way than the motor's encoder and its calibration say; calibrate anew"),
    bit(2, 2, "output encoder: empty table", Shown, "one is configured and was not calibrated"),
    bit(2, 3, "output encoder: faulty table", Shown, "its calibration found readings off by more than 5 degrees of a turn"),
    bit(2, 4, "output encoder: calibration failed", Shown, "its last calibration did not end well"),
    bit(2, 5, "output encoder: position invalid", Fault(0x7306), "one is configured and its magnet is too near or too far"),
    bit(2, 6, "output encoder: initialisation", Shown, "one is configured and did not answer at the start"),
    bit(2, 30, "output encoder: low accuracy", Shown, "its calibration found readings off by more than 1 degree of a turn"),
    bit(3, 0, "calibration: offset", Shown, "the electrical zero was not the same in both directions"),
    bit(3, 1, "calibration: resistance", Shown, "the measured resistance lies outside the range of 0x2000,4"),
    bit(3, 2, "calibration: inductance", Shown, "the measured inductance lies outside the range of 0x2000,3"),
    bit(3, 3, "calibration: pole pairs", Shown, "one turn did not have as many electrical turns as 0x2000,1 says"),
    bit(3, 4, "calibration: set-up", Fault(0x6320), "a parameter that is needed is 0: shown while it is, a fault when a mode of motion needs it"),
    bit(4, 0, "bridge: communication", Critical(0x7510), "the gate driver does not answer over its serial interface, or wrongly, for 5 ms"),
    bit(4, 1, "bridge: overcurrent", Fault(0x2320), "the gate driver saw the current of a short circuit"),
    bit(4, 2, "bridge: general fault", Fault(0x5410), "the gate driver's fault pin is low, and not for a short circuit: too low a supply for the gates, or too hot"),
    bit(5, 0, "hardware: overcurrent", Fault(0x2310), "a measured current above 96 A"),
    bit(5, 1, "hardware: over-voltage", Fault(0x3210), "motor supply above 56 V"),
    bit(5, 2, "hardware: under-voltage", Fault(0x3220), "motor supply below 10 V for 10 ms"),
    bit(5, 3, "hardware: motor temperature", Fault(0x4310), "motor above 0x2000,7"),
    bit(5, 4, "hardware: MOSFET temperature", Fault(0x4210), "bridge above 100 degC"),
    bit(5, 5, "hardware: ADC offsets", Critical(0x5210), "the reading of a current at rest is off by more than 5 % at the start"),
    bit(7, 0, "motion: position outside limits", Fault(0x8612), "in a mode of motion, beyond 0x607D by more than 10 degrees"),
    bit(7, 1, "motion: velocity outside limits", Fault(0x8400), "in a mode of motion, faster than 0x6080 by more than a fifth and 10 RPM"),
    bit(7, 24, "motion: acceleration clipped", Shown, "a profile's rate is above 0x60C5 or 0x60C6"),
    bit(7, 25, "motion: torque clipped", Shown, "the controllers are at a limit of torque, current or voltage"),
    bit(7, 26, "motion: velocity clipped", Shown, "a velocity is above 0x6080"),
    bit(7, 27, "motion: position clipped", Shown, "a target lies beyond 0x607D"),
    bit(8, 30, "communication: CAN watchdog", Announced(0x8130), "no frame for the drive came within 0x2000,12 while a mode of motion was at work"),
];

/// The bit of sub-index `sub`, as a place in [`STATUS_BITS`].
///
/// # Panics
/// At compile time, if there is none.
#[allow(
    clippy::panic,
    clippy::indexing_slicing,
    reason = "runs at compile time, where a panic is an error message"
)]
pub(super) const fn place(sub: u8, bit: u8) -> usize {
    let mut n = 0;
    while n < STATUS_BITS.len() {
        if STATUS_BITS[n].sub == sub && STATUS_BITS[n].bit == bit {
            return n;
        }
        n += 1;
    }
    panic!("no such status bit")
}

/// How many of the bits are announced by emergencies.
const FAULT_COUNT: usize = {
    let mut count = 0;
    let mut n = 0;
    while n < STATUS_BITS.len() {
        #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
        if announced(&STATUS_BITS[n]).is_some() {
            count += 1;
        }
        n += 1;
    }
    count
};

const fn announced(bit: &StatusBit) -> Option<(u16, Kind)> {
    match bit.effect {
        Effect::Fault(code) => Some((code, Kind::Fault)),
        Effect::Critical(code) => Some((code, Kind::Critical)),
        Effect::Announced(code) => Some((code, Kind::Warning)),
        Effect::Shown => None,
    }
}

/// The number of the own cause ([`Cause::Own`]) of a bit that is announced: how many announced bits
/// stand before it in [`STATUS_BITS`].
#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
pub(super) const fn cause(place: usize) -> Option<u8> {
    let mut number = 0;
    let mut n = 0;
    while n < place {
        if announced(&STATUS_BITS[n]).is_some() {
            number += 1;
        }
        n += 1;
    }
    match announced(&STATUS_BITS[place]) {
        Some(_) => Some(number),
        None => None,
    }
}

/// Errors of the bus, of which the page has no bits: CiA 301 7.2.7.1, table 26 (M32).
const OF_BUS: [(Cause, u16); 5] = [
    (Cause::CanOverrun, 0x8110),
    (Cause::ErrorPassive, 0x8120),
    (Cause::BusOffRecovered, 0x8140),
    (Cause::PdoTooShort, 0x8210),
    (Cause::PdoTooLong, 0x8220),
];

/// The fault table: the bits that are announced, then the errors of the bus. The error register has bit 0
/// only (M18).
#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
pub(super) const FAULTS: [FaultRow; FAULT_COUNT + OF_BUS.len()] = {
    let blank = FaultRow {
        cause: Cause::Own(0),
        code: 0,
        kind: Kind::Fault,
        register_bit: 0,
        status_bit: 32,
        states: States::All,
        switch: Switch::Always,
    };
    let mut rows = [blank; FAULT_COUNT + OF_BUS.len()];
    let mut n = 0;
    let mut number = 0;
    while n < STATUS_BITS.len() {
        if let Some((code, kind)) = announced(&STATUS_BITS[n]) {
            rows[number] = FaultRow {
                cause: Cause::Own(number as u8),
                code,
                kind,
                ..blank
            };
            number += 1;
        }
        n += 1;
    }
    while number < rows.len() {
        let (cause, code) = OF_BUS[number - FAULT_COUNT];
        rows[number] = FaultRow {
            cause,
            code,
            kind: Kind::Warning,
            ..blank
        };
        number += 1;
    }
    rows
};

/// The names of the bits.
#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
pub(super) const BIT_NAMES: [(Address, u8, &str); STATUS_BITS.len()] = {
    let mut names = [(Address::new(STATUS, 0), 0, ""); STATUS_BITS.len()];
    let mut n = 0;
    while n < STATUS_BITS.len() {
        let StatusBit { sub, bit, name, .. } = STATUS_BITS[n];
        names[n] = (Address::new(STATUS, sub), bit, name);
        n += 1;
    }
    names
};

/// What the own causes are called: the names of their bits.
#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
pub(super) const CAUSE_NAMES: [&str; FAULT_COUNT] = {
    let mut names = [""; FAULT_COUNT];
    let mut n = 0;
    while n < STATUS_BITS.len() {
        if let Some(number) = cause(n) {
            names[number as usize] = STATUS_BITS[n].name;
        }
        n += 1;
    }
    names
};

const _: () = assert!(STATUS_BITS.len() <= 64 && FAULT_COUNT <= 32);
