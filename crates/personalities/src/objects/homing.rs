//! Homing.

use canopen::{Field, Handle};

use super::Scaled;

/// Homing.
#[derive(Clone, Copy, Debug)]
pub struct HomingObjects {
    /// 0x6098.
    pub method: Field,
    /// 0x607C, counts.
    pub offset: Scaled,
    /// Whether the axis is homed, 0 or 1 (the P3's 0x2402).
    pub is_homed: Handle<u8>,
    /// What the methods need in which the axis moves.
    pub search: Option<HomingSearchObjects>,
}

/// The parameters of homing methods in which the axis moves.
#[derive(Clone, Copy, Debug)]
pub struct HomingSearchObjects {
    /// 0x6099,1, counts/s.
    pub switch_velocity: Scaled,
    /// 0x6099,2, counts/s.
    pub zero_velocity: Scaled,
    /// 0x609A, counts/s².
    pub acceleration: Scaled,
    /// Greatest torque while looking for a hard stop, per mille of rated torque.
    pub stop_torque: Scaled,
    /// How long the axis must press and stand, ms.
    pub stop_time_ms: Field,
    /// How far the axis goes back from a hard stop, counts.
    pub back_off: Field,
    /// How long homing may last, ms; 0: for ever.
    pub timeout_ms: Field,
    /// How far homing may lead, counts; 0: anywhere.
    pub range: Field,
    /// How far a hard stop is away at least, counts.
    pub least_way: Field,
    /// Why homing has failed, a number of [`cia402::HomingError`]; 0: it has not.
    pub error: Handle<u8>,
}
