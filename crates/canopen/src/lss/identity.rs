//! The LSS address: the identity object 0x1018, which no two devices share.

/// One of the four numbers of an LSS address, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Part {
    /// Vendor ID, 0x1018,1.
    Vendor = 0,
    /// Product code, 0x1018,2.
    Product = 1,
    /// Revision number, 0x1018,3.
    Revision = 2,
    /// Serial number, 0x1018,4.
    Serial = 3,
}

impl Part {
    /// All four, in their order.
    pub const ALL: [Part; 4] = [Part::Vendor, Part::Product, Part::Revision, Part::Serial];

    /// From the number that fastscan gives it, 0 to 3.
    pub const fn from_number(number: u8) -> Option<Part> {
        Some(match number {
            0 => Part::Vendor,
            1 => Part::Product,
            2 => Part::Revision,
            3 => Part::Serial,
            _ => return None,
        })
    }

    /// The number that fastscan gives it, 0 to 3.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The one behind it; `None` behind the last.
    pub const fn following(self) -> Option<Part> {
        match self {
            Part::Vendor => Some(Part::Product),
            Part::Product => Some(Part::Revision),
            Part::Revision => Some(Part::Serial),
            Part::Serial => None,
        }
    }
}

impl core::fmt::Display for Part {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Part::Vendor => "vendor ID",
            Part::Product => "product code",
            Part::Revision => "revision number",
            Part::Serial => "serial number",
        })
    }
}

/// An LSS address, 128 bits in four numbers (CiA 301 7.5.2.19).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Identity {
    /// Vendor ID, 0x1018,1.
    pub vendor: u32,
    /// Product code, 0x1018,2.
    pub product: u32,
    /// Revision number, 0x1018,3.
    pub revision: u32,
    /// Serial number, 0x1018,4.
    pub serial: u32,
}

impl Identity {
    /// One of the four numbers.
    pub const fn get(&self, part: Part) -> u32 {
        match part {
            Part::Vendor => self.vendor,
            Part::Product => self.product,
            Part::Revision => self.revision,
            Part::Serial => self.serial,
        }
    }

    /// Replaces one of the four numbers.
    pub const fn set(&mut self, part: Part, number: u32) {
        match part {
            Part::Vendor => self.vendor = number,
            Part::Product => self.product = number,
            Part::Revision => self.revision = number,
            Part::Serial => self.serial = number,
        }
    }
}

/// `0x00000408:0x00000003:0x00010002:0x00000BBC`, as the command line takes it.
impl core::fmt::Display for Identity {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Identity {
            vendor,
            product,
            revision,
            serial,
        } = self;
        write!(
            f,
            "0x{vendor:08X}:0x{product:08X}:0x{revision:08X}:0x{serial:08X}"
        )
    }
}
