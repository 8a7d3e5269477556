//! Block upload (CiA 301 7.2.4.3.12 to 7.2.4.3.15): the server sends a block of numbered segments,
//! the client says how many of them came in order, and the server goes on from there.
//!
//! After silence it depends on what came of the block. If anything did, the confirmation of the
//! block before it has arrived, and what came in order is confirmed. If nothing did, either that
//! confirmation was lost, and has to be repeated, or the whole block, and then the server takes
//! the repetition for the confirmation of segments that never came. The client cannot know, so it
//! repeats only if the size was indicated: bytes that are missing show at the end.

use super::initiate::bare;
use super::segmented::SEGMENT;
use super::transfer::{Answer, Lapse, Reaction, command_and};
use super::{Failure, Progress, Sink, Stage};
use crate::sdo::crc::Crc16;

/// How many blocks in a row may bring nothing that can be used.
pub(super) const FRUITLESS: u8 = 8;

/// What is sent next, or was sent last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sends {
    Start,
    /// So many segments of the block came in order.
    Acknowledge(u8),
}

/// A block upload.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockUpload {
    block_size: u8,
    /// The checksum of what went to the sink, if both sides have one.
    crc: Option<Crc16>,
    sends: Sends,
    /// Segments of this block that came in order.
    good: u8,
    /// Whether any segment of this block came.
    any: bool,
    /// The segment that came last in order. Not given to the sink before another follows, because
    /// only the end says how many bytes of the last segment count.
    held: Option<[u8; 7]>,
    /// The last segment has come: the end is missing.
    is_ending: bool,
    /// So many segments were confirmed because of a pause, and nothing has come since.
    confirmed_in_pause: Option<u8>,
    fruitless: u8,
}

impl BlockUpload {
    pub(super) fn new(block_size: u8, crc: bool) -> BlockUpload {
        BlockUpload {
            block_size,
            crc: crc.then(Crc16::default),
            sends: Sends::Start,
            good: 0,
            any: false,
            held: None,
            is_ending: false,
            confirmed_in_pause: None,
            fruitless: 0,
        }
    }

    pub(super) fn stage(&self) -> Stage {
        if self.is_ending {
            Stage::End
        } else {
            Stage::Block
        }
    }

    /// What is to be sent now; a block begins with it.
    pub(super) fn request(&mut self) -> [u8; 8] {
        (self.good, self.any) = (0, false);
        match self.sends {
            Sends::Start => bare(0xA3),
            Sends::Acknowledge(good) => command_and(0xA2, [good, self.block_size, 0, 0, 0, 0, 0]),
        }
    }

    pub(super) fn receive(
        &mut self,
        answer: &Answer<'_>,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Reaction {
        if answer.frame.len() < 8 {
            return Reaction::Stale;
        }
        let [first, data @ ..] = answer.frame.bytes();
        if self.is_ending {
            return self.end(answer, progress, sink);
        }
        let (number, is_last) = (first & 0x7F, first & 0x80 != 0);
        if number != 0 && Some(number) == self.good.checked_add(1) {
            if let Err(failure) = self.pass_on(SEGMENT, progress, sink) {
                return Reaction::Failed(failure);
            }
            self.held = Some(data);
            (self.good, self.any) = (number, true);
            self.confirmed_in_pause = None;
            self.is_ending = is_last;
        } else if answer.is_repeated || (number != 0 && number <= self.good) {
            return Reaction::Duplicate;
        } else if number == 0 || number > self.block_size || self.goes_on(number) {
            return Reaction::Failed(self.wrong(number));
        } else {
            // Segments are missing before this one. It is confirmed what came before the gap, when
            // the block is over.
            self.any = true;
        }
        if !is_last && number != self.block_size {
            return Reaction::More;
        }
        match self.acknowledge() {
            true => Reaction::Next,
            false => Reaction::Failed(self.wrong(number)),
        }
    }

    /// Whether a block that was taken for ended goes on: nobody knows then what was confirmed.
    fn goes_on(&self, number: u8) -> bool {
        let confirmed = self.confirmed_in_pause.filter(|_| !self.any);
        confirmed
            .is_some_and(|confirmed| confirmed != 0 && Some(number) == confirmed.checked_add(1))
    }

    fn wrong(&self, number: u8) -> Failure {
        Failure::Sequence {
            expected: self.good.saturating_add(1),
            received: number,
        }
    }

    /// Confirms what came in order; false if that was nothing too often.
    fn acknowledge(&mut self) -> bool {
        self.sends = Sends::Acknowledge(self.good);
        self.fruitless = match self.good {
            0 => self.fruitless.saturating_add(1),
            _ => 0,
        };
        self.fruitless < FRUITLESS
    }

    /// Gives `used` bytes of the held segment, if there is one, to the sink.
    fn pass_on(
        &mut self,
        used: u8,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Result<(), Failure> {
        let Some(held) = self.held.take() else {
            return Ok(());
        };
        let bytes = held.get(..usize::from(used)).unwrap_or(&[]);
        if let Some(crc) = &mut self.crc {
            crc.update(bytes);
        }
        progress.take(bytes, sink)
    }

    /// The end of the transfer (CiA 301 7.2.4.3.15).
    fn end(
        &mut self,
        answer: &Answer<'_>,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Reaction {
        let [command, low, high, ..] = answer.frame.bytes();
        if answer.is_repeated {
            return Reaction::Duplicate;
        }
        if command >> 5 != 6 || command & 1 == 0 {
            return Reaction::Failed(Failure::Command { command });
        }
        let used = SEGMENT.saturating_sub(command >> 2 & 7);
        if let Err(failure) = self.pass_on(used, progress, sink) {
            return Reaction::Failed(failure);
        }
        let received = u16::from_le_bytes([low, high]);
        if let Some(crc) = self.crc
            && crc.get() != received
        {
            return Reaction::Failed(Failure::Crc {
                computed: crc.get(),
                received,
            });
        }
        match progress.complete(sink) {
            Ok(()) => Reaction::Done {
                parting: Some(bare(0xA1)),
                is_sized: true,
            },
            Err(failure) => Reaction::Failed(failure),
        }
    }

    /// Nothing came for too long.
    pub(super) fn lapse(&mut self, progress: &Progress) -> Lapse {
        if self.any && !self.is_ending {
            self.confirmed_in_pause = Some(self.good);
            return match self.acknowledge() {
                true => Lapse::GoOn,
                false => Lapse::Repeat,
            };
        }
        match self.sends {
            // If it had arrived, it is unknown in that state, and the server says so.
            Sends::Start => Lapse::Repeat,
            Sends::Acknowledge(_) if self.is_ending => Lapse::Repeat,
            Sends::Acknowledge(_) if progress.total.is_some() => Lapse::Repeat,
            Sends::Acknowledge(_) => Lapse::Restart,
        }
    }
}
