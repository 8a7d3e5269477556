//! The parts of the board that no loop asks, and own behaviour.

use canopen::NodeMemory;
use personalities::board::{Board, Lights};
use personalities::own::OwnBehaviour;

use crate::body::Body;
use crate::comms::Comms;

impl<M: NodeMemory, O: OwnBehaviour, B: Body> Comms<M, O, B> {
    /// See [`crate::Drive::look_at`].
    pub fn look_at(&mut self, axis: usize, board: &Board) {
        self.application.own.look_at(axis as u8, board);
    }

    /// What an axis's loops shall take the encoder's reading `raw` for, counts of a turn. Without own
    /// behaviour that knows better, that reading.
    #[inline]
    pub fn reading(&self, axis: usize, raw: i32) -> i32 {
        self.application.own.reading(axis as u8, raw)
    }

    /// See [`crate::Drive::lights`].
    pub fn lights(&self) -> Option<Lights> {
        self.application.own.lights()
    }
}
