//! The shaft: rotor, load, and what acts between and upon them.

use control::{Mask, Real};

use crate::Motor;
use crate::body::{Body, Figures};
use crate::elastic::Elastic;
use crate::load::Load;
use crate::ripple::Ripple;
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
    elastic: Option<Elastic<R>>,
    cogging: Option<Ripple<R>>,
    pendulum: Option<Ripple<R>>,
    stops: Option<Contact<R>>,
    load_torque: R,
    blocked: R::Mask,
}

/// The motor's rotor, with what is fixed to it, and a load that turns on its own.
fn masses(motor: &Motor, load: &Load) -> (Figures, Figures) {
    let behind = Figures {
        inertia: load.inertia_kgm2,
        viscous: load.viscous_friction_nms,
        coulomb: load.coulomb_friction_nm,
        breakaway: load.coulomb_friction_nm,
    };
    let mut rotor = Figures {
        inertia: motor.rotor_inertia_kgm2,
        viscous: motor.viscous_friction_nms,
        coulomb: motor.coulomb_friction_nm,
        breakaway: motor.static_friction_nm,
    };
    if load.coupling.is_none() {
        rotor.inertia += behind.inertia;
        rotor.viscous += behind.viscous;
        rotor.coulomb += behind.coulomb;
        rotor.breakaway += behind.breakaway;
    }
    (rotor, behind)
}

/// The stops, in terms of what strikes them.
fn contact<R: Real>(load: &Load, masses: &(Figures, Figures), period_s: f64) -> Option<Contact<R>> {
    let (rotor, behind) = masses;
    let strikes = match load.coupling {
        Some(_) => behind.inertia,
        None => rotor.inertia,
    };
    let stops = load.stops.as_ref()?;
    Some(Contact::new(stops, strikes, period_s))
}

/// Half a radian of electrical angle per period, rad/s of the shaft.
fn speed_limit(motor: &Motor, period_s: f64) -> f64 {
    0.5 / (period_s * f64::from(motor.pole_pairs))
}

impl<R: Real> Mechanics<R> {
    /// A shaft at rest at angle zero, free and without load torque.
    pub fn new(motor: &Motor, load: &Load, period_s: f64) -> Self {
        let masses = masses(motor, load);
        let (rotor, behind) = &masses;
        let limit = speed_limit(motor, period_s);
        let elastic = |coupling| Elastic::new(coupling, rotor, behind, limit, period_s);
        Self {
            rotor: Body::new(rotor, limit, period_s),
            elastic: load.coupling.as_ref().map(elastic),
            cogging: Ripple::of_cogging(&motor.cogging),
            pendulum: load.pendulum.as_ref().and_then(Ripple::of_pendulum),
            stops: contact(load, &masses, period_s),
            load_torque: R::splat(0.0),
            blocked: R::Mask::splat(false),
        }
    }

    /// Changes the PWM period, and the load if it is another, keeping the motion. A load that is new
    /// behind a coupling turns with the shaft at first.
    pub fn set_period_s(&mut self, motor: &Motor, load: &Load, period_s: f64) {
        let masses = masses(motor, load);
        let (rotor, behind) = &masses;
        let limit = speed_limit(motor, period_s);
        self.rotor.set_figures(rotor, limit, period_s);
        match (&mut self.elastic, &load.coupling) {
            (Some(elastic), Some(coupling)) => {
                elastic.set_period_s(coupling, rotor, behind, limit, period_s);
            }
            (None, Some(coupling)) => {
                let mut elastic = Elastic::new(coupling, rotor, behind, limit, period_s);
                let shaft = &self.rotor;
                elastic.load.set_position(shaft.angle(), shaft.turns());
                elastic.load.set_speed(shaft.period_speed());
                self.elastic = Some(elastic);
            }
            (_, None) => self.elastic = None,
        }
        self.pendulum = load.pendulum.as_ref().and_then(Ripple::of_pendulum);
        self.stops = contact(load, &masses, period_s);
    }

    /// Sets the torque of the load, Nm; positive opposes positive rotation, like a hoisted weight.
    /// An undefined value counts as none.
    pub fn set_load_torque_nm(&mut self, torque_nm: R) {
        let defined = R::select(torque_nm.le(torque_nm), torque_nm, R::splat(0.0));
        self.load_torque = defined.within(R::splat(1e9));
    }

