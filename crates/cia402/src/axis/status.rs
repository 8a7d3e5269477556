//! What the axis shows of itself.

use crate::modes::{Bits, Limited};
use crate::{Axis, Conditions, Mode, State, Statusword};

impl Axis {
    /// The value of 0x6041.
    pub fn statusword(&self) -> Statusword {
        let flag = |bit: u16, on: bool| if on { bit } else { 0 };
        let bits = match (self.state, &self.stop) {
            (State::OperationEnabled, None) => self.motion.generator().bits(),
            // CiA 402: halted, bit 10 says that the axis stands.
            (State::OperationEnabled, Some(_)) => Bits {
                target_reached: self.halted,
                ..self.motion.generator().bits()
            },
            // CiA 402: with codes 5 to 8, at rest.
            (State::QuickStopActive, Some(stop)) => Bits {
                target_reached: stop.stopped(),
                specific: false,
            },
            _ => Bits::default(),
        };
        let following = self.state == State::OperationEnabled
            && matches!(self.mode, Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION)
            && self.watch.following();
        let homing_failed = self.state == State::OperationEnabled && self.homing_error().is_some();
        Statusword(
            self.state.pattern()
                | flag(Statusword::VOLTAGE, self.voltage)
                | flag(Statusword::WARNING, self.warning)
                | flag(Statusword::REMOTE, self.dialect.remote_bit)
                | flag(Statusword::TARGET_REACHED, bits.target_reached)
                | flag(Statusword::INTERNAL_LIMIT, self.conditions().limited())
                | flag(Statusword::MODE_12, bits.specific)
                | flag(Statusword::MODE_13, following || homing_failed),
        )
    }

    /// What the axis notices at present.
    pub fn conditions(&self) -> Conditions {
        let limited = match self.state {
            State::OperationEnabled if self.stop.is_none() => self.motion.generator().limited(),
            _ => Limited::default(),
        };
        let limits = Limited {
            torque: limited.torque || (self.is_powered() && self.limited),
            ..limited
        };
        Conditions {
            homing_failed: self.homing_error().is_some(),
            ..self.watch.conditions(limits)
        }
    }
}
