//! The documented drives, as data.
//!
//! A [`Personality`] is everything by which one drive differs from another: its dictionary rows,
//! where the drive core finds its targets, feedback and parameters among them and in which units,
//! its fault table, and its dialects. The core crates never ask which drive they are.
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

pub mod board;
pub mod class;
pub mod commissioning;
mod faults;
pub mod md80;
mod objects;
pub mod operation;
pub mod own;
pub mod p3;
pub mod p3_extended;
pub mod p3_jpl;
mod pdo_rows;
mod personality;
pub mod roboteq;
pub mod serial;
mod words;

pub use faults::{Cause, ErrorRules, FaultRow, Kind, MOST_FAULTS, States, SupplyRules, Switch};
pub use objects::{
    AmplifierObjects, AnalogObjects, AxisObjects, BridgeTimeObjects, ConfigurationObjects,
    DirectGainObjects, FeedbackObjects, Figure, GainObjects, HomingObjects, HomingSearchObjects,
    InputFunction, InputObjects, LoopObjects, MotionLoop, MotorObjects, PidObjects,
    ProbeEdgeObjects, ProbeObjects, Scaled, TargetObjects, TargetWindow, VlObjects, WindowObjects,
};
pub use personality::{
    ALL, AxisPersonality, HostObjects, NodeIdObject, Personality, Setting, by_name,
};
pub use words::Words;
