//! Gains from bandwidth, damping and the motor's figures.
//!
//! These run when a parameter is written, not in the control period. A rule that gives a negative
//! gain for the figures at hand is an error that carries the numbers; nothing is clamped.

use core::f32::consts::TAU;

/// A proportional and an integral gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pi<R = f32> {
    /// Output per input.
    pub kp: R,
    /// Output per input and second.
    pub ki: R,
}

/// How the current loop's gains follow from its bandwidth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Kp = 2ζωL − R, Ki = ω²L: the closed loop has the poles of s² + 2ζωs + ω². It also has a
    /// zero at −Ki/Kp, so it overshoots even at ζ = 1. Kp is negative where ω < R / 2ζL, which for
    /// a motor of small L/R is a high bandwidth: 1,430 Hz for an EC-max 22 at ζ = 1.
    SecondOrder,
    /// Kp = ωL, Ki = ωR: the controller's zero cancels the winding's pole and the closed loop is of
    /// first order. Damping is ignored. Any bandwidth is possible.
    PoleZero,
}

/// Which figure an error speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Loop bandwidth, Hz.
    Bandwidth,
    /// Damping ratio.
    Damping,
    /// Resistance of one phase, Ω.
    Resistance,
    /// Inductance of one phase, H.
    Inductance,
    /// Moment of inertia, kg m².
    Inertia,
    /// Torque constant, Nm per ampere of phase current amplitude.
    TorqueConstant,
    /// Encoder counts of one turn.
    CountsPerTurn,
}

/// Why there are no gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TuningError {
    /// A figure is zero, negative, infinite or not a number.
    NotPositive {
        /// Which.
        figure: Figure,
        /// What it was.
        value: f32,
    },
    /// The rule asks for a negative proportional gain. Raise the bandwidth above
    /// `least_bandwidth_hz`, or use [`Rule::PoleZero`].
    NegativeGain {
        /// The gain that the rule gives, V/A.
        kp_v_per_a: f32,
        /// The bandwidth that was asked for, Hz.
        bandwidth_hz: f32,
        /// Where the gain becomes zero with the same damping, Hz.
        least_bandwidth_hz: f32,
    },
    /// The figures are each possible but their gains are beyond the range of `f32`.
    OutOfRange,
}

fn positive(figure: Figure, value: f32) -> Result<f32, TuningError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(TuningError::NotPositive { figure, value })
    }
}

fn finite(gains: Pi) -> Result<Pi, TuningError> {
    if gains.kp.is_finite() && gains.ki.is_finite() {
        Ok(gains)
    } else {
        Err(TuningError::OutOfRange)
    }
}

/// Gains of a current loop, V/A and V/(A s), from its bandwidth in Hz, its damping ratio and one
/// phase's resistance (Ω) and inductance (H): half of what is measured between two terminals.
///
/// # Errors
/// [`TuningError`]; see [`Rule`] for when the second-order rule has no gains.
pub fn current(
    rule: Rule,
    bandwidth_hz: f32,
    damping: f32,
    phase_resistance_ohm: f32,
    phase_inductance_h: f32,
) -> Result<Pi, TuningError> {
    let omega = TAU * positive(Figure::Bandwidth, bandwidth_hz)?;
    let resistance = positive(Figure::Resistance, phase_resistance_ohm)?;
    let inductance = positive(Figure::Inductance, phase_inductance_h)?;
    match rule {
        Rule::SecondOrder => {
            let damping = positive(Figure::Damping, damping)?;
            let kp = 2.0 * damping * omega * inductance - resistance;
            if kp < 0.0 {
                return Err(TuningError::NegativeGain {
                    kp_v_per_a: kp,
                    bandwidth_hz,
                    least_bandwidth_hz: resistance / (2.0 * damping * inductance * TAU),
                });
            }
            finite(Pi {
                kp,
                ki: omega * omega * inductance,
            })
        }
        Rule::PoleZero => finite(Pi {
            kp: omega * inductance,
            ki: omega * resistance,
        }),
    }
}

