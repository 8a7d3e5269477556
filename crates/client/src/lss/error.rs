//! Why a layer setting service did not succeed.

use std::fmt;

use canopen::lss::{Identity, Refusal};

use crate::LinkError;

/// What was being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Selecting a device by its identity.
    Select,
    /// Giving it a node ID.
    SetNodeId,
    /// Giving it a bit rate.
    SetBitTiming,
    /// Letting it store both.
    Store,
    /// Asking for its identity.
    InquireIdentity,
    /// Asking for its node ID.
    InquireNodeId,
    /// Looking for unconfigured devices.
    Scan,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Step::Select => "selecting it",
            Step::SetNodeId => "setting its node ID",
            Step::SetBitTiming => "setting its bit rate",
            Step::Store => "storing its configuration",
            Step::InquireIdentity => "asking for its identity",
            Step::InquireNodeId => "asking for its node ID",
            Step::Scan => "looking for unconfigured devices",
        })
    }
}

/// Why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// No answer came.
    TimedOut {
        /// How long each attempt waited.
        answer_ms: u16,
        /// How many attempts there were.
        attempts: u8,
    },
    /// The device refused.
    Refused(Refusal),
    /// The device says that it has this node ID, which is none.
    NoNodeId(u8),
    /// Devices are there, but so many scans in a row found none of them: frames are lost, devices
    /// answer too late, or nobody has the numbers that were said to be known.
    Lost {
        /// How many scans.
        scans: u32,
    },
    /// The link broke.
    Link(LinkError),
}

/// A layer setting service that did not succeed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LssError {
    /// With which device; `None` if that is not known.
    pub identity: Option<Identity>,
    /// What was being done.
    pub step: Step,
    /// Why it failed.
    pub cause: Cause,
}

impl LssError {
    /// Whether no answer came.
    pub fn is_time_out(&self) -> bool {
        matches!(self.cause, Cause::TimedOut { .. })
    }
}

impl fmt::Display for LssError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.identity, self.step) {
            (Some(identity), step) => write!(f, "device {identity}: {step}: ")?,
            (None, Step::Scan) => write!(f, "{}: ", self.step)?,
            (None, step) => write!(f, "the device in LSS configuration: {step}: ")?,
        }
        match &self.cause {
            Cause::TimedOut {
                answer_ms,
                attempts,
            } => {
                write!(f, "no answer within {answer_ms} ms")?;
                match attempts {
                    0 | 1 => Ok(()),
                    attempts => write!(f, ", asked {attempts} times"),
                }
            }
            Cause::Refused(refusal) => write!(f, "refused, {refusal}"),
            Cause::NoNodeId(byte) => write!(f, "it says {byte}, and there is no such node ID"),
            Cause::Lost { scans } => write!(
                f,
                "devices answer, but {scans} scans in a row found none of them; allow them more \
                 time, and check the numbers that are given as known"
            ),
            Cause::Link(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for LssError {}
