//! Process data objects (CiA 301 7.2.2): mapping, reception, transmission.

mod apply;
mod mapping;
mod receive;
mod transmit;

pub(crate) use mapping::{Direction, Mapping, mapped_entry};
pub(crate) use receive::Rpdo;
pub(crate) use transmit::Tpdo;

/// Receive PDOs and transmit PDOs that a node can have, each.
pub const PDOS: usize = 4;

/// Objects that one PDO can hold: eight bytes, one each.
pub const MAPPED_PER_PDO: usize = 8;

/// Whether a transmission type is one that the standard defines (CiA 301 7.5.2.35, 7.5.2.37):
/// 0 to 240 and 254, 255; 241 to 251 are reserved, 252 and 253 (RTR) are not offered.
pub(crate) const fn is_known_type(transmission_type: u32) -> bool {
    matches!(transmission_type, 0..=240 | 254 | 255)
}
