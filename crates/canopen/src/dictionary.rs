//! The object dictionary: rows sorted, checked and laid out at compile time.
//!
//! ```
//! use canopen::{Dictionary, Row, dictionary, row::{u8, u16}};
//! const ROWS: &[&[Row]] = &[&[u16(0x6041, 0, "Statusword").tpdo(), u8(0x1001, 0, "Error register")]];
//! static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);
//! assert!(OBJECTS.table().find(0x6041, 0).is_ok());
//! ```
//!
//! A dictionary that contradicts itself does not compile: an object declared twice,
//! ```compile_fail
//! # use canopen::{Dictionary, dictionary, row::{u8, u16}};
//! static OBJECTS: Dictionary<2> =
//!     dictionary::layout(&[&[u8(0x2000, 1, "A run").subs(3), u16(0x2000, 3, "Its third")]]);
//! ```
//! a default outside its range,
//! ```compile_fail
//! # use canopen::{Dictionary, dictionary, row::u16};
//! static OBJECTS: Dictionary<1> =
//!     dictionary::layout(&[&[u16(0x2000, 0, "Gain").range(1, 10)]]);
//! ```
//! or a run that leaves its index.
//! ```compile_fail
//! # use canopen::{Dictionary, dictionary, row::u8};
//! static OBJECTS: Dictionary<1> = dictionary::layout(&[&[u8(0x2000, 255, "Run").subs(2)]]);
//! ```
//!
//! Each row becomes twelve hot bytes, which a transfer reads, and the row itself, which only
//! listings, EDS files and range checks read. Sub-index 0 of an object that has other sub-indices
//! need not be declared: it reads as the highest sub-index (CiA 301 7.4.3).

use crate::row::{Default, Row, flag};
use crate::{Abort, DataType, Field, Handle, NodeId, Wire};

/// What a transfer needs to know of a row.
#[derive(Clone, Copy, Debug)]
struct Hot {
    /// `index << 8 | sub` of the row's first sub-index.
    key: u32,
    /// Where the first value lies in the image.
    field: Field,
    flags: u16,
    count: u8,
    class: u8,
}

const _: () = assert!(size_of::<Hot>() == 12);

/// How many rows `parts` hold together.
pub const fn count(parts: &[&[Row]]) -> usize {
    let mut total = 0;
    let mut part = 0;
    while part < parts.len() {
        #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
        let rows = parts[part];
        total += rows.len();
        part += 1;
    }
    total
}

/// Sorts, checks and lays out the rows of `parts`.
///
/// # Panics
/// At compile time, if rows overlap, a default lies outside its range or type, a run leaves its
/// index, `N` is not [`count`]`(parts)`, or the image would exceed 64 KiB.
#[allow(
    clippy::indexing_slicing,
    reason = "runs at compile time, where a panic is an error message"
)]
pub const fn layout<const N: usize>(parts: &[&[Row]]) -> Dictionary<N> {
    assert!(count(parts) == N, "N must be dictionary::count(parts)");
    assert!(N > 0, "a dictionary has at least one row");
    let mut rows = [parts_first(parts); N];
    let mut filled = 0;
    let mut part = 0;
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            // Insertion sort: the parts are nearly sorted, so this is nearly linear.
            let row = parts[part][i];
            let mut at = filled;
            while at > 0 && rows[at - 1].address.key() > row.address.key() {
                rows[at] = rows[at - 1];
                at -= 1;
            }
            rows[at] = row;
            filled += 1;
            i += 1;
        }
        part += 1;
    }
    let first = Hot {
        key: 0,
        field: Field::new(0, DataType::U8),
        flags: 0,
        count: 1,
        class: 0,
    };
    let mut hot = [first; N];
    let mut offset: u32 = 0;
    let mut longest: u32 = 0;
    let mut i = 0;
    while i < N {
        let row = rows[i];
        check(&row);
        if i > 0 {
            let before = rows[i - 1];
            assert!(
                before.address.key() + before.count as u32 <= row.address.key(),
                "two rows declare the same object"
            );
        }
        let size = row.size() as u32;
        // Numbers are aligned to their size, so that a copy is one load and one store.
        if row.data_type.size() > 1 {
            offset = offset.next_multiple_of(size);
        }
        if row.length as u32 > longest && row.writable() {
            longest = row.length as u32;
        }
        let place = match row.default {
            Default::Text(text) if row.is_in_flash() => text.len() as u32,
            _ => offset,
        };
        assert!(place <= u16::MAX as u32, "the image exceeds 64 KiB");
        hot[i] = Hot {
            key: row.address.key(),
            field: Field::sized(place as u16, row.data_type, row.size()),
            flags: row.flags(),
            count: row.count,
            class: row.class,
        };
        offset += size * row.count as u32;
        i += 1;
    }
    assert!(
        offset + longest <= u16::MAX as u32,
        "the image exceeds 64 KiB"
    );
    Dictionary {
        hot,
        rows,
        value_bytes: offset as u16,
        image_bytes: (offset + longest) as u16,
    }
}

