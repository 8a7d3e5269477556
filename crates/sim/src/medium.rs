//! The medium: who sends next, and for how long.

use can::Frame;
use canopen::{Instant, NodeId};

/// One bit at 1 Mbit/s, ns.
pub const BIT_NS: u64 = 1_000;

/// Bits of the interframe space, after which the next frame may begin (ISO 11898-1).
const INTERFRAME_BITS: u64 = 3;
/// An error frame: flag of 6, superposed flags of up to 6, delimiter of 8 bits.
const ERROR_FRAME_BITS: u64 = 20;
/// Bits after which two frames of equal identifier are sure to be told apart: the first bit of the
/// data. Only the length of the disturbance depends on it.
const COLLISION_BITS: u64 = 20;
/// Recessive bits that end bus-off: 128 sequences of 11.
const RECOVERY_BITS: u64 = 128 * 11;

/// Who put a frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sender {
    /// A virtual drive.
    Drive(NodeId),
    /// A program outside, by its number.
    Outside(u32),
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
}

/// A participant's error counters (ISO 11898-1, fault confinement).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorCounters {
    /// Transmit error counter.
    pub transmit: u16,
    /// Receive error counter.
    pub receive: u16,
    /// When the participant that is bus-off may take part again.
    pub(crate) off_until: Option<Instant>,
}

impl ErrorCounters {
    /// Whether it takes no part.
    pub fn is_bus_off(&self) -> bool {
        self.off_until.is_some()
    }

    pub(crate) fn transmitted(&mut self) {
        self.transmit = self.transmit.saturating_sub(1);
    }

    pub(crate) fn received(&mut self) {
        self.receive = self.receive.saturating_sub(1);
    }

    /// An error while sending. Whether that led to bus-off.
    pub(crate) fn transmit_error(&mut self, now: Instant) -> bool {
        self.transmit += 8;
        let off = self.transmit > 255;
        if off {
            self.off_until = Some(now.plus_ns(RECOVERY_BITS * BIT_NS));
        }
        off
    }

    pub(crate) fn receive_error(&mut self) {
        self.receive = (self.receive + 1).min(255);
    }

    /// Takes part again after bus-off.
    pub(crate) fn recover(&mut self) {
        *self = ErrorCounters::default();
    }
}

/// What is on the wire.
#[derive(Clone, Debug)]
pub(crate) enum InFlight {
    /// A frame, and everyone who sends it: several only if they send the same bits.
    Frame { frame: Frame, senders: Vec<Sender> },
    /// Different frames of one identifier, which destroy each other.
    Collision { senders: Vec<Sender> },
}

/// The wire.
#[derive(Debug)]
pub(crate) struct Medium {
    in_flight: Option<InFlight>,
    /// When what is on the wire ends.
    pub(crate) ends: Instant,
    /// When the next frame may begin.
    pub(crate) idle_at: Instant,
    busy_ns: u64,
}

impl Medium {
    pub(crate) fn new() -> Medium {
        Medium {
            in_flight: None,
            ends: Instant::NEVER,
            idle_at: Instant::ZERO,
            busy_ns: 0,
        }
    }

    pub(crate) fn is_idle(&self, now: Instant) -> bool {
        self.in_flight.is_none() && now >= self.idle_at
    }

    /// Arbitration: of all that contend at `now`, the lowest identifier goes on the wire.
    pub(crate) fn arbitrate(&mut self, now: Instant, contenders: &[(Sender, Frame)]) {
        let Some((_, winner)) = contenders
            .iter()
            .min_by_key(|(_, frame)| frame.arbitration_key())
        else {
            return;
        };
        let key = winner.arbitration_key();
        let same = || {
            contenders
                .iter()
                .filter(move |(_, frame)| frame.arbitration_key() == key)
        };
        let senders: Vec<Sender> = same().map(|(sender, _)| *sender).collect();
        let (in_flight, bits, gap) = if same().all(|(_, frame)| frame == winner) {
            let bits = u64::from(winner.wire_bits()) - INTERFRAME_BITS;
            let frame = *winner;
            (InFlight::Frame { frame, senders }, bits, INTERFRAME_BITS)
        } else {
            let bits = COLLISION_BITS + ERROR_FRAME_BITS;
            (InFlight::Collision { senders }, bits, INTERFRAME_BITS)
        };
        self.in_flight = Some(in_flight);
        self.ends = now.plus_ns(bits * BIT_NS);
        self.idle_at = self.ends.plus_ns(gap * BIT_NS);
        self.busy_ns += (bits + gap) * BIT_NS;
    }

    /// What ends now.
    pub(crate) fn take_ended(&mut self, now: Instant) -> Option<InFlight> {
        if now < self.ends {
            return None;
        }
        self.ends = Instant::NEVER;
        self.in_flight.take()
    }

    /// Time for which the wire has been busy, interframe spaces included, ns.
    pub(crate) fn busy_ns(&self) -> u64 {
        self.busy_ns
    }
}
