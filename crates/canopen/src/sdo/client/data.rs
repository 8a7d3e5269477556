//! Where the bytes of a transfer come from and go to: passed into each call, never stored.

use crate::Abort;

/// Takes the bytes of an upload.
pub trait Sink {
    /// Takes `bytes`, which stand at `offset` in the object. They come in order and without gaps.
    /// A call with offset 0 begins anew (the transfer was repeated): what came before is void. An
    /// object without bytes gives one call with offset 0 and no bytes.
    ///
    /// # Errors
    /// The transfer is aborted with this code.
    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Abort>;
}

/// Gives the bytes of a download.
pub trait Source {
    /// Fills `bytes` with what stands at `offset` in the object. Asked again for the same bytes
    /// when segments were lost, and must give the same.
    ///
    /// # Errors
    /// The transfer is aborted with this code.
    fn give(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Abort>;
}

impl<F: FnMut(u32, &[u8]) -> Result<(), Abort>> Sink for F {
    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Abort> {
        self(offset, bytes)
    }
}

impl Source for &[u8] {
    fn give(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Abort> {
        let begin = usize::try_from(offset).map_err(|_| Abort::GENERAL)?;
        let end = begin.checked_add(bytes.len()).ok_or(Abort::GENERAL)?;
        bytes.copy_from_slice(self.get(begin..end).ok_or(Abort::GENERAL)?);
        Ok(())
    }
}

/// For the calls of a transfer that goes the other way: refuses all bytes.
#[derive(Clone, Copy, Debug)]
pub struct NoData;

impl Sink for NoData {
    fn take(&mut self, _: u32, _: &[u8]) -> Result<(), Abort> {
        Err(Abort::GENERAL)
    }
}

impl Source for NoData {
    fn give(&mut self, _: u32, _: &mut [u8]) -> Result<(), Abort> {
        Err(Abort::GENERAL)
    }
}
