//! Roboteq controllers of one to three channels, on a simulated bus and simulated motors.

mod bench;
mod channels;
mod first_words;
#[path = "../master/mod.rs"]
mod master;
mod modes;
mod refusals;
mod set_points;
mod stops;
mod supply;
mod thresholds;
mod watchdog;
