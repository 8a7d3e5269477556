//! The bridge: from duties to mean phase voltages.

use control::io::Duty;
use control::{Mask, Real};

use crate::diodes::{Pull, Pulled, pulled, pulled_on, pulled_unequally};
use crate::{Invalid, Vector};

/// The switches of the bridge and their drivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// What drivers and switches by themselves add to the dead time of the PWM timer
    /// ([`crate::Plant::set_timer_dead_time_s`]), because they open later than they close, s; below a
    /// tenth of the PWM period.
    pub dead_time_s: f64,
    /// Resistance of a switch that is closed, and of a diode beyond its forward voltage, Ω.
    pub switch_ohm: f64,
    /// Current of a phase at which the gate drivers open the bridge by themselves, A; infinite:
    /// never.
    pub overcurrent_a: f32,
    /// For how long after a switching the comparators of the gate drivers see nothing, s.
    pub blanking_s: f64,
}

impl Bridge {
    /// Switches without dead time and resistance; 15 A open them, seen after 1 µs.
    pub const IDEAL: Self = Self {
        dead_time_s: 0.0,
        switch_ohm: 0.0,
        overcurrent_a: 15.0,
        blanking_s: 1e-6,
    };

    /// Whether such a bridge can be.
    pub(crate) fn check(&self, pwm_period_s: f64) -> Result<(), Invalid> {
        let dead_time = self.dead_time_s;
        if !(dead_time >= 0.0 && dead_time < 0.1 * pwm_period_s) {
            return Err(Invalid::Bridge(dead_time));
        }
        let overcurrent = f64::from(self.overcurrent_a);
        for (value, most) in [
            (self.switch_ohm, 1e3),
            (overcurrent, f64::INFINITY),
            (self.blanking_s, 1e-3),
        ] {
            if !(value >= 0.0 && value <= most) {
                return Err(Invalid::Bridge(value));
            }
        }
        Ok(())
    }
}

/// The three half bridges and the timer in front of them.
///
/// A new duty takes effect some PWM periods after it was commanded (the timer's shadow registers
/// load at a period boundary, after the control code has run). Opening all switches does not wait:
/// a trip acts on the gate drivers directly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inverter<R: Real> {
    active: Duty<R>,
    waiting: Duty<R>,
    /// Periods until the waiting duty becomes active; 0: none waits.
    wait: u8,
    delay: u8,
    /// The dead time as a part of the PWM period.
    dead_part: R,
    /// The active duty has a pulse shorter than the dead time, or a phase that does not switch.
    narrow: R::Mask,
    /// Vector of the active duty's phases.
    direction: Vector<R>,
    /// Periods for which a phase without current is to be expected.
    near_zero: u8,
}

/// After a phase has ended without current, so many periods are computed in a way that is longer, but
/// the same whether that happens again or not.
const NEAR_ZERO: u8 = 8;

impl<R: Real> Inverter<R> {
    /// A bridge with all switches open, whose duties load `delay_periods` PWM periods after they
    /// are commanded.
    pub fn new(delay_periods: u8) -> Self {
        let open = Duty {
            phase: [R::splat(0.0); 3],
            enabled: R::Mask::splat(false),
        };
        Self {
            active: open,
            waiting: open,
            wait: 0,
            delay: delay_periods,
            dead_part: R::splat(0.0),
            narrow: R::Mask::splat(false),
            direction: Vector::of_phases(open.phase),
            near_zero: 0,
        }
    }

    /// Sets how many PWM periods after their command duties load, from the next command on.
    pub fn set_delay_periods(&mut self, periods: u8) {
        self.delay = periods;
    }

    /// Sets the dead time, as a part of the PWM period, 0 to ¼.
    pub fn set_dead_part(&mut self, dead_part: R) {
        self.dead_part = dead_part;
        self.activate(self.active);
    }

    /// The dead time as a part of the PWM period.
    #[inline(always)]
    pub fn dead_part(&self) -> R {
        self.dead_part
    }