/// Gains of a velocity loop in encoder counts, A per count/s and A per count, from its bandwidth
/// in Hz, its damping ratio, the inertia at the motor's shaft and the torque constant: Kp = 2ζωJ/Kt
/// and Ki = ω²J/Kt per rad/s, times 2π over the counts of a turn.
///
/// # Errors
/// [`TuningError`].
pub fn velocity(
    bandwidth_hz: f32,
    damping: f32,
    inertia_kg_m2: f32,
    torque_constant_nm_per_a: f32,
    counts_per_turn: f32,
) -> Result<Pi, TuningError> {
    let omega = TAU * positive(Figure::Bandwidth, bandwidth_hz)?;
    let damping = positive(Figure::Damping, damping)?;
    let inertia = positive(Figure::Inertia, inertia_kg_m2)?;
    let torque_constant = positive(Figure::TorqueConstant, torque_constant_nm_per_a)?;
    let counts_per_turn = positive(Figure::CountsPerTurn, counts_per_turn)?;
    let amperes_per_acceleration = inertia / torque_constant * (TAU / counts_per_turn);
    finite(Pi {
        kp: 2.0 * damping * omega * amperes_per_acceleration,
        ki: omega * omega * amperes_per_acceleration,
    })
}

/// A proportional and a derivative gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pd {
    /// Output per input.
    pub kp: f32,
    /// Output per input's rate.
    pub kd: f32,
}

/// Gains of a position loop, counts/s per count (1/s) and counts/s per count/s: Kp = ζω and
/// Kd = ζ − 1. Its velocity demand rides on the velocity feed-forward, so it corrects only what the
/// velocity loop leaves, and what that sees of a following error e is ζ·(de/dt + ωe): the axis comes
/// back with ω whatever ζ is, and the velocity loop holds it ζ times as stiffly. At ζ = 1 the
/// controller is proportional. Keep the bandwidth a quarter of the velocity loop's or less.
///
/// # Errors
/// [`TuningError::NotPositive`].
pub fn position(bandwidth_hz: f32, damping: f32) -> Result<Pd, TuningError> {
    let omega = TAU * positive(Figure::Bandwidth, bandwidth_hz)?;
    let damping = positive(Figure::Damping, damping)?;
    Ok(Pd {
        kp: damping * omega,
        kd: damping - 1.0,
    })
}

