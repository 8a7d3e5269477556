//! Service data objects (CiA 301 7.2.4): access to any object of the dictionary.
//!
//! The way of a request: `request.rs` reads the frame, `serve.rs` decides; an expedited transfer
//! ends there. Others become a [`Transfer`] that `segments.rs`, `block_upload.rs` or
//! `block_download.rs` carry on, from where `source.rs` reads and to where `sink.rs` writes.

mod block_download;
mod block_upload;
pub mod client;
mod crc;
mod request;
mod segments;
mod serve;
mod server;
mod sink;
mod source;

pub(crate) use request::{Request, Size};
pub(crate) use serve::Readable;
pub(crate) use server::{Phase, Place, SdoServer, Transfer, Wait};

/// SDO servers that a node can have, the default one (0x1200) included.
pub const SDO_SERVERS: usize = 3;
