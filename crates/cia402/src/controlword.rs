//! The controlword, object 0x6040.

use core::fmt;

use crate::Mode;

/// The controlword: what the master wants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Controlword(pub u16);

/// The command in bits 0 to 3. Every combination of them is one of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Command {
    /// `x110`
    Shutdown,
    /// `0111`; in operation enabled the same bits say "disable operation".
    SwitchOn,
    /// `1111`; in ready to switch on it switches on first.
    EnableOperation,
    /// `xx0x`
    DisableVoltage,
    /// `x01x`
    QuickStop,
}

impl Command {
    /// The field's name, in lower case.
    pub const fn name(self) -> &'static str {
        match self {
            Command::Shutdown => "shutdown",
            Command::SwitchOn => "switch on",
            Command::EnableOperation => "enable operation",
            Command::DisableVoltage => "disable voltage",
            Command::QuickStop => "quick stop",
        }
    }
}

impl Controlword {
    /// Bit `n`, 0 to 15; bits beyond are 0.
    pub const fn bit(self, n: u32) -> bool {
        n < 16 && (self.0 >> n) & 1 == 1
    }

    /// The command in bits 0 to 3, without regard to bit 7.
    pub const fn command(self) -> Command {
        match (self.bit(3), self.bit(2), self.bit(1), self.bit(0)) {
            (_, _, false, _) => Command::DisableVoltage,
            (_, false, true, _) => Command::QuickStop,
            (_, true, true, false) => Command::Shutdown,
            (false, true, true, true) => Command::SwitchOn,
            (true, true, true, true) => Command::EnableOperation,
        }
    }

    /// Bit 7; only its rising edge acts.
    pub const fn fault_reset(self) -> bool {
        self.bit(7)
    }

    /// Bit 4 in profile position mode: a rising edge hands over a set-point.
    pub const fn new_set_point(self) -> bool {
        self.bit(4)
    }

    /// Bit 4 in interpolated position mode: set-points are taken from the buffer.
    pub const fn enables_interpolation(self) -> bool {
        self.bit(4)
    }

    /// Bit 4 in homing mode: 1 starts, 0 interrupts.
    pub const fn start_homing(self) -> bool {
        self.bit(4)
    }

    /// Bit 5 in profile position mode: leave the present set-point at once.
    pub const fn change_immediately(self) -> bool {
        self.bit(5)
    }

    /// Bit 6 in profile position mode: the target is relative to the preceding target.
    pub const fn relative(self) -> bool {
        self.bit(6)
    }

    /// Bit 8.
    pub const fn halt(self) -> bool {
        self.bit(8)
    }

    /// Bit 9 in profile position mode: pass the present set-point without stopping.
    pub const fn change_on_set_point(self) -> bool {
        self.bit(9)
    }

    /// In words, with the mode-specific bits as `mode` uses them.
    pub const fn in_mode(self, mode: Mode) -> ControlwordInMode {
        ControlwordInMode {
            word: self,
            mode: Some(mode),
        }
    }
}

/// A controlword in words; see [`Controlword::in_mode`].
#[derive(Clone, Copy, Debug)]
pub struct ControlwordInMode {
    word: Controlword,
    mode: Option<Mode>,
}

/// What bit `n` (4, 5, 6, 9) says in a mode.
fn mode_bit(mode: Option<Mode>, n: u32) -> Option<&'static str> {
    match (mode?, n) {
        (Mode::PROFILE_POSITION, 4) => Some("new set-point"),
        (Mode::PROFILE_POSITION, 5) => Some("change immediately"),
        (Mode::PROFILE_POSITION, 6) => Some("relative"),
        (Mode::PROFILE_POSITION, 9) => Some("change on set-point"),
        (Mode::VELOCITY, 4) => Some("enable ramp"),
        (Mode::VELOCITY, 5) => Some("unlock ramp"),
        (Mode::VELOCITY, 6) => Some("reference ramp"),
        (Mode::HOMING, 4) => Some("start homing"),
        (Mode::INTERPOLATED_POSITION, 4) => Some("enable interpolation"),
        _ => None,
    }
}

impl fmt::Display for ControlwordInMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word.command().name())?;
        for n in (4..16).filter(|&n| self.word.bit(n)) {
            match (n, mode_bit(self.mode, n)) {
                (7, _) => f.write_str(", fault reset")?,
                (8, _) => f.write_str(", halt")?,
                (_, Some(name)) => write!(f, ", {name}")?,
                (n, None) => write!(f, ", bit {n}")?,
            }
        }
        Ok(())
    }
}

/// In words; mode-specific bits by number.
impl fmt::Display for Controlword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        ControlwordInMode {
            word: *self,
            mode: None,
        }
        .fmt(f)
    }
}
