//! Segmented transfers (CiA 301 7.2.4.3.4 and 7.2.4.3.7): each segment is confirmed, and a bit that
//! alternates tells it from the one before.
//!
//! A request whose answer did not come is not repeated. If only the answer was lost, the server
//! would take the request for the next one: it aborts if it looks at the toggle bit, and loses or
//! doubles seven bytes if it does not. So the transfer is begun anew if another attempt is allowed.

use super::initiate::bare;
use super::transfer::{Answer, Reaction, command_and};
use super::{Failure, Progress, Sink, Source};

/// Bytes in a segment.
pub(super) const SEGMENT: u8 = 7;

/// The toggle bit, and what came with the wrong one.
#[derive(Clone, Copy, Debug)]
struct Toggle {
    /// Of the segment under way.
    bit: bool,
    /// A frame came again. That may be the wire's doing (a CAN frame is repeated if its last bit
    /// was disturbed at its sender), or the server's bit does not alternate: the time will tell.
    is_doubtful: bool,
}

impl Toggle {
    const FIRST: Toggle = Toggle {
        bit: false,
        is_doubtful: false,
    };

    /// In bit 4.
    fn mask(self) -> u8 {
        u8::from(self.bit) << 4
    }

    /// Judges an answer's toggle bit; `None` if it is right.
    fn check(&mut self, answer: &Answer<'_>, offset: u32) -> Option<Reaction> {
        if answer.command() & 0x10 == self.mask() {
            return None;
        }
        if answer.is_repeated {
            self.is_doubtful = true;
            return Some(Reaction::Duplicate);
        }
        Some(Reaction::Failed(Failure::Toggle { offset }))
    }

    fn next(&mut self) {
        *self = Toggle {
            bit: !self.bit,
            is_doubtful: false,
        };
    }

    /// What it was if no right answer came.
    fn failure(self, offset: u32) -> Option<Failure> {
        self.is_doubtful.then_some(Failure::Toggle { offset })
    }
}

/// An upload in segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentedUpload {
    toggle: Toggle,
}

impl SegmentedUpload {
    pub(super) fn new() -> SegmentedUpload {
        SegmentedUpload {
            toggle: Toggle::FIRST,
        }
    }

    pub(super) fn request(&self) -> [u8; 8] {
        bare(0x60 | self.toggle.mask())
    }

    pub(super) fn receive(
        &mut self,
        answer: &Answer<'_>,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Reaction {
        let [command, data @ ..] = answer.frame.bytes();
        if command >> 5 != 0 {
            return answer.out_of_place();
        }
        if let Some(wrong) = self.toggle.check(answer, progress.done) {
            return wrong;
        }
        let used = SEGMENT.saturating_sub(command >> 1 & 7);
        if answer.frame.len() <= used {
            return Reaction::Stale;
        }
        let bytes = data.get(..usize::from(used)).unwrap_or(&[]);
        if let Err(failure) = progress.take(bytes, sink) {
            return Reaction::Failed(failure);
        }
        if command & 1 == 0 {
            self.toggle.next();
            return Reaction::Next;
        }
        match progress.complete(sink) {
            Ok(()) => Reaction::DONE,
            Err(failure) => Reaction::Failed(failure),
        }
    }

    pub(super) fn failure(&self, progress: &Progress) -> Option<Failure> {
        self.toggle.failure(progress.done)
    }
}

/// A download in segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentedDownload {
    toggle: Toggle,
}

impl SegmentedDownload {
    pub(super) fn new() -> SegmentedDownload {
        SegmentedDownload {
            toggle: Toggle::FIRST,
        }
    }

    /// The next segment.
    ///
    /// # Errors
    /// The source refuses.
    pub(super) fn request(
        &self,
        progress: &Progress,
        source: &mut impl Source,
    ) -> Result<[u8; 8], Failure> {
        let bytes = progress.total.unwrap_or(0);
        let (data, used, is_last) = segment(progress.done, bytes, source)?;
        let unused = SEGMENT.saturating_sub(used);
        let command = self.toggle.mask() | unused << 1 | u8::from(is_last);
        Ok(command_and(command, data))
    }

    pub(super) fn receive(&mut self, answer: &Answer<'_>, progress: &mut Progress) -> Reaction {
        if answer.command() >> 5 != 1 {
            return answer.out_of_place();
        }
        if let Some(wrong) = self.toggle.check(answer, progress.done) {
            return wrong;
        }
        let left = progress.total.unwrap_or(0).saturating_sub(progress.done);
        progress.done = progress.done.saturating_add(left.min(u32::from(SEGMENT)));
        if left <= u32::from(SEGMENT) {
            return Reaction::DONE;
        }
        self.toggle.next();
        Reaction::Next
    }

    pub(super) fn failure(&self, progress: &Progress) -> Option<Failure> {
        self.toggle.failure(progress.done)
    }
}

/// The data of the segment at `offset` of an object with `bytes` bytes, zero padded; how many of
/// them count; whether it is the last.
///
/// # Errors
/// The source refuses.
pub(super) fn segment(
    offset: u32,
    bytes: u32,
    source: &mut impl Source,
) -> Result<([u8; 7], u8, bool), Failure> {
    let left = bytes.saturating_sub(offset);
    let used = left.min(u32::from(SEGMENT)) as u8;
    let mut data = [0; 7];
    if used == SEGMENT {
        // A length that the source knows when it is compiled.
        source.give(offset, &mut data).map_err(Failure::Refused)?;
    } else if let Some(place) = data.get_mut(..usize::from(used))
        && !place.is_empty()
    {
        source.give(offset, place).map_err(Failure::Refused)?;
    }
    Ok((data, used, left <= u32::from(SEGMENT)))
}
