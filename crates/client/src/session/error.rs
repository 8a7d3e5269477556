//! Why a procedure on a motor ended without a result.

use std::fmt;

use canopen::NodeId;
use cia402::State;

use super::Object;
use crate::pdo::PdoError;
use crate::sdo::SdoError;
use crate::{LinkError, ValueError};

/// A figure that is not what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Which figure.
    pub what: &'static str,
    /// What was seen.
    pub seen: f64,
    /// The smallest value that was expected.
    pub low: f64,
    /// The greatest value that was expected; infinite if any is fine.
    pub high: f64,
    /// Unit of all three; empty for plain numbers.
    pub unit: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

impl Finding {
    /// Nothing if `seen` lies in the range, its borders included.
    ///
    /// # Errors
    /// The finding itself.
    pub fn check(self) -> Result<(), Finding> {
        match self.seen >= self.low && self.seen <= self.high {
            true => Ok(()),
            false => Err(self),
        }
    }
}

/// A number as people read it: four digits, no zeros at the end.
fn number(value: f64) -> String {
    let digits = match value.abs() {
        size if size >= 1000.0 || size == 0.0 => 0,
        size if size >= 100.0 => 1,
        size if size >= 10.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.unit {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        write!(f, "{} is {}{unit}, expected ", self.what, number(self.seen))?;
        match (self.low.is_finite(), self.high.is_finite()) {
            (true, true) if self.low == self.high => write!(f, "{}{unit}", number(self.low))?,
            (true, true) => write!(f, "{} to {}{unit}", number(self.low), number(self.high))?,
            (true, false) => write!(f, "at least {}{unit}", number(self.low))?,
            (false, _) => write!(f, "at most {}{unit}", number(self.high))?,
        }
        write!(f, "; {}", self.remedy)
    }
}

/// Why a procedure ended without a result.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// An object could not be read or written.
    Sdo(SdoError),
    /// A PDO could not be configured.
    Pdo(PdoError),
    /// A value does not fit its object.
    Value(ValueError),
    /// The link broke.
    Link(LinkError),
    /// The drive went into fault.
    Fault {
        /// 0x603F, if it could be read.
        code: Option<u16>,
    },
    /// The drive is not where the procedure has brought it.
    State {
        /// The last statusword.
        statusword: u16,
    },
    /// The drive does not go to a state that it was told to go to.
    Unreached {
        /// Where it was told to go.
        wanted: State,
        /// The last statusword.
        statusword: u16,
    },
    /// The drive does not show the mode.
    Mode {
        /// What was written to 0x6060.
        wanted: i8,
        /// What 0x6061 shows.
        shown: i8,
    },
    /// Too few of the process data came.
    Samples {
        /// SYNCs that were sent.
        sent: usize,
        /// Samples that came.
        came: usize,
    },
    /// It is a drive of CiA 402 without the objects that the procedures need: those of the P3 of 2019.
    Foreign {
        /// The first one that it does not have.
        missing: Object,
    },
    /// Looked at before any power was applied.
    NotReady(Finding),
    /// What was measured cannot be; nothing is saved.
    Implausible(Finding),
    /// The user wants no more.
    Stopped,
}

/// How the motor was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// The procedure had not begun to apply power.
    Untouched,
    /// Without power, and the drive has said so; changed objects have their old values again.
    Safe,
    /// Without power; but not all objects could be given their old values again.
    Changed,
    /// The drive answers, but does not take the power from the motor, not even without SYNC. Its
    /// set-points and its SYNC supervision (0x2406) are left as they are then.
    Powered {
        /// The last statusword.
        statusword: u16,
        /// All other objects have their old values again.
        restored: bool,
    },
    /// The drive does not answer. It takes the power away by itself when no SYNC comes.
    Unknown {
        /// After how long, in milliseconds (0x2406).
        within_ms: u16,
    },
}

