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
    /// INTEGER64.
    I64,
    /// UNSIGNED64.
    U64,
    /// REAL64.
    F64,
    /// VISIBLE_STRING: constant in flash, or as many bytes in the image as its row says.
    Text,
    /// OCTET_STRING: as many bytes in the image as its row says.
    Bytes,
    /// DOMAIN: a stream of the owner's; nothing in the image.
    Domain,
}

impl DataType {
    /// Bytes in the image and on the wire; 0 for strings, whose length the row says, and streams.
    #[inline]
    pub const fn size(self) -> u8 {
        match self {
            DataType::Bool | DataType::I8 | DataType::U8 => 1,
            DataType::I16 | DataType::U16 => 2,
            DataType::I32 | DataType::U32 | DataType::F32 => 4,
            DataType::I64 | DataType::U64 | DataType::F64 => 8,
            DataType::Text | DataType::Bytes | DataType::Domain => 0,
        }
    }

    /// Bits in a PDO: a BOOLEAN is one (CiA 301 7.1.4.2); 0 for what no PDO carries.
    #[inline]
    pub const fn bits(self) -> u8 {
        match self {
            DataType::Bool => 1,
            other => other.size() * 8,
        }
    }

    /// Whether it is a number or a BOOLEAN, of a length that the type alone says.
    pub const fn is_number(self) -> bool {
        self.size() != 0
    }

    /// The index in the dictionary's area of static data types (CiA 301 table 44).
    pub const fn code(self) -> u16 {
        match self {
            DataType::Bool => 0x0001,
            DataType::I8 => 0x0002,
            DataType::I16 => 0x0003,
            DataType::I32 => 0x0004,
            DataType::U8 => 0x0005,
            DataType::U16 => 0x0006,
            DataType::U32 => 0x0007,
            DataType::F32 => 0x0008,
            DataType::Text => 0x0009,
            DataType::Bytes => 0x000A,
            DataType::Domain => 0x000F,
            DataType::F64 => 0x0011,
            DataType::I64 => 0x0015,
            DataType::U64 => 0x001B,
        }
    }

    /// Whether the type is an integer with a sign.
    pub const fn is_signed(self) -> bool {
        matches!(
            self,
            DataType::I8 | DataType::I16 | DataType::I32 | DataType::I64
        )
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
            DataType::I64 => "INTEGER64",
            DataType::U64 => "UNSIGNED64",
            DataType::F64 => "REAL64",
            DataType::Text => "VISIBLE_STRING",
            DataType::Bytes => "OCTET_STRING",
            DataType::Domain => "DOMAIN",
        }
    }

    /// The smallest and greatest value of an integer type, as far as an `i64` can say it; `None` for
    /// the others.
    pub const fn bounds(self) -> Option<(i64, i64)> {
        match self {
            DataType::Bool => Some((0, 1)),
            DataType::I8 => Some((i8::MIN as i64, i8::MAX as i64)),
            DataType::I16 => Some((i16::MIN as i64, i16::MAX as i64)),
            DataType::I32 => Some((i32::MIN as i64, i32::MAX as i64)),
            DataType::U8 => Some((0, u8::MAX as i64)),
            DataType::U16 => Some((0, u16::MAX as i64)),
            DataType::U32 => Some((0, u32::MAX as i64)),
            DataType::I64 => Some((i64::MIN, i64::MAX)),
            DataType::U64 => Some((0, i64::MAX)),
            DataType::F32 | DataType::F64 | DataType::Text | DataType::Bytes | DataType::Domain => {
                None
            }
        }
    }

    /// Four little-endian bytes (as an expedited transfer carries them) as a number, sign
    /// extended. Real numbers are truncated toward zero; what is no number of at most four bytes is
    /// 0, see [`DataType::wide_number`].
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
            DataType::I64
            | DataType::U64
            | DataType::F64
            | DataType::Text
            | DataType::Bytes
            | DataType::Domain => 0,
        }
    }

    /// Eight little-endian bytes as a number. An UNSIGNED64 above the greatest `i64` is that; real
    /// numbers are truncated toward zero.
    pub const fn wide_number(self, raw: u64) -> i64 {
        match self {
            DataType::I64 => raw as i64,
            DataType::U64 if raw > i64::MAX as u64 => i64::MAX,
            DataType::U64 => raw as i64,
            DataType::F64 => f64::from_bits(raw) as i64,
            narrow => narrow.number(raw as u32),
        }
    }
}

/// A Rust type that stands for a [`DataType`] in typed handles.
pub trait Wire: Copy {
    /// The dictionary type.
    const TYPE: DataType;
    /// From the low bytes, as an image and the wire hold them.
    fn from_raw(raw: u64) -> Self;
    /// To the low bytes.
    fn to_raw(self) -> u64;
}

macro_rules! wire {
    ($($rust:ty, $unsigned:ty, $kind:ident;)*) => {$(
        impl Wire for $rust {
            const TYPE: DataType = DataType::$kind;
            #[inline(always)]
            fn from_raw(raw: u64) -> Self {
                raw as $rust
            }
            #[inline(always)]
            fn to_raw(self) -> u64 {
                self as $unsigned as u64
            }
        }
    )*};
}

wire! {
    u8, u8, U8;
    u16, u16, U16;
    u32, u32, U32;
    u64, u64, U64;
    i8, u8, I8;
    i16, u16, I16;
    i32, u32, I32;
    i64, u64, I64;
}

impl Wire for f32 {
    const TYPE: DataType = DataType::F32;
    #[inline(always)]
    fn from_raw(raw: u64) -> Self {
        f32::from_bits(raw as u32)
    }
    #[inline(always)]
    fn to_raw(self) -> u64 {
        u64::from(self.to_bits())
    }
}

impl Wire for f64 {
    const TYPE: DataType = DataType::F64;
    #[inline(always)]
    fn from_raw(raw: u64) -> Self {
        f64::from_bits(raw)
    }
    #[inline(always)]
    fn to_raw(self) -> u64 {
        self.to_bits()
    }
}

impl Wire for bool {
    const TYPE: DataType = DataType::Bool;
    #[inline(always)]
    fn from_raw(raw: u64) -> Self {
        raw & 0xFF != 0
    }
    #[inline(always)]
    fn to_raw(self) -> u64 {
        self as u64
    }
}
