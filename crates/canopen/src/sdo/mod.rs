//! Service data objects (CiA 301 7.2.4): access to any object of the dictionary.

mod request;
mod server;

pub(crate) use request::Request;
pub(crate) use server::SdoServer;
