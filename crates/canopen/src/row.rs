//! One row of an object dictionary, written so that it reads like the manual's line.
//!
//! ```
//! use canopen::{Group, Row, row::{u16, u32}};
//! const ROWS: &[Row] = &[
//!     u16(0x6040, 0, "Controlword").rw().rpdo().asks(),
//!     u32(0x1014, 0, "COB-ID EMCY").rw().default_plus_node(0x80).store(Group::Communication),
//!     u32(0x1600, 1, "Mapped object").subs(4).rw(),
//! ];
//! ```

use crate::{Abort, DataType};

/// Index and sub-index of an object.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl Address {
    /// The object at `index`, `sub`.
    pub const fn new(index: u16, sub: u8) -> Address {
        Address { index, sub }
    }

    /// Whether the object lies in the communication area, 0x1000 to 0x1FFF (CiA 301 7.4.1).
    pub const fn is_communication(self) -> bool {
        self.index >= 0x1000 && self.index < 0x2000
    }

    #[inline]
    pub(crate) const fn key(self) -> u32 {
        (self.index as u32) << 8 | self.sub as u32
    }

    /// From `index << 8 | sub`, the form in which the P3's 0x1010,4 names an object.
    pub const fn from_key(key: u32) -> Option<Address> {
        if key >> 24 != 0 {
            return None;
        }
        Some(Address {
            index: (key >> 8) as u16,
            sub: key as u8,
        })
    }
}

impl core::fmt::Display for Address {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "0x{:04X},{}", self.index, self.sub)
    }
}

impl core::fmt::Debug for Address {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

/// Who may read and write an object by SDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never changes.
    Constant,
    /// Read only; the device changes it.
    ReadOnly,
    /// Read and write.
    ReadWrite,
    /// Write only.
    WriteOnly,
    /// Not from outside: an SDO finds no such object, and no data sheet lists it. The drive keeps in it
    /// what its document gives no object for.
    Internal,
}

/// Which "save" command stores an object (CiA 301 7.5.2.13, sub-index 2 and 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Not stored.
    None,
    /// Communication parameters.
    Communication,
    /// Application parameters.
    Application,
}

/// What an object holds after a reset when nothing was stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// This number.
    Value(i64),
    /// This real number.
    Real(f32),
    /// This number plus the node ID.
    PlusNode(u32),
    /// This text.
    Text(&'static str),
}

pub(crate) mod flag {
    pub(crate) const READ: u16 = 1 << 0;
    pub(crate) const WRITE: u16 = 1 << 1;
    pub(crate) const RPDO: u16 = 1 << 2;
    pub(crate) const TPDO: u16 = 1 << 3;
    pub(crate) const ASKS: u16 = 1 << 4;
    pub(crate) const LIVE: u16 = 1 << 5;
    pub(crate) const RANGE: u16 = 1 << 6;
    /// The index lies in the communication area, whose writes the node itself judges.
    pub(crate) const NODE: u16 = 1 << 7;
    /// Constant text, which is not in the image.
    pub(crate) const FLASH: u16 = 1 << 8;
    /// No number of at most four bytes: expedited transfers and fast copies are not for it.
    pub(crate) const LONG: u16 = 1 << 9;
    /// An entry of the error history, which may hold no data.
    pub(crate) const HISTORY: u16 = 1 << 10;
    /// A save command stores it.
    pub(crate) const STORED: u16 = 1 << 11;
}

/// One object, or a run of sub-indices that are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Index and (first) sub-index.
    pub address: Address,
    /// How many sub-indices this row stands for, 1 or more.
    pub count: u8,
    /// The manual's name.
    pub name: &'static str,
    /// Type.
    pub data_type: DataType,
    /// Bytes of a string in the image; 0 for constant text and all other types.
    pub length: u8,
    /// SDO access.
    pub access: Access,
    /// May be mapped into a receive PDO.
    pub maps_rpdo: bool,
    /// May be mapped into a transmit PDO.
    pub maps_tpdo: bool,
    /// Writes go to the [`crate::Owner`] before they are committed.
    pub asks_owner: bool,
    /// The owner refreshes the value before it is read.
    pub is_live: bool,
    /// Value after reset.
    pub default: Default,
    /// Smallest value that a write may have.
    pub minimum: Option<i64>,
    /// Greatest value that a write may have.
    pub maximum: Option<i64>,
    /// The default 0 lies outside the range: it says that nothing was written yet.
    pub is_unset: bool,
    /// Unit, empty if none.
    pub unit: &'static str,
    /// Which save command stores it.
    pub group: Group,
    /// Class of change, 1 to 31, that the owner is told of after a write; 0: none.
    pub class: u8,
    /// Where in the document the object stands.
    pub reference: &'static str,
}

const fn row(index: u16, sub: u8, name: &'static str, data_type: DataType) -> Row {
    Row {
        address: Address::new(index, sub),
        count: 1,
        name,
        data_type,
        length: 0,
        access: Access::ReadOnly,
        maps_rpdo: false,
        maps_tpdo: false,
        asks_owner: false,
        is_live: false,
        default: Default::Value(0),
        minimum: None,
        maximum: None,
        is_unset: false,
        unit: "",
        group: Group::None,
        class: 0,
        reference: "",
    }
}

