//! The medium: who sends next, and for how long. Who has another bit rate hears nothing of it, and
//! has a medium of its own.

mod counters;

pub(crate) use counters::Counted;
pub use counters::{ErrorCounters, ErrorState};

use can::{BitRate, Frame};
use canopen::Instant;

use crate::place::Place;

/// Bits of the interframe space, after which the next frame may begin (ISO 11898-1).
const INTERFRAME_BITS: u64 = 3;
/// An error frame: flag of 6, superposed flags of up to 6, delimiter of 8 bits.
const ERROR_FRAME_BITS: u64 = 20;
/// Bits after which two frames of equal identifier are sure to be told apart: the first bit of the
/// data. Only the length of the disturbance depends on it.
const COLLISION_BITS: u64 = 20;
/// Recessive bits that end bus-off: 128 sequences of 11.
pub(crate) const RECOVERY_BITS: u64 = 128 * 11;

/// Who put a frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sender {
    /// A virtual drive.
    Drive(Place),
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
    /// How often outside programs get it: once, unless it is disturbed ([`crate::Disturbance`]).
    pub copies: u8,
}

/// What is on the wire.
#[derive(Clone, Debug)]
pub(crate) enum InFlight {
    /// A frame, and everyone who sends it: several only if they send the same bits.
    Frame { frame: Frame, senders: Vec<Sender> },
    /// Different frames of one identifier, which destroy each other.
    Collision { senders: Vec<Sender> },
}

/// What has ended on a wire.
#[derive(Clone, Debug)]
pub(crate) struct Ended {
    pub(crate) what: InFlight,
    /// When it began. Who did not listen then has not heard it.
    pub(crate) began: Instant,
    pub(crate) bit_rate: BitRate,
}

/// The wire as those see it who have one bit rate.
#[derive(Debug)]
pub(crate) struct Medium {
    bit_rate: BitRate,
    in_flight: Option<InFlight>,
    began: Instant,
    /// When what is on the wire ends.
    pub(crate) ends: Instant,
    /// When the next frame may begin.
    pub(crate) idle_at: Instant,
    /// A drive may wait for it.
    pub(crate) contended: bool,
}

impl Medium {
    pub(crate) fn new(bit_rate: BitRate) -> Medium {
        Medium {
            bit_rate,
            in_flight: None,
            began: Instant::ZERO,
            ends: Instant::NEVER,
            idle_at: Instant::ZERO,
            contended: false,
        }
    }

    pub(crate) fn bit_rate(&self) -> BitRate {
        self.bit_rate
    }

    pub(crate) fn is_idle(&self, now: Instant) -> bool {
        self.in_flight.is_none() && now >= self.idle_at
    }

    /// Arbitration: of all that contend at `now`, the lowest identifier goes on the wire. For how long
    /// the wire is busy then, interframe space included, ns.
    pub(crate) fn arbitrate(&mut self, now: Instant, contenders: &[(Sender, Frame)]) -> u64 {
        let Some((_, winner)) = contenders
            .iter()
            .min_by_key(|(_, frame)| frame.arbitration_key())
        else {
            return 0;
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
        let bit_ns = self.bit_rate.bit_ns();
        self.in_flight = Some(in_flight);
        self.began = now;
        self.ends = now.plus_ns(bits * bit_ns);
        self.idle_at = self.ends.plus_ns(gap * bit_ns);
        (bits + gap) * bit_ns
    }

    /// What ends now.
    pub(crate) fn take_ended(&mut self, now: Instant) -> Option<Ended> {
        if now < self.ends {
            return None;
        }
        self.ends = Instant::NEVER;
        let what = self.in_flight.take()?;
        Some(Ended {
            what,
            began: self.began,
            bit_rate: self.bit_rate,
        })
    }

    /// Whether one of the senders of what is on the wire is outside.
    pub(crate) fn carries_outside(&self) -> bool {
        let outside = |sender: &Sender| matches!(sender, Sender::Outside(_));
        match &self.in_flight {
            Some(InFlight::Frame { senders, .. } | InFlight::Collision { senders }) => {
                senders.iter().any(outside)
            }
            None => false,
        }
    }
}

/// The media of one bus, one for each bit rate that somebody has had.
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

    /// A drive of this bit rate may wait for the wire.
    pub(crate) fn contend(&mut self, bit_rate: BitRate) {
        match self.0.iter_mut().find(|medium| medium.bit_rate == bit_rate) {
            Some(medium) => medium.contended = true,
            None => {
                let mut medium = Medium::new(bit_rate);
                medium.contended = true;
                self.0.push(medium);
            }
        }
    }
}
