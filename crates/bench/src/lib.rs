//! Counts what a frame costs, and a byte of a long transfer: our CANopen device and two others of the Rust registry, zencan-node
//! and canopen-rs, in the same run.
//!
//! The program runs itself under valgrind's callgrind, each case twice, with few and with many
//! iterations. The difference of the two counts divided by the difference of the iterations is the
//! cost of one iteration, free of set-up, and repeats to the instruction.
//!
//! - [`subject`]: the cases, and what a stack must offer to be measured;
//! - [`block`]: SDO block transfers, of which there is only our own pair of client and server;
//! - [`cyclic_bus`]: four and six drives in cyclic synchronous position on one bus;
//! - [`mixed_bus`]: one of each documented drive on one bus;
//! - [`measure`]: counting instructions;
//! - [`period`]: wall-clock time, for the control cascade and block transfers;
//! - [`mod@reference`]: the figures of a program in another language;
//! - [`report`]: the figures as a table and as JSON.

pub mod block;
pub mod cyclic_bus;
pub mod measure;
pub mod mixed_bus;
pub mod period;
pub mod reference;
pub mod report;
pub mod subject;
