//! The serial line of a Roboteq controller: the same drive as by CAN, at the pace of the line, and
//! again in a replay.

mod bench;
#[path = "../master/mod.rs"]
mod master;
mod motion;
mod objects;
mod pace;
mod page;
mod recorded;
