//! What hangs on the motor's shaft.

use crate::Invalid;

/// The load; all figures at the motor's shaft. With a [`Coupling`] it turns on its own behind a
/// spring; without one it is part of the rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Inertia, kg m².
    pub inertia_kgm2: f64,
    /// Friction torque that does not depend on speed, Nm.
    pub coulomb_friction_nm: f64,
    /// Friction torque per speed, Nm s/rad.
    pub viscous_friction_nms: f64,
    /// An elastic shaft between rotor and load; `None`: rigid.
    pub coupling: Option<Coupling>,
    /// A weight that turns with the load; `None`: balanced.
    pub pendulum: Option<Pendulum>,
    /// The ends of the load's way; `None`: it turns for ever.
    pub stops: Option<Stops>,
}

/// A shaft that twists, with a damper beside its spring and play at its end.
///
/// The spring is held below the stiffness at which the two masses would swing faster than once in
/// twelve PWM periods, which no steps of a PWM period could follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Torque per twist, Nm/rad.
    pub stiffness_nm_per_rad: f64,
    /// Torque per difference of speed, Nm s/rad. Within the play it does not act.
    pub damping_nms: f64,
    /// Twist from one flank to the other in which the load is free, rad.
    pub backlash_rad: f64,
}

/// An unbalanced load in the field of gravity: it opposes positive rotation by `torque_nm` ·
/// sin(position - hanging).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    /// Torque when it is horizontal, Nm.
    pub torque_nm: f64,
    /// Position at which it hangs straight down, turns.
    pub hanging_turns: f64,
}

/// Hard stops: springs with dampers that only push. They act upon the load.
///
/// A mass that strikes one bounces with e^(-ζ φ/√(1-ζ²)) of its speed, φ = π - atan(2ζ√(1-ζ²)/(1-2ζ²))
/// for ζ up to 0.7:
///
/// | ζ | 0 | 0.1 | 0.2 | 0.3 | 0.5 |
/// |---|---|---|---|---|---|
/// | speed after the bounce | 100 % | 74 % | 57 % | 45 % | 30 % |
///
/// The stiffness is held below that at which the contact would last less than 31 PWM periods
/// (44.5 Nm/rad for the bare P3 motor at 100 kHz).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stops {
    /// Where the lower stop is touched, turns; -∞: there is none.
    pub lowest_turns: f64,
    /// Where the upper stop is touched, turns; +∞: there is none.
    pub highest_turns: f64,
    /// Torque per way into the stop, Nm/rad.
    pub stiffness_nm_per_rad: f64,
    /// ζ, the damping in parts of the critical damping of the mass that strikes it.
    pub damping_ratio: f64,
}

impl Stops {
    /// Stops at these positions, turns, into which 30 mNm press a shaft by 4 counts of 4096, and off
    /// which it bounces with 45 % of its speed.
    pub const fn between(lowest_turns: f64, highest_turns: f64) -> Self {
        Self {
            lowest_turns,
            highest_turns,
            stiffness_nm_per_rad: 5.0,
            damping_ratio: 0.3,
        }
    }
}

impl Load {
    /// Nothing.
    pub const NONE: Load = Load {
        inertia_kgm2: 0.0,
        coulomb_friction_nm: 0.0,
        viscous_friction_nms: 0.0,
        coupling: None,
        pendulum: None,
        stops: None,
    };

    /// The part of [`crate::Parameters::check`] that is about what hangs on the shaft, which starts
    /// at `start_turns`.
    pub(crate) fn check(&self, start_turns: f64) -> Result<(), Invalid> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        if let Some(coupling) = &self.coupling {
            if !positive(coupling.stiffness_nm_per_rad) {
                return Err(Invalid::Coupling(coupling.stiffness_nm_per_rad));
            }
            for value in [coupling.damping_nms, coupling.backlash_rad] {
                if !not_negative(value) {
                    return Err(Invalid::Coupling(value));
                }
            }
            if !positive(self.inertia_kgm2) {
                return Err(Invalid::Inertia(self.inertia_kgm2));
            }
        }
        if let Some(pendulum) = &self.pendulum {
            if !pendulum.torque_nm.is_finite() {
                return Err(Invalid::Pendulum(pendulum.torque_nm));
            }
            if !(-MAX_TURNS..=MAX_TURNS).contains(&pendulum.hanging_turns) {
                return Err(Invalid::Pendulum(pendulum.hanging_turns));
            }
        }
        if let Some(stops) = &self.stops {
            let starts_between = stops.lowest_turns <= start_turns
                && start_turns <= stops.highest_turns
                && stops.lowest_turns < stops.highest_turns;
            if !starts_between {
                return Err(Invalid::Stops(stops.lowest_turns, stops.highest_turns));
            }
            if !positive(stops.stiffness_nm_per_rad) {
                return Err(Invalid::Stop(stops.stiffness_nm_per_rad));
            }
            if !not_negative(stops.damping_ratio) {
                return Err(Invalid::Stop(stops.damping_ratio));
            }
        }
        Ok(())
    }
}

/// The farthest that a shaft counts, turns.
pub(crate) const MAX_TURNS: f64 = 1_073_741_824.0;

/// A position in turns as a shaft counts it: within the turn, 2³² per turn and wrapping at half a
/// turn, and whole turns; up to 2³⁰ turns to either side, at zero if undefined.
pub(crate) fn angle_and_turns(turns: f64) -> (i32, i32) {
    let held = turns.clamp(-MAX_TURNS, MAX_TURNS);
    let steps = (held * 4_294_967_296.0) as i64;
    let whole = (steps + 0x8000_0000) >> 32;
    (steps as i32, whole as i32)
}
