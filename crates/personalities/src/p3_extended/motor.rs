//! The motor: what the manual leaves to be chosen.

use canopen::row::u8;
use canopen::{Dictionary, Row};

use crate::p3::motor::parameter;
use crate::{MotorObjects, p3};

/// Beside the P3's own.
pub(super) const ROWS: &[Row] = &[
    // 0: literally, 1: dimensionally right (P30).
    parameter(u8(0x2113, 0, "I2t rule").range(0, 1)),
];

/// Where the controllers find the motor's parameters.
pub(super) const fn motor<const N: usize>(objects: &Dictionary<N>) -> MotorObjects {
    MotorObjects {
        i2t_rule: Some(objects.need(0x2113, 0)),
        ..p3::motor::motor(objects)
    }
}
