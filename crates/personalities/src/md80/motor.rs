//! Where the controllers find their parameters.

use canopen::{Address, Dictionary};

use super::internal;
use crate::p3::{plain, scaled};
use crate::{AmplifierObjects, GainObjects, LoopObjects, MotionLoop, MotorObjects, PidObjects};

/// The motor.
pub(super) const fn motor<const N: usize>(objects: &Dictionary<N>) -> MotorObjects {
    MotorObjects {
        electrical_zero: objects.need(internal::ELECTRICAL_ZERO, 0),
        electrical_polarity: objects.need(internal::ELECTRICAL_POLARITY, 0),
        electrical_polarity_at: Address::new(internal::ELECTRICAL_POLARITY, 0),
        // Pole pairs.
        poles: scaled(objects, 0x2000, 1, 2.0),
        torque_constant: plain(objects, 0x2000, 2),
        // Of one phase.
        terminal_resistance: scaled(objects, 0x2000, 4, 2.0),
        terminal_inductance: scaled(objects, 0x2000, 3, 2.0),
        rotor_inertia: None,
        continuous_current: plain(objects, internal::NONE, 0),
        peak_current: plain(objects, internal::NONE, 0),
        peak_time: plain(objects, internal::NONE, 0),
        user_continuous_current: None,
        user_peak_current: None,
        user_peak_time: None,
        encoder_resolution: objects.need(internal::ENCODER_RESOLUTION, 0),
        encoder_lag: plain(objects, internal::ENCODER_LAG, 0),
        i2t_rule: None,
        may_be_unset: true, // M12
    }
}

/// The amplifier.
pub(super) const fn amplifier<const N: usize>(objects: &Dictionary<N>) -> AmplifierObjects {
    let current = LoopObjects {
        bandwidth: plain(objects, 0x2000, 5),
        damping: None,
        direct: None,
    };
    AmplifierObjects {
        pwm_frequency_hz: objects.need(internal::LOOP_FREQUENCY, 0),
        pwm_per_control: 1,
        max_current: plain(objects, internal::BOARD_CURRENT, 0),
        max_of_rated_current: Some((
            scaled(objects, 0x6073, 0, 1e-3),
            scaled(objects, 0x6075, 0, 1e-3),
        )),
        max_phase_voltage: plain(objects, internal::LONGEST_VOLTAGE, 0),
        current_zero: [
            objects.need(internal::CURRENT_ZERO_A, 0),
            objects.need(internal::CURRENT_ZERO_B, 0),
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
