//! One turning mass: inertia, friction, position.

use control::{Mask as _, Real};

use crate::exponential::decayed_fraction;

/// What turns as one piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Figures {
    /// kg m².
    pub(crate) inertia: f64,
    /// Friction torque per speed, Nm s/rad.
    pub(crate) viscous: f64,
    /// Friction torque of a moving mass, Nm.
    pub(crate) coulomb: f64,
    /// Friction torque of a resting mass, Nm; at least the Coulomb friction.
    pub(crate) breakaway: f64,
}

/// A [`Figures`] for one PWM period.
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
    fn new(figures: &Figures, speed_limit: f64, period_s: f64) -> Self {
        let Figures {
            inertia,
            viscous,
            coulomb,
            breakaway,
        } = *figures;
        let speed_per_torque = if viscous > 0.0 {
            decayed_fraction(viscous * period_s / inertia) / viscous
        } else {
            period_s / inertia
        };
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
            speed_limit: real(speed_limit),
            counts_per_speed: real(period_s * 4_294_967_296.0 / core::f64::consts::TAU),
        }
    }
}

/// Speed and position of one turning mass; see [`crate::Mechanics`] for how they are integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Body<R: Real> {
    coefficients: Coefficients<R>,
    speed: R,
    speed_rest: R,
    speed_before: R,
    angle: R::Count,
    angle_rest: R,
    turns: R::Count,
}

impl<R: Real> Body<R> {
    /// At rest at angle zero; the speed is held below `speed_limit`, rad/s.
    pub(crate) fn new(figures: &Figures, speed_limit: f64, period_s: f64) -> Self {
        let zero = R::splat(0.0);
        Self {
            coefficients: Coefficients::new(figures, speed_limit, period_s),
            speed: zero,
            speed_rest: zero,
            speed_before: zero,
            angle: R::count(0),
            angle_rest: zero,
            turns: R::count(0),
        }
    }

    /// Changes figures and PWM period, keeping the motion.
    pub(crate) fn set_figures(&mut self, figures: &Figures, speed_limit: f64, period_s: f64) {
        self.coefficients = Coefficients::new(figures, speed_limit, period_s);
        self.speed = self.speed.within(self.coefficients.speed_limit);
    }

    /// Stops at once where `stopped`.
    pub(crate) fn stop(&mut self, stopped: R::Mask) {
        let zero = R::splat(0.0);
        self.speed = R::select(stopped, zero, self.speed);
        self.speed_rest = R::select(stopped, zero, self.speed_rest);
        self.speed_before = R::select(stopped, zero, self.speed_before);
    }

    /// Gives it a speed, rad/s; an undefined one counts as none.
    pub(crate) fn set_speed(&mut self, speed: R) {
        let zero = R::splat(0.0);
        let defined = R::select(speed.le(speed), speed, zero);
        self.speed = defined.within(self.coefficients.speed_limit);
        self.speed_before = self.speed;
        self.speed_rest = zero;
    }

    /// Puts it, with the speed that it has, at a position.
    pub(crate) fn set_position(&mut self, angle: R::Count, turns: R::Count) {
        self.angle = angle;
        self.angle_rest = R::splat(0.0);
        self.turns = turns;
    }

    /// Mean speed of the coming period, rad/s.
    #[inline(always)]
    pub(crate) fn period_speed(&self) -> R {
        self.speed
    }

    /// Speed now, between two periods, rad/s.
    #[inline(always)]
    pub(crate) fn speed(&self) -> R {
        (self.speed_before + self.speed) * R::splat(0.5)
    }

    /// Within the turn, 2³² per turn, wrapping at half a turn.
    #[inline(always)]
    pub(crate) fn angle(&self) -> R::Count {
        self.angle
    }

    /// Whole turns.
    #[inline(always)]
    pub(crate) fn turns(&self) -> R::Count {
        self.turns
    }

    /// Way from another position to this one, rad: exact to the count near it, and never wrapping.
    #[inline(always)]
    pub(crate) fn beyond(&self, angle: R::Count, turns: R::Count) -> R {
        let radians = R::splat(core::f32::consts::TAU / 4_294_967_296.0);
        let within = R::of_count(R::count_sub(self.angle, angle));
        // If the angles are more than half a turn apart, their difference has wrapped and a whole
        // turn is missing: 2³², told from none by its half, so rounding does not matter.
        let missing = (R::of_count(self.angle) - R::of_count(angle)) - within;
        let half = R::splat(2_147_483_648.0);
        let carry = R::count_select(half.lt(missing), R::count(1), R::count(0));
        let carry = R::count_select(missing.lt(-half), R::count(-1), carry);
        let whole = R::count_add(R::count_sub(self.turns, turns), carry);
        within * radians + R::of_count(whole) * R::splat(core::f32::consts::TAU)
    }

