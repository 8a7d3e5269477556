//! Everything that the loops need to know beforehand, and what is computed from it once.

use crate::current::CurrentGains;
use crate::i2t::{I2t, I2tLimits};
use crate::io::Scales;
use crate::motion::MotionGains;
use crate::tuning::Pi;
use crate::velocity::{Cutoff, Encoder};
use crate::{Real, modulation};

/// The motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor<R: Real> {
    /// Resistance of one phase, Ω: half of what is measured between two terminals.
    pub phase_resistance_ohm: R,
    /// Inductance of one phase, H: half of what is measured between two terminals.
    pub phase_inductance_h: R,
    /// Torque per ampere of phase current amplitude, Nm/A: 3/2 · pole pairs · flux linkage.
    pub torque_constant_nm_per_a: R,
    /// Pole pairs, at least 1.
    pub pole_pairs: R::Count,
}

/// The encoder and how the rotor is mounted on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderSettings<R: Real> {
    /// Counts of a turn, at least 2 and below 2²⁴ (P3 0x3013,1).
    pub counts_per_turn: R::Count,
    /// Reading at which the d axis stands at phase A (P3 0x3011,1).
    pub electrical_zero: R::Count,
    /// 1, or −1 where the electrical angle falls as the encoder counts up (P3 0x3011,2).
    pub electrical_polarity: R::Count,
    /// 1, or −1 where the user's positive direction is the encoder's negative one (0x607E).
    pub user_polarity: R::Count,
    /// How long before the current was sampled the encoder was, s; negative if after (P3 0x3013,5).
    pub lag_s: R,
    /// The velocity filter of the loops.
    pub loop_cutoff: Cutoff<R>,
    /// The velocity filter of what is reported.
    pub reported_cutoff: Cutoff<R>,
}

/// The power stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerStage<R: Real> {
    /// Conversion of the sensors.
    pub scales: Scales,
    /// Converter counts of phases A and B at no current, calibrated (P3 0x3009).
    pub current_zero: [R; 2],
    /// Greatest current that the amplifier may be asked for, A (P3 0x3001,8).
    pub current_limit_a: R,
    /// Longest voltage vector that the amplifier may be asked for, V (P3 0x3001,9).
    pub voltage_limit_v: R,
    /// Part of the PWM period, 0 to ½, that each phase spends at least on either rail, for the sensors
    /// or the gate drivers. Duties may be nearer to 0 and 1 by what is added against the dead time.
    pub duty_margin: R,
    /// For how long after each switching both switches of a half bridge are open, s (P3 0x3001,2).
    /// Its error is compensated; 0: nothing is.
    pub dead_time_s: R,
    /// How much later than the timer the switches switch, s (P3 0x3001,3 and 4). The currents are
    /// sampled as much later.
    pub propagation_s: R,
}

/// Gains of the three loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains<R: Real> {
    /// d-axis current, V/A and V/(A s).
    pub current_d: Pi<R>,
    /// q-axis current, V/A and V/(A s).
    pub current_q: Pi<R>,
    /// Share of the coupling between the axes, ωL·i, that is fed forward: 0 to 1.
    pub decoupling: R,
    /// Share of the back-EMF that is fed forward: 0 to 1.
    pub emf_feed_forward: R,
    /// Velocity, A per count/s and A per count.
    pub velocity: Pi<R>,
    /// Derivative part of the velocity controller, A per count/s², behind a filter of 400 Hz.
    pub velocity_derivative: R,
    /// Bound of the velocity integrator, A; the present current limit holds besides.
    pub velocity_integral_limit_a: R,
    /// How steeply torque mode fades out before the velocity limit, A per count/s. The velocity
    /// loop's Kp is a good value.
    pub speed_limit: R,
    /// Position, 1/s and 1/s².
    pub position: Pi<R>,
    /// Derivative part of the position controller, counts/s per count/s.
    pub position_derivative: R,
    /// Bound of the position integrator, counts/s.
    pub position_integral_limit: R,
}

