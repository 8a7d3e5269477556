//! A load behind a shaft that twists.

use control::{Mask as _, Real};

use crate::body::{Body, Figures};
use crate::exponential::decayed_fraction;
use crate::load::Coupling;

/// Rotor and load are two masses; this is the second, and the spring between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Elastic<R: Real> {
    pub(crate) load: Body<R>,
    spring: Spring<R>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Spring<R: Real> {
    stiffness: R,
    /// What takes off the difference of speed what the damper alone would in a period, Nm s/rad.
    damping: R,
    /// Half the play, rad, and whether there is any.
    half_play: R,
    has_play: R::Mask,
}

/// Angle of the resonance in a period up to which the spring is followed; there its frequency is 1 %
/// too high.
const MAX_ANGLE: f64 = 0.5;

impl<R: Real> Spring<R> {
    fn new(coupling: &Coupling, rotor_inertia: f64, load_inertia: f64, period_s: f64) -> Self {
        let per_inertia = 1.0 / rotor_inertia + 1.0 / load_inertia;
        let stiffest = (MAX_ANGLE / period_s) * (MAX_ANGLE / period_s) / per_inertia;
        let stiffness = if coupling.stiffness_nm_per_rad < stiffest {
            coupling.stiffness_nm_per_rad
        } else {
            stiffest
        };
        let inverse = period_s * per_inertia;
        let damping = decayed_fraction(coupling.damping_nms * inverse) / inverse;
        let real = |value: f64| R::splat(value as f32);
        Self {
            stiffness: real(stiffness),
            damping: real(damping),
            half_play: real(0.5 * coupling.backlash_rad),
            has_play: R::Mask::splat(coupling.backlash_rad > 0.0),
        }
    }
}

impl<R: Real> Elastic<R> {
    pub(crate) fn new(
        coupling: &Coupling,
        rotor: &Figures,
        load: &Figures,
        speed_limit: f64,
        period_s: f64,
    ) -> Self {
        Self {
            load: Body::new(load, speed_limit, period_s),
            spring: Spring::new(coupling, rotor.inertia, load.inertia, period_s),
        }
    }

    /// Changes the PWM period, keeping the motion.
    pub(crate) fn set_period_s(
        &mut self,
        coupling: &Coupling,
        rotor: &Figures,
        load: &Figures,
        speed_limit: f64,
        period_s: f64,
    ) {
        self.load.set_figures(load, speed_limit, period_s);
        self.spring = Spring::new(coupling, rotor.inertia, load.inertia, period_s);
    }

    /// Torque of the coupling on the load, Nm; the rotor feels it the other way.
    #[inline(always)]
    pub(crate) fn torque(&self, rotor: &Body<R>) -> R {
        let (s, zero) = (&self.spring, R::splat(0.0));
        let twist = rotor.beyond(self.load.angle(), self.load.turns());
        let bent = twist - twist.within(s.half_play);
        let difference = rotor.period_speed() - self.load.period_speed();
        let torque = bent * s.stiffness + difference * s.damping;
        // With play, a flank only pushes, and between the flanks nothing acts.
        let pushed = R::select(zero.lt(bent), torque.greatest(zero), zero);
        let pushed = R::select(bent.lt(zero), torque.least(zero), pushed);
        R::select(s.has_play, pushed, torque)
    }
}
