//! Service data objects (CiA 301 7.2.4): access to any object of the dictionary.

pub mod client;
mod connection;
pub(crate) mod crc;
mod request;
mod serve;

pub(crate) use connection::SdoConnection;
pub(crate) use request::Request;
