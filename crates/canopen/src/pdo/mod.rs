//! Process data objects (CiA 301 7.2.2): mapping, reception, transmission, events.

mod apply;
mod event;
mod mapping;
mod receive;
mod transmit;
mod walk;

pub(crate) use mapping::{Direction, Mapping, mapped_entry};
pub(crate) use receive::{Rpdo, RpdoParameters};
pub(crate) use transmit::{Tpdo, TpdoParameters};

/// Receive PDOs and transmit PDOs that a node can have, each.
pub const PDOS: usize = 4;

/// Objects that one PDO can hold: 64 of one bit each.
pub const MAPPED_PER_PDO: usize = 64;

/// Whether a transmission type may be given to a PDO (CiA 301 7.5.2.35, 7.5.2.37): 0 to 240, 254
/// and 255; for a TPDO 252 and 253 too where remote requests are answered; 241 to 251 are reserved.
pub(crate) const fn is_known_type(
    transmission_type: u32,
    way: Direction,
    remote_requests: bool,
) -> bool {
    match transmission_type {
        0..=240 | 254 | 255 => true,
        252 | 253 => remote_requests && matches!(way, Direction::Transmit),
        _ => false,
    }
}
