//! A CAN controller: its protocol side, receive FIFO and transmit mailboxes.

use std::collections::VecDeque;

use can::{BitRate, Frame};
use canopen::Instant;

use crate::medium::{Protocol, Wire};
use crate::wire_act::Participant;

/// Frames that the receive FIFO holds.
const FIFO_FRAMES: usize = 16;
/// Transmit mailboxes.
const MAILBOXES: usize = 3;

/// What any controller has: the protocol, and a place on a wire.
#[derive(Debug)]
pub(crate) struct Port {
    pub(crate) protocol: Protocol,
    bit_rate: BitRate,
    /// Who it is, if it is cut off.
    cut_off: Option<Participant>,
    /// Nothing is sent before.
    held_until: Instant,
    /// People have been told that it is error passive.
    pub(crate) told_passive: bool,
}

impl Port {
    /// One without power.
    pub(crate) fn new(bit_rate: BitRate) -> Port {
        Port {
            protocol: Protocol::new(),
            bit_rate,
            cut_off: None,
            held_until: Instant::ZERO,
            told_passive: false,
        }
    }

    /// Its bit rate.
    pub(crate) fn bit_rate(&self) -> BitRate {
        self.bit_rate
    }

    /// The wire that it is on.
    #[inline]
    pub(crate) fn wire(&self) -> Wire {
        Wire {
            bit_rate: self.bit_rate,
            cut_off: self.cut_off,
        }
    }

    /// Gives it another bit rate.
    pub(crate) fn tune(&mut self, bit_rate: BitRate, now: Instant) {
        if bit_rate != self.bit_rate {
            self.bit_rate = bit_rate;
            if self.protocol.is_on() {
                self.protocol.start(now);
                self.told_passive = false;
            }
        }
    }

    /// It is without power from now on.
    pub(crate) fn stop(&mut self) {
        self.protocol.stop();
        self.told_passive = false;
    }

    /// Cuts it off from the others, or connects it again.
    pub(crate) fn cut_off(&mut self, who: Option<Participant>) {
        self.cut_off = who;
    }

    /// What it sends waits until then.
    pub(crate) fn hold(&mut self, until: Instant) {
        self.held_until = self.held_until.max(until);
    }

    /// From when on it may send, if the wire is free: now, or later; never: by another's doing.
    #[inline]
    pub(crate) fn may_send_at(&mut self, now: Instant) -> Instant {
        if !self.protocol.is_idle() {
            let until = self.protocol.rests_until(self.bit_rate.bit_ns());
            if until > now {
                return until;
            }
        }
        self.held_until.max(now)
    }
}

/// The controller between a drive's processor and the medium.
#[derive(Debug)]
pub(crate) struct Controller {
    pub(crate) port: Port,
    /// It sends nothing, whatever waits.
    silent: bool,
    fifo: VecDeque<Frame>,
    mailboxes: Vec<Frame>,
    /// Frames for which the FIFO had no room.
    lost: u64,
}

impl Controller {
    /// One that has this bit rate from the start.
    pub(crate) fn new(bit_rate: BitRate) -> Controller {
        Controller {
            port: Port::new(bit_rate),
            silent: false,
            fifo: VecDeque::with_capacity(FIFO_FRAMES),
            mailboxes: Vec::with_capacity(MAILBOXES),
            lost: 0,
        }
    }

    /// Gives it another bit rate, which makes it forget everything.
    pub(crate) fn tune(&mut self, bit_rate: BitRate, now: Instant) {
        self.port.tune(bit_rate, now);
        self.clear();
    }

    /// Keeps it from sending, or lets it send again.
    pub(crate) fn silence(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// Takes a frame from the medium; false if the FIFO is full and the frame is lost.
    pub(crate) fn receive(&mut self, frame: Frame) -> bool {
        let fits = self.fifo.len() < FIFO_FRAMES;
        if fits {
            self.fifo.push_back(frame);
        } else {
            self.lost += 1;
        }
        fits
    }

    /// How many frames it has lost so.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    /// The oldest received frame.
    pub(crate) fn next_received(&mut self) -> Option<Frame> {
        self.fifo.pop_front()
    }

    /// Whether received frames wait.
    pub(crate) fn has_received(&self) -> bool {
        !self.fifo.is_empty()
    }

    /// Whether a mailbox is free.
    pub(crate) fn has_free_mailbox(&self) -> bool {
        self.mailboxes.len() < MAILBOXES
    }

    /// Puts a frame into a free mailbox.
    pub(crate) fn post(&mut self, frame: Frame) {
        debug_assert!(self.has_free_mailbox());
        self.mailboxes.push(frame);
    }

    /// The waiting frame that would win arbitration.
    pub(crate) fn contender(&self) -> Option<Frame> {
        if self.silent {
            return None;
        }
        self.mailboxes
            .iter()
            .copied()
            .min_by_key(Frame::arbitration_key)
    }

    /// The frame was sent; its mailbox is free.
    pub(crate) fn sent(&mut self, frame: Frame) {
        if let Some(at) = self.mailboxes.iter().position(|waiting| *waiting == frame) {
            self.mailboxes.remove(at);
        }
    }

    /// Forgets what it would send: bus-off.
    pub(crate) fn empty_mailboxes(&mut self) {
        self.mailboxes.clear();
    }

    /// Forgets everything: reset.
    pub(crate) fn clear(&mut self) {
        self.fifo.clear();
        self.mailboxes.clear();
    }
}
