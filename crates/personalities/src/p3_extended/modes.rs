//! Velocity mode (2), interpolated position mode (7) and limited jerk, which the P3 has not.

use canopen::row::{i16, i32, u8, u16, u32};
use canopen::{Dictionary, Row};
use cia402::Axis;

use crate::VlObjects;
use crate::class::TARGET_VL_VELOCITY;
use crate::p3::axis::limit;
use crate::p3::motor::feedback;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // Mode 2. 0x6043 is the P3's velocity demand in cts/s, 0x6046 its velocity warning (P20, P28).
    i16(0x6042, 0, "vl target velocity").rw().rpdo().unit("rpm").tells(TARGET_VL_VELOCITY),
    feedback(i16(0x6044, 0, "vl velocity actual value").unit("rpm")),
    delta_speed(0x6048, "vl velocity acceleration: delta speed", 10_000),
    delta_time(0x6048, "vl velocity acceleration: delta time"),
    delta_speed(0x6049, "vl velocity deceleration: delta speed", 10_000),
    delta_time(0x6049, "vl velocity deceleration: delta time"),
    delta_speed(0x604A, "vl velocity quick stop: delta speed", 20_000),
    delta_time(0x604A, "vl velocity quick stop: delta time"),
    limit(i16(0x604B, 1, "vl set-point factor: numerator").default(1)).rpdo(),
    limit(i16(0x604B, 2, "vl set-point factor: denominator").range(1, i16::MAX as i64).default(1)).rpdo(),
    limit(i32(0x604C, 1, "vl dimension factor: numerator").default(1)).rpdo(),
    limit(i32(0x604C, 2, "vl dimension factor: denominator").range(1, i32::MAX as i64).default(1)).rpdo(),
    // Limited jerk: 0 linear ramps, 3 limited jerk. 2,000,000 cts/s2 are reached in 20 ms.
    limit(i16(0x6086, 0, "Motion profile type")).rpdo().asks(),
    u8(0x60A3, 0, "Profile jerk use").constant().default(1),
    limit(u32(0x60A4, 1, "Profile jerk 1").unit("cts/s3").default(100_000_000)).rpdo(),
    // Mode 7: linear interpolation and nothing else, a buffer first in, first out.
    limit(i16(0x60C0, 0, "Interpolation sub mode select").range(0, 0)),
    i32(0x60C1, 1, "Interpolation data record").rw().rpdo().unit("cts").asks(),
    u32(0x60C4, 1, "Maximum buffer size").constant().default(Axis::BUFFER_SIZE as i64),
    limit(u32(0x60C4, 2, "Actual buffer size").range(1, Axis::BUFFER_SIZE as i64).default(Axis::BUFFER_SIZE as i64)),
    limit(u8(0x60C4, 3, "Buffer organisation").range(0, 0)),
    feedback(u16(0x60C4, 4, "Buffer position")),
    u8(0x60C4, 5, "Size of data record").wo().range(1, 1).default(1),
    u8(0x60C4, 6, "Buffer clear").wo().range(0, 1).asks(),
];

const fn delta_speed(index: u16, name: &'static str, rpm: i64) -> Row {
    limit(u32(index, 1, name).unit("rpm").default(rpm)).rpdo()
}

const fn delta_time(index: u16, name: &'static str) -> Row {
    limit(u16(index, 2, name).unit("s").default(1)).rpdo()
}

/// Where velocity mode finds its objects.
pub(super) const fn vl<const N: usize>(objects: &Dictionary<N>) -> VlObjects {
    VlObjects {
        encoder_resolution: objects.need(0x3013, 1),
        dimension_factor: (objects.need(0x604C, 1), objects.need(0x604C, 2)),
        set_point_factor: (objects.need(0x604B, 1), objects.need(0x604B, 2)),
        acceleration: (objects.need(0x6048, 1), objects.need(0x6048, 2)),
        deceleration: (objects.need(0x6049, 1), objects.need(0x6049, 2)),
        quick_stop: (objects.need(0x604A, 1), objects.need(0x604A, 2)),
    }
}
