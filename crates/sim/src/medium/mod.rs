//! The medium: who sends next, and for how long. Who has another bit rate hears nothing of it, and
//! has a medium of its own; so has who is cut off.
//!
//! A frame that nothing can happen to is taken as a whole: its length is computed, and it is there
//! at its end. Everything else is played bit by bit by the controllers' [`Protocol`]s, from start of
//! frame until the wire is free again.

mod counters;
mod decoder;
#[cfg(test)]
mod off;
mod protocol;
mod quiet;
#[cfg(test)]
mod random;
#[cfg(test)]
mod rules;

pub use counters::{ErrorCounters, ErrorState};
pub(crate) use decoder::Field;
pub use protocol::ErrorKind;
pub(crate) use protocol::{Event, Protocol};

use can::{BitRate, Frame};
use canopen::Instant;

use crate::place::Place;
use crate::wire_act::Participant;

/// Bits of the interframe space, after which the next frame may begin (ISO 11898-1).
pub(crate) const INTERFRAME_BITS: u64 = 3;

/// Who put a frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sender {
    /// A virtual drive.
    Drive(Place),
    /// A program outside, by its number.
    Outside(u32),
    /// The node that [`crate::WireAct::Flood`] lets babble.
    Stranger,
}

impl Sender {
    /// Whose controller sent it.
    pub fn participant(self) -> Participant {
        match self {
            Sender::Drive(place) => Participant::Drive(place),
            Sender::Outside(_) => Participant::Outside,
            Sender::Stranger => Participant::Stranger,
        }
    }
}

/// A frame that went over the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    /// When its last bit was received.
    pub at: Instant,
    /// The frame.
    pub frame: Frame,
    /// Who sent it.
    pub sender: Sender,
    /// How often outside programs get it: once, unless it is disturbed ([`crate::Disturbance`],
    /// [`crate::WireAct`]) or their controller is bus-off. 0 of one that an outside program sent:
    /// its controller saw an error in the last bit, and sends it again.
    pub copies: u8,
}

/// A wire: those on it hear each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wire {
    pub(crate) bit_rate: BitRate,
    /// Who is alone on it.
    pub(crate) cut_off: Option<Participant>,
}

/// What acts do to one frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spoilt {
    /// Bits that are flipped, by their number from start of frame, and for whom.
    pub(crate) flips: Vec<(u16, Option<Participant>)>,
    /// Who loses the frame.
    pub(crate) lost_at: Vec<Participant>,
}

/// What is on the wire.
#[derive(Clone, Debug)]
pub(crate) enum InFlight {
    /// A frame that will be good, and everyone who sends it: several only if they send the same
    /// bits.
    Frame {
        frame: Frame,
        senders: Vec<Sender>,
        lost_at: Vec<Participant>,
    },
    /// Anything, bit by bit.
    Bits {
        /// Number of the bit that ends next, from start of frame.
        number: u16,
        spoilt: Spoilt,
    },
}

/// A good frame that has ended on a wire.
#[derive(Clone, Debug)]
pub(crate) struct Ended {
    pub(crate) frame: Frame,
    pub(crate) senders: Vec<Sender>,
    pub(crate) lost_at: Vec<Participant>,
    /// When it began. Who did not listen then has not heard it.
    pub(crate) began: Instant,
    pub(crate) wire: Wire,
}

/// One wire and what is on it.
#[derive(Debug)]
pub(crate) struct Medium {
    pub(crate) wire: Wire,
    in_flight: Option<InFlight>,
    began: Instant,
    /// When the frame that is on the wire ends, or the bit.
    pub(crate) ends: Instant,
    /// When the next frame may begin.
    pub(crate) idle_at: Instant,
    /// Somebody may wait for it.
    pub(crate) contended: bool,
    /// When somebody who waits may begin, other than by the end of a frame.
    pub(crate) retry_at: Instant,
}

impl Medium {
    fn new(wire: Wire) -> Medium {
        Medium {
            wire,
            in_flight: None,
            began: Instant::ZERO,
            ends: Instant::NEVER,
            idle_at: Instant::ZERO,
            contended: false,
            retry_at: Instant::NEVER,
        }
    }

