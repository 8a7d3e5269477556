//! The physical world of one drive: supply, bridge, motor, shaft, sensors.
//!
//! A [`Plant`] takes the duties that a control loop commands, moves the world forward one PWM
//! period at a time, and answers with what the sensors read: raw converter and encoder counts, in
//! the terms of [`control::io`]. Between two calls nothing is approximated that has a closed form:
//! the stator currents, the viscous friction and the diodes of an open bridge are integrated
//! exactly for what is held constant over the period (the duties and the speed).
//!
//! Generic over [`control::Real`], without branches on values, so one drive and a batch of drives
//! compute the same bits. No allocation, clock or I/O.
//!
//! Read it in the order of cause and effect: [`Supply`] → [`Inverter`] → [`Winding`] (or, with the
//! bridge open, [`diodes`]) → torque → [`Mechanics`] → [`Sensors`]; [`Plant`] ties them together.
//! [`Motor`] and [`Parameters`] hold the numbers.
//!
//! Not modelled: saliency, saturation, ripple of the currents within a PWM period.
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

mod ak80;
mod body;
pub mod diodes;
mod elastic;
mod encoder;
mod exponential;
mod gate_driver;
mod inverter;
mod load;
mod magnet;
mod mechanics;
mod motor;
mod noise;
mod output_encoder;
mod parameters;
mod plant;
mod ripple;
mod sensors;
mod spread;
mod stops;
mod supply;
mod switches;
mod thermal;
mod vector;
mod winding;
mod wiring;

pub use ak80::{AK80_9, AK80_9_GEAR, AK80_9_THERMAL, VIRTUAL_MD80};
pub use encoder::{Encoder, EncoderFault};
pub use gate_driver::GateDriverWords;
pub use inverter::{Bridge, Inverter};
pub use load::{Coupling, Load, Pendulum, Stops};
pub use magnet::field_at;
pub use mechanics::Mechanics;
pub use motor::{EC_45_FLAT_339281, EC_MAX_22_283860, EC_MAX_22_283860_THERMAL, Motor};
pub use output_encoder::OutputEncoder;
pub use parameters::{COMPLETE_P3, FULL_P3, Invalid, Parameters, VIRTUAL_P3};
pub use plant::{Plant, Truth};
pub use ripple::Cogging;
pub use sensors::{CurrentSensors, Sensed, Sensors};
pub use spread::Spread;
pub use supply::{Link, LogicSupply, Supply};
pub use switches::{Switch, SwitchName, Switches};
pub use thermal::{AmplifierThermal, MotorThermal, Thermal};
pub use vector::Vector;
pub use winding::Winding;
pub use wiring::{Phase, SHORT_OHM, STRAY_H, Short};
