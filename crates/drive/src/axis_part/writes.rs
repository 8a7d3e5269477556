//! What a write to an object means to its axis.

use canopen::{Abort, Address, Image, Verdict};
use cia402::{Demand, HomingMethod, ModeRefused};
use personalities::own::OwnBehaviour;

use super::{AxisPart, Common};
use crate::configuration::JERK_LIMITED;
use crate::gains::GainWrite;
use crate::probes;

impl AxisPart {
    /// What a write to an object that asks means; `None` if it is not the axis's.
    pub(crate) fn write<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        object: Address,
        raw: u32,
    ) -> Option<Verdict> {
        if self.its.presets_position == Some(object) {
            self.preset_position(raw as i32);
            return Some(Verdict::Done);
        }
        if self.its.motor.electrical_polarity_at == Some(object) {
            return Some(match raw as i8 {
                0 => Verdict::Refuse(Abort::INVALID_VALUE),
                _ => Verdict::Accept,
            });
        }
        if let Some(verdict) = self.write_gain(image, object, raw) {
            return Some(verdict);
        }
        let objects = &self.its.objects;
        if objects.targets.interpolation_data == Some(object) {
            return Some(self.write_interpolation_data(common, image, raw as i32));
        }
        if objects.targets.interpolation_clear == Some(object) {
            self.axis.clear_buffer(raw != 0);
            return Some(Verdict::Done);
        }
        if objects.targets.voltage_d.is_some_and(|at| at.0 == object)
            || objects.targets.voltage_q.is_some_and(|at| at.0 == object)
        {
            return Some(match self.demand(common.own) {
                Demand::PhaseVoltage { .. } => Verdict::Accept,
                _ => Verdict::Refuse(Abort::DEVICE_STATE),
            });
        }
        Some(
            match (object.index.wrapping_sub(objects.base), object.sub) {
                (0x40, 0) => self.write_controlword(common, image, raw as u16),
                (0x60, 0) => self.write_mode(common, image, raw as i8),
                (0x7E, 0) => self.write_polarity(common.own, raw as i8),
                (0xB8, 0) if !probes::is_supported(raw as u16) => {
                    Verdict::Refuse(Abort::INVALID_VALUE)
                }
                (0xB8, 0) => Verdict::Accept,
                (0x86, 0) if matches!(i64::from(raw as i16), 0 | JERK_LIMITED) => Verdict::Accept,
                (0x86, 0) => Verdict::Refuse(Abort::INVALID_VALUE),
                // P48: an angle only where one is used.
                (0xEA, 0) => match self.demand(common.own) {
                    Demand::TorqueWithAngle { .. } | Demand::PhaseVoltage { .. } => Verdict::Accept,
                    _ => Verdict::Refuse(Abort::DEVICE_STATE),
                },
                (0x98, 0) => self.write_homing_method(raw as i8),
                _ => return None,
            },
        )
    }

    /// The actual position gets another name, counts.
    pub(super) fn preset_position(&mut self, position: i32) {
        let shift = position.wrapping_sub(self.feedback.position);
        self.axis.preset_position(shift);
        self.rename(shift);
    }

    pub(super) fn write_controlword<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        word: u16,
    ) -> Verdict {
        if common.is_stopped {
            return Verdict::Refuse(Abort::DEVICE_STATE);
        }
        let asked = self.asked(image);
        self.word.write(word, asked);
        self.pass_controlword(common, image);
        Verdict::Accept
    }

    /// The axis gets the master's controlword as inputs leave it.
    pub(super) fn pass_controlword<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
    ) {
        let word = self.word.value();
        // A limit or rate that came in the same RPDO counts already.
        if word != self.axis.controlword().0 {
            self.configuration = self.read_configuration(common.own, image);
        }
        let targets = self.targets(common.own, image);
        let actual = self.actual(common.own);
        let outcome = self
            .axis
            .write_controlword(word, &self.configuration, &targets, &actual);
        if outcome.fault_reset {
            self.faults.reset(self.personality.faults);
            if self.faults.has_fault() {
                // A critical one.
                self.axis.fault();
            }
        }
        self.take_demand();
    }

    pub(super) fn write_mode<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        mode: i8,
    ) -> Verdict {
        let targets = self.targets(common.own, image);
        let actual = self.actual(common.own);
        let result = self
            .axis
            .write_mode(mode, &self.configuration, &targets, &actual);
        self.take_demand();
        match result {
            Ok(()) => Verdict::Accept,
            Err(ModeRefused::Unsupported(_)) => Verdict::Refuse(Abort::INVALID_VALUE),
            Err(ModeRefused::NotNow(_)) => Verdict::Refuse(Abort::DEVICE_STATE),
        }
    }

    /// A set-point for the buffer: refused while that is full or closed, and in other modes.
    fn write_interpolation_data<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        position: i32,
    ) -> Verdict {
        let targets = self.targets(common.own, image);
        let actual = self.actual(common.own);
        let taken = self
            .axis
            .push_set_point(position, &self.configuration, &targets, &actual);
        if taken {
            Verdict::Accept
        } else {
            Verdict::Refuse(Abort::DEVICE_STATE)
        }
    }

    /// A change of direction under power would turn the demand round.
    fn write_polarity<O: OwnBehaviour>(&self, own: &O, polarity: i8) -> Verdict {
        match polarity {
            1 | -1 if self.is_powered(own) => Verdict::Refuse(Abort::DEVICE_STATE),
            1 | -1 => Verdict::Accept,
            _ => Verdict::Refuse(Abort::INVALID_VALUE),
        }
    }

    /// Numbers that are reserved are no methods.
    fn write_homing_method(&self, number: i8) -> Verdict {
        match HomingMethod::new(number) {
            Some(_) => Verdict::Accept,
            None => Verdict::Refuse(Abort::INVALID_VALUE),
        }
    }

    fn write_gain(&mut self, image: &Image<'_>, object: Address, new: u32) -> Option<Verdict> {
        let gains = &self.its.amplifier.gains;
        let write = self.direct.written(image, gains, object, new)?;
        Some(match write {
            GainWrite::NoGain => Verdict::Refuse(Abort::INVALID_VALUE),
            GainWrite::NoBandwidth => Verdict::Refuse(Abort::DEVICE_STATE),
            GainWrite::ByRule | GainWrite::Direct => Verdict::Accept,
        })
    }
}
