//! Two banks for programs, and which one a start runs.
//!
//! A bank: its record at byte 0, the image's header at byte [`CHUNK`], the image's body at byte 512,
//! where a Cortex-M4 can have its vector table. The record is `SBB1`, sequence number, checksum of
//! the image, CRC-32 of the twelve bytes before, all little-endian UNSIGNED32.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::ImageHeader;
use crate::flash::{CHUNK, Checksum, FlashError, LayoutError, Region};

const MAGIC: [u8; 4] = *b"SBB1";
const RECORD: usize = 16;
const HEADER_AT: u32 = CHUNK as u32;
/// Where a body begins in its bank. 82 interrupts and 16 exceptions of 4 bytes each, the next power
/// of two.
const BODY_AT: u32 = 512;

/// Which bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bank {
    /// The first.
    First,
    /// The second.
    Second,
}

impl Bank {
    /// The one beside it.
    #[must_use]
    pub const fn other(self) -> Bank {
        match self {
            Bank::First => Bank::Second,
            Bank::Second => Bank::First,
        }
    }
}

/// A valid program in a bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Program {
    /// Where.
    pub bank: Bank,
    /// One more than that of the program before; it wraps.
    pub sequence: u32,
    /// Where its body begins, in bytes from the start of the flash.
    pub at: u32,
    /// What its image says.
    pub image: ImageHeader,
}

impl Program {
    /// Whether it was downloaded after `other`.
    #[must_use]
    pub const fn is_after(&self, other: &Program) -> bool {
        let ahead = self.sequence.wrapping_sub(other.sequence);
        ahead != 0 && ahead < 1 << 31
    }
}

/// Where a drive keeps its programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Banks {
    first: Region,
    second: Region,
}

impl Banks {
    /// Banks in `first` and `second` of `flash`.
    ///
    /// # Errors
    /// [`LayoutError`]; a bank that takes no program is unaligned.
    pub fn new<F: NorFlash>(
        first: Region,
        second: Region,
        flash: &F,
    ) -> Result<Banks, LayoutError> {
        Region::check(&[first, second], flash)?;
        for region in [first, second] {
            if region.bytes <= BODY_AT {
                return Err(LayoutError::Unaligned(region));
            }
        }
        Ok(Banks { first, second })
    }

    /// The longest image, header included, that either bank takes, bytes.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        let bytes = if self.first.bytes < self.second.bytes {
            self.first.bytes
        } else {
            self.second.bytes
        };
        bytes.saturating_sub(BODY_AT).saturating_add(HEADER_AT)
    }

    pub(crate) const fn region(&self, bank: Bank) -> Region {
        match bank {
            Bank::First => self.first,
            Bank::Second => self.second,
        }
    }

    /// The program in `bank`, if a whole one was finished there. Reads the whole image.
    ///
    /// # Errors
    /// [`FlashError`] if the flash cannot be read.
    pub fn program<F: ReadNorFlash>(
        &self,
        flash: &mut F,
        bank: Bank,
    ) -> Result<Option<Program>, FlashError> {
        let region = self.region(bank);
        let Some((sequence, checksum)) = read_record(flash, region)? else {
            return Ok(None);
        };
        let image = self.image(flash, bank)?;
        let image = image.filter(|image| image.checksum == checksum);
        Ok(image.map(|image| self.made(bank, sequence, image)))
    }

    const fn made(&self, bank: Bank, sequence: u32, image: ImageHeader) -> Program {
        Program {
            bank,
            sequence,
            at: self.region(bank).at.saturating_add(BODY_AT),
            image,
        }
    }

    /// What a start runs: the newest valid program. `None`: there is none.
    ///
    /// # Errors
    /// [`FlashError`] if the flash cannot be read.
    pub fn newest<F: ReadNorFlash>(&self, flash: &mut F) -> Result<Option<Program>, FlashError> {
        let first = self.program(flash, Bank::First)?;
        let second = self.program(flash, Bank::Second)?;
        Ok(match (first, second) {
            (Some(program), Some(later)) if later.is_after(&program) => Some(later),
            (first, second) => first.or(second),
        })
    }

    /// The image in `bank` if it is whole, whether its record is there or not.
    pub(crate) fn image<F: ReadNorFlash>(
        &self,
        flash: &mut F,
        bank: Bank,
    ) -> Result<Option<ImageHeader>, FlashError> {
        let region = self.region(bank);
        let raw = region.read(flash, HEADER_AT)?;
        let Some(image) = ImageHeader::parse(&raw) else {
            return Ok(None);
        };
        if image.image_bytes() > self.capacity() {
            return Ok(None);
        }
        let mut sum = ImageHeader::checksum_start(&raw);
        region.read_through(flash, BODY_AT, image.body_bytes, |piece| {
            sum = sum.and(piece);
        })?;
        Ok((sum.value() == image.checksum).then_some(image))
    }

    /// Writes the chunk of an image that begins at its byte `at`, a multiple of [`CHUNK`].
    pub(crate) fn write<F: NorFlash>(
        &self,
        flash: &mut F,
        bank: Bank,
        at: u32,
        chunk: &[u8],
    ) -> Result<(), FlashError> {
        let offset = match at.checked_sub(HEADER_AT) {
            Some(in_body) => BODY_AT.saturating_add(in_body),
            None => HEADER_AT,
        };
        self.region(bank).write(flash, offset, chunk)
    }

    /// Makes `image`, which stands whole in `bank`, the program that the next start runs: one write.
    /// `None` if the record does not read back.
    pub(crate) fn commit<F: NorFlash>(
        &self,
        flash: &mut F,
        bank: Bank,
        sequence: u32,
        image: ImageHeader,
    ) -> Result<Option<Program>, FlashError> {
        let region = self.region(bank);
        region.write(flash, 0, &record(sequence, image.checksum))?;
        let kept = read_record(flash, region)? == Some((sequence, image.checksum));
        Ok(kept.then_some(self.made(bank, sequence, image)))
    }
}

fn record(sequence: u32, checksum: u32) -> [u8; RECORD] {
    let [m0, m1, m2, m3] = MAGIC;
    let [s0, s1, s2, s3] = sequence.to_le_bytes();
    let [i0, i1, i2, i3] = checksum.to_le_bytes();
    let start = [m0, m1, m2, m3, s0, s1, s2, s3, i0, i1, i2, i3];
    let [c0, c1, c2, c3] = Checksum::of(&start).value().to_le_bytes();
    [
        m0, m1, m2, m3, s0, s1, s2, s3, i0, i1, i2, i3, c0, c1, c2, c3,
    ]
}

/// The sequence number and the image's checksum in a bank's record.
fn read_record<F: ReadNorFlash>(
    flash: &mut F,
    region: Region,
) -> Result<Option<(u32, u32)>, FlashError> {
    let chunk = region.read(flash, 0)?;
    let Some(raw) = chunk.first_chunk::<RECORD>() else {
        return Ok(None);
    };
    let [_, _, _, _, s0, s1, s2, s3, i0, i1, i2, i3, _, _, _, _] = *raw;
    let sequence = u32::from_le_bytes([s0, s1, s2, s3]);
    let checksum = u32::from_le_bytes([i0, i1, i2, i3]);
    Ok((*raw == record(sequence, checksum)).then_some((sequence, checksum)))
}