/// Everything that [`Cascade`](crate::Cascade) needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<R: Real> {
    /// Control period, s.
    pub period_s: R,
    /// PWM period, s.
    pub pwm_period_s: R,
    /// How long after the start of the control period in which it was computed the timer takes a
    /// duty, s: one PWM period, or more where the converters are slow.
    pub load_delay_s: R,
    /// The motor.
    pub motor: Motor<R>,
    /// The encoder.
    pub encoder: EncoderSettings<R>,
    /// The power stage.
    pub stage: PowerStage<R>,
    /// Gains.
    pub gains: Gains<R>,
    /// The motor's thermal limit.
    pub i2t: I2t<R>,
}

/// A current of so many converter counts has a direction; below, the compensation of the dead time
/// fades out. It can be this little because a demand has no noise.
const SURE_COUNTS: f32 = 0.5;
/// A measured current below this part of what a given voltage would drive at rest takes its direction
/// from the voltage.
const HINT: f32 = 1.0 / 16.0;
/// Smoothing of the current converters' reading, s.
const PHASE_ADC_TIME_S: f32 = 0.05;
/// Filter of the derivative of the velocity error, rad/s: 400 Hz.
const DERIVATIVE_OMEGA: f32 = 400.0 * core::f32::consts::TAU;
/// Smoothing of temperature and supply, rad/s: the P3's 18 Hz (l.1051).
const SLOW_OMEGA: f32 = 18.0 * core::f32::consts::TAU;

/// What the control period uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Constants<R: Real> {
    pub(crate) period_s: R,
    pub(crate) scales: Scales,
    pub(crate) current_zero: [R; 2],
    pub(crate) amplifier_limit_a: R,
    pub(crate) voltage_limit_v: R,
    /// How far duties go from one half, what is added against the dead time included.
    pub(crate) reach: R,
    /// The shortest part of a PWM period that a phase can be on one rail without being there all the
    /// time; 0 where no phase comes that near to a rail.
    pub(crate) shortest: R,
    /// Longest realisable vector, supply voltages.
    pub(crate) radius: R,
    /// Part of a PWM period that the dead time takes off a phase with a current.
    pub(crate) dead_part: R,
    /// The same per ampere of a current that is hardly one.
    pub(crate) dead_part_per_a: R,
    /// Part of the current at rest that says whereto a given voltage drives a current about zero.
    pub(crate) hint_a_per_v: R,

    pub(crate) electrical_zero: R::Count,
    pub(crate) user_polarity: R::Count,
    /// Electrical angle of one count.
    pub(crate) angle_per_count: R::Count,
    /// Electrical angle by which the rotor moves until the current sample, per user count/s.
    pub(crate) sample_advance: R,
    /// The same until the middle of the time for which the duty is applied.
    pub(crate) apply_advance: R,
    /// Electrical rad per user count.
    pub(crate) electrical_rad_per_count: R,
    /// Sign of the q current of positive user torque.
    pub(crate) torque_sign: R,

    pub(crate) encoder: Encoder<R>,
    pub(crate) motion: MotionGains<R>,
    pub(crate) current: CurrentGains<R>,
    pub(crate) i2t: I2tLimits<R>,
    pub(crate) phase_adc_part: R,
    pub(crate) slow_part: R,
}