    fn activate(&mut self, duty: Duty<R>) {
        let (dead, rest) = (self.dead_part, R::splat(1.0) - self.dead_part);
        let narrow = |fraction: R| fraction.lt(dead) | rest.lt(fraction);
        let [a, b, c] = duty.phase;
        self.narrow = narrow(a) | narrow(b) | narrow(c);
        self.direction = Vector::of_phases(duty.phase);
        self.active = duty;
    }

    /// Commands a duty at a control boundary.
    ///
    /// Fractions outside 0 to 1 are held at the ends, where a timer's compare value ends too. A
    /// duty with an undefined fraction opens the switches. A duty that still waits becomes active
    /// now, so the delay is at most the time between two commands.
    pub fn load(&mut self, duty: &Duty<R>) {
        if self.wait > 0 {
            self.activate(self.waiting);
        }
        let [a, b, c] = duty.phase;
        // A NaN is not even equal to itself.
        let defined = a.le(a) & b.le(b) & c.le(c);
        let held = |fraction: R| fraction.greatest(R::splat(0.0)).least(R::splat(1.0));
        self.waiting = Duty {
            phase: [held(a), held(b), held(c)],
            enabled: duty.enabled & defined,
        };
        self.active.enabled = self.active.enabled & self.waiting.enabled;
        self.wait = self.delay;
        if self.wait == 0 {
            self.activate(self.waiting);
        }
    }

    /// Opens the switches now, until the next command.
    pub(crate) fn open(&mut self) {
        let never = R::Mask::splat(false);
        self.active.enabled = never;
        self.waiting.enabled = never;
    }

    /// Whether the switches work in this PWM period; when not, only the diodes do.
    #[inline(always)]
    pub fn enabled(&self) -> R::Mask {
        self.active.enabled
    }

    /// The fractions of this PWM period for which phases A, B, C are on the positive rail, without
    /// dead time.
    #[inline(always)]
    pub fn fractions(&self) -> [R; 3] {
        self.active.phase
    }

    /// What the dead time makes of the currents that this PWM period would end with.
    ///
    /// For the dead time after each switching the diodes decide where a phase is: a current into the
    /// motor finds its positive half shortened, one out of the motor its negative half. So every
    /// phase is pulled toward zero with the mean voltage dead time/period · (bus + two diode drops);
    /// `pull_a` is that voltage times the winding's gain. A current that this would turn round ends
    /// at zero instead, as in [`pulled`]; `before` are the currents with which it begins. A phase that does not switch in this period (0 or 1) has no
    /// dead time, and a pulse shorter than it is lost but not more.
    #[inline(always)]
    pub fn dead_time(&mut self, before: Vector<R>, driven: Vector<R>, pull_a: R) -> Pulled<R> {
        let (on, conduct) = pulled_on(before, driven, pull_a);
        if self.near_zero > 0 {
            // The same work for all currents: nobody has to guess.
            let zero = pulled(driven, pull_a);
            let ends = (!conduct).any();
            self.near_zero = if ends { NEAR_ZERO } else { self.near_zero - 1 };
            if !self.narrow.any() {
                return Pulled::select(conduct, on, zero);
            }
        }
        let is_easy = conduct & !self.narrow;
        if (!is_easy).any() {
            self.near_zero = NEAR_ZERO;
            Pulled::select(is_easy, on, self.zero_or_narrow(driven, pull_a))
        } else {
            on
        }
    }

    #[inline(never)]
    fn zero_or_narrow(&self, driven: Vector<R>, pull_a: R) -> Pulled<R> {
        let quick = pulled(driven, pull_a);
        if self.narrow.any() {
            Pulled::select(self.narrow, self.narrow_pulses(driven, pull_a), quick)
        } else {
            quick
        }
    }

