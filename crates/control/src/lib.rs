//! Motor control mathematics for permanent-magnet synchronous motors.
//!
//! One source serves a microcontroller, one virtual drive and a vectorised batch of drives: every
//! formula is generic over [`Real`], which is `f32` here. Nothing allocates, reads a clock or does
//! I/O; sine, cosine and square root are our own, so results are the same on every machine.
//!
//! [`Cascade`] is the whole: it takes a [`Command`] every millisecond or so, an [`io::Sample`] every
//! control period, and gives an [`io::Duty`]. In the order of the signal it is made of [`velocity`]
//! (position and velocity from the encoder), [`transform`] and [`trig`] (the rotor's frame),
//! [`motion`] (position and velocity loop), [`mod@i2t`] (thermal limit), [`current`] (current loop)
//! and [`modulation`]. [`tuning`] makes the gains, and [`capture`] keeps positions at the edges of
//! inputs. Currents and voltages are amplitudes of the phase
//! quantity; positions are encoder counts.
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

#[cfg(test)]
extern crate std;

pub mod capture;
mod cascade;
mod command;
pub mod current;
mod feedback;
pub mod i2t;
pub mod io;
pub mod modulation;
pub mod motion;
mod parameters;
mod real;
mod segment;
pub mod transform;
pub mod trig;
pub mod tuning;
pub mod velocity;

pub use cascade::Cascade;
pub use command::{Command, FrameSource, Limits};
pub use feedback::Feedback;
pub use parameters::{EncoderSettings, Gains, Motor, Parameters, PowerStage};
pub use real::{Mask, Real};
pub use trig::sin_cos;
