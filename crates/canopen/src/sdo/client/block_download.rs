//! Block download (CiA 301 7.2.4.3.9 to 7.2.4.3.11): the client sends a block of numbered segments,
//! the server says how many of them came in order, and the client goes on from there.
//!
//! After silence the block's last segment is sent again. If it had been lost, the server confirms
//! the block now. If it had not, and the confirmation was lost, the server expects number 1 and
//! takes nothing. A block of one segment is not sent again, because that has number 1 itself.

use super::block_upload::FRUITLESS;
use super::segmented::{SEGMENT, segment};
use super::transfer::{Answer, Lapse, Reaction, command_and};
use super::{Failure, Progress, Source, Stage};
use crate::sdo::crc::Crc16;

/// A block download.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockDownload {
    /// Of the object.
    bytes: u32,
    block_size: u8,
    /// Segments of this block that were sent. The block begins where [`Progress::done`] is.
    sent: u8,
    is_block_sent: bool,
    /// The block's last segment was sent twice.
    is_resent: bool,
    is_resending: bool,
    is_ending: bool,
    fruitless: u8,
    /// Whether both sides have a checksum.
    has_crc: bool,
    crc: Crc16,
    /// The checksum is that of the bytes before this offset. It does not go back with segments
    /// that are sent again, because they hold the same bytes.
    summed: u32,
}

impl BlockDownload {
    /// # Errors
    /// There is no such block size.
    pub(super) fn new(bytes: u32, block_size: u8, has_crc: bool) -> Result<BlockDownload, Failure> {
        Ok(BlockDownload {
            bytes,
            block_size: checked(block_size)?,
            sent: 0,
            is_block_sent: false,
            is_resent: false,
            is_resending: false,
            is_ending: false,
            fruitless: 0,
            has_crc,
            crc: Crc16::default(),
            summed: 0,
        })
    }

    pub(super) fn stage(&self) -> Stage {
        if self.is_ending {
            Stage::End
        } else {
            Stage::Block
        }
    }

    /// Whether the server has to speak before anything else can be sent.
    pub(super) fn waits(&self) -> bool {
        self.is_ending || self.is_block_sent
    }

    /// The next segment, or the end.
    ///
    /// # Errors
    /// The source refuses.
    pub(super) fn request(
        &mut self,
        progress: &Progress,
        source: &mut impl Source,
    ) -> Result<[u8; 8], Failure> {
        if self.is_ending {
            let sum = if self.has_crc { self.crc.get() } else { 0 };
            let [low, high] = sum.to_le_bytes();
            let command = 0xC1 | self.unused_at_end() << 2;
            return Ok(command_and(command, [low, high, 0, 0, 0, 0, 0]));
        }
        if !self.is_resending {
            self.sent = self.sent.saturating_add(1);
        }
        self.is_resending = false;
        let before = u32::from(self.sent.saturating_sub(1)) * u32::from(SEGMENT);
        let offset = progress.done.saturating_add(before);
        let (data, used, is_last) = segment(offset, self.bytes, source)?;
        let end = offset.saturating_add(u32::from(used));
        if end > self.summed {
            self.crc
                .update(data.get(..usize::from(used)).unwrap_or(&[]));
            self.summed = end;
        }
        self.is_block_sent = is_last || self.sent >= self.block_size;
        Ok(command_and(u8::from(is_last) << 7 | self.sent, data))
    }

    /// Bytes of the last segment that do not count. An object without bytes is one segment of
    /// which none counts.
    fn unused_at_end(&self) -> u8 {
        match (self.bytes, (self.bytes % u32::from(SEGMENT)) as u8) {
            (0, _) => SEGMENT,
            (_, 0) => 0,
            (_, used) => SEGMENT.saturating_sub(used),
        }
    }

    pub(super) fn receive(&mut self, answer: &Answer<'_>, progress: &mut Progress) -> Reaction {
        let [command, acknowledged, block_size, ..] = answer.frame.bytes();
        match (command >> 5, command & 3) {
            (5, 1) if self.is_ending => Reaction::DONE,
            (5, 2) if !self.is_ending && answer.frame.len() >= 3 => {
                self.acknowledged(acknowledged, block_size, progress)
            }
            _ => answer.out_of_place(),
        }
    }

    /// The server has so many segments of the block in order (CiA 301 7.2.4.3.10).
    fn acknowledged(&mut self, segments: u8, next: u8, progress: &mut Progress) -> Reaction {
        let wrong = Failure::Sequence {
            expected: self.sent,
            received: segments,
        };
        if segments > self.sent {
            return Reaction::Failed(wrong);
        }
        if segments == 0 && self.is_resent {
            // Of this block, or of the next one, because this one had arrived and the segment that
            // was sent again was not welcome?
            return Reaction::Restart;
        }
        let bytes = u32::from(segments) * u32::from(SEGMENT);
        let end = progress.done.saturating_add(bytes);
        progress.done = end.min(self.bytes);
        (self.is_resent, self.is_block_sent) = (false, false);
        if segments != 0 && end >= self.bytes {
            self.is_ending = true;
            return Reaction::Next;
        }
        self.fruitless = match segments {
            0 => self.fruitless.saturating_add(1),
            _ => 0,
        };
        if self.fruitless >= FRUITLESS {
            return Reaction::Failed(wrong);
        }
        match checked(next) {
            Ok(next) => {
                (self.block_size, self.sent) = (next, 0);
                Reaction::Next
            }
            Err(failure) => Reaction::Failed(failure),
        }
    }

    /// Nothing came for too long.
    pub(super) fn lapse(&mut self) -> Lapse {
        if self.is_ending {
            return Lapse::Repeat;
        }
        if self.sent < 2 {
            return Lapse::Restart;
        }
        (self.is_resending, self.is_resent) = (true, true);
        Lapse::Repeat
    }
}

fn checked(segments: u8) -> Result<u8, Failure> {
    match segments {
        1..=127 => Ok(segments),
        _ => Err(Failure::BlockSize { segments }),
    }
}
