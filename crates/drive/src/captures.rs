//! From the axis's triggers to the control half's captures, and back.

use cia402::{Captured, Edge, HomingInputs, Switch};
use control::capture::{LATCHES, Seen, Trigger};

/// Bits of 0x60FD.
pub(crate) const NEGATIVE_LIMIT: u32 = 1 << 0;
pub(crate) const POSITIVE_LIMIT: u32 = 1 << 1;
pub(crate) const HOME: u32 = 1 << 2;

/// What the control half's captures shall do from now on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CaptureOrder {
    /// The inputs that are active when low.
    pub inverted: u32,
    /// For how long switches, and general inputs, must keep a new level, control periods.
    pub filter: [u16; 2],
    /// New triggers; `None`: as it was.
    pub triggers: [Option<Trigger>; LATCHES],
}

/// What of the captures has changed. The latches are those of homing, probe 1 and probe 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct News(u8);

impl News {
    pub(crate) const INVERTED: News = News(1 << 0);
    pub(crate) const HOMING: News = News(1 << 1);
    pub(crate) const PROBE_1: News = News(1 << 2);
    pub(crate) const PROBE_2: News = News(1 << 3);

    pub(crate) fn add(&mut self, other: News) {
        self.0 |= other.0;
    }

    pub(crate) fn has(self, other: News) -> bool {
        self.0 & other.0 != 0
    }
}

/// What homing asks to be captured.
pub(crate) fn homing_trigger(trigger: cia402::Trigger) -> Trigger {
    let (inputs, edge) = match trigger.edge {
        Some((Switch::NegativeLimit, edge)) => (NEGATIVE_LIMIT, Some(edge)),
        Some((Switch::PositiveLimit, edge)) => (POSITIVE_LIMIT, Some(edge)),
        Some((Switch::Home, edge)) => (HOME, Some(edge)),
        None => (0, None),
    };
    Trigger {
        inputs,
        rising: edge == Some(Edge::Rising),
        falling: edge == Some(Edge::Falling),
        index: trigger.index,
        continuous: false,
        serial: trigger.serial,
    }
}

/// What homing sees.
pub(crate) fn homing_inputs(seen: &Seen) -> HomingInputs {
    let [latched, ..] = seen.latches;
    let active = seen.active;
    let edge = if latched.rising_count > 0 {
        Some(latched.rising)
    } else if latched.falling_count > 0 {
        Some(latched.falling)
    } else {
        None
    };
    HomingInputs {
        negative_limit: active & NEGATIVE_LIMIT != 0,
        positive_limit: active & POSITIVE_LIMIT != 0,
        home: active & HOME != 0,
        captured: Captured {
            serial: latched.serial,
            edge,
            index: (latched.index_count > 0).then_some(latched.index),
        },
    }
}
