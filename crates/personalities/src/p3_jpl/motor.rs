//! The measured board, the objects that are not implemented yet, and the motor: the dictionary has no
//! objects for its figures, which are those of the P3 of 2019, commissioned for the same motor.

use canopen::row::{i16, u8, u16};
use canopen::{Dictionary, Row};

use super::properties::{ELECTRICAL_ZERO, POLES, TURN, property};
use crate::{
    AmplifierObjects, BridgeTimeObjects, Figure, GainObjects, LoopObjects, MotionLoop, MotorObjects,
};

const fn input(row: Row) -> Row {
    row.tpdo()
}

/// Written without effect: the drive answers such writes itself, and the object stays 0.
const fn output(row: Row) -> Row {
    row.rw().rpdo().tpdo().asks()
}

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    i16(0x2201, 0, "Bus voltage").unit("V/256").tpdo().live(),
    i16(0x2202, 0, "Ambient temperature").unit("degC/256").tpdo().live(),
    // "NOT IMPLEMENTED YET": they read 0. J19: sub-index 0 is ADC1.
    input(u16(0x2A01, 0, "ADC1 (not implemented)")),
    input(u16(0x2A01, 1, "ADC2 (not implemented)")),
    output(u8(0x2A10, 0, "Direction of DIO0 and DIO1 (not implemented)")),
    output(u8(0x2A10, 1, "Direction of DIO0 (not implemented)")),
    output(u8(0x2A10, 2, "Direction of DIO1 (not implemented)")),
    input(u8(0x2A11, 0, "DIO0 and DIO1, read (not implemented)")),
    input(u8(0x2A11, 1, "DIO0, read (not implemented)")),
    input(u8(0x2A11, 2, "DIO1, read (not implemented)")),
    output(u8(0x2A12, 0, "DIO0 and DIO1, set (not implemented)")),
    output(u8(0x2A12, 1, "DIO0, set (not implemented)")),
    output(u8(0x2A12, 2, "DIO1, set (not implemented)")),
];

/// Rated torque of the motor, Nm.
pub(super) const RATED_TORQUE_NM: f32 = 0.023;

/// What the controllers know of the motor: maxon EC-max 22 283860.
pub(super) const fn motor<const N: usize>(objects: &Dictionary<N>) -> MotorObjects {
    MotorObjects {
        electrical_zero: property(objects, ELECTRICAL_ZERO, 1.0),
        electrical_polarity: Figure::Fixed(1.0),
        electrical_polarity_at: None,
        poles: property(objects, POLES, 1.0),
        torque_constant: Figure::Fixed(0.031_56),
        terminal_resistance: Figure::Fixed(13.1),
        terminal_inductance: Figure::Fixed(0.73e-3),
        rotor_inertia: Some(Figure::Fixed(4.45e-7)),
        continuous_current: Figure::Fixed(0.716),
        peak_current: Figure::Fixed(2.0),
        peak_time: Figure::Fixed(1.0),
        user_continuous_current: None,
        user_peak_current: None,
        user_peak_time: None,
        encoder_resolution: property(objects, TURN, 1.0),
        encoder_lag: Figure::Fixed(0.0),
        i2t_rule: None,
        may_be_unset: false,
    }
}

/// What they know of the amplifier: a P3 at 48 V.
pub(super) const fn amplifier() -> AmplifierObjects {
    AmplifierObjects {
        pwm_frequency_hz: Figure::Fixed(100_000.0),
        pwm_per_control: 5,
        times: BridgeTimeObjects {
            dead_time: Figure::Fixed(200.0),
            ..BridgeTimeObjects::NONE
        },
        max_current: Figure::Fixed(3.5),
        max_of_rated_current: None,
        max_phase_voltage: Figure::Fixed(27.713),
        current_zero: [Figure::Fixed(1833.0), Figure::Fixed(2071.0)],
        gains: GainObjects {
            current_d: controller(2000.0),
            current_q: controller(2000.0),
            velocity: MotionLoop::Tuned(controller(100.0)),
            position: MotionLoop::Tuned(controller(20.0)),
            acceleration_feed_forward: 0.0,
        },
    }
}

const fn controller(bandwidth_hz: f32) -> LoopObjects {
    LoopObjects {
        bandwidth: Figure::Fixed(bandwidth_hz),
        damping: Some(Figure::Fixed(1.0)),
        direct: None,
    }
}
