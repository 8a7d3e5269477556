//! The statusword, object 0x6041.

use core::fmt;

use crate::{Mode, State};

/// The statusword: what the drive says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Statusword(pub u16);

impl Statusword {
    /// Bit 4: the motor supply is present.
    pub const VOLTAGE: u16 = 1 << 4;
    /// Bit 7: a warning is present.
    pub const WARNING: u16 = 1 << 7;
    /// Bit 9: the drive obeys the controlword.
    pub const REMOTE: u16 = 1 << 9;
    /// Bit 10: the target is reached.
    pub const TARGET_REACHED: u16 = 1 << 10;
    /// Bit 11: a limit holds the demand or the controllers back.
    pub const INTERNAL_LIMIT: u16 = 1 << 11;
    /// Bit 12: set-point acknowledge (1), speed is zero (3), homing attained (6), interpolation active
    /// (7), drive follows the command (8 to 10).
    pub const MODE_12: u16 = 1 << 12;
    /// Bit 13: following error (1, 8), homing error (6).
    pub const MODE_13: u16 = 1 << 13;

    /// Bit 14, the maker's: safe torque off is active.
    pub const TORQUE_OFF: u16 = 1 << 14;

    /// Bit `n`, 0 to 15; bits beyond are 0.
    pub const fn bit(self, n: u32) -> bool {
        n < 16 && (self.0 >> n) & 1 == 1
    }

    /// The state in bits 0 to 3, 5 and 6; `None` for a combination that means nothing.
    pub fn state(self) -> Option<State> {
        State::ALL
            .into_iter()
            .find(|state| self.0 & state.mask() == state.pattern())
    }

    /// Bit 4.
    pub const fn voltage(self) -> bool {
        self.bit(4)
    }

    /// Bit 7.
    pub const fn warning(self) -> bool {
        self.bit(7)
    }

    /// Bit 9.
    pub const fn remote(self) -> bool {
        self.bit(9)
    }

    /// Bit 10.
    pub const fn target_reached(self) -> bool {
        self.bit(10)
    }

    /// Bit 11.
    pub const fn internal_limit(self) -> bool {
        self.bit(11)
    }

    /// Bit 12 in profile position mode.
    pub const fn set_point_acknowledge(self) -> bool {
        self.bit(12)
    }

    /// Bit 12 in profile velocity mode.
    pub const fn speed_is_zero(self) -> bool {
        self.bit(12)
    }

    /// Bit 12 in interpolated position mode.
    pub const fn interpolates(self) -> bool {
        self.bit(12)
    }

    /// Bit 12 in the cyclic modes.
    pub const fn follows_command(self) -> bool {
        self.bit(12)
    }

    /// Bit 12 in homing mode.
    pub const fn homing_attained(self) -> bool {
        self.bit(12)
    }

    /// Bit 13 in homing mode.
    pub const fn homing_error(self) -> bool {
        self.bit(13)
    }

    /// Bit 13 in profile position and cyclic position mode.
    pub const fn following_error(self) -> bool {
        self.bit(13)
    }

    /// In words, with the mode-specific bits as `mode` uses them.
    pub const fn in_mode(self, mode: Mode) -> StatuswordInMode {
        StatuswordInMode {
            word: self,
            mode: Some(mode),
        }
    }
}

/// A statusword in words; see [`Statusword::in_mode`].
#[derive(Clone, Copy, Debug)]
pub struct StatuswordInMode {
    word: Statusword,
    mode: Option<Mode>,
}

/// What bits 12 and 13 say in a mode.
fn mode_bit(mode: Option<Mode>, n: u32) -> Option<&'static str> {
    match (mode?, n) {
        (Mode::PROFILE_POSITION, 12) => Some("set-point acknowledge"),
        (Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION, 13) => Some("following error"),
        (Mode::PROFILE_VELOCITY, 12) => Some("speed is zero"),
        (Mode::PROFILE_VELOCITY, 13) => Some("slippage"),
        (Mode::HOMING, 12) => Some("homing attained"),
        (Mode::HOMING, 13) => Some("homing error"),
        (Mode::INTERPOLATED_POSITION, 12) => Some("interpolation active"),
        (
            Mode::CYCLIC_POSITION
            | Mode::CYCLIC_VELOCITY
            | Mode::CYCLIC_TORQUE
            | Mode::CYCLIC_TORQUE_WITH_ANGLE,
            12,
        ) => Some("follows command"),
        _ => None,
    }
}

impl fmt::Display for StatuswordInMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.word.state() {
            Some(state) => f.write_str(state.name())?,
            None => write!(f, "no state (0x{:02X})", self.word.0 & 0x6F)?,
        }
        for n in [4, 7, 8, 9, 10, 11, 12, 13, 14, 15]
            .into_iter()
            .filter(|&n| self.word.bit(n))
        {
            let name = match n {
                4 => Some("voltage"),
                7 => Some("warning"),
                9 => Some("remote"),
                10 => Some("target reached"),
                11 => Some("internal limit"),
                _ => mode_bit(self.mode, n),
            };
            match name {
                Some(name) => write!(f, ", {name}")?,
                None => write!(f, ", bit {n}")?,
            }
        }
        Ok(())
    }
}

/// In words; mode-specific bits by number.
impl fmt::Display for Statusword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        StatuswordInMode {
            word: *self,
            mode: None,
        }
        .fmt(f)
    }
}
