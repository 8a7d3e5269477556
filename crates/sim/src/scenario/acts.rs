//! What an event does: one row for each kind of act, from which files are read and documents made.

use can::Frame;
use plant::{EncoderFault, Phase, Short, SwitchName};

use super::act_rows::ACTS;
use super::arguments::{Argument, Arguments};
use crate::wire_act::{WhichFrames, WireAct, WireFault};

/// Something that is done to a drive or to the bus.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Act {
    /// Motor supply, V; `None` is what the drive was made with.
    MotorSupply(Option<f32>),
    /// Logic supply, V; `None` is what the drive was made with.
    LogicSupply(Option<f32>),
    /// Hold the shaft, or let it go.
    Block(bool),
    /// Torque of the load, Nm.
    LoadTorque(f32),
    /// Inertia of the load, kg m²; `None` is what the drive was made with.
    LoadInertia(Option<f64>),
    /// Coulomb and viscous friction of the load, Nm and Nm s/rad; `None` is as made.
    LoadFriction(Option<(f64, Option<f64>)>),
    /// Temperature of the amplifier, °C; `None` is that of the surroundings.
    AmplifierTemperature(Option<f32>),
    /// Temperature of the motor, °C; `None` is that of the surroundings.
    MotorTemperature(Option<f32>),
    /// Temperature of the surroundings, °C; `None` is what they were at the start.
    Ambient(Option<f32>),
    /// A phase's wire is open, or mended.
    OpenPhase(Phase, bool),
    /// A short circuit, or none.
    Short(Option<Short>),
    /// A fault of the encoder, or none.
    Encoder(EncoderFault),
    /// Part of the encoder's answers that are wrong, 0 to 1; `None` is as made.
    BadAnswers(Option<f32>),
    /// Distance of the magnet, mm; `None` is as made.
    Magnet(Option<f32>),
    /// The magnet turns on the shaft, turns.
    Slip(f64),
    /// The encoder counts the other way round, or as made.
    EncoderTurned(bool),
    /// The cable of the encoder on the output is off, or on.
    OutputSilent(bool),
    /// The encoder on the output counts the other way round, or as made.
    OutputTurned(bool),
    /// Distance of its magnet, mm; `None` is as made.
    OutputMagnet(Option<f32>),
    /// Voltage for the gates, V; `None` is what it should be.
    GateSupply(Option<f32>),
    /// Temperature of the gate drivers, °C; `None` is cool.
    GateDriverTemperature(Option<f32>),
    /// The gate drivers' serial interface does not answer, or does again.
    GateDriverSilent(bool),
    /// A switch is pressed, or held open, or left to the shaft.
    Switch(SwitchName, Option<bool>),
    /// Level of a digital input, by its bit in 0x60FD.
    Input(u32, bool),
    /// Voltage at analog input 1 or 2, V.
    Analog(usize, f32),
    /// Safe torque off is asked for, or no longer.
    TorqueOff(bool),
    /// The processor handles nothing; how long says the event.
    Stall,
    /// The processor hangs.
    Hang,
    /// Flips a bit in so many stored bytes, of both sets or of the newest.
    Spoil { bytes: u32, both: bool },
    /// The power fails when a save has come so far.
    CutSave(u64),
    /// SYNC messages of outside programs do not get onto the bus, or do again.
    HoldSync(bool),
    /// Something is done to the wire, whoever takes part.
    Wire(WireAct),
    /// A participant's frames wait; how long says the event.
    HoldFrames,
    /// A participant loses frames.
    LoseFrames(WhichFrames),
    /// A participant is cut off, or connected again.
    Disconnect(bool),
    /// A node babbles; how long says the event.
    Flood { frame: Frame, every_ns: u64 },
    /// The cable is broken; how long says the event.
    Break(WireFault),
}

/// What an act is done to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Object {
    Drive,
    /// A drive, or the outside programs.
    Participant,
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
    /// What it changes: two acts upon one thing at one time contradict each other. Empty: they do
    /// not.
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

/// The kind of that name.
pub(super) fn find(name: &str) -> Option<&'static ActKind> {
    ACTS.iter().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::EVENT_KEYS;

    #[test]
    fn names_are_unique_and_undone_by_acts_upon_the_same_thing() {
        for (n, kind) in ACTS.iter().enumerate() {
            assert!(ACTS[..n].iter().all(|other| other.name != kind.name));
            assert!(kind.what.ends_with('.'), "{}", kind.name);
            for argument in kind.arguments {
                let of_event = EVENT_KEYS.iter().any(|(key, ..)| *key == argument.key());
                assert!(!of_event, "{} {}", kind.name, argument.key());
            }
            if let Lasting::Until(undo) = kind.lasting {
                let undo = find(undo).unwrap_or_else(|| panic!("{}", kind.name));
                assert_eq!(undo.thing, kind.thing);
                assert_eq!(undo.object, kind.object);
                let has = |key| kind.arguments.iter().any(|argument| argument.key() == key);
                assert!(undo.arguments.iter().all(|argument| has(argument.key())));
            }
        }
    }
}
