//! The two supplies: of the motor, with the link to the bridge, and of the logic.

use control::{Mask, Real};

use crate::Invalid;
use crate::exponential::decayed_fraction;

/// What is between the motor supply and the bridge: a resistance, a diode, and a capacitor.
///
/// With the bus voltage u, the supply's open-circuit voltage E, and the current i into the bridge,
///
/// C du/dt = (E - u)/Rs - u/Rbleeder - u/Rbrake - i,
///
/// the first term only while u < E: the supply takes nothing back, so a braking motor raises the
/// bus. The third only while the brake is on. Integrated exactly over a PWM period, in which i, the
/// mean of the period, is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Capacitance at the bridge, F, up to 1 F. 0: an ideal supply, which holds its voltage whatever
    /// flows, in either direction, and none of the other figures count.
    pub capacitance_f: f64,
    /// Internal resistance of the motor supply and its cable, Ω.
    pub source_ohm: f64,
    /// What discharges the capacitor, Ω; infinite: nothing.
    pub bleeder_ohm: f64,
    /// The braking resistor, Ω; infinite: none.
    pub brake_ohm: f64,
    /// Bus voltage at which the brake is switched on, V.
    pub brake_on_v: f32,
    /// Bus voltage at which it is switched off again, V.
    pub brake_off_v: f32,
}

impl Link {
    /// No link: an ideal supply.
    pub const IDEAL: Self = Self {
        capacitance_f: 0.0,
        source_ohm: 0.0,
        bleeder_ohm: f64::INFINITY,
        brake_ohm: f64::INFINITY,
        brake_on_v: 0.0,
        brake_off_v: 0.0,
    };

    /// A small drive's link: 220 µF behind 0.15 Ω, discharged by 10 kΩ, without a brake. Figures of
    /// ours.
    pub const SMALL: Self = Self {
        capacitance_f: 220e-6,
        source_ohm: 0.15,
        bleeder_ohm: 10e3,
        ..Self::IDEAL
    };

    /// Whether such a link can be.
    pub(crate) fn check(&self) -> Result<(), Invalid> {
        if !(self.capacitance_f >= 0.0 && self.capacitance_f <= 1.0) {
            return Err(Invalid::Link(self.capacitance_f));
        }
        if self.capacitance_f == 0.0 {
            return Ok(());
        }
        // Infinite is fine for what may be missing.
        for ohm in [self.source_ohm, self.bleeder_ohm, self.brake_ohm] {
            if ohm.is_nan() || ohm <= 0.0 {
                return Err(Invalid::Link(ohm));
            }
        }
        let ordered = self.brake_off_v >= 0.0 && self.brake_off_v <= self.brake_on_v;
        if !(ordered && self.brake_on_v.is_finite()) {
            return Err(Invalid::Link(self.brake_off_v.into()));
        }
        Ok(())
    }
}

/// A state of the link in which it is linear.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch<R: Real> {
    /// Conductances of the source and of what is across the capacitor, S.
    source: R,
    across: R,
    /// (1 - e^(-g h/C))/g with the sum g of both: volts per ampere in a period.
    volts_per_ampere: R,
}

impl<R: Real> Stretch<R> {
    fn new(link: &Link, period_s: f64, conducting: bool, braking: bool) -> Self {
        let source = if conducting {
            1.0 / link.source_ohm
        } else {
            0.0
        };
        let brake = if braking { 1.0 / link.brake_ohm } else { 0.0 };
        let across = 1.0 / link.bleeder_ohm + brake;
        let sum = source + across;
        let capacitance = link.capacitance_f;
        let volts_per_ampere = if sum > 0.0 {
            decayed_fraction(sum * period_s / capacitance) / sum
        } else {
            period_s / capacitance
        };
        let real = |value: f64| R::splat(value as f32).sane();
        Self {
            source: real(source),
            across: real(across),
            volts_per_ampere: real(volts_per_ampere),
        }
    }
}

