//! Quantities and their units, as people write them: `"48 V"`, `"1.5 s"`, `"716 mA"`.

use super::problem::listed;

/// A unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    /// As it is shown.
    pub(super) symbol: &'static str,
    /// One of it in the quantity's first unit.
    factor: f64,
}

const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit { symbol, factor }
}

const TURN_RAD: f64 = std::f64::consts::TAU;

/// What kind of quantity a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A pure number.
    Number,
    /// A whole number.
    Whole,
    /// `true` or `false`.
    Flag,
    /// A part of something, in percent.
    Share,
    /// Time.
    Time,
    /// Frequency.
    Frequency,
    /// Voltage.
    Voltage,
    /// Current.
    Current,
    /// Resistance.
    Resistance,
    /// Inductance.
    Inductance,
    /// Capacitance.
    Capacitance,
    /// Magnetic flux linkage.
    Flux,
    /// Moment of inertia.
    Inertia,
    /// Torque.
    Torque,
    /// Friction torque per speed.
    ViscousFriction,
    /// Torque per angle.
    Stiffness,
    /// Angle.
    Angle,
    /// Position: an angle of any number of turns.
    Position,
    /// Speed of rotation.
    Speed,
    /// Temperature.
    Temperature,
    /// Difference of temperatures.
    TemperatureStep,
    /// Thermal resistance.
    ThermalResistance,
    /// Heat capacity.
    HeatCapacity,
    /// Power.
    Power,
    /// Length.
    Length,
    /// Current for each count of a converter.
    CurrentStep,
    /// Voltage for each count of a converter.
    VoltageStep,
    /// Temperature for each count of a converter.
    TemperatureStepPerCount,
    /// A fraction for each kelvin.
    PerKelvin,
}

