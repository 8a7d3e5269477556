//! Program control, 0x1F51 (CiA 302-3): which command is obeyed when.

use canopen::Abort;

/// What is written to 0x1F51.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// 0: the program stops.
    Stop,
    /// 1: the valid program starts.
    Start,
    /// 2: the stopped program begins anew when it is started.
    Reset,
    /// 3: the memory for a new program is cleared.
    Clear,
}

impl Command {
    /// The command `value`.
    ///
    /// # Errors
    /// [`Abort::INVALID_VALUE`]: reserved, or another manufacturer's.
    pub const fn from_value(value: u8) -> Result<Command, Abort> {
        match value {
            0 => Ok(Command::Stop),
            1 => Ok(Command::Start),
            2 => Ok(Command::Reset),
            3 => Ok(Command::Clear),
            _ => Err(Abort::INVALID_VALUE),
        }
    }
}

/// What the host has to do for a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    Nothing,
    /// Bring the drive to rest and keep its power stage off until the next start.
    Stop,
    /// Reset the node: the start that follows runs the newest valid program.
    Start,
    /// Call [`super::ProgramStore::erase_sector`] until it returns false.
    Clear,
}

/// Where a program store is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The program runs.
    Started,
    /// It does not; the memory for a new one is not clear.
    Stopped,
    /// The memory is being erased.
    Clearing,
    /// It is clear.
    Cleared,
    /// A program is coming.
    Receiving,
}

impl Phase {
    /// What 0x1F51 reads as: 0 stopped, 1 started, 3 no program (in the memory for a new one).
    pub(crate) const fn value(self) -> u8 {
        match self {
            Phase::Stopped | Phase::Clearing => 0,
            Phase::Started => 1,
            Phase::Cleared | Phase::Receiving => 3,
        }
    }

    /// What `command` does here and where it leads.
    ///
    /// # Errors
    /// [`Abort::DEVICE_STATE`] if it is not possible now.
    pub(crate) const fn obey(self, command: Command) -> Result<(Phase, Action), Abort> {
        Ok(match (self, command) {
            (Phase::Started, Command::Stop) => (Phase::Stopped, Action::Stop),
            (Phase::Started, Command::Start) => (Phase::Started, Action::Nothing),
            (Phase::Stopped, Command::Stop | Command::Reset) => (Phase::Stopped, Action::Nothing),
            (Phase::Stopped, Command::Clear) => (Phase::Clearing, Action::Clear),
            (Phase::Cleared, Command::Stop) => (Phase::Stopped, Action::Nothing),
            (Phase::Cleared, Command::Clear) => (Phase::Cleared, Action::Nothing),
            (Phase::Stopped | Phase::Cleared, Command::Start) => (Phase::Started, Action::Start),
            _ => return Err(Abort::DEVICE_STATE),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every phase and every command.
    #[test]
    fn which_command_is_obeyed_when() {
        use Action::{Clear, Nothing, Start, Stop};
        use Phase::{Cleared, Clearing, Receiving, Started, Stopped};
        const NO: Result<(Phase, Action), Abort> = Err(Abort::DEVICE_STATE);
        let to = |phase, action| Ok((phase, action));
        for (phase, reads, stop, start, reset, clear) in [
            (Started, 1, to(Stopped, Stop), to(Started, Nothing), NO, NO),
            (
                Stopped,
                0,
                to(Stopped, Nothing),
                to(Started, Start),
                to(Stopped, Nothing),
                to(Clearing, Clear),
            ),
            (Clearing, 0, NO, NO, NO, NO),
            (
                Cleared,
                3,
                to(Stopped, Nothing),
                to(Started, Start),
                NO,
                to(Cleared, Nothing),
            ),
            (Receiving, 3, NO, NO, NO, NO),
        ] {
            assert_eq!(phase.value(), reads);
            for (value, expected) in [stop, start, reset, clear].into_iter().enumerate() {
                let command = Command::from_value(value as u8).unwrap();
                assert_eq!(phase.obey(command), expected, "{phase:?}, {command:?}");
            }
        }
    }

    #[test]
    fn other_values_are_no_commands() {
        for value in 4..=u8::MAX {
            assert_eq!(Command::from_value(value), Err(Abort::INVALID_VALUE));
        }
    }
}
