//! What can be done to a world while it runs.

use control::Real;

use super::{Plant, winding_of};
use crate::switches::SwitchName;
use crate::{EncoderFault, Link, Load, Phase, Short};

impl<R: Real> Plant<R> {
    /// Sets the motor supply's open-circuit voltage, V; 0 (or less) disconnects it. The sensors stay
    /// alive.
    pub fn set_supply_v(&mut self, voltage_v: R) {
        self.supply.set_voltage_v(voltage_v);
    }

    /// Changes what is between the motor supply and the bridge. The bus keeps its voltage, except that
    /// an ideal supply sets it.
    pub fn set_link(&mut self, link: &Link) {
        self.parameters.link = *link;
        self.supply.set_link(link, self.parameters.pwm_period_s);
        self.look_for_effects();
    }

    /// Sets the logic supply's open-circuit voltage, V; 0 is off.
    pub fn set_logic_supply_v(&mut self, voltage_v: f32) {
        self.parameters.logic.supply_v = voltage_v;
        self.logic_works = self.parameters.logic.is_enough();
    }

    /// Whether the processor has its supply. Without, it runs no loops, hears nothing, and boots anew
    /// when the supply returns; that is up to whoever runs it.
    #[inline]
    pub fn logic_powered(&self) -> bool {
        self.logic_works
    }

    /// Opens the wire of a phase, or mends it.
    pub fn set_open_phase(&mut self, phase: Phase, open: bool) {
        self.wiring.set_open(phase, open);
        self.look_for_effects();
    }

    /// Puts a short circuit at the motor's wires, or takes it away.
    pub fn set_short(&mut self, short: Option<Short>) {
        self.wiring.set_short(short);
        self.look_for_effects();
    }

    /// Puts a fault into the encoder, or takes it out. One that sticks shows what it reads now.
    pub fn set_encoder_fault(&mut self, fault: EncoderFault) {
        let sensed = self.sensed();
        self.sensors.set_encoder_fault(fault, &sensed);
    }

    /// Sets the part of the encoder's answers with a wrong check sum, 0 to 1.
    pub fn set_bad_answers(&mut self, part: R) {
        self.sensors.reader().set_bad_answers(part);
    }

    /// Moves the encoder's magnet to a distance from its sensor, mm; see [`crate::field_at`].
    pub fn set_magnet_mm(&mut self, distance_mm: f32) {
        self.sensors.reader().set_magnet_mm(distance_mm);
    }

    /// Turns the encoder's magnet on the shaft by an angle, 2³² a turn: the electrical zero is
    /// elsewhere from now on.
    pub fn slip_magnet(&mut self, angle: R::Count) {
        self.sensors.reader().slip(angle);
    }

    /// Lets the encoder count the other way round (its direction bit): a turn of N counts reads N less
    /// what it was; or as it was made.
    pub fn set_encoder_turned(&mut self, turned: bool) {
        self.sensors.reader().set_turned(turned);
    }

    /// The same of the encoder on the output, if there is one.
    pub fn set_output_encoder_turned(&mut self, turned: bool) {
        if let Some(encoder) = &mut self.parameters.output_encoder
            && turned != self.output_turned
        {
            self.output_turned = turned;
            *encoder = encoder.turned();
        }
    }

    /// Takes off the cable of the encoder on the output, or puts it on.
    pub fn set_output_encoder_silent(&mut self, silent: bool) {
        if let Some(encoder) = &mut self.parameters.output_encoder {
            encoder.silent = silent;
        }
    }

    /// Moves the magnet of the encoder on the output to a distance from its sensor, mm.
    pub fn set_output_magnet_mm(&mut self, distance_mm: f32) {
        if let Some(encoder) = &mut self.parameters.output_encoder {
            encoder.magnet_mm = distance_mm;
        }
    }

    /// Sets the voltage with which the gate drivers drive, V; `None` is the 12 V that it should be. Below
    /// 8 V they open the bridge and say so, from 8.5 V on they drive again.
    pub fn set_gate_supply_v(&mut self, voltage_v: Option<f32>) {
        self.gate_driver.set_supply_v(voltage_v);
        self.obey_gate_driver();
    }

    /// Sets the temperature of the gate drivers, °C; `None` is that of a cool board. From 170 °C on they
    /// open the bridge and say so, below 150 °C they drive again.
    pub fn set_gate_driver_temperature_c(&mut self, temperature_c: Option<f32>) {
        self.gate_driver.set_temperature_c(temperature_c);
        self.obey_gate_driver();
    }

    /// Gate drivers that cannot drive open the bridge by themselves, also while no command comes.
    fn obey_gate_driver(&mut self) {
        if !self.gate_driver.drives() {
            self.inverter.open();
        }
    }

    /// Cuts the gate drivers' serial interface, or mends it. They drive all the same.
    pub fn set_gate_driver_silent(&mut self, silent: bool) {
        self.gate_driver.set_silent(silent);
    }

