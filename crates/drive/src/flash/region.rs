//! A part of a flash, read, written and erased in its own addresses.

use embedded_storage::nor_flash::{NorFlash, NorFlashError as _, NorFlashErrorKind, ReadNorFlash};

/// Bytes of one access. A flash whose [`ReadNorFlash::READ_SIZE`] or [`NorFlash::WRITE_SIZE`] does
/// not divide it does not compile.
pub const CHUNK: usize = 64;

/// [`CHUNK`] as an address.
pub(crate) const CHUNK_BYTES: u32 = CHUNK as u32;

/// What erased flash reads as.
pub(crate) const ERASED: u8 = 0xFF;

/// The flash has refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashError {
    /// How.
    pub kind: NorFlashErrorKind,
    /// Where, in bytes from the start of the flash.
    pub at: u32,
}

impl core::fmt::Display for FlashError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the flash refuses at 0x{:X}: {}", self.at, self.kind)
    }
}

impl core::error::Error for FlashError {}

/// Regions that cannot be used on a flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutError {
    /// A region does not begin or end at an erase sector and a chunk, or has no bytes.
    Unaligned(Region),
    /// A region runs past the end of the flash.
    OutOfBounds {
        /// Which.
        region: Region,
        /// Bytes that the flash has.
        capacity: u32,
    },
    /// Two regions overlap.
    Overlap(Region, Region),
}

impl core::fmt::Display for LayoutError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            LayoutError::Unaligned(region) => write!(f, "{region} is not made of whole sectors"),
            LayoutError::OutOfBounds { region, capacity } => {
                write!(f, "{region} runs past the flash's {capacity} bytes")
            }
            LayoutError::Overlap(one, other) => write!(f, "{one} and {other} overlap"),
        }
    }
}

impl core::error::Error for LayoutError {}

/// A part of a flash: one or more whole erase sectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Where it begins, in bytes from the start of the flash.
    pub at: u32,
    /// How long it is, bytes.
    pub bytes: u32,
}

impl core::fmt::Display for Region {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the region of {} bytes at 0x{:X}", self.bytes, self.at)
    }
}

impl Region {
    /// The region of `bytes` bytes at `at`.
    #[must_use]
    pub const fn new(at: u32, bytes: u32) -> Region {
        Region { at, bytes }
    }

    /// Finds out whether `regions` can be used on `flash`.
    ///
    /// # Errors
    /// The first [`LayoutError`].
    pub fn check<F: NorFlash>(regions: &[Region], flash: &F) -> Result<(), LayoutError> {
        let capacity = u32::try_from(flash.capacity()).unwrap_or(u32::MAX);
        let step = (F::ERASE_SIZE as u32).max(CHUNK_BYTES);
        for (number, region) in regions.iter().enumerate() {
            if region.bytes == 0 || [region.at, region.bytes].iter().any(|n| n % step != 0) {
                return Err(LayoutError::Unaligned(*region));
            }
            match region.at.checked_add(region.bytes) {
                Some(end) if end <= capacity => {}
                _ => {
                    return Err(LayoutError::OutOfBounds {
                        region: *region,
                        capacity,
                    });
                }
            }
            if let Some(other) = regions.iter().take(number).find(|r| r.overlaps(region)) {
                return Err(LayoutError::Overlap(*other, *region));
            }
        }
        Ok(())
    }

    fn overlaps(&self, other: &Region) -> bool {
        let end = |region: &Region| u64::from(region.at) + u64::from(region.bytes);
        u64::from(self.at) < end(other) && u64::from(other.at) < end(self)
    }

    /// The flash's address of `offset`; out of the region is out of bounds.
    fn address(self, offset: u32, bytes: u32) -> Result<u32, FlashError> {
        let at = self.at.saturating_add(offset);
        let inside = offset
            .checked_add(bytes)
            .is_some_and(|end| end <= self.bytes);
        if inside {
            Ok(at)
        } else {
            let kind = NorFlashErrorKind::OutOfBounds;
            Err(FlashError { kind, at })
        }
    }

