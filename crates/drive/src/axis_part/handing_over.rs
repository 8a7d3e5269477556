//! What an axis hands over: to its control half, and to the dictionary.

use canopen::Image;
use cia402::Statusword;
use control::{Command, Limits, Parameters};
use personalities::own::OwnBehaviour;

use super::{AxisPart, Common};
use crate::captures::{CaptureOrder, News, homing_trigger};
use crate::command::{by_position, command, limits};
use crate::inputs;
use crate::parameters::read_parameters;
use crate::publish::publish;

impl AxisPart {
    /// A new command, if there is one.
    pub(crate) fn take_command<O: OwnBehaviour>(&mut self, own: &O) -> Option<Command<f32>> {
        core::mem::take(&mut self.new_command).then(|| {
            let command = command(
                self.demand(own),
                self.axis.mode(),
                &self.limited_configuration(),
                self.max_motor_velocity,
                &self.loops,
                self.feedback.bus_voltage_v,
            );
            let command = match own.integrates_velocity(self.number) {
                true => by_position(command, &self.feedback, &self.loops),
                false => command,
            };
            Command {
                current_limit: self.own_limit(own).unwrap_or(command.current_limit),
                ..command
            }
        })
    }

    /// Limits that changed while the demand goes on.
    pub(crate) fn take_limits<O: OwnBehaviour>(&mut self, own: &O) -> Option<Limits<f32>> {
        core::mem::take(&mut self.new_limits).then(|| {
            let limits = limits(
                self.demand(own),
                self.axis.mode(),
                &self.limited_configuration(),
                self.max_motor_velocity,
                &self.loops,
            );
            Limits {
                current_a: self.own_limit(own).unwrap_or(limits.current_a),
                ..limits
            }
        })
    }

    /// The greatest current of own behaviour's demand.
    fn own_limit<O: OwnBehaviour>(&self, own: &O) -> Option<f32> {
        own.demand(self.number)?;
        own.current_limit_a(self.number)
    }

    pub(crate) fn take_parameters<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
    ) -> Option<Parameters<f32>> {
        core::mem::take(&mut self.new_parameters).then_some(())?;
        // They were read without an error when they changed.
        read_parameters(image, self.its, common.hardware, self.direct)
            .ok()
            .map(|(parameters, _)| parameters)
    }

    pub(crate) fn take_position_shift(&mut self) -> Option<i32> {
        let shift = core::mem::take(&mut self.new_shift);
        (shift != 0).then_some(shift)
    }

    pub(crate) fn take_captures(&mut self, image: &Image<'_>) -> Option<CaptureOrder> {
        let news = core::mem::take(&mut self.new_captures);
        (news != News::default()).then(|| {
            let inputs = self.its.inputs.as_ref();
            let homing = self.axis.trigger().map(homing_trigger);
            CaptureOrder {
                inverted: inputs.map_or(0, |inputs| image.raw(inputs.inverted)),
                filter: inputs.map_or([0; 2], |inputs| {
                    inputs.filter_us.map(|object| {
                        let ns = image.raw(object).saturating_mul(1000);
                        let periods = self.loops.timing.control_periods(ns);
                        u16::try_from(periods).unwrap_or(u16::MAX)
                    })
                }),
                triggers: [
                    homing.filter(|_| news.has(News::HOMING)),
                    news.has(News::PROBE_1).then(|| self.probes.trigger(0)),
                    news.has(News::PROBE_2).then(|| self.probes.trigger(1)),
                ],
            }
        })
    }

    /// Writes what the drive shows into the image.
    pub(crate) fn publish(&mut self, image: &mut Image<'_>) {
        publish(
            image,
            &self.its.objects,
            &self.axis,
            &self.feedback,
            &self.signals,
            self.loops.pm_per_ampere,
            self.configuration.vl.counts_per_s,
        );
        if let Some(homing) = &self.its.objects.homing {
            image.set(homing.is_homed, u8::from(self.axis.is_homed()));
            if let Some(search) = &homing.search {
                let error = self.axis.homing_error();
                image.set(search.error, error.map_or(0, cia402::HomingError::number));
            }
        }
        if let Some(inputs) = &self.its.inputs {
            inputs::show(image, inputs, self.seen.active, &self.signals);
            if self.signals.torque_off
                && let Some(statusword) = self.its.objects.statusword
            {
                let status = self.axis.statusword().0 | Statusword::TORQUE_OFF;
                image.set(statusword, status);
            }
            self.probes.publish(image, &inputs.probes, &self.seen);
        }
    }
}