impl Quantity {
    /// Its name with an article, for messages.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Quantity::Number => "a number",
            Quantity::Whole => "a whole number",
            Quantity::Flag => "true or false",
            Quantity::Share => "a share",
            Quantity::Time => "a time",
            Quantity::Frequency => "a frequency",
            Quantity::Voltage => "a voltage",
            Quantity::Current => "a current",
            Quantity::Resistance => "a resistance",
            Quantity::Inductance => "an inductance",
            Quantity::Capacitance => "a capacitance",
            Quantity::Flux => "a flux linkage",
            Quantity::Inertia => "a moment of inertia",
            Quantity::Torque => "a torque",
            Quantity::ViscousFriction => "a viscous friction",
            Quantity::Stiffness => "a stiffness",
            Quantity::Angle => "an angle",
            Quantity::Position => "a position",
            Quantity::Speed => "a speed",
            Quantity::Temperature => "a temperature",
            Quantity::TemperatureStep => "a temperature difference",
            Quantity::ThermalResistance => "a thermal resistance",
            Quantity::HeatCapacity => "a heat capacity",
            Quantity::Power => "a power",
            Quantity::Length => "a length",
            Quantity::CurrentStep => "a current per count",
            Quantity::VoltageStep => "a voltage per count",
            Quantity::TemperatureStepPerCount => "a temperature difference per count",
            Quantity::PerKelvin => "a change per kelvin",
        }
    }

    /// Its units; values are kept in the first. None for pure numbers.
    pub(super) const fn units(self) -> &'static [Unit] {
        match self {
            Quantity::Number | Quantity::Whole | Quantity::Flag => const { &[] },
            Quantity::Share => const { &[unit("%", 1.0)] },
            Quantity::Time => {
                const {
                    &[
                        unit("s", 1.0),
                        unit("ms", 1e-3),
                        unit("us", 1e-6),
                        unit("ns", 1e-9),
                        unit("min", 60.0),
                        unit("h", 3600.0),
                    ]
                }
            }
            Quantity::Frequency => const { &[unit("Hz", 1.0), unit("kHz", 1e3)] },
            Quantity::Voltage => const { &[unit("V", 1.0), unit("mV", 1e-3), unit("kV", 1e3)] },
            Quantity::Current => const { &[unit("A", 1.0), unit("mA", 1e-3)] },
            Quantity::Resistance => {
                const { &[unit("ohm", 1.0), unit("mohm", 1e-3), unit("kohm", 1e3)] }
            }
            Quantity::Inductance => const { &[unit("H", 1.0), unit("mH", 1e-3), unit("uH", 1e-6)] },
            Quantity::Capacitance => {
                const { &[unit("F", 1.0), unit("mF", 1e-3), unit("uF", 1e-6)] }
            }
            Quantity::Flux => const { &[unit("Wb", 1.0), unit("mWb", 1e-3)] },
            Quantity::Inertia => {
                const {
                    &[
                        unit("kg m2", 1.0),
                        unit("g cm2", 1e-7),
                        unit("kg cm2", 1e-4),
                    ]
                }
            }
            Quantity::Torque => const { &[unit("Nm", 1.0), unit("mNm", 1e-3), unit("uNm", 1e-6)] },
            Quantity::ViscousFriction => {
                const {
                    &[
                        unit("Nm s/rad", 1.0),
                        unit("mNm s/rad", 1e-3),
                        unit("uNm s/rad", 1e-6),
                    ]
                }
            }
            Quantity::Stiffness => const { &[unit("Nm/rad", 1.0), unit("mNm/rad", 1e-3)] },
            Quantity::Angle => {
                const {
                    &[
                        unit("rad", 1.0),
                        unit("deg", TURN_RAD / 360.0),
                        unit("turns", TURN_RAD),
                    ]
                }
            }
            Quantity::Position => {
                const {
                    &[
                        unit("turns", 1.0),
                        unit("deg", 1.0 / 360.0),
                        unit("rad", 1.0 / TURN_RAD),
                    ]
                }
            }
            Quantity::Speed => {
                const {
                    &[
                        unit("rad/s", 1.0),
                        unit("rpm", TURN_RAD / 60.0),
                        unit("turns/s", TURN_RAD),
                    ]
                }
            }
            Quantity::Temperature => const { &[unit("degC", 1.0)] },
            Quantity::TemperatureStep => const { &[unit("K", 1.0)] },
            Quantity::ThermalResistance => const { &[unit("K/W", 1.0)] },
            Quantity::HeatCapacity => const { &[unit("J/K", 1.0)] },
            Quantity::Power => const { &[unit("W", 1.0), unit("mW", 1e-3)] },
            Quantity::Length => const { &[unit("m", 1.0), unit("mm", 1e-3)] },
            Quantity::CurrentStep => const { &[unit("A/count", 1.0), unit("mA/count", 1e-3)] },
            Quantity::VoltageStep => const { &[unit("V/count", 1.0), unit("mV/count", 1e-3)] },
            Quantity::TemperatureStepPerCount => const { &[unit("K/count", 1.0)] },
            Quantity::PerKelvin => const { &[unit("1/K", 1.0), unit("%/K", 0.01)] },
        }
    }

    /// How it is written, for messages: `write it in V, mV or kV, as in "48 V"`.
    pub(super) fn form(self) -> String {
        let units: Vec<String> = self.units().iter().map(|u| u.symbol.to_owned()).collect();
        match self {
            Quantity::Number => "write a number, as in 1.5".to_owned(),
            Quantity::Whole => "write a whole number, as in 4096 or 0x1000".to_owned(),
            Quantity::Flag => "write true or false".to_owned(),
            _ => format!(
                "write it in {}, as in \"{}\"",
                listed(&units),
                self.example()
            ),
        }
    }

    fn example(self) -> String {
        let number = match self {
            Quantity::Voltage => "48",
            Quantity::Temperature => "25",
            Quantity::Share => "5",
            _ => "1.5",
        };
        let symbol = self.units().first().map_or("", |unit| unit.symbol);
        format!("{number} {symbol}")
    }

    /// Reads a number with its unit; the value is in the first unit.
    pub(super) fn parse(self, text: &str) -> Result<f64, Wrong> {
        let text = text.trim();
        let (number, rest) = split_number(text).ok_or(Wrong::NoNumber)?;
        let value: f64 = number.parse().map_err(|_| Wrong::NoNumber)?;
        let symbol = plain(rest);
        if symbol.is_empty() {
            return match self.units() {
                [] => Ok(value),
                _ => Err(Wrong::NoUnit),
            };
        }
        let unit = self
            .units()
            .iter()
            .find(|unit| plain(unit.symbol) == symbol);
        match unit {
            Some(unit) => Ok(value * unit.factor),
            None => Err(Wrong::Unit(rest.trim().to_owned())),
        }
    }

    /// A value as people write it, with the unit that makes it short.
    pub(super) fn format(self, value: f64) -> String {
        match self {
            Quantity::Flag => return (value != 0.0).to_string(),
            Quantity::Number | Quantity::Whole => return short(value),
            _ => {}
        }
        let units = self.units();
        let fits = |unit: &&Unit| {
            let scaled = (value / unit.factor).abs();
            (1.0..1000.0).contains(&scaled)
        };
        let unit = units.iter().find(fits).or(units.first());
        unit.map_or_else(
            || short(value),
            |unit| format!("{} {}", short(value / unit.factor), unit.symbol),
        )
    }

    /// The unit in which documents show it.
    pub(super) fn main_unit(self) -> &'static str {
        self.units().first().map_or("–", |unit| unit.symbol)
    }
}

/// What is wrong with a text.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Wrong {
    NoNumber,
    NoUnit,
    Unit(String),
}

