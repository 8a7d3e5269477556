//! What lies outside the drive core and is lent to it for a call: data sheet and program memory.

use canopen::Abort;

use crate::program::Action;

/// What carries a drive, as far as the drive's objects reach into it. Passed into the drive's
/// functions, never stored. A host that has none of this is [`NoHost`].
pub trait Host {
    /// The electronic data sheet that 0x1021 hands out (CiA 301 7.5.2.24); empty if there is none.
    fn data_sheet(&self) -> &[u8] {
        &[]
    }

    /// The version of the program that runs, which 0x100A shows; empty if there is none.
    fn software_version(&self) -> &str {
        ""
    }

    /// What 0x1F51, 0x1F56 and 0x1F57 show.
    fn program(&self) -> ProgramState {
        ProgramState::default()
    }

    /// A write of `value` to 0x1F51. What it asks of the drive the drive does; erasing is the
    /// host's, in its own time.
    ///
    /// # Errors
    /// Why the command is not obeyed.
    fn control_program(&mut self, value: u8) -> Result<Action, Abort> {
        let _ = value;
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// A download to 0x1F50 begins, of `bytes` bytes if that was said.
    ///
    /// # Errors
    /// Why it is not taken.
    fn begin_program(&mut self, bytes: Option<u32>) -> Result<(), Abort> {
        let _ = bytes;
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// The next bytes of a download, from byte `at` on.
    ///
    /// # Errors
    /// Why it has ended.
    fn take_program(&mut self, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        let _ = (at, bytes);
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// The download is complete.
    ///
    /// # Errors
    /// Why the program is not one.
    fn finish_program(&mut self) -> Result<(), Abort> {
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// The download has ended before its end.
    fn abort_program(&mut self) {}

    /// Memory that a master may fill and read back, to try its transfers with; empty if there is
    /// none.
    fn scratch(&self) -> &[u8] {
        &[]
    }

    /// A download to that memory begins: it becomes empty.
    ///
    /// # Errors
    /// Why it is not taken: `bytes`, if that was said, are too many, or there is no such memory.
    fn clear_scratch(&mut self, bytes: Option<u32>) -> Result<(), Abort> {
        let _ = bytes;
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// Appends to that memory.
    ///
    /// # Errors
    /// [`Abort::OUT_OF_MEMORY`].
    fn append_scratch(&mut self, bytes: &[u8]) -> Result<(), Abort> {
        let _ = bytes;
        Err(Abort::OUT_OF_MEMORY)
    }
}

/// What a host's program memory shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProgramState {
    /// 0x1F51.
    pub control: u8,
    /// 0x1F56.
    pub identification: u32,
    /// 0x1F57.
    pub status: u32,
}

/// A host without data sheet and program memory.
#[derive(Clone, Copy, Debug)]
pub struct NoHost;

impl Host for NoHost {}
