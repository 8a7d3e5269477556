//! The bytes that a transfer has moved.

use super::{Failure, Progress, Sink};

impl Progress {
    /// Hands bytes that came to the sink.
    ///
    /// # Errors
    /// More than were indicated, or the sink refuses.
    pub(super) fn take(&mut self, bytes: &[u8], sink: &mut impl Sink) -> Result<(), Failure> {
        if bytes.is_empty() {
            return Ok(());
        }
        let added = u32::try_from(bytes.len()).ok();
        let sum = added.and_then(|added| self.done.checked_add(added));
        let limit = self.total.unwrap_or(u32::MAX);
        match sum {
            Some(sum) if sum <= limit => {
                sink.take(self.done, bytes).map_err(Failure::Refused)?;
                self.done = sum;
                Ok(())
            }
            _ => Err(Failure::Size {
                indicated: limit,
                received: sum.unwrap_or(u32::MAX),
            }),
        }
    }

    /// The server says that this was all.
    ///
    /// # Errors
    /// Fewer than were indicated, or the sink refuses.
    pub(super) fn complete(&self, sink: &mut impl Sink) -> Result<(), Failure> {
        match self.total {
            Some(total) if total != self.done => Err(Failure::Size {
                indicated: total,
                received: self.done,
            }),
            _ if self.done == 0 => sink.take(0, &[]).map_err(Failure::Refused),
            _ => Ok(()),
        }
    }
}
