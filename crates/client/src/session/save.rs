//! Saving what was found, entry by entry.

use std::fmt;

use canopen::NodeId;

use super::{Cause, Change, SAVE_ENTRY, Session, Watch};
use crate::Link;

/// How long a drive may take to save an entry.
const SAVE_MS: u64 = 2_000;

/// A drive did not save all of what was found: what is saved, and what is not.
#[derive(Clone, Debug, PartialEq)]
pub struct SaveError {
    /// Which drive.
    pub node: NodeId,
    /// Why the first one of `unsaved` is not saved.
    pub cause: Cause,
    /// What the drive has saved before.
    pub saved: Vec<Change>,
    /// What it has not saved. The drive works with these values until its next reset.
    pub unsaved: Vec<Change>,
}

impl SaveError {
    /// Whether the first one of `unsaved` may be saved nevertheless: the drive has not said no.
    pub fn is_unsure(&self) -> bool {
        !self.cause.is_refusal()
    }
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt_of(self.node, f)?;
        let (unsure, unsaved) = self
            .unsaved
            .split_at(usize::from(self.is_unsure()).min(self.unsaved.len()));
        for (what, changes) in [
            ("saved", self.saved.as_slice()),
            ("perhaps saved", unsure),
            ("not saved", unsaved),
        ] {
            for (place, Change { object, .. }) in changes.iter().enumerate() {
                match place {
                    0 => write!(f, "; {what}: ")?,
                    _ => f.write_str(", ")?,
                }
                write!(f, "{} ({})", object.address, object.name)?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for SaveError {}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Lets the drive save what was found, entry by entry (0x1010,4); gives it.
    ///
    /// # Errors
    /// The drive did not save an entry. [`SaveError`] says which are saved; the others keep their new
    /// values in the drive's memory and stay in [`Session::found`].
    pub async fn save(&mut self) -> Result<Vec<Change>, SaveError> {
        let mut saved = Vec::new();
        let before = self.client.settings.answer_ms;
        // Writing into a flash takes its time.
        self.client.settings.answer_ms = before.max(SAVE_MS);
        let mut failed = None;
        while let Some(change) = self.found.first().copied() {
            let done = self.write_anyway(SAVE_ENTRY, change.object.entry()).await;
            if let Err(cause) = done {
                failed = Some(cause);
                break;
            }
            saved.push(self.found.remove(0));
        }
        self.client.settings.answer_ms = before;
        match failed {
            None => Ok(saved),
            Some(cause) => Err(SaveError {
                node: self.node,
                cause,
                saved,
                unsaved: self.found.clone(),
            }),
        }
    }
}
