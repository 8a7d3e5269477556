//! The three wires between bridge and motor, and what can be wrong with them.
//!
//! * An **open** wire carries no current: the current stands still along that phase's axis, and the
//!   component across it goes on as before. The motor without saliency is the same in all
//!   directions, so this is exact. What the phase carried when it opened is lost in the arc.
//! * A **short** between two wires, or from a wire to a rail, is a loop of its resistance and
//!   [`STRAY_H`] across the bus while the switches are set so. Its current V t/(L + R t) trips the
//!   gate drivers ([`Wiring::trips`]) if it is above their threshold when their comparators see
//!   again; a pulse too short for that does not. From then on only diodes conduct, and the motor
//!   turns against its short-circuited winding.

use control::{Mask, Real};

use crate::diodes::{Pull, Pulled, pulled_unequally};
use crate::{Bridge, Vector};

/// A phase of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Phase A.
    A,
    /// Phase B.
    B,
    /// Phase C.
    C,
}

/// A short circuit at the motor's wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Short {
    /// Between the two phases other than this one.
    BesidePhase(Phase),
    /// From a phase to the negative rail (a grounded supply's housing).
    ToNegative(Phase),
    /// From a phase to the positive rail.
    ToPositive(Phase),
}

/// Inductance of a short circuit's loop: bridge, a metre of cable, capacitor, H.
pub const STRAY_H: f32 = 1e-6;

/// Resistance of a short circuit's loop beside its switches, Ω.
pub const SHORT_OHM: f32 = 0.05;

/// The wires. A batch shares their faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wiring {
    open: [bool; 3],
    short: Option<Short>,
}

/// Where phases B and C stand, a third of a turn from A.
const HALF_SQRT_3: f32 = 0.866_025_4;

impl Phase {
    fn index(self) -> usize {
        match self {
            Phase::A => 0,
            Phase::B => 1,
            Phase::C => 2,
        }
    }

    /// Unit vector a quarter turn ahead of the phase's axis.
    fn across(self) -> (f32, f32) {
        match self {
            Phase::A => (0.0, 1.0),
            Phase::B => (-HALF_SQRT_3, -0.5),
            Phase::C => (HALF_SQRT_3, -0.5),
        }
    }

    /// The values as seen from this phase: its own, the next, the one after.
    fn first<T>(self, [a, b, c]: [T; 3]) -> [T; 3] {
        match self {
            Phase::A => [a, b, c],
            Phase::B => [b, c, a],
            Phase::C => [c, a, b],
        }
    }

    /// The inverse of [`Phase::first`].
    fn back<T>(self, [own, next, last]: [T; 3]) -> [T; 3] {
        match self {
            Phase::A => [own, next, last],
            Phase::B => [last, own, next],
            Phase::C => [next, last, own],
        }
    }
}

impl Wiring {
    pub(crate) fn set_open(&mut self, phase: Phase, open: bool) {
        if let Some(entry) = self.open.get_mut(phase.index()) {
            *entry = open;
        }
    }

    pub(crate) fn set_short(&mut self, short: Option<Short>) {
        self.short = short;
    }

    /// Whether all is as it should be.
    pub(crate) fn is_sound(&self) -> bool {
        *self == Self::default()
    }

    /// What of a current can flow through wires of which some are open.
    #[inline]
    pub(crate) fn passes<R: Real>(&self, current: Vector<R>) -> Vector<R> {
        let only = |phase: Phase| {
            let (alpha, beta) = phase.across();
            let across = Vector {
                alpha: R::splat(alpha),
                beta: R::splat(beta),
            };
            across * (across.alpha * current.alpha + across.beta * current.beta)
        };
        match self.open {
            [false, false, false] => current,
            [true, false, false] => only(Phase::A),
            [false, true, false] => only(Phase::B),
            [false, false, true] => only(Phase::C),
            _ => Vector::zero(),
        }
    }

