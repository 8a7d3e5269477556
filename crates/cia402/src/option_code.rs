//! Option codes: how the axis slows down, and what it does at rest (0x605A, 0x605D, 0x605E).

use crate::configuration::Slowing;
use crate::{Configuration, Dialect, Mode};

/// How a stop slows down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Braking {
    /// On the slow-down ramp, 0x6084.
    SlowDownRamp,
    /// On the quick stop ramp, 0x6085.
    QuickStopRamp,
    /// On the current or the voltage limit: no ramp, the controllers brake with all they may use.
    Limit,
}

impl Braking {
    /// The ramp, if there is one; `mode` has ramps of its own or uses the profile's.
    pub(crate) fn slowing(self, configuration: &Configuration, mode: Mode) -> Option<Slowing> {
        match self {
            Braking::SlowDownRamp => Some(configuration.slow_down(mode)),
            Braking::QuickStopRamp => Some(configuration.quick_stop(mode)),
            Braking::Limit => None,
        }
    }

    /// The halt's (0x605D); codes that the standard does not know count as 1, its default.
    pub(crate) fn of_halt(configuration: &Configuration) -> Braking {
        match configuration.halt_option {
            2 => Braking::QuickStopRamp,
            3 | 4 => Braking::Limit,
            _ => Braking::SlowDownRamp,
        }
    }

    /// The fault reaction's (0x605E), `None` if it frees the motor; codes that the standard does
    /// not know count as 2, its default.
    pub(crate) fn of_fault(configuration: &Configuration) -> Option<Braking> {
        match configuration.fault_reaction_option {
            0 => None,
            1 => Some(Braking::SlowDownRamp),
            3 | 4 => Some(Braking::Limit),
            _ => Some(Braking::QuickStopRamp),
        }
    }
}

/// The quick stop option code (0x605A), as latched when the quick stop began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct QuickStopCode(i8);

impl QuickStopCode {
    /// The standard's default.
    pub(crate) const DEFAULT: QuickStopCode = QuickStopCode(2);

    pub(crate) fn of(configuration: &Configuration) -> QuickStopCode {
        match configuration.quick_stop_option {
            code @ 0..=8 => QuickStopCode(code),
            _ => QuickStopCode::DEFAULT,
        }
    }

    /// 5 to 8: the drive stays in quick stop active.
    pub(crate) fn stays(self) -> bool {
        self.0 >= 5
    }

    /// The motor is freed at once: code 0, or codes below 5 of a drive without ramps.
    pub(crate) fn frees(self, dialect: &Dialect) -> bool {
        self.0 == 0 || (!self.stays() && !dialect.ramps_on_stop)
    }

    pub(crate) fn braking(self) -> Braking {
        match self.0 {
            1 | 5 => Braking::SlowDownRamp,
            2 | 6 => Braking::QuickStopRamp,
            _ => Braking::Limit,
        }
    }
}
