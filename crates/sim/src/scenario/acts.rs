//! What an event does: one row for each kind of act, from which files are read and documents made.

use super::arguments::{Argument, Arguments, number, required};
use super::quantity::Quantity;

/// Something that is done to a drive or to the bus.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Act {
    /// Motor supply, V; `None` is what the drive was made with.
    MotorSupply(Option<f32>),
    /// Hold the shaft, or let it go.
    Block(bool),
    /// Torque of the load, Nm.
    LoadTorque(f32),
    /// Temperature of the amplifier, °C; `None` is what it was made with.
    AmplifierTemperature(Option<f32>),
    /// The processor handles nothing; how long says the event.
    Stall,
    /// SYNC messages of outside programs do not get onto the bus, or do again.
    HoldSync(bool),
}

/// What an act is done to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Object {
    Drive,
    Bus,
}

/// How long an act lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lasting {
    /// It is done, and that is all.
    Once,
    /// With `for`, the act of that name follows after that time.
    Until(&'static str),
    /// `for` must say how long.
    Stated,
}

/// A kind of act.
#[derive(Debug)]
pub struct ActKind {
    /// The word for `do`.
    pub name: &'static str,
    /// What it does.
    pub what: &'static str,
    /// What it changes: two acts upon one thing at one time contradict each other.
    pub(super) thing: &'static str,
    pub(super) object: Object,
    pub(super) lasting: Lasting,
    pub(super) arguments: &'static [Argument],
    pub(super) build: fn(&Arguments) -> Act,
}

impl ActKind {
    /// Its arguments as documents show them: name, form, what it is.
    pub fn shown(&self) -> Vec<[String; 3]> {
        let mut rows = Vec::new();
        if self.object == Object::Drive {
            rows.push([
                "drive".to_owned(),
                "1, \"u1\" or \"all\"".to_owned(),
                "Which drive; needed.".to_owned(),
            ]);
        }
        rows.extend(self.arguments.iter().map(Argument::shown));
        let lasts = match self.lasting {
            Lasting::Once => None,
            Lasting::Until(undo) => Some(format!("After this time `{undo}` follows.")),
            Lasting::Stated => Some("How long; needed.".to_owned()),
        };
        rows.extend(lasts.map(|what| ["for".to_owned(), "s, ms, us, …".to_owned(), what]));
        rows
    }
}

const VOLTAGE: Argument = required("to", number(Quantity::Voltage, 0.0, 1e3), "The voltage.");
const TEMPERATURE: Argument = required(
    "to",
    number(Quantity::Temperature, -273.15, 1000.0),
    "The temperature.",
);

/// All of them.
pub const ACTS: &[ActKind] = &[
    ActKind {
        name: "motor-supply",
        what: "Sets the motor supply.",
        thing: "the motor supply",
        object: Object::Drive,
        lasting: Lasting::Until("restore-motor-supply"),
        arguments: &[VOLTAGE],
        build: |given| Act::MotorSupply(Some(given.number("to") as f32)),
    },
    ActKind {
        name: "cut-motor-supply",
        what: "Disconnects the motor supply. The processor stays alive.",
        thing: "the motor supply",
        object: Object::Drive,
        lasting: Lasting::Until("restore-motor-supply"),
        arguments: &[],
        build: |_| Act::MotorSupply(Some(0.0)),
    },
    ActKind {
        name: "restore-motor-supply",
        what: "Sets the motor supply back to what the drive began with.",
        thing: "the motor supply",
        object: Object::Drive,
        lasting: Lasting::Once,
        arguments: &[],
        build: |_| Act::MotorSupply(None),
    },
    ActKind {
        name: "block-shaft",
        what: "Holds the shaft where it is.",
        thing: "the shaft",
        object: Object::Drive,
        lasting: Lasting::Until("free-shaft"),
        arguments: &[],
        build: |_| Act::Block(true),
    },
    ActKind {
        name: "free-shaft",
        what: "Lets the shaft go.",
        thing: "the shaft",
        object: Object::Drive,
        lasting: Lasting::Once,
        arguments: &[],
        build: |_| Act::Block(false),
    },
    ActKind {
        name: "load-torque",
        what: "Sets the torque of the load.",
        thing: "the load's torque",
        object: Object::Drive,
        lasting: Lasting::Until("remove-load-torque"),
        arguments: &[required(
            "to",
            number(Quantity::Torque, -1e3, 1e3),
            "The torque; positive opposes positive rotation.",
        )],
        build: |given| Act::LoadTorque(given.number("to") as f32),
    },
    ActKind {
        name: "remove-load-torque",
        what: "Sets the torque of the load to 0.",
        thing: "the load's torque",
        object: Object::Drive,
        lasting: Lasting::Once,
        arguments: &[],
        build: |_| Act::LoadTorque(0.0),
    },
    ActKind {
        name: "amplifier-temperature",
        what: "Sets the temperature of the amplifier.",
        thing: "the amplifier's temperature",
        object: Object::Drive,
        lasting: Lasting::Until("restore-amplifier-temperature"),
        arguments: &[TEMPERATURE],
        build: |given| Act::AmplifierTemperature(Some(given.number("to") as f32)),
    },
    ActKind {
        name: "restore-amplifier-temperature",
        what: "Sets the temperature of the amplifier back to what it began with.",
        thing: "the amplifier's temperature",
        object: Object::Drive,
        lasting: Lasting::Once,
        arguments: &[],
        build: |_| Act::AmplifierTemperature(None),
    },
    ActKind {
        name: "stall-processor",
        what: "The processor handles no frame for some time; a controller whose FIFO of 16 frames is \
               full loses those that follow (CAN overrun).",
        thing: "the processor",
        object: Object::Drive,
        lasting: Lasting::Stated,
        arguments: &[],
        build: |_| Act::Stall,
    },
    ActKind {
        name: "stop-sync",
        what: "SYNC messages (0x080) of outside programs do not get onto the bus any more.",
        thing: "SYNC",
        object: Object::Bus,
        lasting: Lasting::Until("resume-sync"),
        arguments: &[],
        build: |_| Act::HoldSync(true),
    },
    ActKind {
        name: "resume-sync",
        what: "SYNC messages of outside programs get onto the bus again.",
        thing: "SYNC",
        object: Object::Bus,
        lasting: Lasting::Once,
        arguments: &[],
        build: |_| Act::HoldSync(false),
    },
];

/// The kind of that name.
pub(super) fn find(name: &str) -> Option<&'static ActKind> {
    ACTS.iter().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_undone_by_acts_upon_the_same_thing() {
        for (n, kind) in ACTS.iter().enumerate() {
            assert!(ACTS[..n].iter().all(|other| other.name != kind.name));
            assert!(kind.what.ends_with('.'), "{}", kind.name);
            if let Lasting::Until(undo) = kind.lasting {
                let undo = find(undo).unwrap_or_else(|| panic!("{}", kind.name));
                assert_eq!(undo.thing, kind.thing);
                assert_eq!(undo.object, kind.object);
                assert!(undo.arguments.is_empty());
            }
        }
    }
}
