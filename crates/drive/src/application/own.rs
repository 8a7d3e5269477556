//! The seam to what only one documented drive does.

use canopen::{Address, Image, Verdict};
use cia402::Statusword;
use personalities::own::{AxisView, Orders, OwnBehaviour};

use super::Application;

/// Controlwords that lead from switch on disabled to operation enabled, and back (CiA 402).
const SHUTDOWN: u16 = 0x06;
const ENABLE_OPERATION: u16 = 0x0F;
const DISABLE_VOLTAGE: u16 = 0x00;

impl<O: OwnBehaviour> Application<O> {
    /// What own behaviour sees.
    pub(crate) fn view(&self) -> AxisView {
        let feedback = &self.feedback;
        let per_ampere = self.loops.pm_per_ampere;
        let Statusword(statusword) = self.axis.statusword();
        AxisView {
            axis: 0,
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
            motor_temperature_c: self.motor_temperature_c(),
            overcurrent: feedback.overcurrent,
            encoder_valid: feedback.encoder_valid,
            current_limited: feedback.current_limited,
            velocity_limited: feedback.velocity_limited,
            i2t_active: feedback.i2t_active,
        }
    }

    /// Of the motor's winding, as its sensor tells, °C.
    pub(crate) fn motor_temperature_c(&self) -> f32 {
        let scales = &self.hardware.scales;
        self.signals.motor_temperature_adc * scales.motor_temperature_k
            + scales.motor_temperature_zero_c
    }

    /// What a write means to own behaviour, if anything.
    pub(super) fn write_own(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
    ) -> Option<Verdict> {
        let mut orders = Orders::default();
        let view = self.view();
        let verdict = self.own.write(image, object, new, &view, &mut orders);
        self.obey(image, &orders);
        verdict
    }

    /// A millisecond of own behaviour.
    pub(crate) fn tick_own(&mut self, image: &mut Image<'_>) {
        let mut orders = Orders::default();
        let view = self.view();
        self.own.tick(image, &view, &mut orders);
        self.obey(image, &orders);
    }

    fn obey(&mut self, image: &Image<'_>, orders: &Orders) {
        if *orders == Orders::default() {
            return;
        }
        if let Some(position) = orders.preset_position {
            self.preset_position(position);
        }
        if let Some(mode) = orders.mode {
            // What cannot be now stays as it was.
            let _ = self.write_mode(image, mode);
        }
        match orders.enable {
            Some(true) => {
                self.write_controlword(image, SHUTDOWN);
                self.write_controlword(image, ENABLE_OPERATION);
            }
            Some(false) => {
                self.write_controlword(image, DISABLE_VOLTAGE);
            }
            None => {}
        }
        if let Some(word) = orders.controlword {
            self.write_controlword(image, word);
        }
        if orders.reset_faults {
            self.faults.reset();
        }
        self.new_command |= orders.new_demand;
        if orders.new_parameters {
            self.configure_loops(image);
            self.configure(image);
        }
        if orders.store.is_some() {
            self.storage_request = orders.store;
            self.restores = false;
        }
    }
}
