//! Layer setting services (CiA 305): giving node IDs and bit timings over the bus.
//!
//! A slave has an *active* node ID, which it communicates with, and a *pending* one, which becomes
//! active with the next reset of communication; the same for bit timing. What is stored is given by
//! the device that owns the slave. A slave whose active and pending node ID are both 0xFF is
//! *unconfigured*: it answers LSS only, and `None` stands for that node ID everywhere here.
//!
//! [`Slave`] and [`Master`] do no I/O. Masters send on 0x7E5, slaves answer on 0x7E4, always eight
//! bytes; [`Request`] and [`Answer`] are those bytes.

mod answer;
mod bit_timing;
mod fastscan;
mod identity;
mod master;
mod request;
mod slave;

pub use answer::{Answer, Refusal, Service};
pub use bit_timing::{BitTiming, BitTimings};
pub use fastscan::{Known, Scan, ScanEnd};
pub use identity::{Identity, Part};
pub use master::{Busy, Job, Master, Outcome, Settings};
pub use request::{Bound, Request, Test, UNCONFIGURED};
pub use slave::{Event, Reply, Slave, State, StoreError};
