//! A drive's CAN controller: receive FIFO and transmit mailboxes.

use std::collections::VecDeque;

use can::{BitRate, Frame};
use canopen::Instant;

/// Frames that the receive FIFO holds.
const FIFO_FRAMES: usize = 16;
/// Transmit mailboxes.
const MAILBOXES: usize = 3;

/// The controller between a drive's processor and the medium.
#[derive(Debug)]
pub(crate) struct Controller {
    bit_rate: BitRate,
    /// Since when it has it.
    tuned_at: Instant,
    /// It sends nothing, whatever waits.
    silent: bool,
    fifo: VecDeque<Frame>,
    mailboxes: Vec<Frame>,
}

impl Controller {
    /// One that has this bit rate from the start.
    pub(crate) fn new(bit_rate: BitRate) -> Controller {
        Controller {
            bit_rate,
            tuned_at: Instant::ZERO,
            silent: false,
            fifo: VecDeque::with_capacity(FIFO_FRAMES),
            mailboxes: Vec::with_capacity(MAILBOXES),
        }
    }

    /// Its bit rate.
    pub(crate) fn bit_rate(&self) -> BitRate {
        self.bit_rate
    }

    /// Gives it another bit rate, which makes it forget everything.
    pub(crate) fn tune(&mut self, bit_rate: BitRate, now: Instant) {
        if bit_rate != self.bit_rate {
            self.bit_rate = bit_rate;
            self.tuned_at = now;
        }
        self.clear();
    }

    /// Whether it hears a frame of this bit rate that began then.
    pub(crate) fn follows(&self, bit_rate: BitRate, began: Instant) -> bool {
        self.bit_rate == bit_rate && self.tuned_at <= began
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
        }
        fits
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

    /// Forgets everything: reset or bus-off.
    pub(crate) fn clear(&mut self) {
        self.fifo.clear();
        self.mailboxes.clear();
    }
}
