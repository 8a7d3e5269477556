//! Every parameter of a drive's world: one row each, from which files are read and documents made.

use plant::Parameters;

use super::quantity::Quantity;
use crate::drive::DriveSettings;
use crate::place::Place;

/// A parameter of a drive's world.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Where it stands: `motor.phase_resistance` is `phase_resistance` in `[drive.1.motor]`.
    pub path: &'static str,
    /// What kind of quantity it is.
    pub quantity: Quantity,
    /// The smallest value, in the quantity's first unit.
    pub least: f64,
    /// The largest.
    pub most: f64,
    /// What it is.
    pub what: &'static str,
    get: fn(&Parameters) -> f64,
    set: fn(&mut Parameters, f64),
}

impl Parameter {
    /// The table that it stands in, below `[drive.N]`.
    pub fn section(&self) -> &'static str {
        self.path.split_once('.').map_or("", |(section, _)| section)
    }

    /// Its key in that table.
    pub fn key(&self) -> &'static str {
        self.path.split_once('.').map_or(self.path, |(_, key)| key)
    }

    /// Its value in a world.
    pub fn of(&self, world: &Parameters) -> f64 {
        (self.get)(world)
    }

    /// Gives it to a world.
    pub(super) fn give(&self, world: &mut Parameters, value: f64) {
        (self.set)(world, value);
    }

    /// What a virtual drive has unless it is told otherwise.
    pub fn default(&self) -> f64 {
        self.of(&usual())
    }

    /// Unit, default and range as documents show them.
    pub fn shown(&self) -> [String; 3] {
        let shown = |value| self.quantity.format(value);
        let range = match (self.least.is_finite(), self.most.is_finite()) {
            _ if self.quantity == Quantity::Flag => "true or false".to_owned(),
            (true, true) => format!("{} to {}", shown(self.least), shown(self.most)),
            (true, false) => format!("{} or more", shown(self.least)),
            _ => "any".to_owned(),
        };
        [
            self.quantity.main_unit().to_owned(),
            shown(self.default()),
            range,
        ]
    }
}

/// The world of a virtual drive that is told nothing.
fn usual() -> Parameters {
    let node = Place::unconfigured(1).expect("a place");
    DriveSettings::at(node, &personalities::p3::P3).plant
}

/// A number that a field may be.
trait Cell: Copy {
    fn get(self) -> f64;
    fn put(value: f64) -> Self;
}

macro_rules! cells {
    ($($kind:ty),*) => {$(
        impl Cell for $kind {
            fn get(self) -> f64 {
                f64::from(self)
            }
            fn put(value: f64) -> $kind {
                value as $kind
            }
        }
    )*};
}
cells!(f64, f32, u8, u16, u32, i32);

impl Cell for bool {
    fn get(self) -> f64 {
        f64::from(u8::from(self))
    }
    fn put(value: f64) -> bool {
        value != 0.0
    }
}

/// A row: path in the file, quantity, smallest and largest value, field of [`Parameters`] (in the
/// quantity's first unit; or times a factor), what it is.
macro_rules! row {
    ($path:literal, $quantity:ident, $least:expr, $most:expr,
     $field:ident $(. $more:ident)* $([$index:literal])? $(* $factor:expr)?, $what:literal) => {
        Parameter {
            path: $path,
            quantity: Quantity::$quantity,
            least: $least,
            most: $most,
            what: $what,
            get: |world| Cell::get(world.$field $(.$more)* $([$index])?) $(* $factor)?,
            set: |world, value| {
                world.$field $(.$more)* $([$index])? = Cell::put(value $(/ $factor)?);
            },
        }
    };
}

const ANY: f64 = f64::INFINITY;