    /// Starts the sensors' noise anew from a seed, which may be another for each drive of a batch.
    pub fn set_noise_seed(&mut self, seed: R::Count) {
        self.sensors.set_noise_seed(seed);
    }

    /// Sets the torque of the load, Nm; positive opposes positive rotation.
    pub fn set_load_torque_nm(&mut self, torque_nm: R) {
        self.mechanics.set_load_torque_nm(torque_nm);
    }

    /// Changes what hangs on the shaft, which keeps its position and speed.
    pub fn set_load(&mut self, load: &Load) {
        self.parameters.load = *load;
        let (motor, period_s) = (&self.parameters.motor, self.parameters.pwm_period_s);
        self.mechanics.set_period_s(motor, load, period_s);
    }

    /// Blocks the shaft where it is, or frees it.
    pub fn set_blocked(&mut self, blocked: R::Mask) {
        self.mechanics.set_blocked(blocked);
    }

    /// Puts shaft and load at an angle (2³² per turn, turn zero) with a speed, rad/s.
    pub fn set_motion(&mut self, angle: R::Count, speed_rad_s: R) {
        self.mechanics.set_motion(angle, speed_rad_s);
        self.align_rotor();
        self.torque = self.winding.torque_nm(self.current, self.rotor);
    }

    /// Heats or cools the amplifier to a temperature, °C, from which it goes on toward what its losses
    /// and the surroundings make of it. An undefined value changes nothing.
    pub fn set_amplifier_temperature_c(&mut self, temperature_c: R) {
        self.heat.set_amplifier(temperature_c);
    }

    /// Heats or cools the motor, winding and housing, to a temperature, °C; likewise.
    pub fn set_motor_temperature_c(&mut self, temperature_c: R) {
        self.heat.set_motor(temperature_c);
        if !self.heat.is_off() {
            self.adopt_temperatures();
        }
    }

    /// Sets the temperature of the surroundings, °C. An undefined value changes nothing. Without
    /// [`crate::Parameters::thermal`] nothing warms or cools to it.
    pub fn set_ambient_c(&mut self, temperature_c: R) {
        self.heat.set_ambient(temperature_c);
    }

    /// Sets the levels of the inputs to which no switch is connected, in the order of
    /// [`control::io::Signals::inputs`].
    pub fn set_inputs(&mut self, levels: u32) {
        self.board.set_inputs(levels);
    }

    /// Presses a switch (`true`), holds it released (`false`), or leaves it to the load again
    /// (`None`). One that is not connected stays so.
    pub fn hold_switch(&mut self, name: SwitchName, held: Option<bool>) {
        self.board.hold(name, held);
    }

    /// Sets the voltages at the analog inputs 1 and 2, V, of which they show 0 to 3.3; an undefined
    /// one reads 0.
    pub fn set_auxiliary_v(&mut self, volts: [f32; 2]) {
        self.board.set_auxiliary_v(volts);
    }

    /// Asks for safe torque off, or no longer.
    pub fn set_torque_off(&mut self, asked: bool) {
        self.board.set_torque_off(asked);
    }

    /// Sets the dead time that the PWM timer makes, s (the P3's 0x3001,2), 0 to 1 ms; at first 0. What
    /// drivers and switches add to it by themselves is [`crate::Bridge::dead_time_s`].
    pub fn set_timer_dead_time_s(&mut self, dead_time_s: f64) {
        let dead_time_s = if dead_time_s > 0.0 { dead_time_s } else { 0.0 };
        self.timer_dead_time_s = if dead_time_s < 1e-3 {
            dead_time_s
        } else {
            1e-3
        };
        self.look_for_effects();
    }

    /// Lets the timer take duties by so many PWM periods later than
    /// [`crate::Parameters::load_delay_periods`] says, from the next command on; at first 0.
    pub fn set_late_periods(&mut self, periods: u8) {
        let delay = self.parameters.load_delay_periods.saturating_add(periods);
        self.inverter.set_delay_periods(delay);
    }

    /// Changes the PWM period, s, between two steps (the P3's 0x3001,1). Motion and currents go on.
    /// The period is held between 1 µs and 1 ms.
    pub fn set_pwm_period_s(&mut self, period_s: f64) {
        let period_s = if period_s > 1e-6 { period_s } else { 1e-6 };
        let period_s = if period_s < 1e-3 { period_s } else { 1e-3 };
        let before_s = core::mem::replace(&mut self.parameters.pwm_period_s, period_s);
        self.board.set_period_s(before_s, period_s, self.periods);
        let (motor, load) = (&self.parameters.motor, &self.parameters.load);
        self.mechanics.set_period_s(motor, load, period_s);
        self.winding = winding_of(&self.parameters);
        self.set_heat();
        self.look_for_effects();
        self.supply.set_link(&self.parameters.link, period_s);
        self.sensors.set_period_s(&self.parameters);
    }
}
