//! From the axis's triggers to the control half's captures, and back.

use cia402::{Captured, Edge, HomingInputs, Switch};
use control::capture::{LATCHES, Seen, Trigger};

/// The latch that homing uses.
pub(crate) const HOMING: usize = 0;

/// Bits of 0x60FD.
pub(crate) const NEGATIVE_LIMIT: u32 = 1 << 0;
pub(crate) const POSITIVE_LIMIT: u32 = 1 << 1;
pub(crate) const HOME: u32 = 1 << 2;

/// What the control half's captures shall do from now on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CaptureOrder {
    /// The inputs that are active when low.
    pub inverted: u32,
    /// New triggers; `None`: as it was.
    pub triggers: [Option<Trigger>; LATCHES],
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
