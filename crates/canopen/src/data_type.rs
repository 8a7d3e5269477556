//! The static data types of CiA 301 (7.4.7) that a dictionary row may have.

/// The type of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum DataType {
    /// BOOLEAN: one byte, 0 or 1.
    Bool,
    /// INTEGER8.
    I8,
    /// INTEGER16.
    I16,
    /// INTEGER32.
    I32,
    /// UNSIGNED8.
    U8,
    /// UNSIGNED16.
    U16,
    /// UNSIGNED32.
    U32,
    /// REAL32.
    F32,
    /// VISIBLE_STRING, constant.
    Text,
}

impl DataType {
    /// Bytes in the image and on the wire; 0 for text, whose length its row says.
    #[inline]
    pub const fn size(self) -> u8 {
        match self {
            DataType::Bool | DataType::I8 | DataType::U8 => 1,
            DataType::I16 | DataType::U16 => 2,
            DataType::I32 | DataType::U32 | DataType::F32 => 4,
            DataType::Text => 0,
        }
    }

    /// Whether the type is an integer with a sign.
    pub const fn is_signed(self) -> bool {
        matches!(self, DataType::I8 | DataType::I16 | DataType::I32)
    }

    /// The standard's name.
    pub const fn name(self) -> &'static str {
        match self {
            DataType::Bool => "BOOLEAN",
            DataType::I8 => "INTEGER8",
            DataType::I16 => "INTEGER16",
            DataType::I32 => "INTEGER32",
            DataType::U8 => "UNSIGNED8",
            DataType::U16 => "UNSIGNED16",
            DataType::U32 => "UNSIGNED32",
            DataType::F32 => "REAL32",
            DataType::Text => "VISIBLE_STRING",
        }
    }

    /// The smallest and greatest value of an integer type; `None` for the others.
    pub const fn bounds(self) -> Option<(i64, i64)> {
        match self {
            DataType::Bool => Some((0, 1)),
            DataType::I8 => Some((i8::MIN as i64, i8::MAX as i64)),
            DataType::I16 => Some((i16::MIN as i64, i16::MAX as i64)),
            DataType::I32 => Some((i32::MIN as i64, i32::MAX as i64)),
            DataType::U8 => Some((0, u8::MAX as i64)),
            DataType::U16 => Some((0, u16::MAX as i64)),
            DataType::U32 => Some((0, u32::MAX as i64)),
            DataType::F32 | DataType::Text => None,
        }
    }

    /// Four little-endian bytes (as an expedited transfer carries them) as a number, sign
    /// extended. Real numbers are truncated toward zero; text is 0.
    #[inline]
    pub const fn number(self, raw: u32) -> i64 {
        match self {
            DataType::Bool | DataType::U8 => (raw & 0xFF) as i64,
            DataType::U16 => (raw & 0xFFFF) as i64,
            DataType::U32 => raw as i64,
            DataType::I8 => raw as u8 as i8 as i64,
            DataType::I16 => raw as u16 as i16 as i64,
            DataType::I32 => raw as i32 as i64,
            DataType::F32 => f32::from_bits(raw) as i64,
            DataType::Text => 0,
        }
    }
}

/// A Rust type that stands for a [`DataType`] in typed handles.
pub trait Wire: Copy {
    /// The dictionary type.
    const TYPE: DataType;
    /// From the low bytes of an expedited transfer.
    fn from_raw(raw: u32) -> Self;
    /// To the low bytes of an expedited transfer.
    fn to_raw(self) -> u32;
}

macro_rules! wire {
    ($($rust:ty, $unsigned:ty, $kind:ident;)*) => {$(
        impl Wire for $rust {
            const TYPE: DataType = DataType::$kind;
            #[inline(always)]
            fn from_raw(raw: u32) -> Self {
                raw as $rust
            }
            #[inline(always)]
            fn to_raw(self) -> u32 {
                self as $unsigned as u32
            }
        }
    )*};
}

wire! {
    u8, u8, U8;
    u16, u16, U16;
    u32, u32, U32;
    i8, u8, I8;
    i16, u16, I16;
    i32, u32, I32;
}

impl Wire for f32 {
    const TYPE: DataType = DataType::F32;
    #[inline(always)]
    fn from_raw(raw: u32) -> Self {
        f32::from_bits(raw)
    }
    #[inline(always)]
    fn to_raw(self) -> u32 {
        self.to_bits()
    }
}

impl Wire for bool {
    const TYPE: DataType = DataType::Bool;
    #[inline(always)]
    fn from_raw(raw: u32) -> Self {
        raw & 0xFF != 0
    }
    #[inline(always)]
    fn to_raw(self) -> u32 {
        self as u32
    }
}
