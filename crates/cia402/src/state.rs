//! The states of the drive and the transitions the controlword commands.

use crate::{Command, Controlword, Dialect};

/// States of the drive function (power drive system, CiA 402 "PDS FSA").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum State {
    /// Starting up, self-test.
    NotReadyToSwitchOn,
    /// Ready for configuration; the motor is free.
    SwitchOnDisabled,
    /// High voltage may be applied; the motor is free.
    ReadyToSwitchOn,
    /// High voltage is applied; the motor is free.
    SwitchedOn,
    /// The drive follows its set-points.
    OperationEnabled,
    /// The drive stops, or has stopped and holds.
    QuickStopActive,
    /// A fault was noticed; the drive reacts to it.
    FaultReactionActive,
    /// The motor is free until the fault is reset.
    Fault,
}

/// What one write of the controlword did to the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The state after it.
    pub state: State,
    /// Whether transition 15 was taken on the way.
    pub fault_reset: bool,
}

impl State {
    /// All states.
    pub const ALL: [State; 8] = [
        State::NotReadyToSwitchOn,
        State::SwitchOnDisabled,
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
        State::QuickStopActive,
        State::FaultReactionActive,
        State::Fault,
    ];

    /// The statusword's state bits: 0 to 3, 5 and 6. Bits that the standard leaves open are 0.
    pub const fn pattern(self) -> u16 {
        match self {
            State::NotReadyToSwitchOn => 0x00,
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReactionActive => 0x0F,
            State::Fault => 0x08,
        }
    }

    /// Which statusword bits tell this state; bit 5 is left open in some.
    pub const fn mask(self) -> u16 {
        match self {
            State::NotReadyToSwitchOn
            | State::SwitchOnDisabled
            | State::FaultReactionActive
            | State::Fault => 0x4F,
            _ => 0x6F,
        }
    }

    /// The field's name, in lower case.
    pub const fn name(self) -> &'static str {
        match self {
            State::NotReadyToSwitchOn => "not ready to switch on",
            State::SwitchOnDisabled => "switch on disabled",
            State::ReadyToSwitchOn => "ready to switch on",
            State::SwitchedOn => "switched on",
            State::OperationEnabled => "operation enabled",
            State::QuickStopActive => "quick stop active",
            State::FaultReactionActive => "fault reaction active",
            State::Fault => "fault",
        }
    }

    /// The state after a command; `stays` says whether the quick stop option code (0x605A) is one
    /// of 5 to 8, without which transition 16 does not exist.
    pub const fn after(self, command: Command, stays: bool) -> State {
        use Command::*;
        use State::*;
        match (self, command) {
            (SwitchOnDisabled, Shutdown) => ReadyToSwitchOn, // 2
            (ReadyToSwitchOn, SwitchOn) => SwitchedOn,       // 3
            (ReadyToSwitchOn, EnableOperation) => OperationEnabled, // 3 and 4
            (ReadyToSwitchOn, DisableVoltage | QuickStop) => SwitchOnDisabled, // 7
            (SwitchedOn, EnableOperation) => OperationEnabled, // 4
            (SwitchedOn, Shutdown) => ReadyToSwitchOn,       // 6
            (SwitchedOn, DisableVoltage | QuickStop) => SwitchOnDisabled, // 10
            (OperationEnabled, SwitchOn) => SwitchedOn,      // 5, "disable operation"
            (OperationEnabled, Shutdown) => ReadyToSwitchOn, // 8
            (OperationEnabled, DisableVoltage) => SwitchOnDisabled, // 9
            (OperationEnabled, QuickStop) => QuickStopActive, // 11
            (QuickStopActive, DisableVoltage) => SwitchOnDisabled, // 12
            (QuickStopActive, EnableOperation) if stays => OperationEnabled, // 16
            _ => self,
        }
    }

    /// The state after a controlword is written. The transitions that need no command (0, 1, 13,
    /// 14 and the end of a quick stop) are not here; see [`crate::Axis`].
    pub const fn written(
        self,
        previous: Controlword,
        word: Controlword,
        stays: bool,
        dialect: &Dialect,
    ) -> Step {
        let edge = word.fault_reset() && !previous.fault_reset();
        let fault_reset = matches!(self, State::Fault) && edge; // 15
        let state = if fault_reset {
            State::SwitchOnDisabled
        } else {
            self
        };
        // All commands but the reset have bit 7 = 0 in CiA 402; some drives do not look at it.
        let command = if word.fault_reset() && !dialect.reset_and_command_in_one_write {
            None
        } else {
            Some(word.command())
        };
        match command {
            Some(command) => Step {
                state: state.after(command, stays),
                fault_reset,
            },
            None => Step { state, fault_reset },
        }
    }
}

impl core::fmt::Display for State {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
