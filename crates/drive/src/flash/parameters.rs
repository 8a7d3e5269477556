//! Parameters in two slots that are written in turn.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::slot::{self, Set, Slot, SlotState};
use super::{FlashError, LayoutError, Region};

/// Where a drive keeps its parameters (0x1010, 0x1011, LSS): two slots of a flash. What a set means
/// is not known here; a drive's is the bytes of [`canopen::store`].
///
/// A save goes into the slot that does not hold the newest set, so at whatever byte the power fails
/// the next start finds the set before or the new one, whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterFlash {
    first: Region,
    second: Region,
}

/// What [`ParameterFlash::load`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// The newest whole set; `None` if nothing was ever stored.
    pub set: Option<Set>,
    /// What the other slot holds. [`SlotState::Broken`] is a save that the power cut short, or
    /// damage.
    pub other: SlotState,
    /// The other slot held a newer set, stored to the end, and is damaged now: `set` is the one
    /// before it. A power cut alone never makes this true.
    pub lost: bool,
}

/// Why there is no set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadError {
    /// There were sets, and none of them is whole.
    Damaged,
    /// The buffer is too small for the set.
    Full {
        /// Bytes of the set.
        bytes: u32,
        /// Bytes that the buffer has.
        capacity: u32,
    },
    /// The flash cannot be read.
    Flash(FlashError),
}

impl core::fmt::Display for LoadError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            LoadError::Damaged => f.write_str("neither slot holds a whole set of parameters"),
            LoadError::Full { bytes, capacity } => {
                write!(f, "a set of {bytes} bytes for a buffer of {capacity}")
            }
            LoadError::Flash(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for LoadError {}

impl From<FlashError> for LoadError {
    fn from(error: FlashError) -> LoadError {
        LoadError::Flash(error)
    }
}

/// Why a set was not stored. The one before still is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// It is longer than a slot.
    TooLong {
        /// Bytes of the set.
        bytes: usize,
        /// Bytes that a slot takes.
        capacity: u32,
    },
    /// It was written and does not read back.
    NotKept(Slot),
    /// The flash refuses.
    Flash(FlashError),
}

