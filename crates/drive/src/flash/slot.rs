//! One of the two slots for parameters: a header and the set behind it.
//!
//! Layout: `SBS1`, sequence number, length of the set in bytes, CRC-32 of the twelve bytes before
//! and the set, all little-endian UNSIGNED32. The header is written last, so a slot that was not
//! written to its end does not check. The second chunk is a mark: unless it is erased, the other slot
//! was written to its end after this one. The set begins in the third chunk.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::region::{CHUNK_BYTES, ERASED};
use super::{CHUNK, Checksum, FlashError, Region};

const MAGIC: [u8; 4] = *b"SBS1";
const HEADER: usize = 16;
const MARK_AT: u32 = CHUNK_BYTES;
const BODY_AT: u32 = 2 * CHUNK_BYTES;

/// Which slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The first.
    First,
    /// The second.
    Second,
}

impl Slot {
    /// The one beside it.
    #[must_use]
    pub const fn other(self) -> Slot {
        match self {
            Slot::First => Slot::Second,
            Slot::Second => Slot::First,
        }
    }
}

/// A whole set in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Set {
    /// Where.
    pub slot: Slot,
    /// One more than that of the set before; it wraps.
    pub sequence: u32,
    /// Its length in bytes, without the header.
    pub bytes: u32,
}

impl Set {
    /// Whether it is later than `other`, if fewer than 2^31 sets lie between them.
    #[must_use]
    pub const fn is_after(&self, other: &Set) -> bool {
        let ahead = self.sequence.wrapping_sub(other.sequence);
        ahead != 0 && ahead < 1 << 31
    }
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotState {
    /// Nothing: every byte is erased.
    Blank,
    /// A part of the header of the very first, empty set, and nothing else: the power failed while
    /// the flash was first made ready, so nothing has ever been stored.
    Formatting,
    /// A whole set.
    Whole(Set),
    /// Anything else: a set that was not written or not erased to its end, or a damaged one.
    Broken,
}

impl SlotState {
    pub(crate) const fn set(self) -> Option<Set> {
        match self {
            SlotState::Whole(set) => Some(set),
            _ => None,
        }
    }
}

/// Where the bytes of a set are in its slot.
pub(crate) const fn body(region: Region, bytes: u32) -> Region {
    Region::new(region.at.saturating_add(BODY_AT), bytes)
}

/// The header of a set and what its checksum has to be.
pub(crate) fn header(sequence: u32, set: &[u8]) -> [u8; HEADER] {
    let start = start(sequence, set.len() as u32);
    let sum = Checksum::of(&start).and(set);
    let mut header = [0; HEADER];
    let fields = start.iter().copied().chain(sum.value().to_le_bytes());
    for (byte, value) in header.iter_mut().zip(fields) {
        *byte = value;
    }
    header
}

/// The part of the header that the checksum covers.
fn start(sequence: u32, bytes: u32) -> [u8; 12] {
    let [m0, m1, m2, m3] = MAGIC;
    let [s0, s1, s2, s3] = sequence.to_le_bytes();
    let [b0, b1, b2, b3] = bytes.to_le_bytes();
    [m0, m1, m2, m3, s0, s1, s2, s3, b0, b1, b2, b3]
}

/// The sequence number, the length and the checksum in `header`, if it begins as one does.
fn fields(header: &[u8; HEADER]) -> Option<(u32, u32, u32)> {
    let [
        m0,
        m1,
        m2,
        m3,
        s0,
        s1,
        s2,
        s3,
        b0,
        b1,
        b2,
        b3,
        c0,
        c1,
        c2,
        c3,
    ] = *header;
    ([m0, m1, m2, m3] == MAGIC).then_some((
        u32::from_le_bytes([s0, s1, s2, s3]),
        u32::from_le_bytes([b0, b1, b2, b3]),
        u32::from_le_bytes([c0, c1, c2, c3]),
    ))
}

/// The longest set that a slot in `region` takes, bytes.
pub(crate) const fn capacity(region: Region) -> u32 {
    region.bytes.saturating_sub(BODY_AT)
}

/// What the slot in `region` holds.
pub(crate) fn look<F: ReadNorFlash>(
    flash: &mut F,
    slot: Slot,
    region: Region,
) -> Result<SlotState, FlashError> {
    let head = region.read(flash, 0)?;
    let Some((raw, _)) = head.split_first_chunk::<HEADER>() else {
        return Ok(SlotState::Broken);
    };
    if let Some((sequence, bytes, stored)) = fields(raw)
        && bytes <= capacity(region)
    {
        let mut sum = Checksum::of(&start(sequence, bytes));
        region.read_through(flash, BODY_AT, bytes, |piece| sum = sum.and(piece))?;
        if sum.value() == stored {
            return Ok(SlotState::Whole(Set {
                slot,
                sequence,
                bytes,
            }));
        }
    }
    if !is_part_of_first(&head) || !region.is_blank_from(flash, CHUNK_BYTES)? {
        return Ok(SlotState::Broken);
    }
    Ok(match head {
        [ERASED, ..] if head == [ERASED; CHUNK] => SlotState::Blank,
        _ => SlotState::Formatting,
    })
}

/// Whether only bits that the first set's header clears are cleared.
fn is_part_of_first(head: &[u8; CHUNK]) -> bool {
    let first = header(FIRST_SEQUENCE, &[]);
    let wanted = first.iter().copied().chain(core::iter::repeat(ERASED));
    head.iter()
        .zip(wanted)
        .all(|(is, wanted)| !is & wanted == 0)
}

/// The sequence number of the empty set that makes a new flash ready.
const FIRST_SEQUENCE: u32 = 0;

/// Whether the slot in `region` is marked: a newer set was stored beside it.
pub(crate) fn is_marked<F: ReadNorFlash>(
    flash: &mut F,
    region: Region,
) -> Result<bool, FlashError> {
    Ok(region.read(flash, MARK_AT)? != [ERASED; CHUNK])
}

/// Marks the slot in `region`, unless it is.
pub(crate) fn mark<F: NorFlash>(flash: &mut F, region: Region) -> Result<(), FlashError> {
    if is_marked(flash, region)? {
        return Ok(());
    }
    region.write(flash, MARK_AT, &[0])
}

/// Hands the set of `bytes` bytes in `region` to `each`, piece by piece.
pub(crate) fn read<F: ReadNorFlash>(
    flash: &mut F,
    region: Region,
    bytes: u32,
    each: impl FnMut(&[u8]),
) -> Result<(), FlashError> {
    region.read_through(flash, BODY_AT, bytes, each)
}

/// Writes the empty set into the first slot, which is blank.
pub(crate) fn format<F: NorFlash>(flash: &mut F, region: Region) -> Result<Set, FlashError> {
    region.write(flash, 0, &header(FIRST_SEQUENCE, &[]))?;
    Ok(Set {
        slot: Slot::First,
        sequence: FIRST_SEQUENCE,
        bytes: 0,
    })
}

/// Erases the slot and writes `set` into it, its header last.
pub(crate) fn write<F: NorFlash>(
    flash: &mut F,
    region: Region,
    sequence: u32,
    set: &[u8],
) -> Result<(), FlashError> {
    region.erase(flash)?;
    let mut offset = BODY_AT;
    for piece in set.chunks(CHUNK) {
        region.write(flash, offset, piece)?;
        offset = offset.saturating_add(CHUNK_BYTES);
    }
    region.write(flash, 0, &header(sequence, set))
}
