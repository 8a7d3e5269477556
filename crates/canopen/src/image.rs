//! The values of a dictionary: one little-endian byte image per node.

use core::marker::PhantomData;

use crate::{DataType, Wire};

/// A typed place in the image, resolved at compile time by [`crate::Dictionary::handle`].
///
/// ```
/// use canopen::{Dictionary, Handle, Image, dictionary, row::u16};
/// const OBJECTS: Dictionary<1> = dictionary::layout(&[&[u16(0x6041, 0, "Statusword")]]);
/// const STATUSWORD: Handle<u16> = OBJECTS.handle(0x6041, 0);
/// let mut bytes = [0; OBJECTS.image_bytes()];
/// Image::new(&mut bytes).set(STATUSWORD, 0x0250);
/// assert_eq!(bytes, [0x50, 0x02]);
/// ```
///
/// What cannot be right does not compile. A handle of another type than the object's:
/// ```compile_fail
/// # use canopen::{Dictionary, Handle, dictionary, row::u16};
/// # const OBJECTS: Dictionary<1> = dictionary::layout(&[&[u16(0x6041, 0, "Statusword")]]);
/// const STATUSWORD: Handle<i16> = OBJECTS.handle(0x6041, 0);
/// ```
/// also where the object may be missing:
/// ```compile_fail
/// # use canopen::{Dictionary, Handle, dictionary, row::u16};
/// # const OBJECTS: Dictionary<1> = dictionary::layout(&[&[u16(0x6041, 0, "Statusword")]]);
/// const STATUSWORD: Option<Handle<u32>> = OBJECTS.optional(0x6041, 0);
/// ```
/// An object that is not there:
/// ```compile_fail
/// # use canopen::{Dictionary, Handle, dictionary, row::u16};
/// # const OBJECTS: Dictionary<1> = dictionary::layout(&[&[u16(0x6041, 0, "Statusword")]]);
/// const CONTROLWORD: Handle<u16> = OBJECTS.handle(0x6040, 0);
/// ```
/// A value of another type than the handle's:
/// ```compile_fail,E0308
/// # use canopen::{Dictionary, Handle, Image, dictionary, row::u16};
/// # const OBJECTS: Dictionary<1> = dictionary::layout(&[&[u16(0x6041, 0, "Statusword")]]);
/// # const STATUSWORD: Handle<u16> = OBJECTS.handle(0x6041, 0);
/// # let mut bytes = [0; OBJECTS.image_bytes()];
/// Image::new(&mut bytes).set(STATUSWORD, 0.5);
/// ```
pub struct Handle<T> {
    offset: u16,
    kind: PhantomData<fn() -> T>,
}

impl<T> Handle<T> {
    pub(crate) const fn at(offset: u16) -> Handle<T> {
        Handle {
            offset,
            kind: PhantomData,
        }
    }
}

impl<T: Wire> Handle<T> {
    /// The same place without its Rust type.
    pub const fn field(self) -> Field {
        Field::new(self.offset, T::TYPE)
    }
}

impl<T> Clone for Handle<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Handle<T> {}

impl<T> core::fmt::Debug for Handle<T> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Handle({})", self.offset)
    }
}

/// A place in the image with its type known at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    offset: u16,
    data_type: DataType,
    /// Of `data_type`, at hand for every copy.
    size: u8,
}

impl Field {
    pub(crate) const fn new(offset: u16, data_type: DataType) -> Field {
        Field::sized(offset, data_type, data_type.size())
    }

    /// A place whose `size` the type does not say: a string's.
    pub(crate) const fn sized(offset: u16, data_type: DataType, size: u8) -> Field {
        Field {
            offset,
            data_type,
            size,
        }
    }

    /// Where it lies in the image; for text in flash, its length.
    #[inline]
    pub(crate) const fn offset(self) -> u16 {
        self.offset
    }

    /// The place of the `step`th value of the same type after this one.
    #[inline]
    pub(crate) const fn nth(self, step: u16) -> Field {
        Field {
            offset: self
                .offset
                .wrapping_add(step.wrapping_mul(self.size as u16)),
            ..self
        }
    }

    /// The object's type.
    pub const fn data_type(self) -> DataType {
        self.data_type
    }

    /// Bytes that it has in the image: of a number its length, of a string the greatest it can
    /// have; 0 for constant text and streams, which are not there.
    #[inline]
    pub const fn size(self) -> u8 {
        self.size
    }
}

/// A node's values, borrowed. Reading a place that is not there gives 0; writing one does nothing:
/// both are impossible with handles of the image's own dictionary.
#[derive(Debug)]
pub struct Image<'a> {
    bytes: &'a mut [u8],
}

