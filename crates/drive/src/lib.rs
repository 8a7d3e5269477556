//! A complete servo drive without its hardware.
//!
//! Two halves meet in two values. [`Comms`] is the communication half: the CANopen node, the axis
//! of CiA 402, the fault manager; it may live in the CAN interrupt. [`control::Cascade`] is the
//! control half: current, velocity and position loops; it may live in the PWM interrupt. Comms
//! gives a [`control::Command`] and takes a [`control::Feedback`]. [`Drive`] holds both, for one
//! processor or one virtual drive.
//!
//! The way of a set-point: frame → [`Comms::receive`] → dictionary → the owner in `application.rs` → axis
//! → demand → `command.rs` → cascade → duty. The way back: sample → cascade → feedback →
//! `publish.rs` → dictionary → TPDO.
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

mod application;
mod axis_part;
mod board;
mod body;
mod captures;
mod command;
mod comms;
mod configuration;
mod drive;
mod faults;
pub mod flash;
mod gains;
mod host;
mod inputs;
mod local;
mod parameters;
mod phasing;
mod probes;
pub mod program;
mod publish;
mod serving;
mod timing;

pub use axis_part::AxisPart;
pub use body::{Body, List, OneAxis};
pub use captures::CaptureOrder;
pub use comms::{Comms, Made, Request, stored_node_id};
pub use drive::{Drive, Hardware, MadeDrive};
pub use faults::Health;
pub use host::{Host, NoHost, ProgramState};
pub use local::Local;
pub use parameters::ParameterError;
pub use timing::PwmTiming;
