//! CAN data link layer values: frames and identifiers, their exact length on the wire, bit rates,
//! and the slcan text codec.
//!
//! Nothing here does I/O, allocates or reads a clock. [`Frame`] is a 16-byte `Copy` value that
//! implements [`embedded_can::Frame`], so it passes through any driver that speaks that trait.
#![no_std]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

mod bit_rate;
mod bit_stream;
mod frame;
pub mod slcan;
mod wire;

pub use bit_rate::{BitRate, UnknownBitRate};
pub use bit_stream::BitStream;
pub use embedded_can::{ExtendedId, Id, StandardId};
pub use frame::Frame;
pub use wire::INTERFRAME_BITS;
