//! Program download into two banks: whatever goes wrong, the next start runs the old program or the
//! new one, whole.

mod any_order;
mod banks;
mod bench;
mod cuts;
mod downloads;
mod states;