    /// Whether it stands, and no rounding owes it a speed.
    #[inline(always)]
    pub(crate) fn stands(&self) -> R::Mask {
        let none = |speed: R| speed.abs().le(R::splat(0.0));
        none(self.speed) & none(self.speed_before) & none(self.speed_rest)
    }

    /// Whether friction holds it, standing, against an opposing torque, Nm.
    #[inline(always)]
    pub(crate) fn is_held_against(&self, opposing: R) -> R::Mask {
        let pushed = opposing * self.coefficients.speed_per_torque;
        pushed.abs().le(self.coefficients.static_speed)
    }

    /// Turns by one period at the present speed.
    #[inline(always)]
    pub(crate) fn turn(&mut self) {
        let owed = self.speed * self.coefficients.counts_per_speed + self.angle_rest;
        let whole = owed.to_count();
        self.angle_rest = owed - R::of_count(whole);
        let angle = R::count_add(self.angle, whole);
        // Far from half a turn it cannot wrap: a period is far less than half a turn.
        let before = R::of_count(self.angle);
        if R::splat(1_073_741_824.0).lt(before.abs()).any() {
            // It wrapped if it went against the motion. Rounding to R keeps the order.
            let (zero, after) = (R::splat(0.0), R::of_count(angle));
            let forward = zero.lt(owed) & after.lt(before);
            let backward = owed.lt(zero) & before.lt(after);
            let passed = R::count_select(
                forward,
                R::count(1),
                R::count_select(backward, R::count(-1), R::count(0)),
            );
            self.turns = R::count_add(self.turns, passed);
        }
        self.angle = angle;
    }

    /// Changes the speed by one period of a driving and an opposing torque, Nm, and of friction; the
    /// speed is none afterwards where `blocked`.
    #[inline(always)]
    pub(crate) fn accelerate(&mut self, driving: R, opposing: R, blocked: R::Mask) {
        let c = &self.coefficients;
        let zero = R::splat(0.0);
        let speed = self.speed;
        let resting = speed.abs().le(zero);
        // What the motor does not change comes first: the rest of the chain is the slow one.
        let drag = (opposing + c.viscous * speed) * c.speed_per_torque;
        let gained = driving * c.speed_per_torque + (self.speed_rest - drag);
        let frictionless = speed + gained;
        let friction = frictionless.within(c.coulomb_speed);
        let next = (frictionless - friction).within(c.speed_limit);
        let holding = R::select(resting, c.static_speed, c.coulomb_speed);
        let held = frictionless.abs().le(holding) | blocked;
        self.speed_before = speed;
        self.speed = R::select(held, zero, next);
        // What rounding left out of the new speed (Kahan); none at the limit, where it would pile
        // up.
        let rest = (gained - friction) - (next - speed);
        self.speed_rest = R::select(held | c.speed_limit.le(next.abs()), zero, rest);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Body, Figures};

    #[test]
    fn the_way_between_two_positions_never_loses_a_turn() {
        let figures = Figures {
            inertia: 1.0,
            viscous: 0.0,
            coulomb: 0.0,
            breakaway: 0.0,
        };
        let mut body = Body::<f32>::new(&figures, 1.0, 1e-5);
        let angles = [
            0,
            1,
            -1,
            50,
            -50,
            127,
            1 << 30,
            -(1 << 30),
            i32::MAX,
            i32::MIN,
            i32::MAX - 40,
            i32::MIN + 40,
            0x3FFF_FFFF,
            -0x3FFF_FFFF,
        ];
        for a in angles {
            for b in angles {
                for (m, n) in [(0, 0), (1, 0), (-1, 0), (5, 7), (100, -100)] {
                    body.set_position(a, m);
                    let turns = |angle: i32, turns: i32| {
                        f64::from(turns) + f64::from(angle) / 4_294_967_296.0
                    };
                    let exact = (turns(a, m) - turns(b, n)) * core::f64::consts::TAU;
                    let error = f64::from(body.beyond(b, n)) - exact;
                    let tolerance = 1e-9 + 4e-7 * exact.abs();
                    assert!(error.abs() < tolerance, "{a} {m} {b} {n}: {error}");
                }
            }
        }
    }
}