/// An UNSIGNED8 object, read only until [`Row::rw`].
pub const fn u8(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::U8)
}

/// An UNSIGNED16 object, read only until [`Row::rw`].
pub const fn u16(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::U16)
}

/// An UNSIGNED32 object, read only until [`Row::rw`].
pub const fn u32(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::U32)
}

/// An INTEGER8 object, read only until [`Row::rw`].
pub const fn i8(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::I8)
}

/// An INTEGER16 object, read only until [`Row::rw`].
pub const fn i16(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::I16)
}

/// An INTEGER32 object, read only until [`Row::rw`].
pub const fn i32(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::I32)
}

/// A REAL32 object, read only until [`Row::rw`].
pub const fn f32(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::F32).default_value(Default::Real(0.0))
}

/// A BOOLEAN object, read only until [`Row::rw`]; no other value than 0 and 1 can be written.
pub const fn bool(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::Bool).range(0, 1)
}

/// An INTEGER64 object, read only until [`Row::rw`].
pub const fn i64(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::I64)
}

/// An UNSIGNED64 object, read only until [`Row::rw`].
pub const fn u64(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::U64)
}

/// A REAL64 object, read only until [`Row::rw`].
pub const fn f64(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::F64).default_value(Default::Real(0.0))
}

/// A VISIBLE_STRING of at most `length` characters in the image, shorter ones ended by a 0. Read
/// only until [`Row::rw`].
pub const fn string(index: u16, sub: u8, name: &'static str, length: u8) -> Row {
    let row = row(index, sub, name, DataType::Text).default_value(Default::Text(""));
    Row { length, ..row }
}

/// An OCTET_STRING of exactly `length` bytes in the image. Read only until [`Row::rw`].
pub const fn bytes(index: u16, sub: u8, name: &'static str, length: u8) -> Row {
    let row = row(index, sub, name, DataType::Bytes).default_value(Default::Text(""));
    Row { length, ..row }
}

/// A DOMAIN: its bytes come from and go to the owner's streams ([`crate::Owner::stream_read`] and
/// its like), any number of them. Read only until [`Row::rw`].
pub const fn domain(index: u16, sub: u8, name: &'static str) -> Row {
    row(index, sub, name, DataType::Domain)
}

/// A constant VISIBLE_STRING, which stays in flash. One of more than 4 characters needs a segmented
/// transfer.
pub const fn text(index: u16, sub: u8, name: &'static str, value: &'static str) -> Row {
    let row = row(index, sub, name, DataType::Text).default_value(Default::Text(value));
    Row {
        access: Access::Constant,
        ..row
    }
}

impl Row {
    /// Read and write.
    pub const fn rw(self) -> Row {
        Row {
            access: Access::ReadWrite,
            ..self
        }
    }

    /// Write only.
    pub const fn wo(self) -> Row {
        Row {
            access: Access::WriteOnly,
            ..self
        }
    }

    /// Never changes.
    pub const fn constant(self) -> Row {
        Row {
            access: Access::Constant,
            ..self
        }
    }

    /// Not to be seen from outside.
    pub const fn internal(self) -> Row {
        Row {
            access: Access::Internal,
            ..self
        }
    }

    /// May be mapped into a receive PDO.
    pub const fn rpdo(self) -> Row {
        Row {
            maps_rpdo: true,
            ..self
        }
    }

    /// May be mapped into a transmit PDO.
    pub const fn tpdo(self) -> Row {
        Row {
            maps_tpdo: true,
            ..self
        }
    }

    /// Every write, by SDO and RPDO alike, goes to [`crate::Owner::write`] first.
    pub const fn asks(self) -> Row {
        Row {
            asks_owner: true,
            ..self
        }
    }

    /// [`crate::Owner::publish`] is called before the value is read or sampled.
    pub const fn live(self) -> Row {
        Row {
            is_live: true,
            ..self
        }
    }

    /// Value after reset.
    pub const fn default(self, value: i64) -> Row {
        self.default_value(Default::Value(value))
    }

    /// Value after reset: `base` plus the node ID.
    pub const fn default_plus_node(self, base: u32) -> Row {
        self.default_value(Default::PlusNode(base))
    }

    /// Value after reset, any kind.
    pub const fn default_value(self, default: Default) -> Row {
        Row { default, ..self }
    }

    /// Range that a write must keep to.
    pub const fn range(self, minimum: i64, maximum: i64) -> Row {
        Row {
            minimum: Some(minimum),
            maximum: Some(maximum),
            ..self
        }
    }

    /// The default 0, outside the range, says that nothing was written yet.
    pub const fn unset(self) -> Row {
        Row {
            is_unset: true,
            ..self
        }
    }

    /// Unit.
    pub const fn unit(self, unit: &'static str) -> Row {
        Row { unit, ..self }
    }