impl<'a> Image<'a> {
    /// Over `bytes`, which hold [`crate::Table::image_bytes`].
    #[inline]
    pub fn new(bytes: &'a mut [u8]) -> Image<'a> {
        Image { bytes }
    }

    /// The value of an object.
    #[inline]
    pub fn get<T: Wire>(&self, handle: Handle<T>) -> T {
        let field = handle.field();
        T::from_raw(match T::TYPE.size() {
            8 => self.wide(field),
            _ => u64::from(self.raw(field)),
        })
    }

    /// Sets the value of an object.
    #[inline]
    pub fn set<T: Wire>(&mut self, handle: Handle<T>, value: T) {
        let field = handle.field();
        match T::TYPE.size() {
            8 => self.set_bytes(field, &value.to_raw().to_le_bytes()),
            _ => self.set_raw(field, value.to_raw() as u32),
        }
    }

    /// The bytes of a number of at most four, zero extended to four; 0 for everything else.
    #[inline]
    pub fn raw(&self, field: Field) -> u32 {
        raw(self.bytes, field)
    }

    /// The bytes of a number of at most eight, zero extended to eight; 0 for everything else.
    pub fn wide(&self, field: Field) -> u64 {
        wide(self.bytes, field)
    }

    /// All of a value's bytes; none for what is not in the image.
    pub fn bytes(&self, field: Field) -> &[u8] {
        bytes(self.bytes, field)
    }

    /// Sets a value's bytes; where `value` ends before it, the rest becomes 0.
    pub fn set_bytes(&mut self, field: Field, value: &[u8]) {
        let at = usize::from(field.offset);
        let Some(place) = self.bytes.get_mut(at..at + usize::from(field.size())) else {
            return;
        };
        for (n, byte) in place.iter_mut().enumerate() {
            *byte = value.get(n).copied().unwrap_or(0);
        }
    }

    /// Sets the value's bytes from the low ones of `raw`.
    #[inline]
    pub fn set_raw(&mut self, field: Field, raw: u32) {
        let at = usize::from(field.offset);
        match field.size() {
            1 => {
                if let Some(byte) = self.bytes.get_mut(at) {
                    *byte = raw as u8;
                }
            }
            2 => {
                if let Some(bytes) = self
                    .bytes
                    .get_mut(at..)
                    .and_then(|rest| rest.first_chunk_mut::<2>())
                {
                    *bytes = (raw as u16).to_le_bytes();
                }
            }
            4 => {
                if let Some(bytes) = self
                    .bytes
                    .get_mut(at..)
                    .and_then(|rest| rest.first_chunk_mut::<4>())
                {
                    *bytes = raw.to_le_bytes();
                }
            }
            _ => {}
        }
    }

    /// The value as a number, sign extended; a real number is truncated.
    #[inline]
    pub fn number(&self, field: Field) -> i64 {
        match field.size() {
            8 => field.data_type.wide_number(self.wide(field)),
            _ => field.data_type.number(self.raw(field)),
        }
    }

    /// The value as a real number.
    #[inline]
    pub fn real(&self, field: Field) -> f32 {
        match field.data_type {
            DataType::F32 => f32::from_bits(self.raw(field)),
            DataType::F64 => f64::from_bits(self.wide(field)) as f32,
            _ => self.number(field) as f32,
        }
    }

    /// Stores a number, held within the object's type.
    #[inline]
    pub fn set_number(&mut self, field: Field, value: i64) {
        if field.size() == 8 {
            let raw = match field.data_type {
                DataType::F64 => (value as f64).to_bits(),
                DataType::U64 if value < 0 => 0,
                _ => value as u64,
            };
            return self.set_bytes(field, &raw.to_le_bytes());
        }
        let raw = match field.data_type.bounds() {
            Some((low, high)) => {
                if value < low {
                    low as u32
                } else if value > high {
                    high as u32
                } else {
                    value as u32
                }
            }
            None => (value as f32).to_bits(),
        };
        self.set_raw(field, raw);
    }
}

/// The value's bytes, zero extended to four; 0 where `bytes` end before.
#[inline]
pub(crate) fn raw(bytes: &[u8], field: Field) -> u32 {
    let at = usize::from(field.offset);
    match field.size() {
        1 => bytes.get(at).map_or(0, |byte| u32::from(*byte)),
        2 => match bytes.get(at..).and_then(|rest| rest.first_chunk::<2>()) {
            Some(bytes) => u32::from(u16::from_le_bytes(*bytes)),
            None => 0,
        },
        4 => match bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()) {
            Some(bytes) => u32::from_le_bytes(*bytes),
            None => 0,
        },
        _ => 0,
    }
}

/// All of a value's bytes; none where `image` ends before.
pub(crate) fn bytes(image: &[u8], field: Field) -> &[u8] {
    let at = usize::from(field.offset);
    image.get(at..at + usize::from(field.size())).unwrap_or(&[])
}

/// The value's bytes, zero extended to eight; 0 for one that has more.
pub(crate) fn wide(image: &[u8], field: Field) -> u64 {
    let bytes = bytes(image, field);
    let mut raw = [0; 8];
    match raw.get_mut(..bytes.len()) {
        Some(place) => place.copy_from_slice(bytes),
        None => return 0,
    }
    u64::from_le_bytes(raw)
}
