//! Modes of operation (0x6060, 0x6061) and the set a drive offers (0x6502).

use core::fmt;

/// A mode of operation. Negative numbers are the maker's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Mode(pub i8);

impl Mode {
    /// No mode: operation enabled without torque.
    pub const IDLE: Mode = Mode(0);
    /// Profile position, PP.
    pub const PROFILE_POSITION: Mode = Mode(1);
    /// Velocity mode of frequency converters, VL.
    pub const VELOCITY: Mode = Mode(2);
    /// Profile velocity, PV.
    pub const PROFILE_VELOCITY: Mode = Mode(3);
    /// Profile torque, TQ.
    pub const PROFILE_TORQUE: Mode = Mode(4);
    /// Homing, HM.
    pub const HOMING: Mode = Mode(6);
    /// Interpolated position, IP.
    pub const INTERPOLATED_POSITION: Mode = Mode(7);
    /// Cyclic synchronous position, CSP.
    pub const CYCLIC_POSITION: Mode = Mode(8);
    /// Cyclic synchronous velocity, CSV.
    pub const CYCLIC_VELOCITY: Mode = Mode(9);
    /// Cyclic synchronous torque, CST.
    pub const CYCLIC_TORQUE: Mode = Mode(10);
    /// Cyclic synchronous torque with commutation angle, CSTCA.
    pub const CYCLIC_TORQUE_WITH_ANGLE: Mode = Mode(11);
    /// The P3's phase voltage with angle; reserved in CiA 402.
    pub const PHASE_VOLTAGE_WITH_ANGLE: Mode = Mode(12);

    /// The field's name, in lower case; `None` for reserved and makers' own modes.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self {
            Mode::IDLE => "idle",
            Mode::PROFILE_POSITION => "profile position",
            Mode::VELOCITY => "velocity",
            Mode::PROFILE_VELOCITY => "profile velocity",
            Mode::PROFILE_TORQUE => "profile torque",
            Mode::HOMING => "homing",
            Mode::INTERPOLATED_POSITION => "interpolated position",
            Mode::CYCLIC_POSITION => "cyclic position",
            Mode::CYCLIC_VELOCITY => "cyclic velocity",
            Mode::CYCLIC_TORQUE => "cyclic torque",
            Mode::CYCLIC_TORQUE_WITH_ANGLE => "cyclic torque with angle",
            Mode::PHASE_VOLTAGE_WITH_ANGLE => "phase voltage with angle",
            _ => return None,
        })
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => f.write_str(name),
            None => write!(f, "mode {}", self.0),
        }
    }
}

/// A set of modes, −16 to 15.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModeSet(u32);

impl ModeSet {
    /// No mode at all.
    pub const EMPTY: ModeSet = ModeSet(0);

    /// What [`crate::Axis`] can do. A dialect's set is cut to this.
    pub const IMPLEMENTED: ModeSet = ModeSet::EMPTY
        .with(Mode::IDLE)
        .with(Mode::PROFILE_POSITION)
        .with(Mode::VELOCITY)
        .with(Mode::PROFILE_VELOCITY)
        .with(Mode::PROFILE_TORQUE)
        .with(Mode::HOMING)
        .with(Mode::INTERPOLATED_POSITION)
        .with(Mode::CYCLIC_POSITION)
        .with(Mode::CYCLIC_VELOCITY)
        .with(Mode::CYCLIC_TORQUE)
        .with(Mode::CYCLIC_TORQUE_WITH_ANGLE)
        .with(Mode::PHASE_VOLTAGE_WITH_ANGLE);

    /// Modes 0 to 15 at their number, −1 to −16 at 16 to 31.
    const fn flag(mode: Mode) -> u32 {
        match mode.0 {
            n @ 0..=15 => 1 << n,
            n @ -16..=-1 => 1 << (15 - n),
            _ => 0,
        }
    }

    /// The set and one mode more. A mode outside −16 to 15 cannot be in a set.
    pub const fn with(self, mode: Mode) -> ModeSet {
        ModeSet(self.0 | ModeSet::flag(mode))
    }

    /// Whether `mode` is in the set.
    pub const fn contains(self, mode: Mode) -> bool {
        self.0 & ModeSet::flag(mode) != 0
    }

    /// The modes in both sets.
    pub const fn and(self, other: ModeSet) -> ModeSet {
        ModeSet(self.0 & other.0)
    }

    /// The modes in one set or the other.
    pub const fn or(self, other: ModeSet) -> ModeSet {
        ModeSet(self.0 | other.0)
    }

    /// The value of 0x6502: bit n − 1 for the standard mode n. Idle and the makers' own modes have
    /// no bit there.
    pub const fn supported_drive_modes(self) -> u32 {
        (self.0 >> 1) & 0x07EF
    }
}