/// The number that a text begins with, and the rest.
fn split_number(text: &str) -> Option<(&str, &str)> {
    let is_number = |part: &str| {
        let digits = part.trim_start_matches(['+', '-']);
        digits.starts_with(|c: char| c.is_ascii_digit()) && part.parse::<f64>().is_ok()
    };
    (1..=text.len())
        .rev()
        .filter(|end| text.is_char_boundary(*end))
        .map(|end| text.split_at(end))
        .find(|(number, _)| is_number(number))
}

/// A unit without what people write in several ways.
fn plain(symbol: &str) -> String {
    let mut text = String::new();
    for c in symbol.chars() {
        match c {
            ' ' | '*' | '·' | '^' => {}
            '²' => text.push('2'),
            '\u{B5}' | '\u{3BC}' => text.push('u'),
            '\u{3A9}' | '\u{2126}' => text.push_str("ohm"),
            '°' => text.push_str("deg"),
            c => text.push(c),
        }
    }
    match text.as_str() {
        "turn" => "turns".to_owned(),
        "turn/s" => "turns/s".to_owned(),
        _ => text,
    }
}

/// A whole number, or one with up to six digits.
fn short(value: f64) -> String {
    const WHOLE: f64 = 1e15;
    if value.trunc() == value && value.abs() < WHOLE {
        return format!("{}", value + 0.0);
    }
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    // Adding zero makes a negative zero positive.
    format!("{}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_with_units() {
        for (quantity, text, value) in [
            (Quantity::Voltage, "48 V", 48.0),
            (Quantity::Voltage, "48V", 48.0),
            (Quantity::Voltage, " -1.5e1 mV", -0.015),
            (Quantity::Current, "716 mA", 0.716),
            (Quantity::Time, "20us", 20e-6),
            (Quantity::Time, "1e-3 s", 1e-3),
            (Quantity::Temperature, "25 °C", 25.0),
            (Quantity::Temperature, "25 degC", 25.0),
            (Quantity::Inertia, "4.45 g cm²", 4.45e-7),
            (Quantity::Inertia, "4.45 g*cm^2", 4.45e-7),
            (Quantity::Resistance, "13 Ω", 13.0),
            (Quantity::Resistance, "13 mΩ", 0.013),
            (Quantity::ViscousFriction, "1 µNm s/rad", 1e-6),
            (Quantity::ViscousFriction, "1 uNm*s/rad", 1e-6),
            (Quantity::Position, "1 turn", 1.0),
            (Quantity::Position, "90 deg", 0.25),
            (Quantity::Share, "5%", 5.0),
            (Quantity::Number, "1.5", 1.5),
        ] {
            let read = quantity.parse(text).unwrap();
            assert!(
                (read - value).abs() <= 1e-12 * value.abs(),
                "{text}: {read}"
            );
        }
    }

    #[test]
    fn what_is_no_quantity() {
        let unit = |text: &str| Wrong::Unit(text.to_owned());
        for (text, wrong) in [
            ("", Wrong::NoNumber),
            ("V", Wrong::NoNumber),
            ("inf V", Wrong::NoNumber),
            ("nan", Wrong::NoNumber),
            ("48", Wrong::NoUnit),
            ("48 W", unit("W")),
            ("48 v", unit("v")),
            ("4,8 V", unit(",8 V")),
            ("48 V V", unit("V V")),
        ] {
            assert_eq!(Quantity::Voltage.parse(text), Err(wrong), "{text}");
        }
        assert_eq!(Quantity::Number.parse("1 V"), Err(unit("V")));
    }

    /// What is shown can be read again.
    #[test]
    fn shown_values_are_short() {
        for (quantity, value, text) in [
            (Quantity::Voltage, 48.0, "48 V"),
            (Quantity::Inductance, 0.3645e-3, "364.5 uH"),
            (Quantity::Inertia, 4.45e-7, "4.45 g cm2"),
            (Quantity::Time, 10e-6, "10 us"),
            (Quantity::Torque, 0.0, "0 Nm"),
            (Quantity::Torque, -2.0e-4, "-200 uNm"),
            (Quantity::Voltage, 1e6, "1000000 V"),
            (Quantity::Flag, 1.0, "true"),
            (Quantity::Whole, 4096.0, "4096"),
            (Quantity::Whole, 1_048_576.0, "1048576"),
            (Quantity::Number, -1_048_576.0, "-1048576"),
            (Quantity::Number, 1.234_567_8, "1.23457"),
            (Quantity::Number, -0.0, "0"),
        ] {
            assert_eq!(quantity.format(value), text);
            if !quantity.units().is_empty() {
                let again = quantity.parse(text).unwrap();
                assert!((again - value).abs() <= 1e-12 * value.abs(), "{text}");
            }
        }
    }
}
