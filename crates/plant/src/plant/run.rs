//! Many PWM periods in a row, with a shorter way through those in which little happens. Bit for bit what
//! as many [`Plant::step`]s do.

use control::{Mask as _, Real};

use super::{Plant, ROTOR_PERIODS};
use crate::{Vector, diodes};

impl<R: Real> Plant<R> {
    /// Moves the world forward by so many PWM periods: as many [`Plant::step`]s.
    pub fn run(&mut self, periods: u32) {
        if self.rests() {
            self.rest(periods);
            return;
        }
        if !self.mechanics.is_alone() {
            (0..periods).for_each(|_| self.step());
            return;
        }
        let mut left = periods;
        while left > 0 {
            let now = left.min(self.inverter.periods_before_load());
            match (self.is_plain, self.has_dead_time_only) {
                (true, _) => self.move_on::<false>(now),
                (_, true) => self.move_on::<true>(now),
                _ => (0..now).for_each(|_| self.step()),
            }
            left -= now;
        }
    }

    /// [`Plant::run`] for two worlds: their periods alternate, so that a processor has work of the one
    /// while it waits for a result of the other.
    pub fn run_both(&mut self, other: &mut Self, periods: u32) {
        if self.rests() || other.rests() {
            self.run(periods);
            other.run(periods);
            return;
        }
        for _ in 0..periods {
            self.step();
            other.step();
        }
    }

    /// Whether nothing flows and nothing turns, nor will as long as the bridge is not switched on: a
    /// period then changes nothing but temperatures.
    #[inline]
    fn rests(&self) -> bool {
        let zero = R::splat(0.0);
        let Vector { alpha, beta } = self.current;
        let flows = !(alpha.abs().le(zero) & beta.abs().le(zero));
        let works = self.inverter.enabled() | self.inverter.will_work();
        let is_ideal = self.is_plain || self.has_dead_time_only;
        is_ideal && !(flows | works | !self.mechanics.rests()).any()
    }

    /// Periods in which nothing moves.
    fn rest(&mut self, periods: u32) {
        let zero = R::splat(0.0);
        // Not minus zero: the diodes have seen to that.
        self.current = Vector::zero();
        for _ in 0..periods {
            self.inverter.end_period();
            self.rotor_age += 1;
            if self.rotor_age >= ROTOR_PERIODS {
                self.align_rotor();
                if !self.heat.is_off() {
                    self.warm(zero, R::Mask::splat(false), zero);
                }
            }
        }
        self.torque = self.winding.torque_nm(self.current, self.rotor);
        self.periods = self.periods.wrapping_add(periods);
    }

    /// So many periods with one duty and an ideal supply, the rotor alone. What changes from one period
    /// to the next is kept at hand: it is one long chain.
    #[inline(always)]
    fn move_on<const DEAD_TIME: bool>(&mut self, periods: u32) {
        let gain = self.winding.gain_a_per_v();
        let bus = self.supply.voltage_v();
        let mut driving = self.inverter.voltage_v(bus) * gain;
        let (mut pull, mut open) = self.bounds();
        let (mut current, mut rotor) = (self.current, self.rotor);
        let mut shaft = self.mechanics.rotor();
        let mut age = self.rotor_age;
        let mut enabled = self.inverter.enabled() & !self.tripped;
        for _ in 0..periods {
            let speed = shaft.period_speed();
            let turning = self.winding.turning(speed);
            let shorted = self.winding.shorted(current, rotor, speed, turning);
            shaft.turn();
            rotor = rotor + rotor.times(turning);
            let driven = shorted + driving;
            let before = core::mem::replace(&mut current, driven);
            if DEAD_TIME {
                current = self.inverter.dead_time(before, driven, pull).current;
            }
            if (!enabled).any() {
                let open = diodes::conduct(shorted, open);
                current = Vector::select(enabled, current, open);
            }
            let square = current.alpha * current.alpha + current.beta * current.beta;
            let trips = enabled & self.overcurrent_square.lt(square);
            age += 1;
            if age >= ROTOR_PERIODS {
                age = 0;
                rotor = self.aligned(shaft.angle());
                if !self.heat.is_off() {
                    self.current = current;
                    self.warm(square, enabled, speed);
                    let gain = self.winding.gain_a_per_v();
                    driving = self.inverter.voltage_v(bus) * gain;
                    (pull, open) = self.bounds();
                }
            }
            if trips.any() {
                self.tripped = self.tripped | trips;
                enabled = enabled & !trips;
            }
            let torque = self.winding.torque_nm(current, rotor);
            self.mechanics.accelerate_alone(&mut shaft, torque);
        }
        self.inverter.end_periods(periods);
        self.rotor_age = age;
        self.periods = self.periods.wrapping_add(periods);
        (self.current, self.rotor) = (current, rotor);
        self.torque = self.winding.torque_nm(current, rotor);
        self.mechanics.set_rotor(shaft);
    }

    /// What the dead time takes off the current of a phase, and what the diodes of the open bridge keep
    /// from flowing, A.
    #[inline(always)]
    fn bounds(&self) -> (R, R) {
        let gain = self.winding.gain_a_per_v();
        let full = self.supply.voltage_v() + self.supply.diode_drops_v();
        let pull = gain * full * self.inverter.dead_part();
        (pull, self.supply.diode_threshold_v() * gain)
    }
}
