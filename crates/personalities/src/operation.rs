//! How a master brings a drive into operation and moves it, by the drive's own document.

use crate::Setting;

/// What a master must know of a drive to move it.
#[derive(Clone, Copy, Debug)]
pub struct Operation {
    /// Written before the first start: what is not so by itself. Objects of the first axis's window stand
    /// for those of each axis.
    pub prepare: &'static [Setting],
    /// How an axis is enabled.
    pub machine: Machine,
    /// How it is moved; each with figures to try it with.
    pub ways: &'static [Way],
}

/// How an axis is enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// By CiA 402's state machine, one transition with each write of 0x6040.
    Standard,
    /// By the same, reset and command in one write.
    Short,
    /// There is none: a mode is in force once it is written.
    None,
}

/// A mode of operation and what moves the axis in it.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// What is written to 0x6060.
    pub mode: i8,
    /// Index of the target, of the first axis.
    pub target: u16,
    /// Index of the actual value, of the first axis.
    pub actual: u16,
    /// What the target is.
    pub kind: WayKind,
}

/// What a target is, in which unit, and how much of it to try.
#[derive(Clone, Copy, Debug)]
pub enum WayKind {
    /// A position that is gone to.
    Position {
        /// Units of a turn.
        per_turn: f64,
        /// Whether the target is handed over with bit 4 of the controlword; if not, it counts when it is
        /// written.
        handshake: bool,
        /// How near is there.
        window: f64,
        /// Turns to try.
        turns: f64,
    },
    /// A position that is followed at once: a stream of them.
    Stream {
        /// Units of a turn.
        per_turn: f64,
        /// How near is there.
        window: f64,
        /// Turns to try.
        turns: f64,
    },
    /// A velocity.
    Velocity {
        /// Units of a revolution per minute.
        per_rpm: f64,
        /// Revolutions per minute to try.
        rpm: f64,
    },
    /// A torque, or the current for it, against a shaft that is held.
    Torque {
        /// The target to try.
        value: f64,
        /// How near is there.
        window: f64,
    },
}

/// Profile position, velocity and torque of CiA 402 with the objects and units of the P3s.
pub(crate) const P3_WAYS: &[Way] = &[
    Way {
        mode: 1,
        target: 0x607A,
        actual: 0x6064,
        kind: WayKind::Position {
            per_turn: 4096.0,
            handshake: true,
            window: 20.0,
            turns: 10.0,
        },
    },
    Way {
        mode: 3,
        target: 0x60FF,
        actual: 0x606C,
        kind: WayKind::Velocity {
            per_rpm: 4096.0 / 60.0,
            rpm: 3000.0,
        },
    },
    Way {
        mode: 4,
        target: 0x6071,
        actual: 0x6077,
        kind: WayKind::Torque {
            value: 500.0,
            window: 20.0,
        },
    },
];

/// Profile velocity and acceleration of the P3s, counts/s and counts/s².
pub(crate) const P3_PROFILE: &[Setting] = &[
    setting(0x6081, &400_000_i32.to_le_bytes()),
    setting(0x6083, &10_000_000_u32.to_le_bytes()),
    setting(0x6084, &10_000_000_u32.to_le_bytes()),
];

/// A setting of an object without sub-indices.
pub(crate) const fn setting(index: u16, bytes: &'static [u8]) -> Setting {
    Setting {
        object: canopen::Address::new(index, 0),
        bytes,
    }
}