/// Why a procedure on a motor ended without a result, and how it left the motor.
#[derive(Clone, Debug, PartialEq)]
pub struct ProcedureError {
    /// Which drive.
    pub node: NodeId,
    /// Why.
    pub cause: Cause,
    /// How the motor was left.
    pub left: Left,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Sdo(error) => write!(f, "{error}"),
            Cause::Pdo(error) => write!(f, "{error}"),
            Cause::Value(error) => write!(f, "{error}"),
            Cause::Link(error) => write!(f, "{error}"),
            Cause::Fault { code: Some(code) } => write!(
                f,
                "the drive went into fault, 0x603F is 0x{code:04X}; remove its cause"
            ),
            Cause::Fault { code: None } => {
                f.write_str("the drive went into fault; read 0x603F and remove its cause")
            }
            Cause::State { statusword } => write!(
                f,
                "the drive left operation enabled, statusword 0x{statusword:04X}; \
                 see that no other master commands it"
            ),
            Cause::Unreached { wanted, statusword } => write!(
                f,
                "the drive does not go to {wanted}, statusword 0x{statusword:04X}; \
                 see that no other master commands it"
            ),
            Cause::Mode { wanted, shown } => write!(
                f,
                "the drive was told mode {wanted} and shows mode {shown} in 0x6061; \
                 see that it has this mode and that no other master commands it"
            ),
            Cause::Samples { sent, came } => write!(
                f,
                "of {sent} SYNCs {came} were answered by TPDO 4; \
                 use a faster way to the bus, or less load on it"
            ),
            Cause::Foreign { missing } => write!(
                f,
                "this drive has no {} ({}): calibration and tuning know the drives of the P3's manual \
                 of 2019 only (p3, p3-extended); choose one with --node",
                missing.address, missing.name
            ),
            Cause::NotReady(finding) => write!(f, "{finding}"),
            Cause::Implausible(finding) => write!(f, "{finding}"),
            Cause::Stopped => f.write_str("stopped"),
        }
    }
}

impl Cause {
    /// Whether the drive said no, which it can only if it is there.
    pub(crate) fn is_refusal(&self) -> bool {
        matches!(self, Cause::Sdo(error) if error.abort().is_some())
    }

    /// With the node, once.
    pub(super) fn fmt_of(&self, node: NodeId, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // It names the node by itself.
            Cause::Sdo(error) => write!(f, "{error}"),
            cause => write!(f, "node {node}: {cause}"),
        }
    }
}

impl fmt::Display for ProcedureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt_of(self.node, f)?;
        match self.left {
            Left::Untouched => f.write_str(" (no power was applied)"),
            Left::Safe => f.write_str(" (the motor is without power, nothing is changed)"),
            Left::Changed => f.write_str(
                " (the motor is without power; some objects keep changed values until the next \
                 reset, these are not saved)",
            ),
            Left::Powered {
                statusword,
                restored,
            } => {
                let objects = match restored {
                    true => "set-points and SYNC supervision, 0x2406, keep changed values",
                    false => "some objects keep changed values",
                };
                write!(
                    f,
                    " (the drive does not take the power from the motor, statusword \
                     0x{statusword:04X}: switch its motor supply off; {objects})"
                )
            }
            Left::Unknown { within_ms: 0 } => {
                f.write_str(" (the drive does not answer: switch its motor supply off)")
            }
            Left::Unknown { within_ms } => write!(
                f,
                " (the drive does not answer; it takes the power away by itself within \
                 {within_ms} ms, by its SYNC supervision 0x2406)"
            ),
        }
    }
}

impl std::error::Error for ProcedureError {}

impl From<SdoError> for Cause {
    fn from(error: SdoError) -> Cause {
        Cause::Sdo(error)
    }
}

impl From<PdoError> for Cause {
    fn from(error: PdoError) -> Cause {
        match error {
            PdoError::Sdo(error) => Cause::Sdo(error),
            other => Cause::Pdo(other),
        }
    }
}

impl From<ValueError> for Cause {
    fn from(error: ValueError) -> Cause {
        Cause::Value(error)
    }
}

impl From<LinkError> for Cause {
    fn from(error: LinkError) -> Cause {
        Cause::Link(error)
    }
}

impl From<Finding> for Cause {
    /// Of what was measured.
    fn from(finding: Finding) -> Cause {
        Cause::Implausible(finding)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_says_what_was_seen_and_expected() {
        let finding = Finding {
            what: "the supply",
            seen: 9.5,
            low: 18.0,
            high: 52.0,
            unit: "V",
            remedy: "switch it on",
        };
        assert_eq!(
            finding.to_string(),
            "the supply is 9.5 V, expected 18 to 52 V; switch it on"
        );
        assert!(finding.check().is_err());
        for seen in [18.0, 52.0] {
            assert_eq!(Finding { seen, ..finding }.check(), Ok(()));
        }
        let nan = Finding {
            seen: f64::NAN,
            ..finding
        };
        assert!(nan.check().is_err());
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (4096.0, "4096"),
            (1234.56, "1235"),
            (12.5, "12.5"),
            (0.5, "0.5"),
            (-0.1234, "-0.123"),
            (100.0, "100"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