/// The motor supply at work.
///
/// Without a capacitor ([`Link::IDEAL`]) it holds its voltage whatever flows, in either direction,
/// or it is off. Off means disconnected and discharged: the bus reads 0 V, a switching bridge has
/// no voltage to give (its switches short the winding), and an open bridge has no path for a
/// current, so currents end with the period.
///
/// With a capacitor, off means that nothing comes from the supply any more; the bus falls as it is
/// discharged, and a turning motor may hold it up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply<R: Real> {
    source: R,
    bus: R,
    diode_drops: R,
    is_ideal: bool,
    has_brake: bool,
    /// Source blocked and conducting, brake off and on.
    blocked: [Stretch<R>; 2],
    conducting: [Stretch<R>; 2],
    braking: R::Mask,
    brake_on: R,
    brake_off: R,
    capacitance_per_period: R,
    supply_current: R,
    brake_current: R,
}

/// Stands for "no path": beyond any voltage that a winding could raise, and safely finite.
const DISCONNECTED_V: f32 = 1e9;

/// More than any bus; a runaway generator's voltage ends here.
const HIGHEST_V: f32 = 10_000.0;

impl<R: Real> Supply<R> {
    /// A supply of `voltage_v`, whose capacitor is charged; `diode_drop_v` is the forward voltage of
    /// one free-wheeling diode.
    pub fn new(link: &Link, period_s: f64, voltage_v: R, diode_drop_v: R) -> Self {
        let zero = R::splat(0.0);
        let nothing = Stretch {
            source: zero,
            across: zero,
            volts_per_ampere: zero,
        };
        let mut supply = Self {
            source: zero,
            bus: zero,
            diode_drops: diode_drop_v + diode_drop_v,
            is_ideal: true,
            has_brake: false,
            blocked: [nothing; 2],
            conducting: [nothing; 2],
            braking: R::Mask::splat(false),
            brake_on: zero,
            brake_off: zero,
            capacitance_per_period: zero,
            supply_current: zero,
            brake_current: zero,
        };
        supply.set_link(link, period_s);
        supply.set_voltage_v(voltage_v);
        supply.bus = supply.source;
        supply
    }

    /// Takes over a link, or another PWM period. The bus keeps its voltage.
    pub(crate) fn set_link(&mut self, link: &Link, period_s: f64) {
        self.is_ideal = link.capacitance_f.is_nan() || link.capacitance_f <= 0.0;
        self.has_brake = link.brake_ohm < f64::INFINITY;
        if !self.is_ideal {
            let stretch = |conducting, braking| Stretch::new(link, period_s, conducting, braking);
            self.blocked = [stretch(false, false), stretch(false, true)];
            self.conducting = [stretch(true, false), stretch(true, true)];
            self.brake_on = R::splat(link.brake_on_v);
            self.brake_off = R::splat(link.brake_off_v);
            self.capacitance_per_period = R::splat((link.capacitance_f / period_s) as f32);
        }
    }

    /// Becomes the same supply as another one, as a bridge with diodes of its own sees it.
    pub(crate) fn follow(&mut self, other: &Self) {
        *self = Self {
            diode_drops: self.diode_drops,
            ..*other
        };
    }

    /// Whether the bus is what it is set to, whatever flows.
    #[inline(always)]
    pub fn is_ideal(&self) -> bool {
        self.is_ideal
    }

    /// Sets the supply's open-circuit voltage, V, up to 10 kV; 0 (or less, or an undefined value)
    /// switches it off.
    pub fn set_voltage_v(&mut self, voltage_v: R) {
        self.source = voltage_v.greatest(R::splat(0.0)).least(R::splat(HIGHEST_V));
        if self.is_ideal {
            self.bus = self.source;
        }
    }

    /// The bus voltage, V.
    #[inline(always)]
    pub fn voltage_v(&self) -> R {
        self.bus
    }

    /// Forward voltage of two diodes, V.
    #[inline(always)]
    pub fn diode_drops_v(&self) -> R {
        self.diode_drops
    }

