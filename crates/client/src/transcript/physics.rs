//! What a transcript may assert beyond the bus.

use canopen::{Instant, NodeId};

use crate::{Link, LinkError};

/// A named quantity of a drive's physical world, as it truly is, not as the drive reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Its present value, and its unit as transcripts write it.
    Value {
        /// Value.
        value: f64,
        /// Unit; empty for a pure number.
        unit: &'static str,
    },
    /// Nobody knows: the drive is a real one.
    NoPlant,
    /// There is no such node.
    UnknownNode,
    /// There is no such quantity.
    UnknownQuantity {
        /// Those there are.
        known: &'static [&'static str],
    },
}

/// Who knows the physical world behind a bus. A simulation does, a real bus does not.
pub trait Physics {
    /// A quantity of `node` at the link's present time. `docs/transcripts.md` lists the names and
    /// units that a virtual drive offers.
    fn quantity(&mut self, node: NodeId, name: &str) -> Reading;
}

/// A link behind which there is no plant that could be asked: a real bus. Physical assertions are
/// then reported as not checked.
#[derive(Clone, Debug)]
pub struct WithoutPhysics<L>(pub L);

impl<L> Physics for WithoutPhysics<L> {
    fn quantity(&mut self, _: NodeId, _: &str) -> Reading {
        Reading::NoPlant
    }
}

impl<L: Link> Link for WithoutPhysics<L> {
    fn now(&self) -> Instant {
        self.0.now()
    }

    fn send(&mut self, frame: can::Frame) -> impl Future<Output = Result<(), LinkError>> {
        self.0.send(frame)
    }

    fn receive(
        &mut self,
        until: Instant,
    ) -> impl Future<Output = Result<Option<(Instant, can::Frame)>, LinkError>> {
        self.0.receive(until)
    }
}