    /// Whether the short circuit trips the gate drivers within a PWM period of these fractions, and
    /// its mean current through the bus over that period, A.
    pub(crate) fn trips<R: Real>(
        &self,
        bridge: &Bridge,
        fractions: [R; 3],
        bus_v: R,
        period_s: f32,
    ) -> (R::Mask, R) {
        let zero = R::splat(0.0);
        let one = R::splat(1.0);
        let half = R::splat(0.5);
        let Some(short) = self.short else {
            return (R::Mask::splat(false), zero);
        };
        // Part of the period in which the loop lies across the bus, and in how many pulses.
        let (part, pulses) = match short {
            // Centre-aligned: the wider pulse stands out on both sides of the narrower.
            Short::BesidePhase(phase) => {
                let [_, next, last] = phase.first(fractions);
                ((next - last).abs() * half, 2.0)
            }
            Short::ToNegative(phase) => {
                let [own, _, _] = phase.first(fractions);
                (own, 1.0)
            }
            Short::ToPositive(phase) => {
                let [own, _, _] = phase.first(fractions);
                (one - own, 1.0)
            }
        };
        let time = part * R::splat(period_s);
        let resistance = R::splat(SHORT_OHM) + R::splat(bridge.switch_ohm as f32) * R::splat(2.0);
        let inductance = R::splat(STRAY_H);
        let current = |time: R| bus_v * time / (inductance + resistance * time);
        let blanking = R::splat(bridge.blanking_s as f32);
        let trips = blanking.lt(time) & R::splat(bridge.overcurrent_a).lt(current(time));
        // Up to the trip, in one pulse; or for all pulses, each a triangle.
        let on = R::select(trips, blanking, time);
        let count = R::select(trips, one, R::splat(pulses));
        let mean = current(on) * on * half * count * R::splat(1.0 / period_s);
        (trips, mean)
    }

    /// The fractions as a winding sees them whose wires are shorted: both ends of a loop in equal
    /// parts.
    #[inline]
    pub(crate) fn seen<R: Real>(&self, fractions: [R; 3]) -> [R; 3] {
        let half = R::splat(0.5);
        match self.short {
            None => fractions,
            Some(Short::BesidePhase(phase)) => {
                let [own, next, last] = phase.first(fractions);
                let mean = (next + last) * half;
                phase.back([own, mean, mean])
            }
            Some(Short::ToNegative(phase)) => {
                let [own, next, last] = phase.first(fractions);
                phase.back([own * half, next, last])
            }
            Some(Short::ToPositive(phase)) => {
                let [own, next, last] = phase.first(fractions);
                phase.back([own * half + half, next, last])
            }
        }
    }

