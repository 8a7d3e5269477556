//! The current loop: two PI controllers in the rotor's frame.

use crate::Real;
use crate::transform::Rotor;

/// What the current loop needs of the motor, the stage and the tuning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentGains<R: Real> {
    /// Proportional gain of the d axis, V/A.
    pub d_kp_v_per_a: R,
    /// Integral gain of the d axis over one control period, V/A.
    pub d_ki_v_per_a: R,
    /// Part of a voltage that could not be realised which the d integrator gives back in a period.
    pub d_back: R,
    /// Proportional gain of the q axis, V/A.
    pub q_kp_v_per_a: R,
    /// Integral gain of the q axis over one control period, V/A.
    pub q_ki_v_per_a: R,
    /// Part of a voltage that could not be realised which the q integrator gives back in a period.
    pub q_back: R,
    /// Inductance fed forward to decouple the axes, H; 0 to leave coupling to the integrators.
    pub decoupling_h: R,
    /// Flux linkage fed forward against the back-EMF, V s; 0 to leave it to the integrators.
    pub feed_forward_v_s: R,
    /// Flux linkage, V s, from which the q integrator starts when the bridge is enabled.
    pub flux_v_s: R,
}

impl<R: Real> CurrentGains<R> {
    /// How much of an unrealised voltage the integrator gives back: Ki·Ts/Kp, which makes the
    /// integrator follow the realised voltage with its own time constant, and at most all of it.
    pub fn back_calculation(kp_v_per_a: R, ki_v_per_a: R) -> R {
        let one = R::splat(1.0);
        let part = ki_v_per_a / kp_v_per_a;
        R::select(R::splat(0.0).lt(kp_v_per_a), part.least(one), one)
    }
}

/// State of the current loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentLoop<R: Real> {
    integral_v: Rotor<R>,
}

impl<R: Real> CurrentLoop<R> {
    /// At rest.
    pub fn new() -> Self {
        let zero = R::splat(0.0);
        Self {
            integral_v: Rotor { d: zero, q: zero },
        }
    }

    /// The voltage for a demanded and a measured current, V, before its limit:
    /// Kp·e + I + feed-forward. The speed is the electrical one.
    #[inline(always)]
    pub fn wanted(
        &self,
        gains: &CurrentGains<R>,
        error_a: Rotor<R>,
        actual_a: Rotor<R>,
        speed_rad_per_s: R,
    ) -> Rotor<R> {
        let coupling = speed_rad_per_s * gains.decoupling_h;
        let forward = speed_rad_per_s * gains.feed_forward_v_s;
        let d = gains.d_kp_v_per_a * error_a.d + self.integral_v.d - coupling * actual_a.q;
        let q =
            gains.q_kp_v_per_a * error_a.q + self.integral_v.q + coupling * actual_a.d + forward;
        Rotor {
            d: d.sane(),
            q: q.sane(),
        }
    }

    /// Ends the control period: I += Ki·Ts·e + back·(realised − wanted). The integrator moves after
    /// its use (forward Euler): of the discretisations this one tolerates most delay. Where
    /// `running` is false it is preset to the back-EMF, so that enabling at speed starts without a
    /// current surge.
    #[inline(always)]
    pub fn settle(
        &mut self,
        gains: &CurrentGains<R>,
        error_a: Rotor<R>,
        unrealised_v: Rotor<R>,
        speed_rad_per_s: R,
        running: R::Mask,
    ) {
        let d = self.integral_v.d + gains.d_ki_v_per_a * error_a.d - gains.d_back * unrealised_v.d;
        let q = self.integral_v.q + gains.q_ki_v_per_a * error_a.q - gains.q_back * unrealised_v.q;
        let preset = speed_rad_per_s * (gains.flux_v_s - gains.feed_forward_v_s);
        self.integral_v = Rotor {
            d: R::select(running, d, R::splat(0.0)).sane(),
            q: R::select(running, q, preset).sane(),
        };
    }
}

impl<R: Real> Default for CurrentLoop<R> {
    fn default() -> Self {
        Self::new()
    }
}
