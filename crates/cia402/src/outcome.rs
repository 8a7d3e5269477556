//! What the axis answers to a write.

use crate::{Mode, State};

/// What a write of the controlword led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The state before the write.
    pub before: State,
    /// The state after it.
    pub after: State,
    /// Transition 15 was taken: the owner clears its latched faults, and calls
    /// [`Axis::fault`](crate::Axis::fault) again for each cause that is still there.
    pub fault_reset: bool,
}

/// Why a mode of operation was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeRefused {
    /// The drive does not have it: abort code 0x06090030.
    Unsupported(Mode),
    /// Not in this state: abort code 0x08000022.
    NotNow(State),
}
