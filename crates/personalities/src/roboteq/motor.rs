//! The motor on each channel, and the power stage: the document has no objects for their figures.
//!
//! A brushless motor of the size that a small controller drives, at 24 V: maxon EC 45 flat, 30 W, the
//! winding for 24 V with Hall sensors, 339281. From the maker's catalogue, edition of May 2012, page 193:
//! 55.3 mNm and 1.01 A continuous, 4,380 RPM and 73 mA without load, 4.83 Ω and 2.24 mH between two
//! phases, 51.0 mNm/A, 92.5 gcm², eight pole pairs. The encoder on it has 1,024 lines, 4,096 counts.

use crate::{
    AmplifierObjects, BridgeTimeObjects, Figure, GainObjects, LoopObjects, MotionLoop, MotorObjects,
};

/// Encoder counts of a turn.
pub(super) const COUNTS: f32 = 4096.0;
/// Continuous current, A of phase amplitude: 55.3 mNm over the torque constant.
pub(super) const RATED_A: f32 = 1.2;
/// Nm per A of phase amplitude: 51.0 mNm/A for block commutation make 46.25 for sinusoidal.
pub(super) const TORQUE_CONSTANT: f32 = 0.046_25;

/// Torque at the continuous current, Nm.
pub(super) const RATED_NM: f32 = 0.055_5;

/// What the controllers know of it.
pub(super) const MOTOR: MotorObjects = MotorObjects {
    electrical_zero: Figure::Fixed(0.0),
    electrical_polarity: Figure::Fixed(1.0),
    electrical_polarity_at: None,
    poles: Figure::Fixed(16.0),
    torque_constant: Figure::Fixed(TORQUE_CONSTANT),
    terminal_resistance: Figure::Fixed(4.83),
    terminal_inductance: Figure::Fixed(2.24e-3),
    rotor_inertia: Some(Figure::Fixed(92.5e-7)),
    continuous_current: Figure::Fixed(RATED_A),
    // The controller limits its current, and knows no heat of the motor.
    peak_current: Figure::Fixed(0.0),
    peak_time: Figure::Fixed(1.0),
    user_continuous_current: None,
    user_peak_current: None,
    user_peak_time: None,
    encoder_resolution: Figure::Fixed(COUNTS),
    encoder_lag: Figure::Fixed(0.0),
    i2t_rule: None,
    may_be_unset: false,
};

/// What they know of the power stage, that of a virtual drive at 24 V.
pub(super) const AMPLIFIER: AmplifierObjects = AmplifierObjects {
    pwm_frequency_hz: Figure::Fixed(100_000.0),
    pwm_per_control: 5,
    times: BridgeTimeObjects::NONE,
    max_current: Figure::Fixed(4.0),
    max_of_rated_current: None,
    max_phase_voltage: Figure::Fixed(40.0),
    current_zero: [Figure::Fixed(1833.0), Figure::Fixed(2071.0)],
    gains: GainObjects {
        current_d: controller(1000.0),
        current_q: controller(1000.0),
        velocity: MotionLoop::Tuned(controller(50.0)),
        position: MotionLoop::Tuned(controller(10.0)),
        acceleration_feed_forward: 1.0,
    },
};

const fn controller(bandwidth_hz: f32) -> LoopObjects {
    LoopObjects {
        bandwidth: Figure::Fixed(bandwidth_hz),
        damping: Some(Figure::Fixed(1.0)),
        direct: None,
    }
}
