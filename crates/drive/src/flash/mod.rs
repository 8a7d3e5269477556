//! What the drive keeps when the power is off: regions of a NOR flash, and parameters in two slots.
//!
//! A drive has one flash for parameters and programs, so nothing here owns it: each call borrows
//! it. All reads are whole chunks of [`CHUNK`] bytes, so every page size up to that is served.

mod checksum;
mod parameters;
mod region;
mod slot;

pub use checksum::Checksum;
pub use parameters::{LoadError, Loaded, ParameterFlash, SaveError};
pub use region::{CHUNK, FlashError, LayoutError, Region};
pub use slot::{Set, Slot, SlotState};