    /// The chunk at `offset`, a multiple of [`CHUNK`].
    pub(crate) fn read<F: ReadNorFlash>(
        self,
        flash: &mut F,
        offset: u32,
    ) -> Result<[u8; CHUNK], FlashError> {
        const { assert!(CHUNK.is_multiple_of(F::READ_SIZE)) };
        let at = self.address(offset, CHUNK_BYTES)?;
        let mut chunk = [0; CHUNK];
        match flash.read(at, &mut chunk) {
            Ok(()) => Ok(chunk),
            Err(error) => Err(FlashError {
                kind: error.kind(),
                at,
            }),
        }
    }

    /// Writes at most a chunk at `offset`, a multiple of [`CHUNK`]; what is missing to a whole page
    /// stays erased.
    pub(crate) fn write<F: NorFlash>(
        self,
        flash: &mut F,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), FlashError> {
        const { assert!(CHUNK.is_multiple_of(F::WRITE_SIZE)) };
        let at = self.address(offset, bytes.len() as u32)?;
        let mut chunk = [ERASED; CHUNK];
        let pages = bytes.len().next_multiple_of(F::WRITE_SIZE);
        let (Some(place), Some(_)) = (chunk.get_mut(..bytes.len()), bytes.first()) else {
            // No bytes, or more than a chunk.
            return match bytes {
                [] => Ok(()),
                _ => Err(FlashError {
                    kind: NorFlashErrorKind::OutOfBounds,
                    at,
                }),
            };
        };
        place.copy_from_slice(bytes);
        let written = flash.write(at, chunk.get(..pages).unwrap_or(&chunk));
        written.map_err(|error| FlashError {
            kind: error.kind(),
            at,
        })
    }

    /// Erases the sector at `offset` and returns where the next one begins; `None` after the last.
    pub(crate) fn erase_sector<F: NorFlash>(
        self,
        flash: &mut F,
        offset: u32,
    ) -> Result<Option<u32>, FlashError> {
        let sector = F::ERASE_SIZE as u32;
        let at = self.address(offset, sector)?;
        match flash.erase(at, at.saturating_add(sector)) {
            Ok(()) => {}
            Err(error) => {
                let kind = error.kind();
                return Err(FlashError { kind, at });
            }
        }
        let next = offset.saturating_add(sector);
        Ok((next < self.bytes).then_some(next))
    }

    /// Erases all of it, the first sector first: whatever stands at its head is gone before what
    /// it speaks of.
    pub(crate) fn erase<F: NorFlash>(self, flash: &mut F) -> Result<(), FlashError> {
        let mut next = Some(0);
        while let Some(offset) = next {
            next = self.erase_sector(flash, offset)?;
        }
        Ok(())
    }

    /// Whether the region is erased from `offset`, a multiple of [`CHUNK`], to its end.
    pub(crate) fn is_blank_from<F: ReadNorFlash>(
        self,
        flash: &mut F,
        offset: u32,
    ) -> Result<bool, FlashError> {
        let mut offset = offset;
        while offset < self.bytes {
            if self.read(flash, offset)? != [ERASED; CHUNK] {
                return Ok(false);
            }
            offset = offset.saturating_add(CHUNK_BYTES);
        }
        Ok(true)
    }

    /// Hands the `bytes` bytes from `offset`, a multiple of [`CHUNK`], to `each`, piece by piece.
    pub(crate) fn read_through<F: ReadNorFlash>(
        self,
        flash: &mut F,
        offset: u32,
        bytes: u32,
        mut each: impl FnMut(&[u8]),
    ) -> Result<(), FlashError> {
        let mut done = 0u32;
        while done < bytes {
            let chunk = self.read(flash, offset.saturating_add(done))?;
            let rest = usize::try_from(bytes.saturating_sub(done)).unwrap_or(CHUNK);
            each(chunk.get(..rest.min(CHUNK)).unwrap_or(&chunk));
            done = done.saturating_add(CHUNK_BYTES);
        }
        Ok(())
    }
}
