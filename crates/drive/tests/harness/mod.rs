//! What the fuzz targets, the replay of their corpora and the property tests share.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file is a crate of its own and uses a part"
)]

#[path = "../../../canopen/tests/harness/mod.rs"]
mod canopen_harness;

pub mod controller;
pub mod script;
