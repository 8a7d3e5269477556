//! What the fuzz targets run. The interpreters live beside the crates' own tests, which replay the
//! corpora; here they are only brought together.
//!
//! A new target is: an interpreter with a `run(&[u8])` in the tests of its crate, included below; a
//! file of five lines in `fuzz_targets/`; a `[[bin]]`; and a corpus directory of the same name.
//! `canopen_harness::script::steps` turns bytes into frames, time and owner's doings for any
//! dictionary, so a target for a whole drive need only say what to do with them.

#[path = "../../crates/canopen/tests/harness/mod.rs"]
pub mod canopen_harness;

#[path = "../../crates/drive/tests/harness/mod.rs"]
pub mod drive_harness;

#[path = "../../crates/eds/tests/harness/mod.rs"]
pub mod eds_harness;
#[path = "../../crates/canopen/tests/sdo_client/harness/mod.rs"]
pub mod sdo_client_harness;

#[path = "../../crates/personalities/tests/serial/harness.rs"]
pub mod serial_harness;
