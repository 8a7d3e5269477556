//! What a drive's document calls what numbers mean.

use canopen::Address;
use cia402::Mode;

/// Names of numbers, where the standards have others or none.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    /// Modes of operation (0x6060).
    pub modes: &'static [(i8, &'static str)],
    /// The mode of CiA 402 whose bits controlword and statusword have in a mode of the maker's own.
    pub mode_bits: &'static [(i8, Mode)],
    /// Bits of objects: which object, which bit, its name. The error register counts in emergencies, too.
    pub bits: &'static [(Address, u8, &'static str)],
    /// Error codes of emergencies and 0x603F.
    pub errors: &'static [(u16, &'static str)],
}

impl Words {
    /// All as the standards have it.
    pub const STANDARD: Words = Words {
        modes: &[],
        mode_bits: &[],
        bits: &[],
        errors: &[],
    };
}
