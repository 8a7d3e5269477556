//! What a PDO carries: a mapping compiled into a short list of copies.

use crate::row::flag;
use crate::{Abort, Device, Entry, Field, MAPPED_PER_PDO};

/// Copies that a mapping is compiled into, at most. Others are walked, see [`Mapping::is_walked`].
const COPIES: usize = 4;
/// Bits of a frame's data.
const BITS: u16 = 64;

/// Which way a PDO goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Receive,
    Transmit,
}

/// One object's bytes between a PDO and the image, in eight bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Copy {
    /// Where the value lies in the image.
    offset: u16,
    pub(crate) row: u16,
    /// First bit within the PDO: 0 to 56.
    shift: u8,
    /// Bits that the object has fewer than 32: 0, 16 or 24.
    unused_bits: u8,
    pub(crate) sub: u8,
    /// The class of change, and [`Copy::ASKS`] and [`Copy::JUDGED`].
    flags: u8,
}

const _: () = assert!(size_of::<Copy>() == 8);

/// A compiled mapping.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mapping {
    copies: [Copy; COPIES],
    count: u8,
    bits: u8,
    /// As many as `bits` need.
    bytes: u8,
    live: bool,
    walked: bool,
}

/// The object that a mapping entry (index, sub-index, length in bits) names, if it may be mapped, and
/// how many of its bits.
pub(crate) fn mapped_entry(
    device: &Device,
    entry: u32,
    way: Direction,
) -> Result<(Entry, u8), Abort> {
    let table = &device.table;
    let [bits, sub, index_low, index_high] = entry.to_le_bytes();
    let index = u16::from_le_bytes([index_low, index_high]);
    let found = table.find(index, sub).map_err(|missing| {
        // A sub-index 0 that no row declares exists all the same.
        match sub == 0 && table.highest_sub_index(index).is_some() {
            true => Abort::NOT_MAPPABLE,
            false => missing,
        }
    })?;
    let mappable = match way {
        Direction::Receive => found.maps_rpdo(),
        Direction::Transmit => found.maps_tpdo(),
    };
    // The length must be the object's (CiA 301 7.5.2.36).
    let all = found.field.data_type().bits();
    let is_part = device.dialect.short_mapping && matches!(bits, 8 | 16) && bits < all;
    if !mappable || (bits != all && !is_part) {
        return Err(Abort::NOT_MAPPABLE);
    }
    Ok((found, bits))
}

impl Copy {
    /// Its owner is asked: such copies come last.
    const ASKS: u8 = 1 << 6;
    /// A value may be refused, by its owner, its range or the node, or is a parameter that is
    /// stored, of which the node keeps account.
    const JUDGED: u8 = 1 << 7;

    const NONE: Copy = Copy {
        offset: 0,
        row: 0,
        shift: 0,
        unused_bits: 24,
        sub: 0,
        flags: 0,
    };

    fn new(found: &Entry, sub: u8, shift: u8) -> Copy {
        let mut flags = found.class & 31;
        if found.has(flag::ASKS) {
            flags |= Copy::ASKS;
        }
        if found.has(flag::ASKS | flag::RANGE | flag::NODE | flag::STORED) {
            flags |= Copy::JUDGED;
        }
        Copy {
            offset: found.field.offset(),
            row: found.row,
            shift,
            unused_bits: 32u8.saturating_sub(8 * found.field.size()),
            sub,
            flags,
        }
    }

    #[inline]
    pub(crate) fn is_judged(&self) -> bool {
        self.flags & Copy::JUDGED != 0
    }

    fn asks(&self) -> bool {
        self.flags & Copy::ASKS != 0
    }

    /// The class of change that a write tells.
    #[inline]
    pub(crate) fn class(&self) -> u8 {
        self.flags & 31
    }

    /// Where the value lies.
    #[inline]
    pub(crate) fn field(&self) -> Field {
        let size = 4u8.saturating_sub(self.unused_bits / 8);
        Field::sized(self.offset, crate::DataType::U32, size)
    }

    /// The object's bytes in the data of a PDO, zero extended.
    #[inline]
    pub(crate) fn extract(&self, data: u64) -> u32 {
        (data >> (self.shift & 63)) as u32 & self.mask()
    }

