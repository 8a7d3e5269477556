//! Service data objects from the client's side (CiA 301 7.2.4): reading and writing any object of
//! a node. The protocols are in [`canopen::sdo_client`]; here they meet a [`crate::Link`].

mod frame;
mod long;
mod run;
mod transfer;

pub use canopen::sdo_client::{Done, Failure, NoData, Progress, Sink, Source, StartError};
pub use frame::{Answer, Data, Request};
pub use long::Method;
pub use transfer::{Access, Cause, SdoError};
