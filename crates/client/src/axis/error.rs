//! Why a procedure on an axis did not succeed.

use std::fmt;

use canopen::NodeId;
use cia402::{Mode, State, Statusword};

use super::Goal;
use crate::ValueError;
use crate::sdo::SdoError;

/// Why an axis did not do what it was asked.
#[derive(Clone, Debug, PartialEq)]
pub enum AxisError {
    /// An SDO transfer failed.
    Sdo(SdoError),
    /// It is in fault, or fell back into it when the fault was reset.
    Fault {
        /// The node.
        node: NodeId,
        /// 0x603F, if it could be read.
        code: Option<u16>,
    },
    /// It is in another state than is needed.
    State {
        /// The node.
        node: NodeId,
        /// What is needed.
        wanted: State,
        /// The last statusword.
        seen: Statusword,
        /// How long was waited; 0 if that was not to be waited for.
        within_ms: u64,
    },
    /// It did not take the mode.
    Mode {
        /// The node.
        node: NodeId,
        /// What was written to 0x6060.
        wanted: Mode,
        /// What 0x6061 shows.
        shown: Mode,
        /// How long was waited.
        within_ms: u64,
    },
    /// Statusword bit 12 did not become what the handshake of a set-point wants.
    Handshake {
        /// The node.
        node: NodeId,
        /// What bit 12 should have become.
        wanted: bool,
        /// The last statusword.
        seen: Statusword,
        /// How long was waited.
        within_ms: u64,
    },
    /// The target was not reached.
    NotReached {
        /// The node.
        node: NodeId,
        /// What was to be reached.
        goal: Goal,
        /// The last actual value.
        actual: i64,
        /// The last statusword.
        seen: Statusword,
        /// How long was waited.
        within_ms: u64,
    },
    /// A value does not fit its object.
    Value(ValueError),
}

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            AxisError::Sdo(error) => write!(f, "{error}"),
            AxisError::Fault { node, code } => {
                write!(f, "node {node} is in fault")?;
                match code {
                    Some(code) => {
                        let text = crate::decode::emergency_text(*code);
                        write!(f, ", 0x603F is 0x{code:04X}: {text}")?;
                    }
                    None => f.write_str(", 0x603F cannot be read")?,
                }
                f.write_str("; remove the cause and reset the fault")
            }
            AxisError::State {
                node,
                wanted,
                seen,
                within_ms,
            } => {
                write!(f, "node {node} is not in {wanted}")?;
                if *within_ms > 0 {
                    write!(f, " within {within_ms} ms")?;
                }
                write!(f, ", its statusword is 0x{:04X}: {seen}", seen.0)
            }
            AxisError::Mode {
                node,
                wanted,
                shown,
                within_ms,
            } => write!(
                f,
                "node {node} shows mode {} ({shown}) {within_ms} ms after {} ({wanted}) was set",
                shown.0, wanted.0
            ),
            AxisError::Handshake {
                node,
                wanted,
                seen,
                within_ms,
            } => write!(
                f,
                "node {node} did not {} the set-point within {within_ms} ms, its statusword is \
                 0x{:04X}: {seen}",
                if *wanted { "acknowledge" } else { "release" },
                seen.0
            ),
            AxisError::NotReached {
                node,
                goal,
                actual,
                seen,
                within_ms,
            } => write!(
                f,
                "node {node} did not reach {goal} within {within_ms} ms, it is at {actual}, its \
                 statusword is 0x{:04X}: {seen}",
                seen.0
            ),
            AxisError::Value(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for AxisError {}

impl From<SdoError> for AxisError {
    fn from(error: SdoError) -> AxisError {
        AxisError::Sdo(error)
    }
}

impl From<ValueError> for AxisError {
    fn from(error: ValueError) -> AxisError {
        AxisError::Value(error)
    }
}