/// Current that accelerates an inertia, A per count/s²: the acceleration feed-forward.
///
/// # Errors
/// [`TuningError`].
pub fn acceleration_current(
    inertia_kg_m2: f32,
    torque_constant_nm_per_a: f32,
    counts_per_turn: f32,
) -> Result<f32, TuningError> {
    let inertia = positive(Figure::Inertia, inertia_kg_m2)?;
    let torque_constant = positive(Figure::TorqueConstant, torque_constant_nm_per_a)?;
    let counts_per_turn = positive(Figure::CountsPerTurn, counts_per_turn)?;
    Ok(inertia / torque_constant * (TAU / counts_per_turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EC-max 22 283860: 13.1 Ω and 0.729 mH between terminals.
    const R: f32 = 6.55;
    const L: f32 = 0.000_364_5;

    fn near(got: f32, wanted: f64) {
        assert!(
            (f64::from(got) / wanted - 1.0).abs() < 2e-6,
            "{got} {wanted}"
        );
    }

    #[test]
    fn second_order_gains_put_both_poles_where_they_belong() {
        let Pi { kp, ki } = current(Rule::SecondOrder, 2000.0, 1.0, R, L).unwrap();
        // 2·12566.37·0.0003645 − 6.55 and 12566.37²·0.0003645, by hand.
        near(kp, 2.610_884_4);
        near(ki, 57_559.6);
        // The closed loop L s² + (R + Kp) s + Ki has a double pole at −ω: discriminant zero.
        let (kp, ki, r, l) = (f64::from(kp), f64::from(ki), f64::from(R), f64::from(L));
        let middle = (r + kp) / (2.0 * l);
        assert!((middle / 12_566.370_6 - 1.0).abs() < 1e-6);
        assert!((middle * middle / (ki / l) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn pole_zero_gains_cancel_the_winding() {
        let Pi { kp, ki } = current(Rule::PoleZero, 1000.0, f32::NAN, R, L).unwrap();
        near(kp, 6_283.185_307 * 0.000_364_5);
        near(ki, 6_283.185_307 * 6.55);
        near(ki / kp, 6.55 / 0.000_364_5);
    }

    #[test]
    fn a_negative_gain_is_an_error_with_its_numbers() {
        let Err(TuningError::NegativeGain {
            kp_v_per_a,
            bandwidth_hz,
            least_bandwidth_hz,
        }) = current(Rule::SecondOrder, 1000.0, 1.0, R, L)
        else {
            panic!("gains where there are none");
        };
        near(kp_v_per_a, 2.0 * 6_283.185_307 * 0.000_364_5 - 6.55);
        assert_eq!(bandwidth_hz, 1000.0);
        near(
            least_bandwidth_hz,
            6.55 / (2.0 * 0.000_364_5 * core::f64::consts::TAU),
        );
        assert!(current(Rule::SecondOrder, least_bandwidth_hz * 1.0001, 1.0, R, L).is_ok());
        assert!(current(Rule::PoleZero, 1000.0, 1.0, R, L).is_ok());
    }

    #[test]
    fn velocity_and_position_gains_follow_their_formulas() {
        let Pi { kp, ki } = velocity(100.0, 1.0, 4.45e-7, 0.031_56, 4096.0).unwrap();
        let per_rad = 4.45e-7 / 0.031_56;
        let counts = core::f64::consts::TAU / 4096.0;
        near(kp, 2.0 * 628.318_530_7 * per_rad * counts);
        near(ki, 628.318_530_7 * 628.318_530_7 * per_rad * counts);
        let Pd { kp, kd } = position(20.0, 1.0).unwrap();
        near(kp, 125.663_706);
        assert_eq!(kd, 0.0);
        let Pd { kp, kd } = position(20.0, 2.5).unwrap();
        near(kp, 314.159_265);
        assert_eq!(kd, 1.5);
        near(
            acceleration_current(4.45e-7, 0.031_56, 4096.0).unwrap(),
            per_rad * counts,
        );
    }

    #[test]
    fn impossible_figures_are_named() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            for rule in [Rule::SecondOrder, Rule::PoleZero] {
                for (figure, result) in [
                    (Figure::Bandwidth, current(rule, bad, 1.0, R, L)),
                    (Figure::Resistance, current(rule, 2e3, 1.0, bad, L)),
                    (Figure::Inductance, current(rule, 2e3, 1.0, R, bad)),
                ] {
                    expect(figure, bad, result);
                }
            }
            let damping = current(Rule::SecondOrder, 2e3, bad, R, L);
            expect(Figure::Damping, bad, damping);
            let counts = velocity(1.0, 1.0, 1.0, 1.0, bad);
            expect(Figure::CountsPerTurn, bad, counts);
            expect(Figure::Inertia, bad, velocity(1.0, 1.0, bad, 1.0, 1.0));
            let constant = velocity(1.0, 1.0, 1.0, bad, 1.0);
            expect(Figure::TorqueConstant, bad, constant);
            assert!(position(bad, 1.0).is_err());
            expect(Figure::Damping, bad, position(1.0, bad));
        }
        assert_eq!(
            current(Rule::PoleZero, 1e38, 1.0, 1e10, 1.0),
            Err(TuningError::OutOfRange)
        );
    }

    fn expect<T: core::fmt::Debug>(figure: Figure, bad: f32, result: Result<T, TuningError>) {
        let Err(TuningError::NotPositive {
            figure: named,
            value,
        }) = result
        else {
            panic!("{figure:?} of {bad} accepted");
        };
        assert_eq!(named, figure);
        assert_eq!(value.to_bits(), bad.to_bits());
    }
}
