//! The drive's side of program download.

use canopen::Abort;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::control::Phase;
use super::download::{Destination, Download};
use super::{Action, Bank, Banks, Command, Failure, Program};
use crate::flash::FlashError;

/// Takes a new program beside the one that runs (0x1F50 to 0x1F57, sub-index 1).
///
/// The order that CiA 302-3 asks for: stop (0x1F51 := 0), clear (:= 3), wait until bit 0 of 0x1F57
/// is 0, download to 0x1F50, look at 0x1F57 and 0x1F56, start (:= 1). The flash is passed into each
/// call; nothing is written but to the bank that does not run. Every abort that is returned is also
/// told by [`ProgramStore::status`].
#[derive(Clone, Copy, Debug)]
pub struct ProgramStore {
    banks: Banks,
    product: u32,
    running: Option<Program>,
    /// What the next start runs.
    valid: Option<Program>,
    phase: Phase,
    /// The next sector to be erased, in bytes from the start of the bank.
    erase_from: u32,
    /// While [`Phase::Receiving`].
    download: Option<Download>,
    failure: Option<Failure>,
}

impl ProgramStore {
    /// The store of a drive whose product code (0x1018,2) is `product`, just after a start: what
    /// runs is the newest valid program. Without one the store is stopped.
    ///
    /// # Errors
    /// [`FlashError`] if the flash cannot be read.
    pub fn open<F: ReadNorFlash>(
        flash: &mut F,
        banks: Banks,
        product: u32,
    ) -> Result<ProgramStore, FlashError> {
        let valid = banks.newest(flash)?;
        let (phase, failure) = match valid {
            Some(_) => (Phase::Started, None),
            None => (Phase::Stopped, Some(Failure::NoProgram)),
        };
        Ok(ProgramStore {
            banks,
            product,
            running: valid,
            valid,
            phase,
            erase_from: 0,
            download: None,
            failure,
        })
    }

    /// The program that runs since the start, or did until it was stopped.
    #[must_use]
    pub const fn running(&self) -> Option<&Program> {
        self.running.as_ref()
    }

    /// The program that the next start runs.
    #[must_use]
    pub const fn valid(&self) -> Option<&Program> {
        self.valid.as_ref()
    }

    /// Program control (0x1F51) as it reads: 0 stopped, 1 started, 3 memory cleared.
    #[must_use]
    pub const fn control_value(&self) -> u8 {
        self.phase.value()
    }

    /// Software identification (0x1F56): the checksum of the program that the next start runs, 0 if
    /// there is none.
    #[must_use]
    pub fn identification(&self) -> u32 {
        self.valid.map_or(0, |program| program.image.checksum)
    }

    /// Flash status (0x1F57): bit 0 while the memory is erased or a program comes; bits 1 to 7 the
    /// error code of CiA 302-3; bits 16 to 31 the reason, see [`Failure::status`].
    #[must_use]
    pub fn status(&self) -> u32 {
        match self.phase {
            Phase::Clearing | Phase::Receiving => 1,
            _ => self.failure.map_or(0, Failure::status),
        }
    }

    /// Why the last download or command did not succeed; `None` after one that did.
    #[must_use]
    pub const fn failure(&self) -> Option<Failure> {
        self.failure
    }

    /// The bank for a new program: never the one that runs.
    fn target(&self) -> Bank {
        self.running
            .map_or(Bank::First, |program| program.bank.other())
    }

    fn destination(&self) -> Destination {
        Destination {
            banks: self.banks,
            bank: self.target(),
            product: self.product,
        }
    }

    fn refuse<T>(&mut self, failure: Failure) -> Result<T, Abort> {
        self.failure = Some(failure);
        Err(failure.abort())
    }

    /// The bank is no longer clear, unless nothing was written yet.
    fn end_download<T>(&mut self, failure: Failure) -> Result<T, Abort> {
        let written = self.download.is_none_or(|download| download.has_written());
        self.download = None;
        self.phase = if written {
            Phase::Stopped
        } else {
            Phase::Cleared
        };
        self.refuse(failure)
    }

