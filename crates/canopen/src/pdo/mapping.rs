//! What a PDO carries: a mapping compiled into a short list of copies.

use crate::row::flag;
use crate::{Abort, Entry, Field, MAPPED_PER_PDO, Table};

/// Which way a PDO goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Receive,
    Transmit,
}

/// One object's bytes between a PDO and the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Copy {
    pub(crate) field: Field,
    pub(crate) row: u16,
    /// First bit within the PDO: 0 to 56.
    shift: u8,
    /// Bits that the object has fewer than 32: 0, 16 or 24.
    unused_bits: u8,
    pub(crate) sub: u8,
    pub(crate) class: u8,
    /// Its owner is asked: such copies come last.
    asks: bool,
    /// A value may be refused: by its owner, its range or the node.
    pub(crate) judged: bool,
}

/// A compiled mapping.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mapping {
    copies: [Copy; MAPPED_PER_PDO],
    count: u8,
    bytes: u8,
    live: bool,
}

/// The object that a mapping entry (index, sub-index, length in bits) names, if it may be mapped.
pub(crate) fn mapped_entry(table: &Table, entry: u32, way: Direction) -> Result<Entry, Abort> {
    let [bits, sub, index_low, index_high] = entry.to_le_bytes();
    let found = table.find(u16::from_le_bytes([index_low, index_high]), sub)?;
    let mappable = match way {
        Direction::Receive => found.maps_rpdo(),
        Direction::Transmit => found.maps_tpdo(),
    };
    // The length must be the object's (CiA 301 7.5.2.36; the P3's PDOs are byte-wise, l.79).
    if !mappable || bits != found.field.size() * 8 {
        return Err(Abort::NOT_MAPPABLE);
    }
    Ok(found)
}

impl Copy {
    /// The object's bytes in the data of a PDO, zero extended.
    #[inline]
    pub(crate) fn extract(&self, data: u64) -> u32 {
        (data >> (self.shift & 63)) as u32 & self.mask()
    }

    /// The image's bytes at their place in a PDO.
    #[inline]
    fn sample(&self, bytes: &[u8]) -> u64 {
        let at = usize::from(self.field.offset());
        // Four bytes at once and a mask; only the image's last objects have fewer after them.
        let raw = match bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()) {
            Some(four) => u32::from_le_bytes(*four) & self.mask(),
            None => self.sample_at_end(bytes),
        };
        u64::from(raw) << (self.shift & 63)
    }

    #[cold]
    #[inline(never)]
    fn sample_at_end(&self, bytes: &[u8]) -> u32 {
        crate::image::raw(bytes, self.field)
    }

    /// The object's bytes among four.
    #[inline]
    fn mask(&self) -> u32 {
        u32::MAX >> (self.unused_bits & 31)
    }
}

impl Mapping {
    pub(crate) const EMPTY: Mapping = Mapping {
        copies: [Copy {
            field: Field::new(0, crate::DataType::U8),
            row: 0,
            shift: 0,
            unused_bits: 24,
            sub: 0,
            class: 0,
            asks: false,
            judged: false,
        }; MAPPED_PER_PDO],
        count: 0,
        bytes: 0,
        live: false,
    };

    /// Compiles `entries`.
    ///
    /// # Errors
    /// The abort that CiA 301 (7.5.2.36) gives for the first entry that cannot be, or
    /// [`Abort::MAP_TOO_LONG`] if they exceed eight bytes.
    pub(crate) fn compile(
        table: &Table,
        entries: impl Iterator<Item = u32>,
        way: Direction,
    ) -> Result<Mapping, Abort> {
        let mut mapping = Mapping::EMPTY;
        for entry in entries {
            let found = mapped_entry(table, entry, way)?;
            let size = found.field.size();
            let end = mapping.bytes.saturating_add(size);
            let Some(place) = mapping.copies.get_mut(usize::from(mapping.count)) else {
                return Err(Abort::MAP_TOO_LONG);
            };
            if end > 8 {
                return Err(Abort::MAP_TOO_LONG);
            }
            *place = Copy {
                field: found.field,
                row: found.row,
                shift: mapping.bytes * 8,
                unused_bits: 32 - 8 * size,
                sub: (entry >> 8) as u8,
                class: found.class,
                asks: found.has(flag::ASKS),
                judged: found.has(flag::ASKS | flag::RANGE | flag::NODE),
            };
            mapping.count += 1;
            mapping.bytes = end;
            mapping.live |= found.has(flag::LIVE);
        }
        // Plain objects first, then those that ask, by index: a controlword sees the target that
        // came with it, and 0x6040 acts before 0x6060 (P10).
        if let Some(copies) = mapping.copies.get_mut(..usize::from(mapping.count)) {
            copies.sort_unstable_by_key(|copy| (copy.asks, copy.row, copy.shift));
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
        self.copies()
            .iter()
            .fold(0, |data, copy| data | copy.sample(bytes))
    }

    /// Bytes that a PDO of this mapping has.
    #[inline]
    pub(crate) fn bytes(&self) -> u8 {
        self.bytes
    }

    /// Whether a live object is among them.
    #[inline]
    pub(crate) fn is_live(&self) -> bool {
        self.live
    }
}