#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
const fn parts_first(parts: &[&[Row]]) -> Row {
    let mut part = 0;
    while part < parts.len() {
        if !parts[part].is_empty() {
            return parts[part][0];
        }
        part += 1;
    }
    crate::row::u8(0, 0, "")
}

#[allow(
    clippy::panic,
    reason = "runs at compile time, where a panic is an error message"
)]
const fn check(row: &Row) {
    assert!(row.count >= 1, "a row stands for at least one sub-index");
    assert!(
        row.address.sub as u16 + row.count as u16 <= 256,
        "a run leaves its index"
    );
    assert!(row.class < 32, "change classes are 1 to 31");
    assert!(!row.name.is_empty(), "a row has a name");
    match row.default {
        Default::Value(_) if matches!(row.data_type, DataType::Domain) => {
            assert!(!row.maps_rpdo && !row.maps_tpdo, "no PDO can map a stream");
        }
        Default::Value(value) => match row.data_type.bounds() {
            Some((low, high)) => {
                assert!(
                    value >= low && value <= high,
                    "a default lies outside its type"
                );
                if let Some(minimum) = row.minimum {
                    let unset = row.is_unset && value == 0;
                    assert!(
                        unset || value >= minimum,
                        "a default lies below its minimum"
                    );
                }
                if let Some(maximum) = row.maximum {
                    assert!(value <= maximum, "a default lies above its maximum");
                }
            }
            None => panic!("real numbers and strings need a default of their own kind"),
        },
        Default::Real(_) => assert!(
            matches!(row.data_type, DataType::F32 | DataType::F64),
            "a real default"
        ),
        Default::PlusNode(_) => {
            assert!(
                matches!(row.data_type, DataType::U32),
                "a COB-ID default is an UNSIGNED32"
            )
        }
        Default::Text(text) => {
            assert!(
                matches!(row.data_type, DataType::Text | DataType::Bytes),
                "a text default"
            );
            assert!(
                row.is_in_flash() || text.len() <= row.length as usize,
                "a default text is longer than its object"
            );
            assert!(
                !row.is_in_flash() || !row.writable(),
                "text in flash cannot be written: declare a string"
            );
            assert!(!row.maps_rpdo && !row.maps_tpdo, "no PDO can map a string");
            assert!(
                row.length > 0 || matches!(row.data_type, DataType::Text),
                "bytes have a length"
            );
        }
    }
}

/// A dictionary of `N` rows.
#[derive(Clone, Copy, Debug)]
pub struct Dictionary<const N: usize> {
    hot: [Hot; N],
    rows: [Row; N],
    value_bytes: u16,
    image_bytes: u16,
}

impl<const N: usize> Dictionary<N> {
    /// The view that nodes use, whatever `N` is.
    pub const fn table(&'static self) -> Table {
        Table {
            hot: &self.hot,
            rows: &self.rows,
            value_bytes: self.value_bytes,
            image_bytes: self.image_bytes,
        }
    }

    /// Bytes that a node's image needs.
    pub const fn image_bytes(&self) -> usize {
        self.image_bytes as usize
    }

    /// A typed handle to an object.
    ///
    /// # Panics
    /// At compile time, if there is no such object or it has another type.
    #[allow(
        clippy::panic,
        reason = "runs at compile time, where a panic is an error message"
    )]
    pub const fn handle<T: Wire>(&self, index: u16, sub: u8) -> Handle<T> {
        match self.optional::<T>(index, sub) {
            Some(handle) => handle,
            None => panic!("no such object"),
        }
    }

    /// A typed handle to an object that this drive may lack.
    ///
    /// # Panics
    /// At compile time, if the object exists with another type.
    pub const fn optional<T: Wire>(&self, index: u16, sub: u8) -> Option<Handle<T>> {
        match self.field(index, sub) {
            Some(field) => {
                assert!(
                    field.data_type() as u8 == T::TYPE as u8,
                    "the object has another type than the handle"
                );
                Some(Handle::at(field.offset()))
            }
            None => None,
        }
    }

    /// Where an object lies and of which type it is; `None` if there is none.
    #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
    pub const fn field(&self, index: u16, sub: u8) -> Option<Field> {
        let key = (index as u32) << 8 | sub as u32;
        let mut i = 0;
        while i < N {
            let hot = &self.hot[i];
            if key >= hot.key && key < hot.key + hot.count as u32 {
                return Some(hot.field.nth((key - hot.key) as u16));
            }
            i += 1;
        }
        None
    }

    /// Like [`Dictionary::field`] for an object that must exist.
    ///
    /// # Panics
    /// At compile time, if it does not.
    #[allow(
        clippy::panic,
        reason = "runs at compile time, where a panic is an error message"
    )]
    pub const fn need(&self, index: u16, sub: u8) -> Field {
        match self.field(index, sub) {
            Some(field) => field,
            None => panic!("no such object"),
        }
    }
}