    /// What the EMF between two lines must exceed before the diodes conduct, V.
    #[inline(always)]
    pub fn diode_threshold_v(&self) -> R {
        let threshold = self.bus + self.diode_drops;
        if self.is_ideal {
            let on = R::splat(0.0).lt(self.bus);
            R::select(on, threshold, R::splat(DISCONNECTED_V))
        } else {
            threshold
        }
    }

    /// Ends a PWM period in which the bridge has taken `bridge_current_a`, its mean, A; negative when
    /// the motor feeds it. An ideal supply does not care.
    #[inline(always)]
    pub fn end_period(&mut self, bridge_current_a: R) {
        let zero = R::splat(0.0);
        let [blocked, blocked_braking] = &self.blocked;
        let [conducting, conducting_braking] = &self.conducting;
        let (source, bus, drawn) = (self.source, self.bus, bridge_current_a);
        let (mut across, mut alone_v, mut supplied_v) = (
            blocked.across,
            blocked.volts_per_ampere,
            conducting.volts_per_ampere,
        );
        if self.has_brake {
            let on = self.brake_on.le(bus) | (self.braking & self.brake_off.lt(bus));
            self.braking = on;
            across = R::select(on, blocked_braking.across, across);
            alone_v = R::select(on, blocked_braking.volts_per_ampere, alone_v);
            supplied_v = R::select(on, conducting_braking.volts_per_ampere, supplied_v);
            self.brake_current = (across - blocked.across) * bus;
        }
        let flowing = -(across * bus) - drawn;
        let alone = bus + flowing * alone_v;
        let supplied = bus + (conducting.source * (source - bus) + flowing) * supplied_v;
        // The supply lifts the bus up to its own voltage and never lowers it.
        let next = alone.greatest(supplied.least(source));
        self.supply_current = (next - alone) * self.capacitance_per_period;
        self.bus = next.greatest(zero).least(R::splat(HIGHEST_V));
    }

    /// Current out of the motor supply, the mean of the last period, A; 0 for an ideal one, which
    /// does not look.
    pub fn supply_current_a(&self) -> R {
        self.supply_current
    }

    /// Current through the brake, A.
    pub fn brake_current_a(&self) -> R {
        self.brake_current
    }
}

/// The supply of processor, sensors and gate drivers, apart from the motor's. A batch shares it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogicSupply {
    /// Open-circuit voltage, V; 0 is off.
    pub supply_v: f32,
    /// Internal resistance, Ω.
    pub source_ohm: f32,
    /// What the logic takes, A.
    pub current_a: f32,
    /// Least voltage at the drive at which the logic works, V.
    pub least_v: f32,
}

impl LogicSupply {
    /// 24 V behind 0.5 Ω, 80 mA, at work from 7 V. Figures of ours.
    pub const NOMINAL: Self = Self {
        supply_v: 24.0,
        source_ohm: 0.5,
        current_a: 0.08,
        least_v: 7.0,
    };

    /// Voltage at the drive, V.
    pub fn voltage_v(&self) -> f32 {
        let voltage = self.supply_v - self.source_ohm * self.current_a;
        if voltage > 0.0 { voltage } else { 0.0 }
    }

    /// Whether the logic works.
    pub fn is_enough(&self) -> bool {
        self.voltage_v() >= self.least_v
    }

