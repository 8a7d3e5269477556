//! What a write to an object means to the drive.

use canopen::{Abort, Address, Image, NodeId, Verdict, store};
use cia402::{Demand, HomingMethod, ModeRefused};
use personalities::own::OwnBehaviour;

use super::Application;
use crate::configuration::JERK_LIMITED;
use crate::gains::{GainWrite, stored_together};
use crate::probes;

impl<O: OwnBehaviour> Application<O> {
    /// What a write to an object that asks means.
    pub(crate) fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        if let Some(verdict) = self.write_own(image, object, new) {
            return verdict;
        }
        let mut raw = [0; 4];
        for (place, byte) in raw.iter_mut().zip(new) {
            *place = *byte;
        }
        let raw = u32::from_le_bytes(raw);
        if self.personality.presets_position == Some(object) {
            self.preset_position(raw as i32);
            return Verdict::Done;
        }
        if self
            .personality
            .node_id
            .is_some_and(|own| own.at_once && own.address == object)
        {
            // Its row has judged the range.
            self.new_node_id = NodeId::new(raw as u8);
            return Verdict::Accept;
        }
        if object == self.personality.motor.electrical_polarity_at {
            return match raw as i8 {
                0 => Verdict::Refuse(Abort::INVALID_VALUE),
                _ => Verdict::Accept,
            };
        }
        if let Some(verdict) = self.write_gain(image, object, raw) {
            return verdict;
        }
        let objects = &self.personality.axis;
        if objects.targets.interpolation_data == Some(object) {
            return self.write_interpolation_data(image, raw as i32);
        }
        if objects.targets.interpolation_clear == Some(object) {
            self.axis.clear_buffer(raw != 0);
            return Verdict::Done;
        }
        if objects.targets.voltage_d.is_some_and(|at| at.0 == object)
            || objects.targets.voltage_q.is_some_and(|at| at.0 == object)
        {
            return match self.demand() {
                Demand::PhaseVoltage { .. } => Verdict::Accept,
                _ => Verdict::Refuse(Abort::DEVICE_STATE),
            };
        }
        match (object.index.wrapping_sub(objects.base), object.sub) {
            (0x40, 0) => return self.write_controlword(image, raw as u16),
            (0x60, 0) => return self.write_mode(image, raw as i8),
            (0x7E, 0) => return self.write_polarity(raw as i8),
            (0xB8, 0) if !probes::is_supported(raw as u16) => {
                return Verdict::Refuse(Abort::INVALID_VALUE);
            }
            (0xB8, 0) => return Verdict::Accept,
            (0x86, 0) if matches!(i64::from(raw as i16), 0 | JERK_LIMITED) => {
                return Verdict::Accept;
            }
            (0x86, 0) => return Verdict::Refuse(Abort::INVALID_VALUE),
            // P48: an angle only where one is used.
            (0xEA, 0) => {
                return match self.demand() {
                    Demand::TorqueWithAngle { .. } | Demand::PhaseVoltage { .. } => Verdict::Accept,
                    _ => Verdict::Refuse(Abort::DEVICE_STATE),
                };
            }
            (0x98, 0) => return self.write_homing_method(raw as i8),
            _ => {}
        }
        match object.index {
            0x1010 => self.write_store(object, raw),
            0x1011 => match store::Request::from_restore(object.sub, raw) {
                Ok(request) => {
                    self.storage_request = Some(request);
                    self.restores = true;
                    Verdict::Later
                }
                Err(abort) => Verdict::Refuse(abort),
            },
            _ => Verdict::Refuse(Abort::DEVICE_STATE),
        }
    }

    /// The actual position gets another name, counts.
    pub(super) fn preset_position(&mut self, position: i32) {
        let shift = position.wrapping_sub(self.feedback.position);
        self.axis.preset_position(shift);
        self.rename(shift);
    }

    pub(super) fn write_controlword(&mut self, image: &Image<'_>, word: u16) -> Verdict {
        if self.is_stopped {
            return Verdict::Refuse(Abort::DEVICE_STATE);
        }
        let asked = self.asked(image);
        self.word.write(word, asked);
        self.pass_controlword(image);
        Verdict::Accept
    }

    /// The axis gets the master's controlword as inputs leave it.
    pub(super) fn pass_controlword(&mut self, image: &Image<'_>) {
        let word = self.word.value();
        // A limit or rate that came in the same RPDO counts already.
        if word != self.axis.controlword().0 {
            self.configuration = self.read_configuration(image);
        }
        let targets = self.targets(image);
        let actual = self.actual();
        let outcome = self
            .axis
            .write_controlword(word, &self.configuration, &targets, &actual);
        if outcome.fault_reset {
            self.faults.reset();
            if self.faults.has_fault() {
                // A critical one.
                self.axis.fault();
            }
        }
        self.take_demand();
    }

    pub(super) fn write_mode(&mut self, image: &Image<'_>, mode: i8) -> Verdict {
        let targets = self.targets(image);
        let actual = self.actual();
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
    fn write_interpolation_data(&mut self, image: &Image<'_>, position: i32) -> Verdict {
        let targets = self.targets(image);
        let actual = self.actual();
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
    fn write_polarity(&self, polarity: i8) -> Verdict {
        match polarity {
            1 | -1 if self.is_powered() => Verdict::Refuse(Abort::DEVICE_STATE),
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

    fn write_store(&mut self, object: Address, value: u32) -> Verdict {
        let request = if self.personality.stores_single_entry == Some(object) {
            // P4: index << 8 | sub-index. Only an object that is stored at all can be saved.
            let address = Address::from_key(value);
            match address.filter(|address| store::is_stored(&self.table(), *address)) {
                Some(address) => {
                    let gains = &self.personality.amplifier.gains;
                    match stored_together(gains, address) {
                        Some((first, count)) => store::Request::Run { first, count },
                        None => store::Request::Single(address),
                    }
                }
                None => return Verdict::Refuse(Abort::CANNOT_STORE),
            }
        } else {
            match store::Request::from_write(object.sub, value) {
                Ok(request) => request,
                Err(abort) => return Verdict::Refuse(abort),
            }
        };
        self.storage_request = Some(request);
        self.restores = false;
        Verdict::Later
    }

    fn table(&self) -> canopen::Table {
        self.personality.device.table
    }

    fn write_gain(&mut self, image: &Image<'_>, object: Address, new: u32) -> Option<Verdict> {
        let gains = &self.personality.amplifier.gains;
        let write = self.direct.written(image, gains, object, new)?;
        Some(match write {
            GainWrite::NoGain => Verdict::Refuse(Abort::INVALID_VALUE),
            GainWrite::NoBandwidth => Verdict::Refuse(Abort::DEVICE_STATE),
            GainWrite::ByRule | GainWrite::Direct => Verdict::Accept,
        })
    }
}
