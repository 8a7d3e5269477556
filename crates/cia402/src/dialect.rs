//! What drives do differently, as data.

use crate::ModeSet;

/// The differences between drives that the axis must know. Constant data of a personality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Bits 0 to 3 of the controlword are obeyed also when bit 7 is set, after the fault reset if
    /// there is one: 0x0086 leads from fault to ready to switch on in one write (P3 l.244). In the
    /// standard every other command needs bit 7 = 0.
    pub reset_and_command_in_one_write: bool,
    /// A mode other than 0 can be chosen in operation enabled only (P3 l.490).
    pub modes_only_when_enabled: bool,
    /// Entering operation enabled puts the drive into mode 0 (P3 l.488).
    pub mode_display_cleared_on_enable: bool,
    /// A quick stop decelerates, as do the reaction to a fault and the ways out of operation
    /// enabled, where their option codes say so. If not, quick stop option codes 0 to 4 free the
    /// motor at once, and 5 to 8 hold the position of that moment (P3 l.185, l.841); all else frees
    /// the motor.
    pub ramps_on_stop: bool,
    /// Controlword bit 8, halt, stops the axis in the modes 1, 2, 3, 4, 6 and 7, as 0x605D says. If not,
    /// the bit has no meaning (P3 l.149).
    pub halt_bit: bool,
    /// A target position that is written in mode 1 counts at once, as in mode 8: controlword bits 4 to
    /// 6 and 9 have no meaning, and statusword bit 12 stays 0 (M25). In the standard it waits for
    /// bit 4.
    pub set_points_at_once: bool,
    /// Makers' own modes in which the axis rests, like mode 0.
    pub resting_modes: ModeSet,
    /// Statusword bit 9 exists and is 1 (P3 has none, l.150).
    pub remote_bit: bool,
    /// The modes offered; those that the axis does not implement are left out.
    pub modes: ModeSet,
}

impl Dialect {
    /// Plain CiA 402 with every implemented mode.
    pub const STANDARD: Dialect = Dialect {
        reset_and_command_in_one_write: false,
        modes_only_when_enabled: false,
        mode_display_cleared_on_enable: false,
        ramps_on_stop: true,
        halt_bit: true,
        set_points_at_once: false,
        resting_modes: ModeSet::EMPTY,
        remote_bit: true,
        modes: ModeSet::IMPLEMENTED,
    };

    /// The modes that are offered and work.
    pub const fn modes(&self) -> ModeSet {
        self.modes.and(ModeSet::IMPLEMENTED.or(self.resting_modes))
    }

    /// The true value of 0x6502.
    pub const fn supported_drive_modes(&self) -> u32 {
        self.modes().supported_drive_modes()
    }
}
