//! The shaft: inertia, friction, load, position.

use control::{Mask, Real};

use crate::Motor;
use crate::exponential::decayed_fraction;

/// What is coupled rigidly to the rotor; all figures at the motor shaft, and added to the motor's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Inertia, kg m².
    pub inertia_kgm2: f64,
    /// Friction torque that does not depend on speed, Nm.
    pub coulomb_friction_nm: f64,
    /// Friction torque per speed, Nm s/rad.
    pub viscous_friction_nms: f64,
}

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
    coefficients: Coefficients<R>,
    speed: R,
    speed_rest: R,
    speed_before: R,
    angle: R::Count,
    angle_rest: R,
    turns: R::Count,
    load_torque: R,
    blocked: R::Mask,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Coefficients<R: Real> {
    /// (1 - e^(-B h/J))/B, or h/J without viscous friction: speed per torque, rad/s per Nm.
    speed_per_torque: R,
    /// B, Nm s/rad.
    viscous: R,
    /// Speed that friction takes off in a period, moving and at rest, rad/s.
    coulomb_speed: R,
    static_speed: R,
    speed_limit: R,
    /// Angle counts of one period per rad/s.
    counts_per_speed: R,
}

impl<R: Real> Coefficients<R> {
    fn new(motor: &Motor, load: &Load, period_s: f64) -> Self {
        let inertia = motor.rotor_inertia_kgm2 + load.inertia_kgm2;
        let viscous = motor.viscous_friction_nms + load.viscous_friction_nms;
        let speed_per_torque = if viscous > 0.0 {
            decayed_fraction(viscous * period_s / inertia) / viscous
        } else {
            period_s / inertia
        };
        let coulomb = motor.coulomb_friction_nm + load.coulomb_friction_nm;
        let breakaway = motor.static_friction_nm + load.coulomb_friction_nm;
        let breakaway = if breakaway > coulomb {
            breakaway
        } else {
            coulomb
        };
        let real = |value: f64| R::splat(value as f32);
        Self {
            speed_per_torque: real(speed_per_torque),
            viscous: real(viscous),
            coulomb_speed: real(coulomb * speed_per_torque),
            static_speed: real(breakaway * speed_per_torque),
            speed_limit: real(0.5 / (period_s * f64::from(motor.pole_pairs))),
            counts_per_speed: real(period_s * 4_294_967_296.0 / core::f64::consts::TAU),
        }
    }
}

impl<R: Real> Mechanics<R> {
    /// A shaft at rest at angle zero, free and without load torque.
    pub fn new(motor: &Motor, load: &Load, period_s: f64) -> Self {
        let zero = R::splat(0.0);
        Self {
            coefficients: Coefficients::new(motor, load, period_s),
            speed: zero,
            speed_rest: zero,
            speed_before: zero,
            angle: R::count(0),
            angle_rest: zero,
            turns: R::count(0),
            load_torque: zero,
            blocked: R::Mask::splat(false),
        }
    }

    /// Changes the PWM period, keeping the motion.
    pub fn set_period_s(&mut self, motor: &Motor, load: &Load, period_s: f64) {
        self.coefficients = Coefficients::new(motor, load, period_s);
        self.speed = self.speed.within(self.coefficients.speed_limit);
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
        self.speed = R::select(blocked, R::splat(0.0), self.speed);
        self.speed_rest = R::select(blocked, R::splat(0.0), self.speed_rest);
        self.speed_before = R::select(blocked, R::splat(0.0), self.speed_before);
    }

    /// Puts the shaft at an angle (2³² per turn, turn zero) with a speed in rad/s. A blocked shaft
    /// takes the angle alone; an undefined speed counts as none.
    pub fn set_motion(&mut self, angle: R::Count, speed_rad_s: R) {
        let zero = R::splat(0.0);
        let defined = R::select(speed_rad_s.le(speed_rad_s), speed_rad_s, zero);
        self.speed = R::select(
            self.blocked,
            zero,
            defined.within(self.coefficients.speed_limit),
        );
        self.speed_before = self.speed;
        self.speed_rest = zero;
        self.angle = angle;
        self.angle_rest = zero;
        self.turns = R::count(0);
    }

    /// Puts the shaft, with the speed that it has, at a position: angle (2³² per turn) and whole
    /// turns as [`Mechanics::turns`] counts them.
    pub fn set_position(&mut self, angle: R::Count, turns: R::Count) {
        self.angle = angle;
        self.angle_rest = R::splat(0.0);
        self.turns = turns;
    }

    /// Speed during the coming period, rad/s.
    #[inline(always)]
    pub fn period_speed_rad_s(&self) -> R {
        self.speed
    }

    /// Speed now, between two periods, rad/s.
    #[inline(always)]
    pub fn speed_rad_s(&self) -> R {
        (self.speed_before + self.speed) * R::splat(0.5)
    }

    /// Angle within the turn, 2³² per turn, wrapping at half a turn either side of zero.
    #[inline(always)]
    pub fn angle(&self) -> R::Count {
        self.angle
    }

    /// Whole turns: position in turns = `turns` + `angle` / 2³², wrapping after 2³¹ turns.
    #[inline(always)]
    pub fn turns(&self) -> R::Count {
        self.turns
    }

    /// Turns the shaft by one period at its present speed.
    #[inline(always)]
    pub fn turn(&mut self) {
        let owed = self.speed * self.coefficients.counts_per_speed + self.angle_rest;
        let whole = owed.to_count();
        self.angle_rest = owed - R::of_count(whole);
        let angle = R::count_add(self.angle, whole);
        // The angle wrapped if it went against the motion. Rounding to R keeps the order, and a
        // period is far less than a turn.
        let (zero, before, after) = (R::splat(0.0), R::of_count(self.angle), R::of_count(angle));
        let forward = zero.lt(owed) & after.lt(before);
        let backward = owed.lt(zero) & before.lt(after);
        let passed = R::count_select(
            forward,
            R::count(1),
            R::count_select(backward, R::count(-1), R::count(0)),
        );
        self.turns = R::count_add(self.turns, passed);
        self.angle = angle;
    }

    /// Changes the speed by one period of the motor's torque, Nm, against load and friction.
    #[inline(always)]
    pub fn accelerate(&mut self, motor_torque_nm: R) {
        let c = &self.coefficients;
        let zero = R::splat(0.0);
        let speed = self.speed;
        let resting = speed.abs().le(zero);
        // What the motor does not change comes first: the rest of the chain is the slow one.
        let drag = (self.load_torque + c.viscous * speed) * c.speed_per_torque;
        let gained = motor_torque_nm * c.speed_per_torque + (self.speed_rest - drag);
        let frictionless = speed + gained;
        let friction = frictionless.within(c.coulomb_speed);
        let next = (frictionless - friction).within(c.speed_limit);
        let holding = R::select(resting, c.static_speed, c.coulomb_speed);
        let held = frictionless.abs().le(holding) | self.blocked;
        self.speed_before = speed;
        self.speed = R::select(held, zero, next);
        // What rounding left out of the new speed (Kahan); none at the limit, where it would pile
        // up.
        let rest = (gained - friction) - (next - speed);
        self.speed_rest = R::select(held | c.speed_limit.le(next.abs()), zero, rest);
    }
}
