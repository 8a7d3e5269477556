//! What each act of a scenario does to a drive's world, its processor and its memory.

mod bench;
mod drive;
#[path = "../master/mod.rs"]
mod master;
mod sensors;
