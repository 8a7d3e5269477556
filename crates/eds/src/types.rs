//! The codes of CiA 301 and 306: object types, data types, access types.

/// The object code of CiA 301 7.4.3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ObjectType {
    /// 0x0: a dictionary entry without data.
    Null,
    /// 0x2: a large variable amount of data.
    Domain,
    /// 0x5: a type definition.
    DefType,
    /// 0x6: a record type definition.
    DefStruct,
    /// 0x7: a single value; also where `ObjectType` is missing (CiA 306).
    #[default]
    Var,
    /// 0x8: sub-objects of one type.
    Array,
    /// 0x9: sub-objects of several types.
    Record,
}

impl ObjectType {
    /// From its code.
    pub const fn from_code(code: u64) -> Option<ObjectType> {
        Some(match code {
            0 => ObjectType::Null,
            2 => ObjectType::Domain,
            5 => ObjectType::DefType,
            6 => ObjectType::DefStruct,
            7 => ObjectType::Var,
            8 => ObjectType::Array,
            9 => ObjectType::Record,
            _ => return None,
        })
    }

    /// Its code.
    pub const fn code(self) -> u8 {
        match self {
            ObjectType::Null => 0,
            ObjectType::Domain => 2,
            ObjectType::DefType => 5,
            ObjectType::DefStruct => 6,
            ObjectType::Var => 7,
            ObjectType::Array => 8,
            ObjectType::Record => 9,
        }
    }

    /// The standard's name.
    pub const fn name(self) -> &'static str {
        match self {
            ObjectType::Null => "NULL",
            ObjectType::Domain => "DOMAIN",
            ObjectType::DefType => "DEFTYPE",
            ObjectType::DefStruct => "DEFSTRUCT",
            ObjectType::Var => "VAR",
            ObjectType::Array => "ARRAY",
            ObjectType::Record => "RECORD",
        }
    }

    /// Whether such an object has sub-objects.
    pub const fn has_subs(self) -> bool {
        matches!(
            self,
            ObjectType::Array | ObjectType::Record | ObjectType::DefStruct
        )
    }
}

/// Who may read and write an object (CiA 306, `AccessType`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// `const`: never changes.
    Constant,
    /// `ro`: read only.
    ReadOnly,
    /// `wo`: write only.
    WriteOnly,
    /// `rw`: read and write.
    ReadWrite,
    /// `rwr`: read and write, mapped into transmit PDOs only.
    ReadWriteInput,
    /// `rww`: read and write, mapped into receive PDOs only.
    ReadWriteOutput,
}

impl Access {
    /// The standard's word.
    pub const fn name(self) -> &'static str {
        match self {
            Access::Constant => "const",
            Access::ReadOnly => "ro",
            Access::WriteOnly => "wo",
            Access::ReadWrite => "rw",
            Access::ReadWriteInput => "rwr",
            Access::ReadWriteOutput => "rww",
        }
    }

    /// From a word in any case; the second value says whether that is the standard's word.
    pub(crate) fn from_word(word: &str) -> Option<(Access, bool)> {
        let lower = word.to_ascii_lowercase();
        Some(match lower.as_str() {
            "const" => (Access::Constant, true),
            "ro" => (Access::ReadOnly, true),
            "wo" => (Access::WriteOnly, true),
            "rw" => (Access::ReadWrite, true),
            "rwr" => (Access::ReadWriteInput, true),
            "rww" => (Access::ReadWriteOutput, true),
            "constant" => (Access::Constant, false),
            "r" => (Access::ReadOnly, false),
            "w" => (Access::WriteOnly, false),
            "wr" => (Access::ReadWrite, false),
            _ => return None,
        })
    }

    /// Whether an SDO may read it.
    pub const fn readable(self) -> bool {
        !matches!(self, Access::WriteOnly)
    }

    /// Whether an SDO may write it.
    pub const fn writable(self) -> bool {
        !matches!(self, Access::Constant | Access::ReadOnly)
    }
}

/// A data type's code (CiA 301 7.4.7): a standard type, or an index of the dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DataType(pub u16);

/// What values of a data type are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 0 or 1.
    Boolean,
    /// A number with a sign, of so many bits.
    Signed(u8),
    /// A number without a sign, of so many bits.
    Unsigned(u8),
    /// REAL32.
    Real32,
    /// REAL64.
    Real64,
    /// Characters.
    Text,
    /// Bytes.
    Bytes,
    /// Times of 48 bits, and everything that the standard's static types do not say.
    Other,
}

