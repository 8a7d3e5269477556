//! The drive's objects as a command line reaches them.

use canopen::{Abort, Address, Instant, NodeMemory};
use personalities::own::OwnBehaviour;
use personalities::serial::Objects;

use crate::body::Body;
use crate::{Drive, Host};

/// The objects of a drive at a moment ([`Drive::local`]), for what is not CAN.
#[derive(Debug)]
pub struct Local<'a, M, O, B: Body, H> {
    drive: &'a mut Drive<M, O, B>,
    now: Instant,
    host: &'a mut H,
}

impl<'a, M, O, B: Body, H> Local<'a, M, O, B, H> {
    pub(crate) fn new(drive: &'a mut Drive<M, O, B>, now: Instant, host: &'a mut H) -> Self {
        Local { drive, now, host }
    }
}

impl<M: NodeMemory, O: OwnBehaviour, B: Body, H: Host> Objects for Local<'_, M, O, B, H> {
    fn read(&mut self, object: Address) -> Result<i64, Abort> {
        self.drive.comms.read_local(object, self.host)
    }

    fn write(&mut self, object: Address, value: i64) -> Result<(), Abort> {
        let comms = &mut self.drive.comms;
        let written = comms.write_local(object, value, self.now, self.host);
        self.drive.hand_over();
        written
    }

    fn store(&mut self) -> Result<(), Abort> {
        self.drive.comms.store_local()
    }
}
