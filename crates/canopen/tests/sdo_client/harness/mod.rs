//! A model of an SDO server, a wire that loses and doubles frames, and bytes as a script of both:
//! shared with the fuzz target.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "the tests and the fuzz target use a part each"
)]

pub mod model;
pub mod script;
pub mod wire;
