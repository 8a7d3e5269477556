//! The motor supply.

use control::Real;

/// An ideal motor supply: it holds its voltage whatever flows, in either direction, or it is off.
///
/// Off means disconnected and discharged: the bus reads 0 V, a switching bridge has no voltage to
/// give (its switches short the winding), and an open bridge has no path for a current, so
/// currents end with the period. The logic supply is separate and stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply<R: Real> {
    voltage: R,
    diode_drops: R,
}

/// Stands for "no path": beyond any voltage that a winding could raise, and safely finite.
const DISCONNECTED_V: f32 = 1e9;

impl<R: Real> Supply<R> {
    /// A supply of `voltage_v`; `diode_drop_v` is the forward voltage of one free-wheeling diode.
    pub fn new(voltage_v: R, diode_drop_v: R) -> Self {
        let mut supply = Self {
            voltage: R::splat(0.0),
            diode_drops: diode_drop_v + diode_drop_v,
        };
        supply.set_voltage_v(voltage_v);
        supply
    }

    /// Sets the voltage, V, up to 10 kV; 0 (or less, or an undefined value) switches it off.
    pub fn set_voltage_v(&mut self, voltage_v: R) {
        self.voltage = voltage_v.greatest(R::splat(0.0)).least(R::splat(10_000.0));
    }

    /// The bus voltage, V.
    #[inline(always)]
    pub fn voltage_v(&self) -> R {
        self.voltage
    }

    /// What the EMF between two lines must exceed before the diodes conduct, V.
    #[inline(always)]
    pub fn diode_threshold_v(&self) -> R {
        let on = R::splat(0.0).lt(self.voltage);
        R::select(
            on,
            self.voltage + self.diode_drops,
            R::splat(DISCONNECTED_V),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Supply;

    #[test]
    fn off_means_disconnected() {
        let mut supply = Supply::new(48.0_f32, 0.8);
        assert_eq!(supply.voltage_v(), 48.0);
        assert!((supply.diode_threshold_v() - 49.6).abs() < 1e-5);
        for off in [0.0, -5.0, f32::NAN, f32::NEG_INFINITY] {
            supply.set_voltage_v(off);
            assert_eq!(supply.voltage_v(), 0.0, "{off}");
            assert!(supply.diode_threshold_v() > 1e6);
        }
    }
}
