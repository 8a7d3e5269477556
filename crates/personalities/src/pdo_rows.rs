//! The communication parameters of a PDO (CiA 301 7.5.2.35, 7.5.2.37), as the standard names them; `index` is
//! 0x1400 or 0x1800 and the PDO's number.

use canopen::Group::Communication;
use canopen::Row;
use canopen::row::{u8, u16, u32};

/// COB-ID: `base` plus the node ID.
pub(crate) const fn cob_id(index: u16, base: u32) -> Row {
    u32(index, 1, "COB-ID used by PDO")
        .rw()
        .default_plus_node(base)
        .store(Communication)
}

/// Transmission type, 255 at first.
pub(crate) const fn transmission_type(index: u16) -> Row {
    u8(index, 2, "Transmission type")
        .rw()
        .default(255)
        .store(Communication)
}

/// Inhibit time, 100 µs (TPDO).
pub(crate) const fn inhibit_time(index: u16) -> Row {
    u16(index, 3, "Inhibit time")
        .rw()
        .unit("100us")
        .store(Communication)
}

/// Event timer, ms.
pub(crate) const fn event_timer(index: u16) -> Row {
    u16(index, 5, "Event timer")
        .rw()
        .unit("ms")
        .store(Communication)
}
