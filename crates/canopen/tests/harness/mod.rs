//! What the tests of this crate share: two devices of one dictionary, one with everything, and a
//! node on a bench.
#![allow(
    dead_code,
    unreachable_pub,
    unused_imports,
    reason = "each test file is a crate of its own and uses a part"
)]

mod bench;
pub mod config;
pub mod devices;
pub mod full;
pub mod lss;
pub mod script;
pub mod sdo_server;
pub mod stand;
pub mod streams;

pub use bench::{Bench, ID, Recorder};
pub use devices::{BASIC, LENIENT, P3_LIKE, STANDARD};
pub use full::FULL;
pub use stand::Stand;
pub use streams::{Call, Streams};
