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
        Field {
            offset,
            data_type,
            size: data_type.size(),
        }
    }

    /// Where it lies in the image; for text, its length.
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

    /// Bytes of its value.
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
        T::from_raw(self.raw(handle.field()))
    }

    /// Sets the value of an object.
    #[inline]
    pub fn set<T: Wire>(&mut self, handle: Handle<T>, value: T) {
        self.set_raw(handle.field(), value.to_raw());
    }

    /// The value's bytes, zero extended to four.
    #[inline]
    pub fn raw(&self, field: Field) -> u32 {
        raw(self.bytes, field)
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
        field.data_type.number(self.raw(field))
    }

    /// The value as a real number.
    #[inline]
    pub fn real(&self, field: Field) -> f32 {
        match field.data_type {
            DataType::F32 => f32::from_bits(self.raw(field)),
            _ => self.number(field) as f32,
        }
    }

    /// Stores a number, held within the object's type.
    #[inline]
    pub fn set_number(&mut self, field: Field, value: i64) {
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
