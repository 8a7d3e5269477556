//! The stator currents over one PWM period, exactly.

use control::Real;

use crate::exponential::{decayed, decayed_fraction};
use crate::{Motor, Vector};

/// The winding of a motor without saliency, discretised exactly in the stator frame.
///
/// With the phase voltage v and the speed ω (electrical) constant over a period h, and a = e^(-Rh/L),
///
/// i(h) = a i(0) + (1 - a)/R · v - (jωψ/L) e^(jθ) (e^(jωh) - a) / (R/L + jω),
///
/// valid at every speed down to zero, in f32 to some µA: the differences in the last term are
/// formed before anything is rounded (`e^(jωh) - a = (1 - a) + (e^(jωh) - 1)`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding<R: Real> {
    /// a: what is left of a current after one period.
    remaining: R,
    /// 1 - a.
    decayed: R,
    /// (1 - a)/R, A/V.
    gain: R,
    /// Weight of the first current in the mean of a period: 1/x - a/(1 - a), x = Rh/L.
    first_weight: R,
    /// p L/R, s: times the mechanical speed, the reactance over the resistance.
    reactance: R,
    /// p h, s: times the mechanical speed, the electrical angle of one period.
    electrical_period: R,
    /// ψ/L, A.
    short_circuit_current: R,
    /// 1.5 p ψ, Nm/A.
    torque_constant: R,
    /// p ψ, V s/rad.
    emf_constant: R,
    /// h/L, 1/Ω; L, H; p, with the direction in which the magnet turns.
    constants_per_ohm: R,
    inductance: R,
    electrical_turns: R,
}

impl<R: Real> Winding<R> {
    /// The winding of `motor` for PWM periods of `period_s`.
    pub fn new(motor: &Motor, period_s: f64) -> Self {
        let (resistance, inductance) = (motor.phase_resistance_ohm, motor.phase_inductance_h);
        let electrical_turns = f64::from(motor.electrical_turns());
        let constants = resistance * period_s / inductance;
        let decayed = decayed_fraction(constants);
        let first_weight = if constants > 1e-3 {
            1.0 / constants - (1.0 - decayed) / decayed
        } else {
            0.5 - constants / 12.0
        };
        let real = |value: f64| R::splat(value as f32);
        Self {
            remaining: real(1.0 - decayed),
            decayed: real(decayed),
            gain: real(decayed / resistance),
            first_weight: real(first_weight),
            reactance: real(electrical_turns * inductance / resistance),
            electrical_period: real(electrical_turns * period_s),
            short_circuit_current: real(motor.flux_wb / inductance),
            torque_constant: real(1.5 * electrical_turns * motor.flux_wb),
            emf_constant: real(electrical_turns * motor.flux_wb),
            constants_per_ohm: real(period_s / inductance),
            inductance: real(inductance),
            electrical_turns: real(electrical_turns),
        }
    }

    /// Gives it another resistance, Ω, and flux, Wb, as it has warmed up. Both positive.
    pub fn set_warm(&mut self, resistance_ohm: R, flux_wb: R) {
        let one = R::splat(1.0);
        let constants = resistance_ohm * self.constants_per_ohm;
        self.decayed = decayed(constants);
        self.remaining = one - self.decayed;
        self.gain = self.decayed / resistance_ohm;
        // The series where the difference would lose digits; its next term is x³/720.
        let series = R::splat(0.5) - constants * R::splat(1.0 / 12.0);
        let exact = one / constants - self.remaining / self.decayed;
        self.first_weight = R::select(constants.lt(R::splat(0.05)), series, exact);
        self.reactance = self.electrical_turns * self.inductance / resistance_ohm;
        self.short_circuit_current = flux_wb / self.inductance;
        self.emf_constant = self.electrical_turns * flux_wb;
        self.torque_constant = self.emf_constant * R::splat(1.5);
    }

    /// e^(jωh) - 1: what turning for one period at the mechanical speed adds to a vector of length
    /// 1 that turns with the magnet.
    ///
    /// A series, because the difference itself is wanted to full precision. The mechanics holds the
    /// electrical angle of a period within half a radian, where the rest of the series is below
    /// 1e-7 of it.
    #[inline(always)]
    pub fn turning(&self, speed_rad_s: R) -> Vector<R> {
        let angle = self.electrical_period * speed_rad_s;
        let square = angle * angle;
        let series = |c4: f32, c2: f32, c0: f32| {
            (R::splat(c4) * square + R::splat(c2)) * square + R::splat(c0)
        };
        Vector {
            alpha: square * series(-1.0 / 720.0, 1.0 / 24.0, -0.5),
            beta: angle + angle * square * series(-1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0),
        }
    }

    /// Current at the end of the period when the terminals are shorted (no voltage), from
    /// `current` and `rotor` at its begin (A; unit vector along the magnet), the mechanical speed
    /// during it, rad/s, and the [`Winding::turning`] of that speed.
    #[inline(always)]
    pub fn shorted(
        &self,
        current: Vector<R>,
        rotor: Vector<R>,
        speed_rad_s: R,
        turning: Vector<R>,
    ) -> Vector<R> {
        // jω/(R/L + jω) = q (q + j)/(1 + q²), q = ωL/R.
        let q = self.reactance * speed_rad_s;
        let scale = self.short_circuit_current * q / (q * q + R::splat(1.0));
        let response = Vector {
            alpha: q * scale,
            beta: scale,
        };
        let turned = Vector {
            alpha: turning.alpha + self.decayed,
            beta: turning.beta,
        };
        current * self.remaining - rotor.times(response).times(turned)
    }

    /// Amperes that one volt of mean phase voltage adds within the period.
    #[inline(always)]
    pub fn gain_a_per_v(&self) -> R {
        self.gain
    }

    /// Mean of the current over a period, from its ends; exact for an EMF that stands still in it.
    #[inline(always)]
    pub fn mean(&self, first: Vector<R>, last: Vector<R>) -> Vector<R> {
        last + (first - last) * self.first_weight
    }

    /// Torque on the rotor, Nm.
    #[inline(always)]
    pub fn torque_nm(&self, current: Vector<R>, rotor: Vector<R>) -> R {
        self.torque_constant * rotor.cross(current)
    }

    /// Electromotive force of the phases, V.
    pub fn emf_v(&self, rotor: Vector<R>, speed_rad_s: R) -> Vector<R> {
        Vector {
            alpha: -rotor.beta,
            beta: rotor.alpha,
        } * (self.emf_constant * speed_rad_s)
    }
}
