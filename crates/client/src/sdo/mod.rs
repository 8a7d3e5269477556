//! Service data objects from the client's side (CiA 301 7.2.4): reading and writing any object of
//! a node, by expedited transfers.

mod frame;
mod transfer;

pub use frame::{Answer, Data, Request};
pub use transfer::{Access, Cause, SdoError};
