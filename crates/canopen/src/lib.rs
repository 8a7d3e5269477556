//! A CiA 301 device as a state machine without I/O.
//!
//! The caller owns the clock and the wire. It hands received frames to [`Node::receive`], calls
//! [`Node::poll`] when [`Node::next_deadline`] has come, and takes frames from [`Node::transmit`]
//! until there are none. Nothing here allocates, sleeps, or knows any global.
//!
//! What a device *is* stands in one table of [`Row`]s, checked and laid out at compile time by
//! [`dictionary`]; the values live in one byte [`Image`] per node. How a device differs from the
//! standard stands in its [`Dialect`]. What a write *means* is the [`Owner`]'s business.
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

mod abort;
mod access;
mod cob_id;
mod communication;
mod data_type;
mod device;
mod dialect;
pub mod dictionary;
mod emergency;
mod events;
mod guarding;
mod heartbeat;
mod image;
mod local;
pub mod lss;
mod monitor;
pub mod nmt;
mod node;
mod outbox;
mod owner;
mod pdo;
mod rename;
pub mod row;
mod sdo;
pub mod store;
mod sync;
mod time;
mod time_stamp;

pub use abort::Abort;
pub use cob_id::{CobId, NodeId};
pub use data_type::{DataType, Wire};
pub use device::{CommunicationObjects, Device};
pub use dialect::{AcknowledgeData, Dialect, RangeAbort, RpdoSync, SdoTransfers, UploadReply};
pub use dictionary::{Dictionary, Entry, Table};
pub use emergency::Emergency;
pub use events::{CommunicationErrors, Events, News};
pub use image::{Field, Handle, Image};
pub use monitor::{MONITORED, Monitored};
pub use nmt::{NmtState, Reset};
pub use node::{Node, NodeMemory};
pub use owner::{Changed, NoOwner, Owner, Verdict};
pub use pdo::{MAPPED_PER_PDO, PDOS};
pub use row::{Access, Address, Default, Group, Row};
pub use sdo::SDO_SERVERS;
pub use sdo::client as sdo_client;
pub use time::Instant;
pub use time_stamp::TimeOfDay;
