//! Digital inputs.

use canopen::row::u32;
use canopen::{Dictionary, Row};

use crate::InputObjects;
use crate::p3::axis::limit;
use crate::p3::motor::feedback;

/// 0x60FD of CiA 402, and in 0x2431 what the standard leaves to makers.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // Bits 0 to 3: negative limit, positive limit, home switch, interlock; 16 to 19: general inputs.
    feedback(u32(0x60FD, 0, "Digital inputs")),
    // The same bits: active when low, as limit switches usually are that open.
    limit(u32(0x2431, 1, "Inverted digital inputs").range(0, 0x000F_000F)),
];

/// Where the drive finds them.
pub(super) const fn objects<const N: usize>(objects: &Dictionary<N>) -> InputObjects {
    InputObjects {
        active: objects.handle(0x60FD, 0),
        inverted: objects.need(0x2431, 1),
    }
}
