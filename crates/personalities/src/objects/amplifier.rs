//! The amplifier.

use super::{Figure, GainObjects, Scaled};

/// The amplifier and the controllers.
#[derive(Clone, Copy, Debug)]
pub struct AmplifierObjects {
    /// PWM frequency, Hz.
    pub pwm_frequency_hz: Figure,
    /// PWM periods per control period.
    pub pwm_per_control: u8,
    /// What switches and converters take their time for.
    pub times: BridgeTimeObjects,
    /// Greatest current, A.
    pub max_current: Figure,
    /// A lower one: 0x6073, a share of 0x6075, A.
    pub max_of_rated_current: Option<(Scaled, Scaled)>,
    /// Longest voltage vector, V of phase amplitude.
    pub max_phase_voltage: Figure,
    /// Calibrated readings at no current of phases A and B, converter counts.
    pub current_zero: [Figure; 2],
    /// The controllers.
    pub gains: GainObjects,
}

/// What the bridge's switches and the current converters take their time for, ns.
#[derive(Clone, Copy, Debug)]
pub struct BridgeTimeObjects {
    /// For how long after each switching both switches of a half bridge are open.
    pub dead_time: Figure,
    /// How much later than the timer a switch switches, at least.
    pub propagation: Figure,
    /// By how much later at most than that.
    pub propagation_spread: Figure,
    /// For how long after a switching the current sensors do not read a current.
    pub settling: Figure,
    /// For how long a converter looks.
    pub sampling: Figure,
    /// After what time beyond that its reading is there.
    pub conversion: Figure,
}

impl BridgeTimeObjects {
    /// Nothing takes a time that the drive knows of.
    pub const NONE: BridgeTimeObjects = BridgeTimeObjects {
        dead_time: Figure::Fixed(0.0),
        propagation: Figure::Fixed(0.0),
        propagation_spread: Figure::Fixed(0.0),
        settling: Figure::Fixed(0.0),
        sampling: Figure::Fixed(0.0),
        conversion: Figure::Fixed(0.0),
    };
}
