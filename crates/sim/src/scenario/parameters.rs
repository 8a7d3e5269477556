//! The parameters of a drive's world; their rows are in `parameter_rows.rs`.

use personalities::Personality;
use personalities::p3::P3;
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
    /// Reads it.
    pub(super) get: fn(&Parameters) -> f64,
    /// Writes it.
    pub(super) set: fn(&mut Parameters, f64),
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

    /// What a virtual drive has unless it is told otherwise, infinite: none; `None` where its world has
    /// nothing of the kind until a file says so.
    pub fn default(&self, drive: &'static Personality) -> Option<f64> {
        let world = usual(drive);
        let warms = self.section() == "thermal" && self.key() != "ambient";
        (!warms || world.thermal.is_some()).then(|| self.of(&world))
    }

    /// What stands for "none".
    pub(super) fn none(&self) -> f64 {
        self.of(&usual(&P3))
    }

    /// Whether a file may say that there is none.
    pub(super) fn may_be_none(&self) -> bool {
        self.none().is_infinite()
    }

    /// A value as people write it.
    pub(super) fn format(&self, value: f64) -> String {
        match value.is_infinite() {
            true => "none".to_owned(),
            false => self.quantity.format(value),
        }
    }

    /// Unit, default of a drive and range as documents show them.
    pub fn shown(&self, drive: &'static Personality) -> [String; 3] {
        let shown = |value| self.quantity.format(value);
        let mut range = match self.quantity {
            Quantity::Flag => "true or false".to_owned(),
            _ => format!("{} to {}", shown(self.least), shown(self.most)),
        };
        if self.may_be_none() {
            range.push_str(", or none");
        }
        let default = self.default(drive);
        [
            self.quantity.main_unit().to_owned(),
            default.map_or_else(|| "-".to_owned(), |value| self.format(value)),
            range,
        ]
    }
}

/// The world of a virtual drive that is told nothing.
pub(super) fn usual(drive: &'static Personality) -> Parameters {
    let node = Place::unconfigured(1).expect("a place");
    DriveSettings::at(node, drive).plant
}

#[cfg(test)]
mod tests {
    use super::super::parameter_rows::PARAMETERS;
    use super::*;
    use plant::{Stops, Switch, Switches};

    /// Each row reads what it writes, within its own limits, and nothing else changes.
    #[test]
    fn every_row_is_its_own_field() {
        let mut usual = usual(&P3);
        let away = Some(Switch::between(1e4, 1e5));
        usual.switches = Switches {
            negative_limit: away,
            positive_limit: away,
            home: away,
        };
        usual.load.stops = Some(Stops::between(-1e4, 1e5));
        for parameter in PARAMETERS {
            let default = parameter.of(&usual);
            assert!(
                (parameter.least..=parameter.most).contains(&default) || parameter.may_be_none(),
                "{}: {default}",
                parameter.path
            );
            let other = match parameter.quantity {
                Quantity::Flag => 1.0 - default,
                _ if default == parameter.most => parameter.least,
                Quantity::Whole => default + 1.0,
                _ if default.is_infinite() => parameter.most,
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
            let same = PARAMETERS.iter().filter(|p| p.path == parameter.path);
            assert_eq!(same.count(), 1, "{}", parameter.path);
            assert!(parameter.what.ends_with('.'), "{}", parameter.path);
        }
    }
}
