//! Tuning a drive's loops to what hangs on its motor.
//!
//! The drive makes its gains from a bandwidth, a damping and the motor's data sheet. With a load
//! on the shaft, and with the delays of a real drive, the closed loop has another natural frequency
//! than that bandwidth. [`Session::tune_velocity`](crate::session::Session::tune_velocity) and
//! [`tune_position`](crate::session::Session::tune_position) measure it: the shaft
//! turns slowly, a small step is added again and again, and a model is fitted to the mean response.
//! Then bandwidth and damping are corrected and measured again, until the loop is as asked.

mod loops;
mod shaft;
mod steps;

pub use loops::{Asked, Tuned};
pub use shaft::Shaft;
