//! From the dictionary to the loops: motor, encoder, amplifier and gains in SI units.

use canopen::Image;
use control::i2t::I2t;
use control::tuning::{self, Rule, TuningError};
use control::velocity::Cutoff;
use control::{EncoderSettings, Gains, Motor, Parameters, PowerStage, Real as _};
use personalities::{AxisPersonality, Figure, LoopObjects, MotorObjects};

use crate::Hardware;
use crate::configuration::{gear, limit, max_motor_velocity, value};
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
    /// Greatest current of a demand of the axis, beside its torque, A; 0 for a motor that was not set up.
    pub(crate) greatest_a: f32,
}

/// What velocity gains follow from, as the objects have it.
pub(crate) fn figures(image: &Image<'_>, axis: &AxisPersonality) -> Figures {
    let motor = &axis.motor;
    Figures {
        inertia_kg_m2: motor
            .rotor_inertia
            .map_or(0.0, |figure| value(image, figure)),
        torque_constant_nm_per_a: set(image, motor, motor.torque_constant),
        counts_per_turn: value(image, motor.encoder_resolution),
        gear: gear(image, &axis.objects),
    }
}

/// A figure, and for one that was not set yet anything from which controllers can be made: they get
/// no current.
fn set(image: &Image<'_>, motor: &MotorObjects, figure: Figure) -> f32 {
    let read = value(image, figure);
    if motor.may_be_unset && !(read > 0.0 && read.is_finite()) {
        1.0
    } else {
        read
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
        0 if motor.may_be_unset => 1,
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
    let resistance = 0.5 * set(image, motor, motor.terminal_resistance);
    let inductance = 0.5 * set(image, motor, motor.terminal_inductance);
    let is_set_up = !motor.may_be_unset
        || [
            motor.poles,
            motor.terminal_resistance,
            motor.terminal_inductance,
            motor.torque_constant,
        ]
        .into_iter()
        .all(|object| value(image, object) > 0.0);

    let current = |objects: &LoopObjects| {
        let bandwidth = set(image, motor, objects.bandwidth);
        // A manual that speaks of bandwidth and damping means this rule: no other has a damping.
        let (rule, damping) = match objects.damping {
            Some(damping) => (Rule::SecondOrder, value(image, damping)),
            None => (Rule::PoleZero, 1.0),
        };
        tuning::current(rule, bandwidth, damping, resistance, inductance)
    };
    let gains = &amplifier.gains;
    let figures = figures(image, axis);
    let velocity = direct.velocity(image, &gains.velocity, &figures)?;
    let position = direct.position(image, &gains.position, &figures)?;

    let least = |a: f32, b: Option<f32>| match b {
        Some(b) if b < a => b,
        _ => a,
    };
    let rated = amplifier.max_of_rated_current.map(|(share, rated)| {
        let part = value(image, share);
        part * value(image, rated)
    });
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
            torque_constant_nm_per_a: figures.torque_constant_nm_per_a,
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
            velocity_integral_limit_a: velocity.integral_limit.unwrap_or(amplifier_a),
            speed_limit: velocity.pi.kp,
            position: position.pi,
            position_derivative: position.kd,
            position_integral_limit: position
                .integral_limit
                .unwrap_or(max_motor_velocity(image, &axis.objects).unwrap_or(f32::MAX)),
        },
        i2t: I2t {
            enabled: peak_a > 0.0 && continuous_a > 0.0,
            literal: motor.i2t_rule.is_none_or(|rule| image.number(rule) == 0),
            continuous_a,
            peak_a,
            peak_time_s,
        },
    };
    // At the output.
    let torque_per_ampere = figures.torque_constant_nm_per_a / figures.gear;
    let amperes_per_pm = rated_torque / torque_per_ampere * 1e-3;
    let rotor_amperes_per_acceleration = match motor.rotor_inertia {
        Some(_) => tuning::acceleration_current(
            figures.inertia_kg_m2,
            figures.torque_constant_nm_per_a,
            figures.counts_per_turn,
        )?,
        None => 0.0,
    };
    let loops = LoopParameters {
        timing,
        amperes_per_pm,
        pm_per_ampere: match motor.may_be_unset && rated_torque <= 0.0 {
            true => 0.0,
            false => torque_per_ampere / rated_torque * 1e3,
        },
        amperes_per_acceleration: gains.acceleration_feed_forward * rotor_amperes_per_acceleration,
        rotor_amperes_per_acceleration,
        continuous_a,
        counts_per_turn: counts_per_turn.unsigned_abs(),
        greatest_a: match is_set_up {
            true => rated.unwrap_or(f32::MAX),
            false => 0.0,
        },
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