/// A dictionary of any size.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    hot: &'static [Hot],
    rows: &'static [Row],
    value_bytes: u16,
    image_bytes: u16,
}

/// One object found in a [`Table`].
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Where its value lies, and its type.
    pub field: Field,
    /// Which row it belongs to.
    pub row: u16,
    pub(crate) flags: u16,
    pub(crate) class: u8,
}

impl Entry {
    #[inline]
    pub(crate) const fn has(&self, flag: u16) -> bool {
        self.flags & flag != 0
    }

    /// Whether it may be mapped into a receive PDO.
    pub const fn maps_rpdo(&self) -> bool {
        self.has(flag::RPDO)
    }

    /// Whether it may be mapped into a transmit PDO.
    pub const fn maps_tpdo(&self) -> bool {
        self.has(flag::TPDO)
    }
}

impl Table {
    /// Bytes that a node's image needs: the values, and room in which the longest string that can be
    /// written is gathered before it is judged.
    pub const fn image_bytes(&self) -> usize {
        self.image_bytes as usize
    }

    /// Bytes of the values.
    pub(crate) const fn value_bytes(&self) -> usize {
        self.value_bytes as usize
    }

    /// The rows in the order of index and sub-index.
    pub const fn rows(&self) -> &'static [Row] {
        self.rows
    }

    /// The row of an entry.
    pub fn row(&self, entry: &Entry) -> Option<&'static Row> {
        self.rows.get(usize::from(entry.row))
    }

    /// The object at `index`, `sub`.
    ///
    /// # Errors
    /// [`Abort::NO_OBJECT`] or [`Abort::NO_SUB_INDEX`].
    #[inline]
    pub fn find(&self, index: u16, sub: u8) -> Result<Entry, Abort> {
        let key = u32::from(index) << 8 | u32::from(sub);
        let after = self.hot.partition_point(|hot| hot.key <= key);
        let Some(row) = after.checked_sub(1) else {
            return Err(self.missing(index, after));
        };
        let Some(hot) = self.hot.get(row) else {
            return Err(Abort::NO_OBJECT);
        };
        let step = key.wrapping_sub(hot.key);
        if step >= u32::from(hot.count) {
            return Err(self.missing(index, after));
        }
        Ok(Entry {
            field: hot.field.nth(step as u16),
            row: row as u16,
            flags: hot.flags,
            class: hot.class,
        })
    }

    /// What a look-up that found nothing answers: the index has other sub-indices, or not.
    #[cold]
    fn missing(&self, index: u16, after: usize) -> Abort {
        let neighbours = [after.checked_sub(1), Some(after)];
        let known = neighbours.iter().flatten().any(|&row| {
            self.hot
                .get(row)
                .is_some_and(|hot| hot.key >> 8 == u32::from(index))
        });
        if known {
            Abort::NO_SUB_INDEX
        } else {
            Abort::NO_OBJECT
        }
    }

    /// The highest sub-index of `index`, which sub-index 0 reads as where no row declares it;
    /// `None` if the index has only sub-index 0 or does not exist.
    pub fn highest_sub_index(&self, index: u16) -> Option<u8> {
        let after = self
            .hot
            .partition_point(|hot| hot.key <= (u32::from(index) << 8 | 0xFF));
        let last = self.hot.get(after.checked_sub(1)?)?;
        let highest = last.key.wrapping_add(u32::from(last.count)).wrapping_sub(1);
        (highest >> 8 == u32::from(index) && highest & 0xFF != 0).then_some(highest as u8)
    }

    /// Fills `image` with the defaults for `node`.
    pub fn defaults(&self, image: &mut crate::Image<'_>, node: NodeId) {
        self.defaults_where(image, node, |_| true);
    }

    /// Fills the communication parameters that can be stored with their defaults for `node`.
    pub(crate) fn communication_defaults(&self, image: &mut crate::Image<'_>, node: NodeId) {
        self.defaults_where(image, node, |row| {
            row.address.is_communication() && !matches!(row.group, crate::Group::None)
        });
    }

    fn defaults_where(
        &self,
        image: &mut crate::Image<'_>,
        node: NodeId,
        wanted: impl Fn(&Row) -> bool,
    ) {
        for (hot, row) in self
            .hot
            .iter()
            .zip(self.rows)
            .filter(|(_, row)| wanted(row))
        {
            let raw = match (row.default, row.data_type) {
                (Default::Value(value), _) => value as u64,
                (Default::Real(value), DataType::F64) => f64::from(value).to_bits(),
                (Default::Real(value), _) => u64::from(value.to_bits()),
                (Default::PlusNode(base), _) => u64::from(base.wrapping_add(u32::from(node.get()))),
                (Default::Text(text), _) => {
                    for step in 0..hot.count {
                        image.set_bytes(hot.field.nth(u16::from(step)), text.as_bytes());
                    }
                    continue;
                }
            };
            for step in 0..hot.count {
                image.set_bytes(hot.field.nth(u16::from(step)), &raw.to_le_bytes());
            }
        }
    }
}