impl DataType {
    /// BOOLEAN.
    pub const BOOLEAN: DataType = DataType(0x01);
    /// INTEGER8.
    pub const INTEGER8: DataType = DataType(0x02);
    /// INTEGER16.
    pub const INTEGER16: DataType = DataType(0x03);
    /// INTEGER32.
    pub const INTEGER32: DataType = DataType(0x04);
    /// UNSIGNED8.
    pub const UNSIGNED8: DataType = DataType(0x05);
    /// UNSIGNED16.
    pub const UNSIGNED16: DataType = DataType(0x06);
    /// UNSIGNED32.
    pub const UNSIGNED32: DataType = DataType(0x07);
    /// REAL32.
    pub const REAL32: DataType = DataType(0x08);
    /// VISIBLE_STRING.
    pub const VISIBLE_STRING: DataType = DataType(0x09);
    /// OCTET_STRING.
    pub const OCTET_STRING: DataType = DataType(0x0A);
    /// UNICODE_STRING.
    pub const UNICODE_STRING: DataType = DataType(0x0B);
    /// DOMAIN.
    pub const DOMAIN: DataType = DataType(0x0F);
    /// REAL64.
    pub const REAL64: DataType = DataType(0x11);
    /// INTEGER64.
    pub const INTEGER64: DataType = DataType(0x15);
    /// UNSIGNED64.
    pub const UNSIGNED64: DataType = DataType(0x1B);

    /// The standard's name and what its values are; `None` for types that only the file can define.
    const fn standard(self) -> Option<(&'static str, Kind)> {
        Some(match self.0 {
            0x01 => ("BOOLEAN", Kind::Boolean),
            0x02 => ("INTEGER8", Kind::Signed(8)),
            0x03 => ("INTEGER16", Kind::Signed(16)),
            0x04 => ("INTEGER32", Kind::Signed(32)),
            0x05 => ("UNSIGNED8", Kind::Unsigned(8)),
            0x06 => ("UNSIGNED16", Kind::Unsigned(16)),
            0x07 => ("UNSIGNED32", Kind::Unsigned(32)),
            0x08 => ("REAL32", Kind::Real32),
            0x09 => ("VISIBLE_STRING", Kind::Text),
            0x0A => ("OCTET_STRING", Kind::Bytes),
            0x0B => ("UNICODE_STRING", Kind::Text),
            0x0C => ("TIME_OF_DAY", Kind::Other),
            0x0D => ("TIME_DIFFERENCE", Kind::Other),
            0x0F => ("DOMAIN", Kind::Bytes),
            0x10 => ("INTEGER24", Kind::Signed(24)),
            0x11 => ("REAL64", Kind::Real64),
            0x12 => ("INTEGER40", Kind::Signed(40)),
            0x13 => ("INTEGER48", Kind::Signed(48)),
            0x14 => ("INTEGER56", Kind::Signed(56)),
            0x15 => ("INTEGER64", Kind::Signed(64)),
            0x16 => ("UNSIGNED24", Kind::Unsigned(24)),
            0x18 => ("UNSIGNED40", Kind::Unsigned(40)),
            0x19 => ("UNSIGNED48", Kind::Unsigned(48)),
            0x1A => ("UNSIGNED56", Kind::Unsigned(56)),
            0x1B => ("UNSIGNED64", Kind::Unsigned(64)),
            // Record types of CiA 301 7.4.8.
            0x20 => ("PDO_COMMUNICATION_PARAMETER", Kind::Other),
            0x21 => ("PDO_MAPPING", Kind::Other),
            0x22 => ("SDO_PARAMETER", Kind::Other),
            0x23 => ("IDENTITY", Kind::Other),
            _ => return None,
        })
    }

    /// The standard's name, if it is a type of the standard.
    pub const fn name(self) -> Option<&'static str> {
        match self.standard() {
            Some((name, _)) => Some(name),
            None => None,
        }
    }

    /// What its values are.
    pub const fn kind(self) -> Kind {
        match self.standard() {
            Some((_, kind)) => kind,
            None => Kind::Other,
        }
    }
}

impl Kind {
    /// The smallest and greatest value of a number type.
    pub const fn bounds(self) -> Option<(i128, i128)> {
        match self {
            Kind::Boolean => Some((0, 1)),
            Kind::Signed(bits) => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Kind::Unsigned(bits) => Some((0, (1 << bits) - 1)),
            _ => None,
        }
    }

    /// Bytes on the wire of types that have a fixed size.
    pub const fn size(self) -> Option<usize> {
        match self {
            Kind::Boolean => Some(1),
            Kind::Signed(bits) | Kind::Unsigned(bits) => Some(bits as usize / 8),
            Kind::Real32 => Some(4),
            Kind::Real64 => Some(8),
            Kind::Text | Kind::Bytes | Kind::Other => None,
        }
    }
}