impl core::fmt::Display for SaveError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            SaveError::TooLong { bytes, capacity } => {
                write!(f, "a set of {bytes} bytes for a slot of {capacity}")
            }
            SaveError::NotKept(slot) => {
                write!(f, "the {slot:?} slot does not read back as written")
            }
            SaveError::Flash(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SaveError {}

impl From<FlashError> for SaveError {
    fn from(error: FlashError) -> SaveError {
        SaveError::Flash(error)
    }
}

impl ParameterFlash {
    /// Slots in `first` and `second` of `flash`.
    ///
    /// # Errors
    /// [`LayoutError`].
    pub fn new<F: NorFlash>(
        first: Region,
        second: Region,
        flash: &F,
    ) -> Result<ParameterFlash, LayoutError> {
        Region::check(&[first, second], flash)?;
        Ok(ParameterFlash { first, second })
    }

    /// The longest set that can be stored, bytes.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        let (first, second) = (slot::capacity(self.first), slot::capacity(self.second));
        if first < second { first } else { second }
    }

    const fn region(&self, slot: Slot) -> Region {
        match slot {
            Slot::First => self.first,
            Slot::Second => self.second,
        }
    }

    /// Where the bytes of `set` are, without its header.
    #[must_use]
    pub const fn body(&self, set: &Set) -> Region {
        slot::body(self.region(set.slot), set.bytes)
    }

    /// What `slot` holds. Reads all of the slot at most.
    ///
    /// # Errors
    /// [`FlashError`] if the flash cannot be read.
    pub fn look<F: ReadNorFlash>(
        &self,
        flash: &mut F,
        slot: Slot,
    ) -> Result<SlotState, FlashError> {
        slot::look(flash, slot, self.region(slot))
    }

    /// Finds the newest whole set without reading it out.
    ///
    /// # Errors
    /// [`LoadError::Damaged`], [`LoadError::Flash`].
    pub fn find<F: ReadNorFlash>(&self, flash: &mut F) -> Result<Loaded, LoadError> {
        let first = self.look(flash, Slot::First)?;
        let second = self.look(flash, Slot::Second)?;
        let (set, other) = match (first.set(), second.set()) {
            (Some(set), Some(later)) if later.is_after(&set) => (Some(later), first),
            (Some(set), _) => (Some(set), second),
            (None, Some(set)) => (Some(set), first),
            (None, None) if first == SlotState::Formatting => (None, second),
            (None, None) if first == SlotState::Blank && second == first => (None, second),
            (None, None) => return Err(LoadError::Damaged),
        };
        let lost = match set {
            Some(set) if other == SlotState::Broken => {
                slot::is_marked(flash, self.region(set.slot))?
            }
            _ => false,
        };
        Ok(Loaded { set, other, lost })
    }

    /// Reads the newest whole set into `out`.
    ///
    /// # Errors
    /// [`LoadError`]; a drive then starts on its defaults and says so.
    pub fn load<F: ReadNorFlash>(
        &self,
        flash: &mut F,
        out: &mut [u8],
    ) -> Result<Loaded, LoadError> {
        let loaded = self.find(flash)?;
        let Some(set) = loaded.set else {
            return Ok(loaded);
        };
        let full = LoadError::Full {
            bytes: set.bytes,
            capacity: out.len() as u32,
        };
        let bytes = usize::try_from(set.bytes).map_err(|_| full)?;
        let mut rest = out.get_mut(..bytes).ok_or(full)?;
        let region = self.region(set.slot);
        slot::read(flash, region, set.bytes, |piece| {
            let here = core::mem::take(&mut rest);
            if let Some((place, after)) = here.split_at_mut_checked(piece.len()) {
                place.copy_from_slice(piece);
                rest = after;
            }
        })?;
        Ok(loaded)
    }

    /// Stores `set` in place of the oldest and returns where. Erasing and writing take as long as
    /// the flash takes. A save over two damaged slots makes the first of them whole.
    ///
    /// # Errors
    /// [`SaveError`]; the newest whole set is the one that it was before, or this one.
    pub fn save<F: NorFlash>(&self, flash: &mut F, set: &[u8]) -> Result<Set, SaveError> {
        let capacity = self.capacity();
        let bytes = match u32::try_from(set.len()) {
            Ok(bytes) if bytes <= capacity => bytes,
            _ => {
                let bytes = set.len();
                return Err(SaveError::TooLong { bytes, capacity });
            }
        };
        let before = self.ready(flash)?;
        let (slot, sequence) = match before {
            Before::Set(set) => (set.slot.other(), set.sequence.wrapping_add(1)),
            Before::Formatting => (Slot::Second, 1),
            Before::Damaged => (Slot::First, 1),
        };
        slot::write(flash, self.region(slot), sequence, set)?;
        let written = Set {
            slot,
            sequence,
            bytes,
        };
        if self.look(flash, slot)? != SlotState::Whole(written) {
            return Err(SaveError::NotKept(slot));
        }
        if let Before::Set(set) = before {
            slot::mark(flash, self.region(set.slot))?;
        }
        Ok(written)
    }

    /// Erases each slot whose state is `wanted`. Over whole sets this forgets them; a cut in the
    /// middle of it may leave damage.
    ///
    /// # Errors
    /// [`FlashError`] if the flash refuses.
    pub fn erase<F: NorFlash>(
        &self,
        flash: &mut F,
        wanted: impl Fn(SlotState) -> bool,
    ) -> Result<(), FlashError> {
        for slot in [Slot::First, Slot::Second] {
            if wanted(self.look(flash, slot)?) {
                self.region(slot).erase(flash)?;
            }
        }
        Ok(())
    }

    /// What a save follows. A new flash is made ready: the first slot gets the empty set, so that a
    /// first save that is cut short is no damage.
    fn ready<F: NorFlash>(&self, flash: &mut F) -> Result<Before, FlashError> {
        match self.find(flash) {
            Ok(Loaded { set: Some(set), .. }) => Ok(Before::Set(set)),
            Ok(Loaded { .. }) if self.look(flash, Slot::First)? == SlotState::Formatting => {
                Ok(Before::Formatting)
            }
            Ok(Loaded { .. }) => slot::format(flash, self.first).map(Before::Set),
            Err(LoadError::Flash(error)) => Err(error),
            Err(LoadError::Damaged | LoadError::Full { .. }) => Ok(Before::Damaged),
        }
    }
}

/// What a save follows.
#[derive(Clone, Copy, Debug)]
enum Before {
    /// The newest whole set.
    Set(Set),
    /// The flash was not made ready to the end; nothing was ever stored.
    Formatting,
    /// No whole set.
    Damaged,
}
