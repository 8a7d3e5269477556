//! The position and the velocity loop: from following error to current demand.
//!
//! A cascade: position P (and I, where asked for) plus the demand's own velocity makes the velocity
//! demand; velocity PI plus feed-forward makes the current demand. A PD "impedance" law
//! kp·Δx + kd·Δv + feed-forward is this cascade with a velocity Kp of kd, no integrals and a
//! position Kp of kp/kd.
//!
//! Windup: an integrator stands still while its output is cut and it would push further the same
//! way, be it cut by a current limit or because the supply cannot drive the demanded current.

use crate::{Mask as _, Real};

/// Gains of both loops, in counts; integral gains already times the control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionGains<R: Real> {
    /// counts/s per count.
    pub position_kp: R,
    /// counts/s per count and period.
    pub position_ki: R,
    /// counts/s per count/s.
    pub position_kd: R,
    /// Bound of the position integrator, counts/s.
    pub position_integral_limit: R,
    /// A per count/s.
    pub velocity_kp: R,
    /// A per count/s and period.
    pub velocity_ki: R,
    /// A per count/s of what the velocity error's filter leaves.
    pub velocity_kd: R,
    /// Part of the velocity error that its filter takes each period, at most 1.
    pub derivative_part: R,
    /// Bound of the velocity integrator, A.
    pub velocity_integral_limit_a: R,
    /// How steeply torque goes to zero before the velocity limit in torque mode, A per count/s.
    pub speed_limit_gain: R,
}

/// What the loops act on in one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionInput<R: Real> {
    /// The position loop is closed.
    pub position_loop: R::Mask,
    /// The velocity loop is closed, by itself or under the position loop.
    pub velocity_loop: R::Mask,
    /// Position demand − position, counts.
    pub following_error: R,
    /// Its rate, counts/s.
    pub following_rate: R,
    /// Velocity demand, offset included, counts/s.
    pub velocity_demand: R,
    /// Actual velocity, counts/s.
    pub velocity: R,
    /// Current demand or feed-forward, A.
    pub current_demand: R,
    /// Bound of the velocity, counts/s.
    pub velocity_limit: R,
    /// Bound of the current demand, A.
    pub current_limit: R,
    /// Demanded − measured current while the supply limits the voltage, else 0, A.
    pub unrealised: R,
}

/// State of both loops and what they last gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLoops<R: Real> {
    position_integral: R,
    velocity_integral: R,
    /// Velocity error behind the filter of its derivative.
    slow_speed_error: R,
    position_closed: R::Mask,
    velocity_closed: R::Mask,
    /// The bridge was driven in the last period.
    driven: R::Mask,
    /// By how much the current demand was last cut, or could not be driven, A.
    excess: R,
    /// Velocity demand after its limit, counts/s; the velocity while no loop is closed.
    pub demand_velocity: R,
    /// Current demand after its limits, A.
    pub demand_current: R,
    /// The velocity limit cut the demand, or in torque mode the torque.
    pub velocity_limited: R::Mask,
    /// The current limit cut the demand.
    pub current_limited: R::Mask,
}

/// Whether a cut of `excess` (wanted − given) and an error of the same sign wind an integrator up.
#[inline(always)]
fn winds_up<R: Real>(excess: R, error: R) -> R::Mask {
    R::splat(0.0).lt(excess * error)
}

impl<R: Real> MotionLoops<R> {
    /// At rest, all loops open.
    pub fn new() -> Self {
        let zero = R::splat(0.0);
        let off = R::Mask::splat(false);
        Self {
            position_integral: zero,
            velocity_integral: zero,
            slow_speed_error: zero,
            position_closed: off,
            velocity_closed: off,
            driven: off,
            excess: zero,
            demand_velocity: zero,
            demand_current: zero,
            velocity_limited: off,
            current_limited: off,
        }
    }

