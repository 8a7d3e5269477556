//! From the dictionary to the loops: motor, encoder, amplifier and gains in SI units.

use canopen::Image;
use control::i2t::I2t;
use control::tuning::{self, Rule, TuningError};
use control::velocity::Cutoff;
use control::{EncoderSettings, Gains, Motor, Parameters, PowerStage, Real as _};
use personalities::{AxisPersonality, LoopObjects};

use crate::Hardware;
use crate::configuration::{limit, value};
use crate::gains::{Direct, Figures};
use crate::timing::{PwmTiming, read_timing};

/// A set of parameters from which no controller can be made. The drive announces it as a parameter
/// error and keeps the controllers that it had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterError {
    /// A controller's gains cannot be computed.
    Tuning(TuningError),
    /// Number of poles: not an even number of at least 2.
    Poles(i64),
    /// Encoder resolution: not 2 to 2²⁴ − 1 counts.
    EncoderResolution(i64),
    /// A polarity that is neither 1 nor −1.
    Polarity(i64),
    /// PWM frequency 0, Hz.
    PwmFrequency(i64),
    /// The body has no room for so many axes, or the drive has none.
    Axes(usize),
    /// A dead time in which the slowest driver has not switched yet when the quickest does: both
    /// switches of a half bridge would be closed.
    DeadTime {
        /// What it was, ns.
        ns: u16,
        /// How far the drivers' delays are apart, ns.
        least_ns: u16,
    },
    /// No pulse is long enough for the current converters: it would take more than half a PWM period.
    SamplingPulse {
        /// What it would have to be, ns.
        ns: u32,
        /// The PWM period, ns.
        period_ns: u32,
    },
    /// The current converters are not ready before the next control period begins.
    Conversion {
        /// When they are, ns.
        ns: u32,
        /// The PWM period, ns.
        period_ns: u32,
    },
}

impl From<TuningError> for ParameterError {
    fn from(error: TuningError) -> ParameterError {
        ParameterError::Tuning(error)
    }
}

/// What the communication half needs to know of the loops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopParameters {
    pub(crate) timing: PwmTiming,
    /// Current of one per mille of rated torque, A.
    pub(crate) amperes_per_pm: f32,
    /// Per mille of rated torque of 1 A.
    pub(crate) pm_per_ampere: f32,
    /// Current fed forward for a demanded acceleration, A per count/s².
    pub(crate) amperes_per_acceleration: f32,
    /// Current that accelerates the bare rotor, A per count/s².
    pub(crate) rotor_amperes_per_acceleration: f32,
    /// Current that the motor bears for ever, A.
    pub(crate) continuous_a: f32,
    /// The encoder's.
    pub(crate) counts_per_turn: u32,
}

/// What velocity gains follow from, as the objects have it.
pub(crate) fn figures(image: &Image<'_>, axis: &AxisPersonality) -> Figures {
    let motor = &axis.motor;
    Figures {
        inertia_kg_m2: value(image, motor.rotor_inertia),
        torque_constant_nm_per_a: value(image, motor.torque_constant),
        counts_per_turn: value(image, motor.encoder_resolution),
    }
}

