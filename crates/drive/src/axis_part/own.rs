//! The seam to what only one documented drive does.

use canopen::Image;
use cia402::Statusword;
use control::io::Magnet;
use personalities::own::{AxisView, Orders, OwnBehaviour};

use super::{AxisPart, Common};
use crate::Hardware;

/// Controlwords that lead from switch on disabled to operation enabled, and back (CiA 402).
const SHUTDOWN: u16 = 0x06;
const ENABLE_OPERATION: u16 = 0x0F;
const DISABLE_VOLTAGE: u16 = 0x00;

impl AxisPart {
    /// What own behaviour sees.
    pub(crate) fn view(&self, hardware: &Hardware) -> AxisView {
        let feedback = &self.feedback;
        let per_ampere = self.loops.pm_per_ampere;
        let Statusword(statusword) = self.axis.statusword();
        AxisView {
            axis: self.number,
            state: self.axis.state(),
            mode: self.axis.mode(),
            statusword,
            has_fault: self.faults.has_fault(),
            position: feedback.position,
            position_demand: feedback.demand_position,
            velocity: feedback.velocity_reported,
            velocity_demand: feedback.demand_velocity,
            torque_pm: feedback.current_q_a * per_ampere,
            torque_demand_pm: feedback.demand_current_a * per_ampere,
            current_a: [feedback.current_d_a, feedback.current_q_a],
            voltage_v: feedback.voltage_v,
            electrical_angle: (feedback.electrical_angle >> 16) as i16,
            encoder: feedback.encoder,
            counts_per_turn: self.loops.counts_per_turn,
            bus_voltage_v: feedback.bus_voltage_v,
            amplifier_temperature_c: feedback.temperature_c,
            motor_temperature_c: self.motor_temperature_c(hardware),
            overcurrent: feedback.overcurrent,
            encoder_valid: feedback.encoder_valid,
            current_limited: feedback.current_limited,
            velocity_limited: feedback.velocity_limited,
            i2t_active: feedback.i2t_active,
            conditions: self.axis.conditions(),
            phase_adc: feedback.phase_adc,
            phase_adc_zero: hardware.scales.current_zero,
            magnet_is_good: self.signals.magnet == Magnet::Good,
            output_encoder: self.signals.output_encoder,
        }
    }

    /// Of the motor's winding, as its sensor tells, °C.
    pub(crate) fn motor_temperature_c(&self, hardware: &Hardware) -> f32 {
        let scales = &hardware.scales;
        self.signals.motor_temperature_adc * scales.motor_temperature_k
            + scales.motor_temperature_zero_c
    }

    /// Carries out what own behaviour wants of this axis. What is to be stored is the drive's business.
    pub(crate) fn obey<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        orders: &Orders,
    ) {
        if *orders == Orders::default() {
            return;
        }
        if let Some(position) = orders.preset_position {
            self.preset_position(position);
        }
        if let Some(mode) = orders.mode {
            // What cannot be now stays as it was.
            let _ = self.write_mode(common, image, mode);
        }
        match orders.enable {
            Some(true) => {
                self.write_controlword(common, image, SHUTDOWN);
                self.write_controlword(common, image, ENABLE_OPERATION);
            }
            Some(false) => {
                self.write_controlword(common, image, DISABLE_VOLTAGE);
            }
            None => {}
        }
        if let Some(word) = orders.controlword {
            self.write_controlword(common, image, word);
        }
        if orders.reset_faults {
            self.faults.reset(self.personality.faults);
        }
        self.new_command |= orders.new_demand;
        if orders.new_parameters {
            self.configure_loops(common, image);
            self.configure(common.own, image);
        }
        if orders.new_targets {
            self.take_targets(common, image, |_| true);
            self.take_demand();
        }
    }
}
