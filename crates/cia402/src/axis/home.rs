//! What homing makes of an axis: names for positions, triggers for captures, a limit of torque.

use super::Axis;
use crate::modes::{Homing, Motion};
use crate::{Configuration, HomingError, Trigger};

impl Axis {
    /// While homing runs, positions have no meaning; where it succeeds, they get one.
    pub(super) fn name_home(&mut self) {
        let Motion::Homing(homing) = &mut self.motion else {
            return;
        };
        self.homed &= !homing.is_running();
        if let Some(shift) = homing.take_shift() {
            self.preset_position(shift);
            self.shift = Some(self.shift.unwrap_or(0).wrapping_add(shift));
            self.homed = true;
        }
    }

    /// By how much all positions have become greater because home was attained, since the last call.
    /// The axis counts so already; the owner renames the position in the control half before it
    /// passes the next demand on.
    pub fn take_position_shift(&mut self) -> Option<i32> {
        self.shift.take()
    }

    /// What the control half shall capture for homing, if that changed since the last call.
    pub fn take_trigger(&mut self) -> Option<Trigger> {
        match &mut self.motion {
            Motion::Homing(homing) => homing.take_trigger(),
            _ => None,
        }
    }

    /// What the control half shall capture for homing, in mode 6.
    pub fn trigger(&self) -> Option<Trigger> {
        self.homing().map(Homing::trigger)
    }

    /// Whether homing has been done since the start, and not begun anew without success.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    pub(super) fn homing(&self) -> Option<&Homing> {
        match &self.motion {
            Motion::Homing(homing) => Some(homing),
            _ => None,
        }
    }

    /// Why homing has failed, in mode 6 until it is started again.
    pub fn homing_error(&self) -> Option<HomingError> {
        self.homing().and_then(Homing::error)
    }

    /// Greatest torque at present, per mille: that of the configuration, or less while the axis is to
    /// press against a hard stop.
    pub fn torque_limit_pm(&self, configuration: &Configuration) -> f32 {
        let stop = configuration.homing.stop_torque_pm;
        let presses = self.homing().is_some_and(Homing::presses);
        if presses && stop < configuration.max_torque_pm {
            stop
        } else {
            configuration.max_torque_pm
        }
    }
}