    pub(crate) fn bit_ns(&self) -> u64 {
        self.wire.bit_rate.bit_ns()
    }

    pub(crate) fn is_idle(&self, now: Instant) -> bool {
        self.in_flight.is_none() && now >= self.idle_at
    }

    /// Whether a good frame is on the wire.
    pub(crate) fn carries_frame(&self) -> bool {
        matches!(self.in_flight, Some(InFlight::Frame { .. }))
    }

    /// Whether it is looked at bit by bit.
    pub(crate) fn is_in_bits(&self) -> bool {
        matches!(self.in_flight, Some(InFlight::Bits { .. }))
    }

    /// A good frame begins. How long the wire is busy then, interframe space included, ns.
    pub(crate) fn begin_frame(
        &mut self,
        now: Instant,
        frame: Frame,
        senders: Vec<Sender>,
        lost_at: Vec<Participant>,
    ) -> u64 {
        let busy_ns = u64::from(frame.wire_bits()) * self.bit_ns();
        self.in_flight = Some(InFlight::Frame {
            frame,
            senders,
            lost_at,
        });
        self.began = now;
        self.idle_at = now.plus_ns(busy_ns);
        self.ends = Instant(self.idle_at.0 - INTERFRAME_BITS * self.bit_ns());
        busy_ns
    }

    /// Bits are looked at one by one, the first of which is `number` and ends then.
    pub(crate) fn begin_bits(&mut self, number: u16, ends: Instant, spoilt: Spoilt) {
        self.in_flight = Some(InFlight::Bits { number, spoilt });
        self.ends = ends;
        self.idle_at = Instant::NEVER;
    }

    /// The bit that has ended: its number and what is done to its frame.
    pub(crate) fn bit(&self) -> Option<(u16, &Spoilt)> {
        match &self.in_flight {
            Some(InFlight::Bits { number, spoilt }) => Some((*number, spoilt)),
            _ => None,
        }
    }

    /// The next bit.
    pub(crate) fn next_bit(&mut self) {
        let bit_ns = self.bit_ns();
        if let Some(InFlight::Bits { number, .. }) = &mut self.in_flight {
            *number = number.saturating_add(1);
            self.ends = self.ends.plus_ns(bit_ns);
        }
    }

    /// The wire is free.
    pub(crate) fn end_bits(&mut self, now: Instant) {
        self.in_flight = None;
        self.ends = Instant::NEVER;
        self.idle_at = now;
        self.contended = true;
    }

    /// The good frame that ends now.
    pub(crate) fn take_ended(&mut self, now: Instant) -> Option<Ended> {
        if now < self.ends || !self.carries_frame() {
            return None;
        }
        self.ends = Instant::NEVER;
        self.take_frame()
    }

    /// The good frame that is on the wire.
    pub(crate) fn take_frame(&mut self) -> Option<Ended> {
        match self.in_flight.take()? {
            InFlight::Frame {
                frame,
                senders,
                lost_at,
            } => Some(Ended {
                frame,
                senders,
                lost_at,
                began: self.began,
                wire: self.wire,
            }),
            bits @ InFlight::Bits { .. } => {
                self.in_flight = Some(bits);
                None
            }
        }
    }
}

/// The media of one bus, one for each wire that there has been.
#[derive(Debug, Default)]
pub(crate) struct Media(Vec<Medium>);

impl Media {
    /// Each, in the order in which they were first needed.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Medium> {
        self.0.iter()
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The one of that number.
    pub(crate) fn nth(&mut self, n: usize) -> &mut Medium {
        &mut self.0[n]
    }

    /// The number of that wire's, which is made if there is none.
    pub(crate) fn number(&mut self, wire: Wire) -> usize {
        let known = self.0.iter().position(|medium| medium.wire == wire);
        known.unwrap_or_else(|| {
            self.0.push(Medium::new(wire));
            self.0.len() - 1
        })
    }

    /// Somebody may wait for this wire.
    pub(crate) fn contend(&mut self, wire: Wire) {
        let n = self.number(wire);
        self.0[n].contended = true;
    }
}