    /// One control period; the current demand is in [`demand_current`](Self::demand_current).
    #[inline(always)]
    pub fn period(&mut self, gains: &MotionGains<R>, input: &MotionInput<R>) {
        let zero = R::splat(0.0);

        // Position.
        let error = input.following_error;
        let held = R::select(
            input.position_loop & self.position_closed,
            self.position_integral,
            zero,
        );
        let correction =
            gains.position_kp * error + held + gains.position_kd * input.following_rate;
        let wanted = input.velocity_demand + R::select(input.position_loop, correction, zero);
        let wanted = wanted.sane();
        let demand = wanted.within(input.velocity_limit);
        let cut = input.velocity_limit.lt(wanted.abs());
        let grown = held + gains.position_ki * error;
        let windup = winds_up(wanted - demand, error) | winds_up(self.excess, error);
        self.position_integral = R::select(windup, held, grown)
            .within(gains.position_integral_limit)
            .sane();

        // Velocity. Closing the loop takes over the current that is driven: no bump. If none is,
        // because the bridge was off, the feed-forward acts at once: it may be holding a load.
        let speed_error = demand - input.velocity;
        let taken_over = self.demand_current - input.current_demand;
        let taken_over = R::select(self.driven, taken_over, zero);
        let held = R::select(self.velocity_closed, self.velocity_integral, taken_over);
        let slow = R::select(self.velocity_closed, self.slow_speed_error, speed_error);
        let fast = speed_error - slow;
        self.slow_speed_error = (slow + gains.derivative_part * fast).sane();
        let by_velocity = gains.velocity_kp * speed_error
            + held
            + gains.velocity_kd * fast
            + input.current_demand;

        // Torque mode: the torque that would speed up further fades out before the limit.
        let up = (gains.speed_limit_gain * (input.velocity_limit - input.velocity)).greatest(zero);
        let down = (gains.speed_limit_gain * (-input.velocity_limit - input.velocity)).least(zero);
        let by_torque = input.current_demand.least(up).greatest(down);
        let faded = up.lt(input.current_demand) | input.current_demand.lt(down);

        let wanted = R::select(input.velocity_loop, by_velocity, by_torque).sane();
        let given = wanted.within(input.current_limit);
        let grown = held + gains.velocity_ki * speed_error;
        self.excess = wanted - given + input.unrealised;
        let windup = winds_up(self.excess, speed_error);
        self.velocity_integral = R::select(windup, held, grown)
            .within(gains.velocity_integral_limit_a.least(input.current_limit))
            .sane();

        self.position_closed = input.position_loop;
        self.velocity_closed = input.velocity_loop;
        self.driven = R::Mask::splat(true);
        self.current_limited = input.current_limit.lt(wanted.abs());
        self.velocity_limited = (input.velocity_loop & cut) | (!input.velocity_loop & faded);
        self.demand_velocity = R::select(input.velocity_loop, demand, input.velocity);
        self.demand_current = given.sane();
    }

    /// Bridge off: nothing is demanded and all loops are open where `mask` is true.
    #[inline(always)]
    pub fn release(&mut self, mask: R::Mask) {
        let zero = R::splat(0.0);
        self.demand_current = R::select(mask, zero, self.demand_current);
        self.driven = self.driven & !mask;
        self.velocity_closed = self.velocity_closed & !mask;
        self.position_closed = self.position_closed & !mask;
        self.current_limited = self.current_limited & !mask;
        self.velocity_limited = self.velocity_limited & !mask;
    }

    /// Turns the user's direction round where `mask` is true.
    pub(crate) fn reverse(&mut self, mask: R::Mask) {
        for state in [
            &mut self.position_integral,
            &mut self.velocity_integral,
            &mut self.slow_speed_error,
            &mut self.demand_velocity,
            &mut self.demand_current,
            &mut self.excess,
        ] {
            *state = R::select(mask, -*state, *state);
        }
    }
}

impl<R: Real> Default for MotionLoops<R> {
    fn default() -> Self {
        Self::new()
    }
}
