//! Homing on a simulated rail with limit switches, home switch, index pulses and hard stops: every
//! method from every kind of beginning, against the places that the diagrams of CiA 402 show.

#[path = "../rig/mod.rs"]
mod rig;

mod machine;
mod methods;
mod outcome;
