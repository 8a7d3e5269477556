//! A node that is no drive and sends too much ([`crate::WireAct::Flood`]).

use can::{BitRate, Frame};
use canopen::Instant;

use crate::controller::Port;

/// A frame sent again and again.
#[derive(Debug)]
struct Flood {
    frame: Frame,
    every_ns: u64,
    /// When the next one is due.
    due: Instant,
    until: Instant,
}

/// The babbling node: on the bus while it has something to send.
#[derive(Debug)]
pub(crate) struct Stranger {
    pub(crate) port: Port,
    floods: Vec<Flood>,
}

impl Stranger {
    /// One that is not on the bus.
    pub(crate) fn new(bit_rate: BitRate) -> Stranger {
        Stranger {
            port: Port::new(bit_rate),
            floods: Vec::new(),
        }
    }

    /// Begins a flood.
    pub(crate) fn flood(&mut self, frame: Frame, every_ns: u64, now: Instant, until: Instant) {
        if !self.port.protocol.is_on() {
            self.port.protocol.start(now);
        }
        self.floods.push(Flood {
            frame,
            every_ns,
            due: now,
            until,
        });
    }

    /// The frame that it would send.
    pub(crate) fn contender(&self, now: Instant) -> Option<Frame> {
        self.floods
            .iter()
            .filter(|flood| flood.due <= now && now < flood.until)
            .map(|flood| flood.frame)
            .min_by_key(Frame::arbitration_key)
    }

    /// The frame was sent.
    pub(crate) fn sent(&mut self, frame: Frame, now: Instant) {
        if let Some(flood) = self
            .floods
            .iter_mut()
            .filter(|flood| flood.frame == frame)
            .min_by_key(|flood| flood.due)
        {
            // What it could not send in time is not made up for.
            flood.due = flood.due.plus_ns(flood.every_ns).max(now);
        }
    }

    /// When it has something to do next: a frame to send, or to leave the bus.
    pub(crate) fn next_event(&self, now: Instant) -> Instant {
        self.floods
            .iter()
            .map(|flood| {
                if flood.due > now {
                    flood.due.min(flood.until)
                } else {
                    flood.until
                }
            })
            .min()
            .unwrap_or(Instant::NEVER)
    }

    /// Ends what is over. Whether it leaves the bus now.
    pub(crate) fn end_floods(&mut self, now: Instant) -> bool {
        self.floods.retain(|flood| now < flood.until);
        self.floods.is_empty() && self.port.protocol.is_on() && self.port.protocol.is_at_rest()
    }
}
