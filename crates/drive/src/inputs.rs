//! What digital and analog inputs ask of the axis.

use canopen::Image;
use cia402::{Mode, Targets};
use control::io::Signals;
use personalities::{AnalogObjects, InputFunction, InputObjects};

/// Bits of the controlword.
const ENABLE_VOLTAGE: u16 = 1 << 1;
const QUICK_STOP: u16 = 1 << 2;
const ENABLE_OPERATION: u16 = 1 << 3;
const START: u16 = 1 << 4;
const HALT: u16 = 1 << 8;

/// The first general input in 0x60FD.
pub(crate) const FIRST_GENERAL: u32 = 16;

/// The controlword as the axis gets it: that of the master, and what inputs make of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Word {
    /// As the master wrote it.
    written: u16,
    /// Bits that inputs have cleared. Only the master's next write sets them again, so that nothing
    /// starts because an input lets go.
    cleared: u16,
    /// Bits that inputs set.
    set: u16,
}

impl Word {
    /// The master has written.
    pub(crate) fn write(&mut self, word: u16, asked: Asked) {
        *self = Word {
            written: word,
            cleared: asked.clear,
            set: asked.set,
        };
    }

    /// The inputs ask for something; whether that changes the word.
    pub(crate) fn ask(&mut self, asked: Asked) -> bool {
        let before = *self;
        self.cleared |= asked.clear;
        self.set = asked.set;
        *self != before
    }

    /// The axis was stopped by something else than the word: nothing but the master's next write lets
    /// it run on.
    pub(crate) fn hold(&mut self) {
        self.cleared |= QUICK_STOP | ENABLE_OPERATION;
    }

    /// The word for the axis.
    pub(crate) fn value(self) -> u16 {
        (self.written | self.set) & !self.cleared
    }
}

/// Bits of the controlword that inputs ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Asked {
    clear: u16,
    set: u16,
}

impl Asked {
    /// What the general inputs ask for, `active` being those in the order of 0x60FD, and safe torque
    /// off.
    pub(crate) fn by(
        image: &Image<'_>,
        objects: &InputObjects,
        active: u32,
        torque_off: bool,
    ) -> Asked {
        let mut asked = Asked::default();
        for (bit, function) in (FIRST_GENERAL..).zip(objects.functions) {
            let is_active = active >> bit & 1 == 1;
            match (InputFunction::of(image.raw(function)), is_active) {
                (InputFunction::QuickStop, true) => asked.clear |= QUICK_STOP,
                (InputFunction::Enable, false) => asked.clear |= ENABLE_OPERATION,
                (InputFunction::Start, true) => asked.set |= START,
                (InputFunction::Halt, true) => asked.set |= HALT,
                _ => {}
            }
        }
        if torque_off {
            asked.clear |= ENABLE_VOLTAGE;
        }
        asked
    }
}

/// The targets with the one that the analog input commands, if it does and the mode is its.
pub(crate) fn analog_target(
    image: &Image<'_>,
    objects: &AnalogObjects,
    signals: &Signals,
    mode: Mode,
    targets: Targets,
) -> Targets {
    let [reading, _] = signals.auxiliary_adc;
    let offset = image.number(objects.offset) as f32;
    let dead = image.number(objects.dead_band) as f32;
    let away = reading - offset;
    // Beyond the dead band the command begins at zero.
    let beyond = if away > dead {
        away - dead
    } else if away < -dead {
        away + dead
    } else {
        0.0
    };
    let command = beyond * image.number(objects.scale) as f32 / 2048.0;
    match (image.raw(objects.target), mode) {
        (1, Mode::PROFILE_TORQUE) => Targets {
            torque_pm: command as i16,
            ..targets
        },
        (2, Mode::PROFILE_VELOCITY) => Targets {
            velocity: command as i32,
            ..targets
        },
        _ => targets,
    }
}

/// Writes what the inputs say into the image, `active` being those in the order of 0x60FD.
pub(crate) fn show(image: &mut Image<'_>, objects: &InputObjects, active: u32, signals: &Signals) {
    image.set(objects.active, active);
    image.set(objects.torque_off, u8::from(signals.torque_off));
    for (object, reading) in objects.analog.readings.iter().zip(signals.auxiliary_adc) {
        image.set(*object, reading as u16);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_stopped_otherwise_no_input_starts_again() {
        let mut word = Word::default();
        word.write(0x0F, Asked::default());
        word.hold();
        for set in [HALT, 0, START, 0] {
            let asked = Asked { clear: 0, set };
            word.ask(asked);
            assert_eq!(word.value() & (QUICK_STOP | ENABLE_OPERATION), 0);
        }
        word.write(0x0F, Asked::default());
        assert_eq!(word.value(), 0x0F);
    }

    #[test]
    fn what_an_input_has_cleared_the_master_must_write_anew() {
        let mut word = Word::default();
        word.write(0x0F, Asked::default());
        let stop = Asked {
            clear: QUICK_STOP,
            set: 0,
        };
        assert!(word.ask(stop));
        assert_eq!(word.value(), 0x0B);
        assert!(!word.ask(stop));
        assert!(!word.ask(Asked::default()), "nothing starts by itself");
        assert_eq!(word.value(), 0x0B);
        word.write(0x0F, Asked::default());
        assert_eq!(word.value(), 0x0F);
        // A bit that is set follows its input.
        let halt = Asked {
            clear: 0,
            set: HALT,
        };
        assert!(word.ask(halt));
        assert_eq!(word.value(), 0x10F);
        assert!(word.ask(Asked::default()));
        assert_eq!(word.value(), 0x0F);
    }
}
