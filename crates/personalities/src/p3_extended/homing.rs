//! Homing with switches, index pulse and hard stops, of which the faithful P3 has none (l.176).

use canopen::row::{i8, i16, u8, u16, u32};
use canopen::{Dictionary, Row};
use cia402::HomingMethod;

use crate::p3::axis::limit;
use crate::p3::motor::feedback;
use crate::p3::plain;
use crate::{HomingObjects, HomingSearchObjects};

/// CiA 402, and in 0x2430 what the standard leaves to makers.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // Reserved numbers are refused.
    limit(i8(0x6098, 0, "Homing method").range(-4, 37).default(37)).rpdo().asks(),
    limit(u32(0x6099, 1, "Speed during search for switch").unit("cts/s").default(20_000)).rpdo(),
    limit(u32(0x6099, 2, "Speed during search for zero").unit("cts/s").default(2_000)).rpdo(),
    limit(u32(0x609A, 0, "Homing acceleration").unit("cts/s2").default(200_000)).rpdo(),
    limit(i16(0x2430, 1, "Hard stop torque").unit("permille").range(1, 1000).default(300)),
    limit(u16(0x2430, 2, "Hard stop time").unit("ms").range(10, 10_000).default(100)),
    limit(u32(0x2430, 3, "Back-off from the hard stop").unit("cts").range(1, i32::MAX as i64).default(200)),
    limit(u32(0x2430, 4, "Homing time-out").unit("ms").default(60_000)),
    limit(u32(0x2430, 5, "Homing range").unit("cts").range(0, i32::MAX as i64)),
    feedback(u8(0x2430, 6, "Homing error")),
    // The manual's "minimum homing range" (l.1010).
    limit(u32(0x2430, 7, "Least way to the hard stop").unit("cts").range(0, i32::MAX as i64)),
];

const METHODS: usize = HomingMethod::ALL.len();

/// 0x60E3: the methods that work.
pub(super) const METHOD_ROWS: [Row; METHODS] = method_rows();

#[allow(clippy::indexing_slicing, reason = "runs at compile time")]
const fn method_rows() -> [Row; METHODS] {
    let mut rows = [i8(0x60E3, 1, "Supported homing method").constant(); METHODS];
    let mut i = 0;
    while i < METHODS {
        rows[i] = i8(0x60E3, i as u8 + 1, "Supported homing method")
            .constant()
            .default(HomingMethod::ALL[i] as i64);
        i += 1;
    }
    rows
}

/// Where the axis finds them.
pub(super) const fn objects<const N: usize>(objects: &Dictionary<N>) -> HomingObjects {
    HomingObjects {
        method: objects.need(0x6098, 0),
        offset: plain(objects, 0x607C, 0),
        is_homed: objects.handle(0x2402, 0),
        search: Some(HomingSearchObjects {
            switch_velocity: plain(objects, 0x6099, 1),
            zero_velocity: plain(objects, 0x6099, 2),
            acceleration: plain(objects, 0x609A, 0),
            stop_torque: plain(objects, 0x2430, 1),
            stop_time_ms: objects.need(0x2430, 2),
            back_off: objects.need(0x2430, 3),
            timeout_ms: objects.need(0x2430, 4),
            range: objects.need(0x2430, 5),
            least_way: objects.need(0x2430, 7),
            error: objects.handle(0x2430, 6),
        }),
    }
}
