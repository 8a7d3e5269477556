//! Other systems than Linux have no CAN interfaces.

use super::{Heard, InterfaceError};
use can::Frame;
use std::convert::Infallible;
use std::time::Duration;

/// Cannot be had here.
#[derive(Debug)]
pub(crate) struct Interface(Infallible);

impl Interface {
    pub(crate) fn open(name: &str) -> Result<Interface, InterfaceError> {
        let name = name.to_owned();
        Err(InterfaceError::NotLinux { name })
    }

    pub(crate) async fn receive(&self) -> Result<Heard, InterfaceError> {
        match self.0 {}
    }

    pub(crate) async fn send(&self, _: &Frame, _: Duration) -> Result<(), InterfaceError> {
        match self.0 {}
    }
}