/// All of them, in the order of their sections.
pub const PARAMETERS: &[Parameter] = &[
    row!(
        "motor.pole_pairs",
        Whole,
        1.0,
        255.0,
        motor.pole_pairs,
        "Magnetic pole pairs."
    ),
    row!(
        "motor.phase_resistance",
        Resistance,
        1e-4,
        1e4,
        motor.phase_resistance_ohm,
        "Resistance of one phase: half of what is measured between two terminals."
    ),
    row!(
        "motor.phase_inductance",
        Inductance,
        1e-7,
        10.0,
        motor.phase_inductance_h,
        "Inductance of one phase: half of what is measured between two terminals."
    ),
    row!(
        "motor.flux",
        Flux,
        1e-6,
        100.0,
        motor.flux_wb,
        "Peak flux linkage of one phase with the magnet; the torque per ampere of peak phase current is 1.5 times pole pairs times it."
    ),
    row!(
        "motor.rotor_inertia",
        Inertia,
        0.0,
        1e3,
        motor.rotor_inertia_kgm2,
        "Inertia of the rotor."
    ),
    row!(
        "motor.coulomb_friction",
        Torque,
        0.0,
        1e4,
        motor.coulomb_friction_nm,
        "Friction that does not depend on speed."
    ),
    row!(
        "motor.static_friction",
        Torque,
        0.0,
        1e4,
        motor.static_friction_nm,
        "Torque needed to break away from standstill; not below the Coulomb friction."
    ),
    row!(
        "motor.viscous_friction",
        ViscousFriction,
        0.0,
        1e3,
        motor.viscous_friction_nms,
        "Friction per speed."
    ),
    row!(
        "load.inertia",
        Inertia,
        0.0,
        1e3,
        load.inertia_kgm2,
        "Inertia of what the motor drives."
    ),
    row!(
        "load.coulomb_friction",
        Torque,
        0.0,
        1e4,
        load.coulomb_friction_nm,
        "The load's friction that does not depend on speed."
    ),
    row!(
        "load.viscous_friction",
        ViscousFriction,
        0.0,
        1e3,
        load.viscous_friction_nms,
        "The load's friction per speed."
    ),
    row!(
        "inverter.pwm_period",
        Time,
        1e-6,
        1e-3,
        pwm_period_s,
        "PWM period at power-on; 0x3001 changes it."
    ),
    row!(
        "inverter.delay_periods",
        Whole,
        0.0,
        4.0,
        load_delay_periods,
        "PWM periods between the command of a duty and its effect."
    ),
    row!(
        "inverter.diode_drop",
        Voltage,
        0.0,
        100.0,
        diode_drop_v,
        "Forward voltage of one free-wheeling diode."
    ),
    row!(
        "supply.motor_voltage",
        Voltage,
        0.0,
        1e4,
        supply_v,
        "Motor supply; 0 V is off."
    ),
    row!(
        "encoder.counts_per_turn",
        Whole,
        1.0,
        1_048_576.0,
        encoder.counts_per_turn,
        "Counts of one turn."
    ),
    row!(
        "encoder.zero",
        Whole,
        0.0,
        1_048_575.0,
        encoder.zero_counts,
        "Reading with the rotor aligned with phase A."
    ),
    row!(
        "encoder.reversed",
        Flag,
        0.0,
        1.0,
        encoder.reversed,
        "Whether the reading falls when the shaft turns in its positive direction."
    ),
    row!(
        "sensors.current_step",
        CurrentStep,
        1e-6,
        100.0,
        scales.current_a,
        "Current of one converter count."
    ),
    row!(
        "sensors.voltage_step",
        VoltageStep,
        1e-6,
        100.0,
        scales.voltage_v,
        "Supply voltage of one converter count."
    ),
    row!(
        "sensors.temperature_step",
        TemperatureStepPerCount,
        1e-6,
        100.0,
        scales.temperature_k,
        "Amplifier temperature of one converter count."
    ),
    row!(
        "sensors.temperature_zero",
        Temperature,
        -273.15,
        1e3,
        scales.temperature_zero_c,
        "Amplifier temperature at which its converter reads 0."
    ),
    row!(
        "sensors.current_zero_a",
        Number,
        0.0,
        4095.0,
        current_zero_counts[0],
        "Reading of phase A's converter at no current, counts."
    ),
    row!(
        "sensors.current_zero_b",
        Number,
        0.0,
        4095.0,
        current_zero_counts[1],
        "Reading of phase B's converter at no current, counts."
    ),
    row!(
        "thermal.ambient",
        Temperature,
        -273.15,
        1e3,
        ambient_c,
        "Temperature of the surroundings, and of everything at the start."
    ),
];

/// The parameter of that path.
pub(super) fn find(path: &str) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| parameter.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each row reads what it writes, within its own limits, and nothing else changes.
    #[test]
    fn every_row_is_its_own_field() {
        let usual = usual();
        for parameter in PARAMETERS {
            let default = parameter.default();
            assert!(
                (parameter.least..=parameter.most).contains(&default),
                "{}: {default}",
                parameter.path
            );
            let other = match parameter.quantity {
                Quantity::Flag => 1.0 - default,
                _ if default == parameter.most => parameter.least,
                Quantity::Whole => default + 1.0,
                _ if parameter.most.is_finite() => default + (parameter.most - default) / 4.0,
                _ => default + 1.0,
            };
            let mut world = usual;
            parameter.give(&mut world, other);
            let read = parameter.of(&world);
            assert!(
                (read - other).abs() <= 1e-6 * other.abs(),
                "{}: {read}",
                parameter.path
            );
            for another in PARAMETERS.iter().filter(|p| p.path != parameter.path) {
                assert_eq!(another.of(&world), another.of(&usual), "{}", another.path);
            }
            assert_eq!(find(parameter.path).map(|p| p.path), Some(parameter.path));
            assert!(parameter.what.ends_with('.'), "{}", parameter.path);
        }
    }
}
