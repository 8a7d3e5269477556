//! Parts of a drive's board that no loop asks: what they say, and what they show.

use core::fmt;

use control::io::Magnet;

/// What these parts say, as whoever carries the drive reads them for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Board {
    /// The chip between the PWM timer and the bridge's switches.
    pub gate_driver: GateDriver,
    /// What an encoder on the output of a gear says of its magnet, if one is there and answers.
    pub output_magnet: Option<Magnet>,
}

/// What a gate driver says over wires of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateDriver {
    /// Its fault pin is pulled low.
    pub fault_pin: bool,
    /// Its status register, as its serial interface gives it. If nobody drives the wire, all bits are
    /// ones.
    pub status: u16,
    /// A control register whose value is known, likewise.
    pub control: u16,
}

/// What the lights of a board do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lights {
    /// The green one.
    pub green: Light,
    /// The red one.
    pub red: Light,
}

impl Lights {
    /// Those of a drive that is well.
    pub const WELL: Lights = Lights {
        green: Light::Blinks { per_s: 1 },
        red: Light::Off,
    };
}

/// What a light does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// It is dark.
    Off,
    /// It shines.
    On,
    /// It shines so many times a second.
    Blinks {
        /// Times a second.
        per_s: u8,
    },
}

impl fmt::Display for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Light::Off => f.write_str("off"),
            Light::On => f.write_str("on"),
            Light::Blinks { per_s: 1 } => f.write_str("blinks once a second"),
            Light::Blinks { per_s } => write!(f, "blinks {per_s} times a second"),
        }
    }
}

impl fmt::Display for Lights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.green == self.red {
            return write!(f, "green and red LED: {}", self.green);
        }
        write!(f, "green LED: {}, red LED: {}", self.green, self.red)
    }
}
