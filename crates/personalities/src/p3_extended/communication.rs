//! Rows of the communication area, 0x0002 to 0x1FFF.

pub(super) use crate::p3::communication::{PDO_ROWS, ROWS};
