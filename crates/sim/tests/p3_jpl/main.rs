//! The P3 of 2016 on a simulated bus and motor: what its manual says that tables do not tell.

mod barrett_can;
mod bench;
mod communication;
mod errors;
#[path = "../master/mod.rs"]
mod master;
mod modes;
mod objects;
mod refusals;
