//! The MD80 on a simulated bus, with its sample motor: what its page says that tables do not tell.

mod bench;
mod calibration;
mod commands;
mod controllers;
mod directions;
mod faults;
#[path = "../master/mod.rs"]
mod master;
mod motion;
mod output_encoder;
mod pdos;
mod rows;
mod scenarios;
mod states;
mod status_words;
mod thresholds;
mod transitions;
mod values;
