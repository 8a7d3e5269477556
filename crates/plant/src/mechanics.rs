//! The shaft: rotor, load, and what acts between and upon them.

use control::{Mask, Real};

use crate::Motor;
use crate::body::{Body, Figures};
use crate::load::Load;
use crate::stops::Contact;

/// Speed and position of the shaft.
///
/// Speed and position leapfrog: the speed held here is the mean over the coming period, and the
/// torque at the period's end changes it to the next period's mean. This keeps second order and
/// the balance of energy without looking ahead.
///
/// * Viscous friction: the exact exponential over a period.
/// * Coulomb friction: a torque that removes at most the whole speed within a period. So a shaft at
///   rest stays exactly at rest until the applied torque exceeds the static friction, nothing
///   chatters about zero, and friction never adds energy.
/// * Position: a wrapping angle of 2³² per turn, whole turns, and the fraction of a count that is
///   still owed; the speed likewise carries what its last bit could not hold. Neither a slow shaft
///   nor a feeble torque is lost in rounding.
///
/// Above half a radian of *electrical* angle per period (477,000 rpm for one pole pair at 100 kHz)
/// the model of the winding ends, and the speed is held there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics<R: Real> {
    rotor: Body<R>,
    stops: Option<Contact<R>>,
    load_torque: R,
    blocked: R::Mask,
}

/// Rotor and rigid load as one piece.
fn rigid(motor: &Motor, load: &Load) -> Figures {
    Figures {
        inertia: motor.rotor_inertia_kgm2 + load.inertia_kgm2,
        viscous: motor.viscous_friction_nms + load.viscous_friction_nms,
        coulomb: motor.coulomb_friction_nm + load.coulomb_friction_nm,
        breakaway: motor.static_friction_nm + load.coulomb_friction_nm,
    }
}

/// Half a radian of electrical angle per period, rad/s of the shaft.
fn speed_limit(motor: &Motor, period_s: f64) -> f64 {
    0.5 / (period_s * f64::from(motor.pole_pairs))
}

impl<R: Real> Mechanics<R> {
    /// A shaft at rest at angle zero, free and without load torque.
    pub fn new(motor: &Motor, load: &Load, period_s: f64) -> Self {
        let figures = rigid(motor, load);
        let contact = |stops| Contact::new(stops, figures.inertia, period_s);
        Self {
            rotor: Body::new(&figures, speed_limit(motor, period_s), period_s),
            stops: load.stops.as_ref().map(contact),
            load_torque: R::splat(0.0),
            blocked: R::Mask::splat(false),
        }
    }

    /// Changes the PWM period, keeping the motion.
    pub fn set_period_s(&mut self, motor: &Motor, load: &Load, period_s: f64) {
        let figures = rigid(motor, load);
        let contact = |stops| Contact::new(stops, figures.inertia, period_s);
        self.rotor
            .set_figures(&figures, speed_limit(motor, period_s), period_s);
        self.stops = load.stops.as_ref().map(contact);
    }

    /// Sets the torque of the load, Nm; positive opposes positive rotation, like a hoisted weight.
    /// An undefined value counts as none.
    pub fn set_load_torque_nm(&mut self, torque_nm: R) {
        let defined = R::select(torque_nm.le(torque_nm), torque_nm, R::splat(0.0));
        self.load_torque = defined.within(R::splat(1e9));
    }

    /// Blocks the shaft where it is, or frees it. A blocked shaft stops at once, whatever its
    /// energy.
    pub fn set_blocked(&mut self, blocked: R::Mask) {
        self.blocked = blocked;
        self.rotor.stop(blocked);
    }

    /// Puts the shaft at an angle (2³² per turn, turn zero) with a speed in rad/s. A blocked shaft
    /// takes the angle alone; an undefined speed counts as none.
    pub fn set_motion(&mut self, angle: R::Count, speed_rad_s: R) {
        self.rotor.set_position(angle, R::count(0));
        self.rotor.set_speed(speed_rad_s);
        self.rotor.stop(self.blocked);
    }

    /// Puts the shaft, with the speed that it has, at a position: angle (2³² per turn) and whole
    /// turns as [`Mechanics::turns`] counts them.
    pub fn set_position(&mut self, angle: R::Count, turns: R::Count) {
        self.rotor.set_position(angle, turns);
    }

    /// Speed during the coming period, rad/s.
    #[inline(always)]
    pub fn period_speed_rad_s(&self) -> R {
        self.rotor.period_speed()
    }

    /// Speed now, between two periods, rad/s.
    #[inline(always)]
    pub fn speed_rad_s(&self) -> R {
        self.rotor.speed()
    }

    /// Angle within the turn, 2³² per turn, wrapping at half a turn either side of zero.
    #[inline(always)]
    pub fn angle(&self) -> R::Count {
        self.rotor.angle()
    }

    /// Whole turns: position in turns = `turns` + `angle` / 2³², wrapping after 2³¹ turns.
    #[inline(always)]
    pub fn turns(&self) -> R::Count {
        self.rotor.turns()
    }

    /// Turns the shaft by one period at its present speed.
    #[inline(always)]
    pub fn turn(&mut self) {
        self.rotor.turn();
    }

    /// Changes the speed by one period of the motor's torque, Nm, against load and friction.
    #[inline(always)]
    pub fn accelerate(&mut self, motor_torque_nm: R) {
        let mut driving = motor_torque_nm;
        if let Some(stops) = &self.stops {
            driving = driving + stops.torque(&self.rotor, driving - self.load_torque);
        }
        self.rotor
            .accelerate(driving, self.load_torque, self.blocked);
    }
}