    /// Which save command stores it.
    pub const fn store(self, group: Group) -> Row {
        Row { group, ..self }
    }

    /// After a write, this class (1 to 31) is set in the [`crate::Changed`] that is returned.
    pub const fn tells(self, class: u8) -> Row {
        Row { class, ..self }
    }

    /// A run of `count` sub-indices that are alike, from the row's own on.
    pub const fn subs(self, count: u8) -> Row {
        Row { count, ..self }
    }

    /// Where in the document the object stands.
    pub const fn reference(self, reference: &'static str) -> Row {
        Row { reference, ..self }
    }

    /// Whether an SDO may read it.
    pub const fn readable(&self) -> bool {
        !matches!(self.access, Access::WriteOnly | Access::Internal)
    }

    /// Whether an SDO may write it.
    pub const fn writable(&self) -> bool {
        matches!(self.access, Access::ReadWrite | Access::WriteOnly)
    }

    /// Whether the value whose bytes are `raw` keeps to the row's range.
    ///
    /// # Errors
    /// [`Abort::VALUE_TOO_HIGH`], [`Abort::VALUE_TOO_LOW`], or [`Abort::INVALID_VALUE`] for a real
    /// value that is not a number.
    pub(crate) fn check_range(&self, raw: u32) -> Result<(), Abort> {
        let (above, below) = match self.data_type {
            DataType::F32 => {
                let value = f32::from_bits(raw);
                let limited = self.minimum.is_some() || self.maximum.is_some();
                if limited && value.is_nan() {
                    return Err(Abort::INVALID_VALUE);
                }
                // In 64 bits, because a bound need not be a REAL32.
                let value = f64::from(value);
                (
                    self.maximum.is_some_and(|maximum| value > maximum as f64),
                    self.minimum.is_some_and(|minimum| value < minimum as f64),
                )
            }
            data_type => {
                let value = data_type.number(raw);
                (
                    self.maximum.is_some_and(|maximum| value > maximum),
                    self.minimum.is_some_and(|minimum| value < minimum),
                )
            }
        };
        match (above, below) {
            (true, _) => Err(Abort::VALUE_TOO_HIGH),
            (_, true) => Err(Abort::VALUE_TOO_LOW),
            _ => Ok(()),
        }
    }

    /// Bytes of one sub-index in the image; constant text and streams have none.
    pub(crate) const fn size(&self) -> u8 {
        if self.length != 0 {
            self.length
        } else {
            self.data_type.size()
        }
    }

    /// Whether it is text that stays in flash.
    pub(crate) const fn is_in_flash(&self) -> bool {
        matches!(self.data_type, DataType::Text) && self.length == 0
    }

    /// Like [`Row::check_range`], for eight bytes.
    pub(crate) fn check_wide_range(&self, raw: u64) -> Result<(), Abort> {
        if let DataType::F64 = self.data_type {
            let value = f64::from_bits(raw);
            let limited = self.minimum.is_some() || self.maximum.is_some();
            if limited && value.is_nan() {
                return Err(Abort::INVALID_VALUE);
            }
            if self.maximum.is_some_and(|maximum| value > maximum as f64) {
                return Err(Abort::VALUE_TOO_HIGH);
            }
            if self.minimum.is_some_and(|minimum| value < minimum as f64) {
                return Err(Abort::VALUE_TOO_LOW);
            }
            return Ok(());
        }
        let value = self.data_type.wide_number(raw);
        // An UNSIGNED64 can be more than any maximum says.
        let beyond = matches!(self.data_type, DataType::U64) && raw > i64::MAX as u64;
        if beyond && self.maximum.is_some() {
            return Err(Abort::VALUE_TOO_HIGH);
        }
        if self.maximum.is_some_and(|maximum| value > maximum) {
            return Err(Abort::VALUE_TOO_HIGH);
        }
        if self.minimum.is_some_and(|minimum| value < minimum) {
            return Err(Abort::VALUE_TOO_LOW);
        }
        Ok(())
    }

    pub(crate) const fn flags(&self) -> u16 {
        let mut flags = 0;
        if self.readable() {
            flags |= flag::READ;
        }
        if self.writable() {
            flags |= flag::WRITE;
        }
        if self.maps_rpdo {
            flags |= flag::RPDO;
        }
        if self.maps_tpdo {
            flags |= flag::TPDO;
        }
        if self.asks_owner {
            flags |= flag::ASKS;
        }
        if self.is_live {
            flags |= flag::LIVE;
        }
        if self.minimum.is_some() || self.maximum.is_some() {
            flags |= flag::RANGE;
        }
        if self.address.is_communication() {
            flags |= flag::NODE;
        }
        if self.is_in_flash() {
            flags |= flag::FLASH;
        }
        if !matches!(self.data_type.size(), 1 | 2 | 4) {
            flags |= flag::LONG;
        }
        if !matches!(self.group, Group::None) {
            flags |= flag::STORED;
        }
        if self.address.index == 0x1003 {
            flags |= flag::HISTORY;
        }
        flags
    }
}
