//! What went over a bus, written down.

pub mod candump;