    /// Blocks the motor's shaft where it is, or frees it. A blocked shaft stops at once, whatever its
    /// energy. A load behind a coupling goes on, as far as that lets it.
    pub fn set_blocked(&mut self, blocked: R::Mask) {
        self.blocked = blocked;
        self.rotor.stop(blocked);
    }

    /// Puts shaft and load at an angle (2³² per turn, turn zero) with a speed in rad/s. A blocked shaft
    /// takes the angle alone; an undefined speed counts as none.
    pub fn set_motion(&mut self, angle: R::Count, speed_rad_s: R) {
        self.set_position(angle, R::count(0));
        self.rotor.set_speed(speed_rad_s);
        self.rotor.stop(self.blocked);
        if let Some(elastic) = &mut self.elastic {
            elastic.load.set_speed(speed_rad_s);
        }
    }

    /// Puts shaft and load, with the speed that they have, at a position: angle (2³² per turn) and
    /// whole turns as [`Mechanics::turns`] counts them.
    pub fn set_position(&mut self, angle: R::Count, turns: R::Count) {
        self.rotor.set_position(angle, turns);
        if let Some(elastic) = &mut self.elastic {
            elastic.load.set_position(angle, turns);
        }
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

    /// What carries the load: a mass of its own, or the rotor.
    fn carrier(&self) -> &Body<R> {
        self.elastic
            .as_ref()
            .map_or(&self.rotor, |elastic| &elastic.load)
    }

    /// The load's angle, as [`Mechanics::angle`]; the same as that without a coupling.
    pub fn load_angle(&self) -> R::Count {
        self.carrier().angle()
    }

    /// The load's whole turns.
    pub fn load_turns(&self) -> R::Count {
        self.carrier().turns()
    }

    /// The load's speed now, rad/s.
    pub fn load_speed_rad_s(&self) -> R {
        self.carrier().speed()
    }

    /// Whether the rotor turns by itself: nothing hangs on it but what it carries and friction, and
    /// no torque depends on its angle.
    #[inline(always)]
    pub(crate) fn is_alone(&self) -> bool {
        self.elastic.is_none()
            && self.cogging.is_none()
            && self.pendulum.is_none()
            && self.stops.is_none()
    }

    /// Whether the rotor is alone and stands, and still does after a period without a torque of the
    /// motor.
    #[inline(always)]
    pub(crate) fn rests(&self) -> R::Mask {
        let held = self.rotor.is_held_against(self.load_torque) | self.blocked;
        R::Mask::splat(self.is_alone()) & self.rotor.stands() & held
    }

    /// The rotor, to be moved by itself for some periods.
    #[inline(always)]
    pub(crate) fn rotor(&self) -> Body<R> {
        self.rotor
    }

    /// The rotor as it has moved.
    #[inline(always)]
    pub(crate) fn set_rotor(&mut self, rotor: Body<R>) {
        self.rotor = rotor;
    }

    /// [`Mechanics::accelerate`] for a rotor that is alone.
    #[inline(always)]
    pub(crate) fn accelerate_alone(&self, rotor: &mut Body<R>, motor_torque_nm: R) {
        rotor.accelerate(motor_torque_nm, self.load_torque, self.blocked);
    }

    /// Turns shaft and load by one period at their present speeds.
    #[inline(always)]
    pub fn turn(&mut self) {
        self.rotor.turn();
        if let Some(elastic) = &mut self.elastic {
            elastic.load.turn();
        }
    }

    /// Changes the speed by one period of the motor's torque, Nm, against load and friction.
    #[inline(always)]
    pub fn accelerate(&mut self, motor_torque_nm: R) {
        let mut driving = motor_torque_nm;
        if let Some(cogging) = &self.cogging {
            driving -= cogging.opposing(self.rotor.angle());
        }
        let mut opposing = self.load_torque;
        if let Some(pendulum) = &self.pendulum {
            opposing += pendulum.opposing(self.carrier().angle());
        }
        let Some(elastic) = &mut self.elastic else {
            if let Some(stops) = &self.stops {
                driving += stops.torque(&self.rotor);
            }
            self.rotor.accelerate(driving, opposing, self.blocked);
            return;
        };
        let passed = elastic.torque(&self.rotor);
        let mut pushing = passed;
        if let Some(stops) = &self.stops {
            pushing += stops.torque(&elastic.load);
        }
        let free = R::Mask::splat(false);
        elastic.load.accelerate(pushing, opposing, free);
        self.rotor.accelerate(driving, passed, self.blocked);
    }
}