    #[inline(never)]
    fn narrow_pulses(&self, driven: Vector<R>, pull_a: R) -> Pulled<R> {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let scale = pull_a / self.dead_part;
        let pulls = self.active.phase.map(|fraction| {
            let switches = zero.lt(fraction) & fraction.lt(one);
            let dead = R::select(switches, self.dead_part, zero);
            Pull {
                down: scale * dead.least(fraction),
                up: scale * dead.least(one - fraction),
            }
        });
        pulled_unequally(driven, pulls)
    }

    /// Mean voltage of the phases against the star point over this PWM period, V.
    #[inline(always)]
    pub fn voltage_v(&self, bus_voltage_v: R) -> Vector<R> {
        self.direction * bus_voltage_v
    }

    /// Ends a PWM period.
    #[inline(always)]
    pub fn end_period(&mut self) {
        if self.wait > 0 {
            self.wait -= 1;
            if self.wait == 0 {
                self.activate(self.waiting);
            }
        }
    }

    /// Whether the switches work when the duty that waits has become active.
    #[inline(always)]
    pub(crate) fn will_work(&self) -> R::Mask {
        self.waiting.enabled & R::Mask::splat(self.wait > 0)
    }

    /// PWM periods of the duty that is active, as far as it is known.
    #[inline(always)]
    pub(crate) fn periods_before_load(&self) -> u32 {
        match self.wait {
            0 => u32::MAX,
            wait => u32::from(wait),
        }
    }

    /// Ends so many PWM periods, at most [`Inverter::periods_before_load`].
    #[inline(always)]
    pub(crate) fn end_periods(&mut self, periods: u32) {
        if self.wait > 0 {
            self.wait -= periods as u8;
            if self.wait == 0 {
                self.activate(self.waiting);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Inverter;
    use control::io::Duty;

    fn duty(a: f32, b: f32, c: f32) -> Duty<f32> {
        Duty {
            phase: [a, b, c],
            enabled: true,
        }
    }

    fn alpha(inverter: &Inverter<f32>) -> f32 {
        inverter.voltage_v(48.0).alpha
    }

    #[test]
    fn a_duty_waits_for_its_period() {
        for delay in 0..4 {
            let mut inverter = Inverter::new(delay);
            inverter.load(&duty(0.75, 0.5, 0.5));
            for _ in 0..delay {
                assert!(!inverter.enabled());
                inverter.end_period();
            }
            assert!(inverter.enabled());
            // 0.25 of 48 V on phase A against the mean of the others: two thirds of 12 V.
            assert!((alpha(&inverter) - 8.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_trip_does_not_wait() {
        let mut inverter = Inverter::new(1);
        inverter.load(&duty(0.75, 0.5, 0.5));
        inverter.end_period();
        assert!(inverter.enabled());
        inverter.load(&Duty {
            enabled: false,
            ..duty(0.75, 0.5, 0.5)
        });
        assert!(!inverter.enabled());
        inverter.end_period();
        assert!(!inverter.enabled());
    }

    #[test]
    fn a_long_delay_ends_with_the_next_command() {
        let mut inverter = Inverter::new(200);
        inverter.load(&duty(0.75, 0.5, 0.5));
        inverter.end_period();
        inverter.load(&duty(0.25, 0.5, 0.5));
        assert!((alpha(&inverter) - 8.0).abs() < 1e-5);
        inverter.load(&duty(0.5, 0.5, 0.5));
        assert!((alpha(&inverter) + 8.0).abs() < 1e-5);
    }

    #[test]
    fn duties_end_at_the_rails_and_undefined_ones_open_the_bridge() {
        let mut inverter = Inverter::new(0);
        inverter.load(&duty(1e30, -1e30, f32::NEG_INFINITY));
        assert!((alpha(&inverter) - 32.0).abs() < 1e-5);
        for phase in 0..3 {
            let mut bad = duty(0.5, 0.5, 0.5);
            bad.phase[phase] = f32::NAN;
            inverter.load(&bad);
            assert!(!inverter.enabled());
            assert!(alpha(&inverter).is_finite());
        }
    }
}