    /// As [`crate::diodes::conduct`], with the short circuit; `drop_current` is what one diode drop of
    /// `bus_current` makes, A.
    #[inline]
    pub(crate) fn conduct<R: Real>(
        &self,
        shorted: Vector<R>,
        bus_current: R,
        drop_current: R,
    ) -> Pulled<R> {
        let zero = R::splat(0.0);
        let tied = Pull {
            down: zero,
            up: zero,
        };
        // Against the rail that a phase is tied to, a diode there puts its drop against a current,
        // and one to the other rail the whole bus. What flows in the tied phase is counted as the
        // diodes of that rail would be: `taken` is then a measure of the bus current.
        match self.short {
            None => crate::diodes::pulled(shorted, bus_current * R::splat(0.5)),
            // The two tied phases are one leg of half the impedance; what goes round between them
            // sees no bus.
            Some(Short::BesidePhase(phase)) => {
                let [own, _, _] = phase.first(shorted.phases());
                let greatest = bus_current * R::splat(2.0 / 3.0);
                let taken = own.within(greatest) * R::splat(0.75);
                let taken = phase.back([taken, -taken, -taken]);
                Pulled {
                    current: shorted - Vector::of_phases(taken),
                    taken,
                }
            }
            Some(Short::ToNegative(phase)) => {
                let free = Pull {
                    down: drop_current,
                    up: bus_current - drop_current,
                };
                let pulled = pulled_unequally(shorted, phase.back([tied, free, free]));
                let [_, next, last] = phase.first(pulled.taken);
                let taken = phase.back([drop_current, next, last]);
                Pulled { taken, ..pulled }
            }
            Some(Short::ToPositive(phase)) => {
                let free = Pull {
                    down: bus_current - drop_current,
                    up: drop_current,
                };
                let pulled = pulled_unequally(shorted, phase.back([tied, free, free]));
                let [_, next, last] = phase.first(pulled.taken);
                let taken = phase.back([-drop_current, next, last]);
                Pulled { taken, ..pulled }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Phase, Short, Wiring};
    use crate::{Bridge, Vector};

    const PHASES: [Phase; 3] = [Phase::A, Phase::B, Phase::C];

    #[test]
    fn an_open_wire_carries_nothing() {
        for phase in PHASES {
            let mut wiring = Wiring::default();
            wiring.set_open(phase, true);
            let before = Vector::of_phases([1.0_f32, 0.3, -1.3]);
            let after = wiring.passes(before).phases();
            let [own, next, last] = phase.first(after);
            assert!(own.abs() < 1e-6 && (next + last).abs() < 1e-6);
            let [_, next_before, last_before] = phase.first(before.phases());
            // The difference of the other two stays.
            assert!((next - last - (next_before - last_before)).abs() < 1e-6);
            wiring.set_open(PHASES[(phase.index() + 1) % 3], true);
            assert_eq!(wiring.passes(before), Vector::zero());
        }
    }

    #[test]
    fn a_short_trips_when_a_pulse_outlasts_the_blanking() {
        let bridge = Bridge::IDEAL;
        let trips = |short, fractions: [f32; 3], volts: f32| {
            let mut wiring = Wiring::default();
            wiring.set_short(Some(short));
            wiring.trips(&bridge, fractions, volts, 10e-6).0
        };
        for phase in PHASES {
            let beside = Short::BesidePhase(phase);
            // 10 µs: a difference of 0.2 makes two pulses of 1 µs.
            assert!(!trips(beside, phase.back([0.9, 0.5, 0.5]), 48.0));
            assert!(!trips(beside, phase.back([0.5, 0.59, 0.4]), 48.0));
            assert!(trips(beside, phase.back([0.5, 0.4, 0.61]), 48.0));
            // 12 V for 1.05 µs at 1 µH: 12 A are not enough.
            assert!(!trips(beside, phase.back([0.5, 0.4, 0.61]), 12.0));
            assert!(trips(
                Short::ToNegative(phase),
                phase.back([0.11, 0.0, 0.0]),
                48.0
            ));
            assert!(!trips(
                Short::ToNegative(phase),
                phase.back([0.09, 1.0, 1.0]),
                48.0
            ));
            assert!(trips(
                Short::ToPositive(phase),
                phase.back([0.89, 1.0, 1.0]),
                48.0
            ));
            assert!(!trips(
                Short::ToPositive(phase),
                phase.back([0.91, 0.0, 0.0]),
                48.0
            ));
            assert!(!trips(beside, [0.1, 0.5, 0.9], 0.0));
        }
        let whole = Wiring::default();
        assert!(!whole.trips(&bridge, [0.0_f32, 1.0, 0.5], 48.0, 10e-6).0);
    }

    #[test]
    fn shorted_phases_feel_the_bus_together_and_each_other_not() {
        for phase in PHASES {
            let mut wiring = Wiring::default();
            wiring.set_short(Some(Short::BesidePhase(phase)));
            let before = Vector::of_phases(phase.back([2.0_f32, -0.5, -1.5]));
            let got = wiring.conduct(before, 0.6, 0.0);
            let [own, next, last] = phase.first(got.current.phases());
            // Two thirds of the bus against the single phase, one against the two.
            assert!((own - 1.6).abs() < 1e-6);
            assert!((next + 0.3).abs() < 1e-6 && (last + 1.3).abs() < 1e-6);
            // What circulates between the two goes on when the rest has ended.
            let before = Vector::of_phases(phase.back([0.1_f32, 0.7, -0.8]));
            let [own, next, last] = phase.first(wiring.conduct(before, 0.6, 0.0).current.phases());
            assert!(own.abs() < 1e-6 && (next - 0.75).abs() < 1e-6 && (last + 0.75).abs() < 1e-6);
        }
    }

    #[test]
    fn a_phase_on_a_rail_conducts_one_way_for_nothing_and_the_other_against_the_bus() {
        for phase in PHASES {
            let mut wiring = Wiring::default();
            // Out of the tied phase to the negative rail, and back through the lower diodes.
            wiring.set_short(Some(Short::ToNegative(phase)));
            let out = Vector::of_phases(phase.back([-1.0_f32, 0.6, 0.4]));
            let after = wiring.conduct(out, 0.5, 0.0).current;
            assert!((after.alpha - out.alpha).abs() < 1e-6 && (after.beta - out.beta).abs() < 1e-6);
            // Into it: the others give to the positive rail, against two thirds of the bus.
            let into = Vector::of_phases(phase.back([1.0_f32, -0.5, -0.5]));
            let [own, _, _] = phase.first(wiring.conduct(into, 0.6, 0.0).current.phases());
            assert!((own - 0.6).abs() < 1e-6, "{own}");
            let [own, next, last] = phase.first(wiring.conduct(into, 1e9, 0.0).current.phases());
            assert!(own.abs() + next.abs() + last.abs() < 1e-5);
            // The positive rail mirrors it.
            wiring.set_short(Some(Short::ToPositive(phase)));
            let after = wiring.conduct(into, 0.5, 0.0).current;
            assert!((after.alpha - into.alpha).abs() < 1e-6);
        }
    }
}