    /// The image's bytes at their place in a PDO.
    #[inline]
    fn sample(&self, bytes: &[u8]) -> u64 {
        let at = usize::from(self.offset);
        // Four bytes at once and a mask; only the image's last objects have fewer after them.
        let raw = match bytes.get(at..at + 4) {
            Some(&[b0, b1, b2, b3]) => u32::from_le_bytes([b0, b1, b2, b3]) & self.mask(),
            _ => self.sample_at_end(bytes),
        };
        u64::from(raw) << (self.shift & 63)
    }

    #[cold]
    #[inline(never)]
    fn sample_at_end(&self, bytes: &[u8]) -> u32 {
        crate::image::raw(bytes, self.field())
    }

    /// The object's bytes among four.
    #[inline]
    fn mask(&self) -> u32 {
        u32::MAX >> (self.unused_bits & 31)
    }
}

impl Mapping {
    pub(crate) const EMPTY: Mapping = Mapping {
        copies: [Copy::NONE; COPIES],
        count: 0,
        bits: 0,
        bytes: 0,
        live: false,
        walked: false,
    };

    /// Compiles `entries`.
    ///
    /// # Errors
    /// The abort that CiA 301 (7.5.2.36) gives for the first entry that cannot be, or
    /// [`Abort::MAP_TOO_LONG`] if they exceed eight bytes.
    pub(crate) fn compile(
        device: &Device,
        entries: impl Iterator<Item = u32>,
        way: Direction,
    ) -> Result<Mapping, Abort> {
        let mut mapping = Mapping::EMPTY;
        for entry in entries {
            let (found, bits) = mapped_entry(device, entry, way)?;
            let end = u16::from(mapping.bits) + u16::from(bits);
            if end > BITS || usize::from(mapping.count) >= MAPPED_PER_PDO {
                return Err(Abort::MAP_TOO_LONG);
            }
            let is_plain = !found.has(flag::LONG)
                && bits == found.field.data_type().bits()
                && bits.is_multiple_of(8)
                && mapping.bits.is_multiple_of(8);
            match mapping.copies.get_mut(usize::from(mapping.count)) {
                Some(place) if is_plain => {
                    *place = Copy::new(&found, (entry >> 8) as u8, mapping.bits);
                }
                _ => mapping.walked = true,
            }
            mapping.count += 1;
            mapping.bits = end as u8;
            mapping.bytes = mapping.bits.div_ceil(8);
            mapping.live |= found.has(flag::LIVE);
        }
        if mapping.walked {
            return Ok(mapping);
        }
        // Plain objects first, then those that ask, by index: a controlword sees the target that
        // came with it, and 0x6040 acts before 0x6060 (P10).
        if let Some(copies) = mapping.copies.get_mut(..usize::from(mapping.count)) {
            copies.sort_unstable_by_key(|copy| (copy.asks(), copy.row, copy.shift));
        }
        Ok(mapping)
    }

    #[inline]
    pub(crate) fn copies(&self) -> &[Copy] {
        self.copies.get(..usize::from(self.count)).unwrap_or(&[])
    }

    /// The mapped values in `bytes` as the data of a PDO.
    #[inline]
    pub(crate) fn sample(&self, bytes: &[u8]) -> u64 {
        let mut data = 0;
        for copy in self.copies.iter().take(usize::from(self.count)) {
            data |= copy.sample(bytes);
        }
        data
    }

    /// Bytes that a PDO of this mapping has; the last one's bits need not all be used.
    #[inline]
    pub(crate) fn bytes(&self) -> u8 {
        self.bytes
    }

    /// How many objects are mapped.
    pub(crate) fn count(&self) -> u8 {
        self.count
    }

    /// Whether the mapping is no list of copies: its objects are not whole bytes, wider than four,
    /// more than four, or mapped in part. It is then read from the image entry by entry with every frame. That
    /// costs a look-up an object; lists of 64 copies would cost four kilobytes of memory a node.
    #[inline]
    pub(crate) fn is_walked(&self) -> bool {
        self.walked
    }

    /// Whether a live object is among them.
    #[inline]
    pub(crate) fn is_live(&self) -> bool {
        self.live
    }
}
