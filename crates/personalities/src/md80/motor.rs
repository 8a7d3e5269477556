//! Where the controllers find their parameters.

use canopen::Dictionary;

use super::internal;
use crate::p3::{plain, scaled};
use crate::{
    AmplifierObjects, BridgeTimeObjects, Figure, GainObjects, LoopObjects, MotionLoop,
    MotorObjects, PidObjects,
};

/// The motor.
pub(super) const fn motor<const N: usize>(objects: &Dictionary<N>) -> MotorObjects {
    MotorObjects {
        electrical_zero: Figure::plain(objects.need(internal::ELECTRICAL_ZERO, 0)),
        electrical_polarity: Figure::plain(objects.need(internal::ELECTRICAL_POLARITY, 0)),
        electrical_polarity_at: None,
        // Pole pairs.
        poles: Figure::Object(scaled(objects, 0x2000, 1, 2.0)),
        torque_constant: Figure::plain(objects.need(0x2000, 2)),
        // Of one phase.
        terminal_resistance: Figure::Object(scaled(objects, 0x2000, 4, 2.0)),
        terminal_inductance: Figure::Object(scaled(objects, 0x2000, 3, 2.0)),
        rotor_inertia: None,
        continuous_current: Figure::Fixed(0.0),
        peak_current: Figure::Fixed(0.0),
        peak_time: Figure::Fixed(0.0),
        user_continuous_current: None,
        user_peak_current: None,
        user_peak_time: None,
        encoder_resolution: Figure::Fixed(internal::COUNTS_PER_TURN as f32),
        encoder_lag: Figure::Fixed(0.0),
        i2t_rule: None,
        may_be_unset: true, // M12
    }
}

/// The amplifier.
pub(super) const fn amplifier<const N: usize>(objects: &Dictionary<N>) -> AmplifierObjects {
    let current = LoopObjects {
        bandwidth: Figure::plain(objects.need(0x2000, 5)),
        damping: None,
        direct: None,
    };
    AmplifierObjects {
        pwm_frequency_hz: Figure::Fixed(internal::LOOP_HZ),
        pwm_per_control: 1,
        times: BridgeTimeObjects::NONE,
        max_current: Figure::Fixed(internal::BOARD_CURRENT_A),
        max_of_rated_current: Some((
            scaled(objects, 0x6073, 0, 1e-3),
            scaled(objects, 0x6075, 0, 1e-3),
        )),
        // As long as the supply makes it.
        max_phase_voltage: Figure::Fixed(100.0),
        current_zero: [
            Figure::plain(objects.need(internal::CURRENT_ZERO_A, 0)),
            Figure::plain(objects.need(internal::CURRENT_ZERO_B, 0)),
        ],
        gains: GainObjects {
            current_d: current,
            current_q: current,
            velocity: gains(objects, 0x2001),
            position: gains(objects, 0x2002),
            acceleration_feed_forward: 0.0,
        },
    }
}

const fn gains<const N: usize>(objects: &Dictionary<N>, index: u16) -> MotionLoop {
    MotionLoop::Gains(PidObjects {
        proportional: plain(objects, index, 1),
        integral: plain(objects, index, 2),
        derivative: plain(objects, index, 3),
        integral_limit: plain(objects, index, 4),
    })
}
