//! SDO abort codes.

/// An SDO abort code (CiA 301, 7.2.4.3.17). Unknown codes are kept as they came.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Abort(pub u32);

macro_rules! aborts {
    ($($name:ident = $code:literal, $text:literal;)*) => {
        impl Abort {
            $(#[doc = $text] pub const $name: Abort = Abort($code);)*

            /// Every code that the standard names.
            pub const ALL: &[Abort] = &[$(Abort::$name),*];

            /// What the code means, in the standard's terms; `None` for an unknown code.
            pub const fn text(self) -> Option<&'static str> {
                match self.0 {
                    $($code => Some($text),)*
                    _ => None,
                }
            }
        }
    };
}

aborts! {
    TOGGLE = 0x0503_0000, "toggle bit not alternated";
    TIMED_OUT = 0x0504_0000, "SDO protocol timed out";
    COMMAND = 0x0504_0001, "client/server command specifier not valid or unknown";
    BLOCK_SIZE = 0x0504_0002, "invalid block size";
    SEQUENCE_NUMBER = 0x0504_0003, "invalid sequence number";
    CRC = 0x0504_0004, "CRC error";
    OUT_OF_MEMORY = 0x0504_0005, "out of memory";
    UNSUPPORTED_ACCESS = 0x0601_0000, "unsupported access to an object";
    WRITE_ONLY = 0x0601_0001, "attempt to read a write-only object";
    READ_ONLY = 0x0601_0002, "attempt to write a read-only object";
    NO_OBJECT = 0x0602_0000, "object does not exist in the object dictionary";
    NOT_MAPPABLE = 0x0604_0041, "object cannot be mapped to the PDO";
    MAP_TOO_LONG = 0x0604_0042, "number and length of the mapped objects would exceed the PDO length";
    PARAMETER_INCOMPATIBLE = 0x0604_0043, "general parameter incompatibility";
    INTERNAL_INCOMPATIBLE = 0x0604_0047, "general internal incompatibility in the device";
    HARDWARE = 0x0606_0000, "access failed due to a hardware error";
    LENGTH = 0x0607_0010, "data type does not match, length of service parameter does not match";
    TOO_LONG = 0x0607_0012, "data type does not match, length of service parameter too high";
    TOO_SHORT = 0x0607_0013, "data type does not match, length of service parameter too low";
    NO_SUB_INDEX = 0x0609_0011, "sub-index does not exist";
    INVALID_VALUE = 0x0609_0030, "invalid value for parameter";
    VALUE_TOO_HIGH = 0x0609_0031, "value of parameter written too high";
    VALUE_TOO_LOW = 0x0609_0032, "value of parameter written too low";
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036, "maximum value is less than minimum value";
    NOT_AVAILABLE = 0x060A_0023, "resource not available: SDO connection";
    GENERAL = 0x0800_0000, "general error";
    CANNOT_STORE = 0x0800_0020, "data cannot be transferred or stored to the application";
    LOCAL_CONTROL = 0x0800_0021, "data cannot be transferred or stored because of local control";
    DEVICE_STATE = 0x0800_0022, "data cannot be transferred or stored because of the present device state";
    NO_DICTIONARY = 0x0800_0023, "object dictionary not present or its dynamic generation fails";
    NO_DATA = 0x0800_0024, "no data available";
}

impl core::fmt::Display for Abort {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "0x{:08X}: {}",
            self.0,
            self.text().unwrap_or("unknown abort code")
        )
    }
}

impl core::fmt::Debug for Abort {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Abort(0x{:08X})", self.0)
    }
}

impl core::error::Error for Abort {}