    /// Whether such a supply can be.
    pub(crate) fn check(&self) -> Result<(), Invalid> {
        for value in [self.supply_v, self.source_ohm, self.current_a, self.least_v] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Invalid::Logic(value));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Link, LogicSupply, Supply};
    use control::Real;

    const H: f64 = 10e-6;

    #[test]
    fn an_ideal_supply_that_is_off_is_disconnected() {
        let mut supply = Supply::new(&Link::IDEAL, H, 48.0_f32, 0.8);
        assert_eq!(supply.voltage_v(), 48.0);
        assert!((supply.diode_threshold_v() - 49.6).abs() < 1e-5);
        for off in [0.0, -5.0, f32::NAN, f32::NEG_INFINITY] {
            supply.set_voltage_v(off);
            assert_eq!(supply.voltage_v(), 0.0, "{off}");
            assert!(supply.diode_threshold_v() > 1e6);
        }
    }

    #[test]
    fn the_bus_follows_the_exponential_to_the_voltage_under_load() {
        let link = Link {
            bleeder_ohm: 100.0,
            ..Link::SMALL
        };
        let mut supply = Supply::new(&link, H, 48.0_f32, 0.8);
        let sum = 1.0 / 0.15 + 1.0 / 100.0;
        let end = (48.0 / 0.15 - 10.0) / sum;
        for n in 1..=50 {
            supply.end_period(10.0);
            let time = f64::from(n) * H;
            let expected = end + (48.0 - end) * (-time * sum / 220e-6).exp();
            let actual = f64::from(supply.voltage_v());
            assert!((actual - expected).abs() < 2e-5, "{n}: {actual} {expected}");
        }
        let expected = 10.0 + end / 100.0;
        assert!((f64::from(supply.supply_current_a()) / expected - 1.0).abs() < 0.01);
    }

    #[test]
    fn regeneration_raises_the_bus_and_none_of_it_goes_back() {
        let link = Link {
            bleeder_ohm: f64::INFINITY,
            ..Link::SMALL
        };
        let mut supply = Supply::new(&link, H, 48.0_f32, 0.8);
        for _ in 0..100 {
            supply.end_period(-2.0);
            assert_eq!(supply.supply_current_a(), 0.0);
        }
        // 2 A for 1 ms into 220 µF.
        assert!((supply.voltage_v() - 48.0 - 2e-3 / 220e-6).abs() < 1e-3);
        // It stays until something takes it.
        supply.end_period(0.0);
        assert!(supply.voltage_v() > 57.0);
    }

    #[test]
    fn switched_off_the_bus_falls_through_the_bleeder() {
        let mut supply = Supply::new(&Link::SMALL, H, 48.0_f32, 0.8);
        supply.set_voltage_v(0.0);
        // One time constant: 2.2 s.
        for _ in 0..220_000 {
            supply.end_period(0.0);
        }
        let expected = 48.0 / std::f32::consts::E;
        assert!((supply.voltage_v() / expected - 1.0).abs() < 1e-3);
        supply.set_voltage_v(48.0);
        for _ in 0..100 {
            supply.end_period(0.0);
        }
        assert!((supply.voltage_v() - 48.0).abs() < 0.01);
    }

    #[test]
    fn the_brake_switches_between_its_two_voltages() {
        let link = Link {
            brake_ohm: 10.0,
            brake_on_v: 56.0,
            brake_off_v: 54.0,
            ..Link::SMALL
        };
        let mut supply = Supply::new(&link, H, 48.0_f32, 0.8);
        let (mut highest, mut lowest_after) = (0.0_f32, 100.0_f32);
        let mut was_on = false;
        let mut switched = 0;
        for n in 0..5_000 {
            supply.end_period(-3.0);
            let bus = supply.voltage_v();
            if n > 500 {
                highest = highest.greatest(bus);
                lowest_after = lowest_after.least(bus);
            }
            let on = supply.brake_current_a() > 0.0;
            switched += u32::from(on != was_on);
            was_on = on;
        }
        assert!(highest > 55.9 && highest < 56.3, "{highest}");
        assert!(lowest_after < 54.1 && lowest_after > 53.7, "{lowest_after}");
        assert!(switched > 20, "{switched}");
    }

    #[test]
    fn the_logic_ends_below_its_least_voltage() {
        let mut logic = LogicSupply::NOMINAL;
        assert!((logic.voltage_v() - 23.96).abs() < 1e-5);
        assert!(logic.is_enough());
        logic.supply_v = 7.03;
        assert!(!logic.is_enough());
        logic.supply_v = 0.0;
        assert_eq!(logic.voltage_v(), 0.0);
    }
}
