//! The drive profile CiA 402 (IEC 61800-7-201/301) as pure logic.
//!
//! One [`Axis`] is one drive function: the state machine with its controlword and statusword, the
//! modes of operation and their set-point generators, limits, windows and the quick stop. It is
//! told what was written, what the motor does and that a millisecond has passed; it answers with
//! the next [`Demand`] for the controllers. It never allocates, reads no clock and does no I/O.
//!
//! What drives do differently is data in a [`Dialect`]; what a user sets is in a
//! [`Configuration`], in internal units: encoder counts, seconds, per mille of rated torque.
//!
//! Reading order: [`State`] (state machine), [`Controlword`], [`Statusword`], [`Mode`], [`Profile`]
//! (the trapezoid) and [`JerkProfile`], then the modes one by one, then [`Axis`], which ties them together.
//!
//! Not here: cyclic torque with angle. [`ModeSet::IMPLEMENTED`] says what works, and
//! 0x6502 follows from it.
#![no_std]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

mod arithmetic;
mod axis;
mod conditions;
mod configuration;
mod controlword;
mod demand;
mod dialect;
mod homing;
mod jerk;
mod mode;
mod modes;
mod option_code;
mod outcome;
mod path;
mod profile;
mod ramp;
mod state;
mod statusword;
mod stop;
mod torque;
mod windows;

pub use axis::Axis;
pub use conditions::Conditions;
pub use configuration::{Actual, Configuration, Target, Targets, VlConfiguration, Window};
pub use controlword::{Command, Controlword, ControlwordInMode};
pub use demand::{Demand, Point};
pub use dialect::Dialect;
pub use homing::{
    Captured, Direction, Edge, HomingConfiguration, HomingError, HomingInputs, HomingMethod,
    Switch, Trigger,
};
pub use jerk::JerkProfile;
pub use mode::{Mode, ModeSet};
pub use outcome::{ModeRefused, Outcome};
pub use profile::{Profile, ProfileLimits};
pub use state::{State, Step};
pub use statusword::{Statusword, StatuswordInMode};
