//! What a power stage gives to the control loops and takes from them: the only seam between the
//! drive and the world, real or simulated.

use crate::Real;

/// What the sensors say at the start of a control period. Raw converter counts: scaling and
/// offsets are the drive's business, and the drive learns nothing else about the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<R: Real> {
    /// Current of phases A and B, converter counts, 0 to 4095; about 2048 at no current.
    pub phase_adc: [R; 2],
    /// Absolute encoder reading within one turn, 0 to resolution − 1 counts.
    pub encoder: R::Count,
    /// Motor supply, converter counts, 0 to 4095.
    pub bus_adc: R,
    /// Amplifier temperature, converter counts, 0 to 4095.
    pub temperature_adc: R,
}

/// What the bridge does until the next load: the fraction of the PWM period, 0 to 1, for which
/// each phase A, B, C is connected to the positive supply.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duty<R: Real> {
    /// Phases A, B, C.
    pub phase: [R; 3],
    /// Whether the bridge switches at all; when false all six switches are open.
    pub enabled: R::Mask,
}

/// How a power stage converts: a property of the hardware's design, known to the drive (which
/// reads the converters) and to the plant (which models them).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Current of one converter count, A.
    pub current_a: f32,
    /// Counts at no current, nominally; each board deviates by its bias.
    pub current_zero: f32,
    /// Supply voltage of one converter count, V.
    pub voltage_v: f32,
    /// Temperature of one converter count, K.
    pub temperature_k: f32,
    /// Temperature at zero counts, °C.
    pub temperature_zero_c: f32,
}