    /// Obeys a write of `value` to 0x1F51. Whether the drive may be stopped in its NMT state is the
    /// caller's to judge before.
    ///
    /// # Errors
    /// [`Abort::INVALID_VALUE`] for a value that is no command, [`Abort::DEVICE_STATE`] for one that
    /// is not possible now.
    pub fn control(&mut self, value: u8) -> Result<Action, Abort> {
        let (phase, action) = self.phase.obey(Command::from_value(value)?)?;
        match action {
            Action::Start if self.valid.is_none() => return self.refuse(Failure::NoProgram),
            Action::Clear => {
                // A program that waits in this bank is given up, and the one that runs is next.
                self.valid = self.running;
                self.erase_from = 0;
                self.failure = None;
            }
            Action::Nothing | Action::Stop | Action::Start => {}
        }
        self.phase = phase;
        Ok(action)
    }

    /// Erases one more sector after [`Action::Clear`]. Returns whether there are more; without
    /// anything to erase it does nothing.
    ///
    /// # Errors
    /// [`Abort::HARDWARE`]; the memory is not clear then.
    pub fn erase_sector<F: NorFlash>(&mut self, flash: &mut F) -> Result<bool, Abort> {
        if self.phase != Phase::Clearing {
            return Ok(false);
        }
        let region = self.banks.region(self.target());
        match region.erase_sector(flash, self.erase_from) {
            Ok(Some(next)) => {
                self.erase_from = next;
                Ok(true)
            }
            Ok(None) => {
                self.phase = Phase::Cleared;
                Ok(false)
            }
            Err(error) => {
                self.phase = Phase::Stopped;
                self.refuse(Failure::Flash(error))
            }
        }
    }

    /// A download to 0x1F50 begins, of `bytes` bytes if the client says how many.
    ///
    /// # Errors
    /// [`Abort::DEVICE_STATE`] if the memory is not clear or a download is on its way,
    /// [`Abort::TOO_LONG`] and [`Abort::TOO_SHORT`] for a size that no program has.
    pub fn begin(&mut self, bytes: Option<u32>) -> Result<(), Abort> {
        match self.phase {
            Phase::Cleared => {}
            Phase::Started | Phase::Stopped => return self.refuse(Failure::NotCleared),
            Phase::Clearing | Phase::Receiving => return Err(Abort::DEVICE_STATE),
        }
        match Download::new(bytes, self.banks.capacity()) {
            Ok(download) => {
                self.download = Some(download);
                self.phase = Phase::Receiving;
                self.failure = None;
                Ok(())
            }
            Err(failure) => self.refuse(failure),
        }
    }

    /// Takes `bytes`, any number, for place `at` of the download; the places follow each other.
    ///
    /// # Errors
    /// [`Failure::abort`] of what is wrong; the download has ended then, and the old program is as
    /// it was. [`Abort::DEVICE_STATE`] without a download.
    pub fn write<F: NorFlash>(
        &mut self,
        flash: &mut F,
        at: u32,
        bytes: &[u8],
    ) -> Result<(), Abort> {
        let to = self.destination();
        let Some(download) = &mut self.download else {
            return Err(Abort::DEVICE_STATE);
        };
        match download.take(flash, &to, at, bytes) {
            Ok(()) => Ok(()),
            Err(failure) => self.end_download(failure),
        }
    }

    /// The download has come to its end. The image is checked, read back and made the program that
    /// the next start runs. Reads the whole image.
    ///
    /// # Errors
    /// As [`ProgramStore::write`].
    pub fn finish<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), Abort> {
        let Some(mut download) = self.download else {
            return Err(Abort::DEVICE_STATE);
        };
        match self.settle(flash, &mut download) {
            Ok(program) => {
                self.download = None;
                self.phase = Phase::Stopped;
                self.valid = Some(program);
                Ok(())
            }
            Err(failure) => self.end_download(failure),
        }
    }

    fn settle<F: NorFlash>(
        &self,
        flash: &mut F,
        download: &mut Download,
    ) -> Result<Program, Failure> {
        let to = self.destination();
        let image = download.finish(flash, &to)?;
        if self.banks.image(flash, to.bank)? != Some(image) {
            return Err(Failure::NotKept);
        }
        let before = self.running.map_or(0, |program| program.sequence);
        let sequence = before.wrapping_add(1);
        let program = self.banks.commit(flash, to.bank, sequence, image)?;
        program.ok_or(Failure::NotKept)
    }

    /// The client has aborted the transfer, or it has timed out. Without a download it does nothing.
    pub fn abort(&mut self) {
        if let Some(download) = self.download {
            let received = download.received();
            let _: Result<(), Abort> = self.end_download(Failure::Aborted { received });
        }
    }
}
