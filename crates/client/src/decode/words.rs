//! What a drive's own document calls its objects and what their numbers mean.

use canopen::{Address, Table};
use cia402::Mode;

use super::emergency::emergency_text;

/// Names, types and units of one kind of drive. The default is a drive of which nothing is known: the
/// standards' names serve then.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveWords {
    /// Its dictionary.
    pub table: Option<Table>,
    /// Names of modes of operation (0x6060) where CiA 402 has others or none.
    pub modes: &'static [(i8, &'static str)],
    /// The mode of CiA 402 whose bits controlword and statusword have in a mode of the maker's own.
    pub mode_bits: &'static [(i8, Mode)],
    /// Names of bits of objects that are nothing but bits; of the error register, 0x1001, those that
    /// have another name than in CiA 301.
    pub bits: &'static [(Address, u8, &'static str)],
    /// Names of error codes where the standards have others.
    pub errors: &'static [(u16, &'static str)],
}

impl DriveWords {
    /// The name of a mode.
    pub fn mode(&self, mode: i8) -> String {
        match self.modes.iter().find(|(number, _)| *number == mode) {
            Some((_, name)) => (*name).to_owned(),
            None => Mode(mode).to_string(),
        }
    }

    /// The mode whose bits controlword and statusword have in `mode`.
    pub(super) fn bits_of(&self, mode: Mode) -> Mode {
        let own = self.mode_bits.iter().find(|(number, _)| *number == mode.0);
        own.map_or(mode, |(_, mode)| *mode)
    }

    /// An error code in words.
    pub(super) fn error(&self, code: u16) -> &'static str {
        let own = self.errors.iter().find(|(number, _)| *number == code);
        own.map_or_else(|| emergency_text(code), |(_, name)| name)
    }

    /// The name of a bit.
    pub fn bit(&self, object: Address, bit: u8) -> Option<&'static str> {
        let mut own = self.bits.iter();
        let own = own.find(|(of, number, _)| *of == object && *number == bit);
        own.map(|(_, _, name)| *name)
    }

    /// The set bits of an object by name, if it is one of bits.
    pub fn set_bits(&self, object: Address, raw: u32) -> Option<String> {
        if !self.bits.iter().any(|(of, _, _)| *of == object) {
            return None;
        }
        let set = (0..32).filter(|bit| raw >> bit & 1 == 1);
        let names = set.map(|bit| match self.bit(object, bit) {
            Some(name) => name.to_owned(),
            None => format!("bit {bit}"),
        });
        let names: Vec<String> = names.collect();
        Some(match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        })
    }
}
