//! The stacks under measurement.

pub(crate) mod blocks;
mod canopen_rs;
mod servobus;
mod zencan;

use bench::subject::{self, Case};

use self::canopen_rs::CanopenRs;
use self::servobus::Servobus;
use self::zencan::Zencan;
use crate::Error;

/// The stacks, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SubjectName {
    /// Ours.
    Servobus,
    /// zencan-node 0.0.5.
    Zencan,
    /// canopen-rs 0.6.1.
    CanopenRs,
}

impl SubjectName {
    /// Every stack, in the order of the report.
    pub(crate) const ALL: [Self; 3] = [Self::Servobus, Self::Zencan, Self::CanopenRs];

    /// Its name on the command line and in the report.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Servobus => "servobus",
            Self::Zencan => "zencan-node",
            Self::CanopenRs => "canopen-rs",
        }
    }

    /// Whether it has the function that the case measures.
    pub(crate) const fn offers(self, case: Case) -> bool {
        match (self, case) {
            // canopen-rs knows no time: the application sends heartbeats and counts periods.
            (Self::CanopenRs, Case::IdlePoll) => false,
            // Between our own client and server only.
            (_, Case::Block(..)) => matches!(self, Self::Servobus),
            _ => true,
        }
    }
}

/// Runs one case of one stack, answers checked.
pub(crate) fn run(name: SubjectName, case: Case, iterations: u64) -> Result<(), Error> {
    let result = match (name, case) {
        (SubjectName::Servobus, Case::SdoUpload) => {
            subject::run_upload(&mut Servobus::with_50_objects(), iterations)
        }
        (SubjectName::Servobus, Case::SdoUpload500) => {
            subject::run_upload(&mut Servobus::with_500_objects(), iterations)
        }
        (SubjectName::Servobus, Case::Sync4Tpdo) => {
            subject::run_sync(&mut Servobus::with_50_objects(), iterations)
        }
        (SubjectName::Servobus, Case::IdlePoll) => {
            subject::run_poll(&mut Servobus::with_50_objects(), iterations)
        }
        (SubjectName::Servobus, Case::Block(direction, side)) => {
            blocks::run(direction, side, iterations)
        }
        (SubjectName::Zencan, Case::SdoUpload) => {
            subject::run_upload(&mut Zencan::with_50_objects(), iterations)
        }
        (SubjectName::Zencan, Case::SdoUpload500) => {
            subject::run_upload(&mut Zencan::with_500_objects(), iterations)
        }
        (SubjectName::Zencan, Case::Sync4Tpdo) => {
            subject::run_sync(&mut Zencan::with_50_objects(), iterations)
        }
        (SubjectName::Zencan, Case::IdlePoll) => {
            subject::run_poll(&mut Zencan::with_50_objects(), iterations)
        }
        (SubjectName::CanopenRs, Case::SdoUpload) => {
            subject::run_upload(&mut CanopenRs::<50>::new(), iterations)
        }
        (SubjectName::CanopenRs, Case::SdoUpload500) => {
            subject::run_upload(&mut CanopenRs::<500>::new(), iterations)
        }
        (SubjectName::CanopenRs, Case::Sync4Tpdo) => {
            subject::run_sync(&mut CanopenRs::<50>::new(), iterations)
        }
        (SubjectName::CanopenRs, Case::IdlePoll) => return Err(Error::NoClock(name.name())),
        (SubjectName::Zencan | SubjectName::CanopenRs, Case::Block(..)) => {
            let subject = name.name();
            return Err(Error::OursOnly { subject, case });
        }
    };
    result.map_err(|wrong| Error::Wrong {
        subject: name.name(),
        case,
        wrong,
    })
}