impl<R: Real> Constants<R> {
    pub(crate) fn of(p: &Parameters<R>) -> Self {
        let e = &p.encoder;
        let counts = R::of_count(e.counts_per_turn);
        let pole_pairs = R::of_count(p.motor.pole_pairs);
        let user = R::of_count(e.user_polarity);
        let electrical = R::of_count(e.electrical_polarity);

        // 2³²/counts, rounded: exact for a power of two, else half a unit per count, which is
        // below 10⁻⁵ turns at any resolution in use. 2³¹/counts first, since 2³² is no count.
        let half = R::splat(2_147_483_648.0) / counts;
        let angle = R::count_mul(half.to_count(), R::count(2));
        let remainder = (half - R::of_count(half.to_count())) * R::splat(2.0) + R::splat(0.5);
        let angle = R::count_add(angle, remainder.to_count());
        let angle = R::count_mul(
            angle,
            R::count_mul(p.motor.pole_pairs, e.electrical_polarity),
        );
        let angle_per_user_count = R::of_count(angle) * user;

        let rad_per_count =
            R::splat(core::f32::consts::TAU) / counts * pole_pairs * electrical * user;
        let flux_v_s = p.motor.torque_constant_nm_per_a / (R::splat(1.5) * pole_pairs);
        // The encoder is read by the timer, all that the bridge does comes later.
        let sampled = e.lag_s + p.stage.propagation_s;
        let applied = sampled + p.load_delay_s + R::splat(0.5) * p.period_s;

        let dead_part = modulation::dead_part(p.stage.dead_time_s, p.pwm_period_s);
        let half = R::splat(0.5);
        let sure_a = R::splat(SURE_COUNTS * p.stage.scales.current_a);
        let reach = modulation::reach(p.stage.duty_margin);
        let g = &p.gains;
        let d_ki = g.current_d.ki * p.period_s;
        let q_ki = g.current_q.ki * p.period_s;
        Self {
            period_s: p.period_s,
            scales: p.stage.scales,
            current_zero: p.stage.current_zero,
            amplifier_limit_a: p.stage.current_limit_a,
            voltage_limit_v: p.stage.voltage_limit_v,
            reach: (reach + dead_part).least(half),
            shortest: R::select(reach.lt(half), R::splat(0.0), dead_part),
            radius: modulation::radius(reach),
            dead_part,
            dead_part_per_a: dead_part / sure_a,
            hint_a_per_v: R::splat(HINT) / p.motor.phase_resistance_ohm,
            electrical_zero: e.electrical_zero,
            user_polarity: e.user_polarity,
            angle_per_count: angle,
            sample_advance: angle_per_user_count * sampled,
            apply_advance: angle_per_user_count * applied,
            electrical_rad_per_count: rad_per_count,
            torque_sign: electrical * user,
            encoder: Encoder::new(
                e.counts_per_turn,
                e.user_polarity,
                p.period_s,
                &e.loop_cutoff,
                &e.reported_cutoff,
            ),
            motion: MotionGains {
                position_kp: g.position.kp,
                position_ki: g.position.ki * p.period_s,
                position_kd: g.position_derivative,
                position_integral_limit: g.position_integral_limit,
                velocity_kp: g.velocity.kp,
                velocity_ki: g.velocity.ki * p.period_s,
                velocity_kd: g.velocity_derivative * R::splat(DERIVATIVE_OMEGA),
                derivative_part: (p.period_s * R::splat(DERIVATIVE_OMEGA)).least(R::splat(1.0)),
                velocity_integral_limit_a: g.velocity_integral_limit_a,
                speed_limit_gain: g.speed_limit,
            },
            current: CurrentGains {
                d_kp_v_per_a: g.current_d.kp,
                d_ki_v_per_a: d_ki,
                d_back: CurrentGains::back_calculation(g.current_d.kp, d_ki),
                q_kp_v_per_a: g.current_q.kp,
                q_ki_v_per_a: q_ki,
                q_back: CurrentGains::back_calculation(g.current_q.kp, q_ki),
                decoupling_h: p.motor.phase_inductance_h * g.decoupling,
                feed_forward_v_s: flux_v_s * g.emf_feed_forward,
                flux_v_s,
            },
            i2t: I2tLimits::new(&p.i2t, p.period_s),
            phase_adc_part: p.period_s * R::splat(1.0 / PHASE_ADC_TIME_S),
            slow_part: p.period_s * R::splat(SLOW_OMEGA),
        }
    }
}