/// Reads the parameters of the loops, and what the communication half needs of them.
///
/// # Errors
/// The first [`ParameterError`].
pub(crate) fn read_parameters(
    image: &Image<'_>,
    axis: &AxisPersonality,
    hardware: &Hardware,
    direct: Direct,
) -> Result<(Parameters<f32>, LoopParameters), ParameterError> {
    let motor = &axis.motor;
    let amplifier = &axis.amplifier;
    let poles = value(image, motor.poles) as i64;
    let pole_pairs = match poles {
        2..=4096 if poles % 2 == 0 => (poles / 2) as i32,
        _ => return Err(ParameterError::Poles(poles)),
    };
    let resolution = value(image, motor.encoder_resolution) as i64;
    let counts_per_turn = match resolution {
        2..=0xFF_FFFF => resolution as i32,
        _ => return Err(ParameterError::EncoderResolution(resolution)),
    };
    let electrical_polarity = polarity(value(image, motor.electrical_polarity) as i64)?;
    let user_polarity = match axis.objects.polarity {
        Some(field) => polarity(image.number(field))?,
        None => 1,
    };
    let (timing, times) = read_timing(image, amplifier)?;
    // The objects are terminal to terminal, two phases in series.
    let resistance = 0.5 * value(image, motor.terminal_resistance);
    let inductance = 0.5 * value(image, motor.terminal_inductance);
    let inertia = value(image, motor.rotor_inertia);
    let torque_constant = value(image, motor.torque_constant);
    let counts = counts_per_turn as f32;

    let current = |objects: &LoopObjects| {
        let (bandwidth, damping) = (
            value(image, objects.bandwidth),
            value(image, objects.damping),
        );
        // The manual speaks of bandwidth and damping; only this rule has a damping.
        tuning::current(
            Rule::SecondOrder,
            bandwidth,
            damping,
            resistance,
            inductance,
        )
    };
    let gains = &amplifier.gains;
    let figures = figures(image, axis);
    let velocity = direct.velocity(image, &gains.velocity, &figures)?;
    let position = direct.position(image, &gains.position)?;

    let least = |a: f32, b: Option<f32>| match b {
        Some(b) if b < a => b,
        _ => a,
    };
    let amplifier_a = value(image, amplifier.max_current);
    let continuous_a = least(
        value(image, motor.continuous_current),
        limit(image, motor.user_continuous_current),
    );
    let peak_a = least(
        value(image, motor.peak_current),
        limit(image, motor.user_peak_current),
    );
    let peak_time_s = limit(image, motor.user_peak_time).unwrap_or(value(image, motor.peak_time));
    let rated_torque = value(image, axis.objects.rated_torque_nm);
    let [zero_a, zero_b] = amplifier.current_zero;

    let parameters = Parameters {
        period_s: timing.control_period_s(),
        pwm_period_s: 1.0 / timing.frequency_hz as f32,
        load_delay_s: times.load_delay_s,
        motor: Motor {
            phase_resistance_ohm: resistance,
            phase_inductance_h: inductance,
            torque_constant_nm_per_a: torque_constant,
            pole_pairs,
        },
        encoder: EncoderSettings {
            counts_per_turn,
            electrical_zero: value(image, motor.electrical_zero) as i32,
            electrical_polarity,
            user_polarity,
            lag_s: value(image, motor.encoder_lag),
            loop_cutoff: Cutoff::LOOP,
            reported_cutoff: Cutoff::REPORTED,
        },
        stage: PowerStage {
            scales: hardware.scales,
            current_zero: [value(image, zero_a), value(image, zero_b)],
            current_limit_a: amplifier_a,
            voltage_limit_v: value(image, amplifier.max_phase_voltage),
            duty_margin: hardware.duty_margin.greatest(times.duty_margin),
            dead_time_s: times.dead_time_s,
            propagation_s: times.propagation_s,
        },
        gains: Gains {
            current_d: current(&gains.current_d)?,
            current_q: current(&gains.current_q)?,
            decoupling: 1.0,
            emf_feed_forward: 1.0,
            velocity: velocity.pi,
            velocity_derivative: velocity.kd,
            velocity_integral_limit_a: amplifier_a,
            speed_limit: velocity.pi.kp,
            position: position.pi,
            position_derivative: position.kd,
            position_integral_limit: limit(image, axis.objects.configuration.max_motor_velocity)
                .unwrap_or(f32::MAX),
        },
        i2t: I2t {
            enabled: peak_a > 0.0 && continuous_a > 0.0,
            literal: motor.i2t_rule.is_none_or(|rule| image.number(rule) == 0),
            continuous_a,
            peak_a,
            peak_time_s,
        },
    };
    let amperes_per_pm = rated_torque / torque_constant * 1e-3;
    let rotor_amperes_per_acceleration =
        tuning::acceleration_current(inertia, torque_constant, counts)?;
    let loops = LoopParameters {
        timing,
        amperes_per_pm,
        pm_per_ampere: torque_constant / rated_torque * 1e3,
        amperes_per_acceleration: gains.acceleration_feed_forward * rotor_amperes_per_acceleration,
        rotor_amperes_per_acceleration,
        continuous_a,
        counts_per_turn: counts_per_turn.unsigned_abs(),
    };
    Ok((parameters, loops))
}

fn polarity(value: i64) -> Result<i32, ParameterError> {
    match value {
        1 => Ok(1),
        -1 => Ok(-1),
        _ => Err(ParameterError::Polarity(value)),
    }
}
