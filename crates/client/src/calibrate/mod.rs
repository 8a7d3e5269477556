//! Calibrating a drive that is new to its motor, as the P3's manual prescribes it (l.238 to l.290),
//! and what that leaves open.
//!
//! ```text
//! Session::new(&mut client, node, watch)
//!     current_sensor  → electrical_zero (and phase order) → encoder_lag
//!     → session.found(): shown to the user → session.save() or session.discard()
//! ```
//!
//! Each procedure checks first whether the motor may get power, and leaves it without power. What
//! it found is in the drive's memory then, not yet saved. It knows the drive by its objects only, so
//! it does not matter whether that is real. The theory is in `docs/calibration.md`.

mod current_sensor;
mod electrical_zero;
mod encoder_lag;
mod free_shaft;
mod own;
mod sweep;

pub use current_sensor::CurrentSensor;
pub use electrical_zero::{ElectricalZero, Method};
pub use encoder_lag::EncoderLag;
pub use own::{OwnCalibration, OwnError, StatusWords};
