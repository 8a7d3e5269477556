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
    /// The gate drivers have seen the current of a short circuit and opened all switches by
    /// themselves. It stays until the bridge is commanded off.
    pub overcurrent: R::Mask,
    /// Whether the encoder answered, and with a right check sum.
    pub encoder_valid: R::Mask,
}

/// What one drive's board says beside the currents: slow quantities and levels. Not for batches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Levels of the digital inputs, in the order of object 0x60FD (CiA 402-2): bit 0 the negative
    /// limit switch, 1 the positive, 2 the home switch, 3 the interlock, 16 to 19 the general inputs.
    pub inputs: u32,
    /// Temperature of the motor's winding, converter counts, 0 to 4095.
    pub motor_temperature_adc: f32,
    /// Analog inputs 1 and 2, converter counts, 0 to 4095.
    pub auxiliary_adc: [f32; 2],
    /// What the encoder says of its magnet.
    pub magnet: Magnet,
    /// Safe torque off is asked for.
    pub torque_off: bool,
    /// Angle of an encoder on the output of a gear, turns from 0 to 1, if one is there and answers.
    pub output_encoder: Option<f32>,
}

impl Signals {
    /// A board on which nothing is connected and nothing is wrong, at the converters' zero.
    pub const QUIET: Signals = Signals {
        inputs: 0,
        motor_temperature_adc: 0.0,
        auxiliary_adc: [0.0; 2],
        magnet: Magnet::Good,
        torque_off: false,
        output_encoder: None,
    };
}

/// The field of the encoder's magnet at its sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Magnet {
    /// As strong as it should be.
    Good,
    /// Too weak: the magnet is too far away, or has lost its strength.
    TooWeak,
    /// Too strong: the magnet is too near, or the wrong one.
    TooStrong,
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
    /// Temperature of the motor of one converter count, K.
    pub motor_temperature_k: f32,
    /// Temperature of the motor at zero counts, °C.
    pub motor_temperature_zero_c: f32,
}
