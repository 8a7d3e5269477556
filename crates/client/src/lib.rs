//! The master's side of a CANopen bus: SDO access, NMT, finding nodes, putting frames into words,
//! and playing transcripts.
//!
//! Nothing here opens a socket or reads a clock. Everything is written once over a [`Link`], which
//! may be a simulated bus in virtual time or a real interface. Start with [`Client`]; a monitor
//! starts with [`decode::Decoder`], a test with [`transcript::Transcript`].
//!
//! Objects of up to four bytes are read and written by [`Client::upload`] and [`Client::download`],
//! of any length by [`Client::upload_to`] and [`Client::download_from`].

pub mod axis;
mod block_on;
pub mod calibrate;
mod client;
pub mod decode;
mod fit;
mod link;
pub mod lss;
mod nmt;
pub mod pdo;
pub mod scan;
pub mod sdo;
pub mod session;
pub mod transcript;
pub mod tune;
mod value;

pub use block_on::block_on;
pub use client::{BlockSettings, Client, RequestForm, Settings};
pub use link::{Link, LinkError, Observed, Seen, Way};
pub use nmt::{BootUp, WaitError};
pub use value::{Value, ValueError};
