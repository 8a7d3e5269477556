//! One drive's world, put together.

mod acts;
mod run;
mod shared;

use control::io::{Duty, Magnet, Sample, Signals};
use control::{Mask, Real, sin_cos};

use crate::diodes::{self, Pulled};
use crate::gate_driver::{GateDriver, GateDriverWords};
use crate::load::angle_and_turns;
use crate::switches::Board;
use crate::thermal::{Heat, Periods};
use crate::wiring::Wiring;
use crate::{Inverter, Mechanics, Parameters, Sensed, Sensors, Supply, Vector, Winding};

/// The world of one drive (or of a batch).
///
/// At every control boundary: [`Plant::sample`], compute, [`Plant::load`]; then [`Plant::run`] for the
/// PWM periods until the next boundary.
///
/// ```
/// use control::io::Duty;
/// use plant::{Parameters, Plant};
///
/// let mut plant = Plant::<f32>::new(&Parameters::default());
/// let sample = plant.sample();
/// assert_eq!(sample.encoder, 0x0DF8);
/// plant.load(&Duty { phase: [0.55, 0.5, 0.5], enabled: true });
/// plant.run(5);
/// assert!(plant.truth().phase_current_a[0] > 0.1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant<R: Real> {
    parameters: Parameters,
    supply: Supply<R>,
    inverter: Inverter<R>,
    winding: Winding<R>,
    mechanics: Mechanics<R>,
    sensors: Sensors<R>,
    wiring: Wiring,
    /// Ideal switches, supply, wires and sensors: the short way through a period.
    is_plain: bool,
    /// All of them ideal but for the dead time: the second shortest.
    has_dead_time_only: bool,
    is_sound: bool,
    logic_works: bool,
    has_dead_time: bool,
    /// The dead time that the PWM timer has been told, s.
    timer_dead_time_s: f64,
    /// The gate drivers have opened the bridge, until it is commanded off.
    tripped: R::Mask,
    overcurrent_square: R,
    gate_driver: GateDriver,
    /// The encoder on the output counts the other way round.
    output_turned: bool,
    bridge_current: R,
    /// What the bridge takes is added up with that of other axes: see [`Plant::step_axes`].
    leaves_supply: bool,
    electrical_turns: R::Count,
    heat: Heat<R>,
    current: Vector<R>,
    /// Unit vector along the magnet.
    rotor: Vector<R>,
    /// Periods until `rotor` is taken from the angle again.
    rotor_age: u8,
    torque: R,
    board: Board,
    /// PWM periods since the beginning, wrapping.
    periods: u32,
}

/// The rotor's direction is turned along from period to period and taken from the shaft's angle
/// after so many, long before rounding amounts to anything: a sine costs more than a turn.
const ROTOR_PERIODS: u8 = 8;

/// What really happens, for tests and plots. The drive never sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth<R: Real> {
    /// Shaft angle within the turn, 2³² per turn, wrapping at half a turn either side of zero.
    pub angle: R::Count,
    /// Whole turns: position in turns = `turns` + `angle` / 2³².
    pub turns: R::Count,
    /// Speed of the shaft, rad/s.
    pub speed_rad_s: R,
    /// Angle of the load; that of the shaft without a [`crate::Coupling`].
    pub load_angle: R::Count,
    /// Whole turns of the load.
    pub load_turns: R::Count,
    /// Speed of the load, rad/s.
    pub load_speed_rad_s: R,
    /// Current into phases A, B, C, A.
    pub phase_current_a: [R; 3],
    /// Electromotive force of phases A, B, C, V.
    pub phase_emf_v: [R; 3],
    /// Torque of the motor on the rotor, before friction, Nm.
    pub torque_nm: R,
    /// Voltage at the bridge, V.
    pub bus_voltage_v: R,
    /// Switches that the load (or somebody) pressed when [`Plant::signals`] was last asked: bit 0 the
    /// negative limit switch, 1 the positive, 2 the home switch; whatever their polarity.
    pub switches: u32,
    /// Current into the bridge, the mean of the last period, A; negative when the motor feeds it.
    /// 0 with [`crate::Link::IDEAL`], which does not look.
    pub bridge_current_a: R,
    /// Current out of the motor supply, the mean of the last period, A; likewise.
    pub supply_current_a: R,
    /// Current through the braking resistor, A.
    pub brake_current_a: R,
    /// Temperature of the motor's winding, °C.
    pub winding_c: R,
    /// Temperature of the motor's housing, °C.
    pub housing_c: R,
    /// Temperature of the amplifier, °C.
    pub amplifier_c: R,
}

impl Truth<f32> {
    /// Position of the load, turns.
    pub fn load_position_turns(&self) -> f64 {
        f64::from(self.load_turns) + f64::from(self.load_angle) / 4_294_967_296.0
    }

    /// Position of the shaft, turns.
    pub fn position_turns(&self) -> f64 {
        f64::from(self.turns) + f64::from(self.angle) / 4_294_967_296.0
    }
}

impl<R: Real> Plant<R> {
    /// A world at rest: shaft at its start, no current, all switches open. Parameters
    /// should pass [`Parameters::check`].
    pub fn new(parameters: &Parameters) -> Self {
        let (motor, period_s) = (&parameters.motor, parameters.pwm_period_s);
        let (angle, turns) = angle_and_turns(parameters.start_turns);
        let mut plant = Self {
            parameters: *parameters,
            supply: Supply::new(
                &parameters.link,
                period_s,
                R::splat(parameters.supply_v),
                R::splat(parameters.diode_drop_v),
            ),
            inverter: Inverter::new(parameters.load_delay_periods),
            winding: winding_of(parameters),
            mechanics: Mechanics::new(motor, &parameters.load, period_s),
            sensors: Sensors::new(parameters),
            wiring: Wiring::default(),
            is_plain: true,
            has_dead_time_only: false,
            is_sound: true,
            logic_works: parameters.logic.is_enough(),
            has_dead_time: false,
            timer_dead_time_s: 0.0,
            tripped: R::Mask::splat(false),
            overcurrent_square: overcurrent_square(parameters),
            gate_driver: GateDriver::sound(),
            output_turned: false,
            bridge_current: R::splat(0.0),
            leaves_supply: false,
            electrical_turns: R::count(motor.electrical_turns().into()),
            heat: Heat::new(R::splat(parameters.ambient_c)),
            current: Vector::zero(),
            rotor: Vector::zero(),
            rotor_age: 0,
            torque: R::splat(0.0),
            board: Board::new(&parameters.switches, way(angle, turns), period_s),
            periods: 0,
        };
        plant
            .mechanics
            .set_position(R::count(angle), R::count(turns));
        plant.set_heat();
        plant.look_for_effects();
        plant.align_rotor();
        plant
    }

    /// The parameters that this world was made of, with the PWM period as it is now. Supply, load
    /// torque and temperature may have been set otherwise since; see [`Plant::truth`].
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Commands a duty at a control boundary. It takes effect
    /// [`Parameters::load_delay_periods`] later, opening the bridge at once. Any value is safe: see
    /// [`Inverter::load`]. Without logic supply, or with gate drivers that cannot drive, the bridge
    /// opens. Switching it off ends a trip of the gate drivers.
    pub fn load(&mut self, duty: &Duty<R>) {
        let enabled =
            duty.enabled & R::Mask::splat(self.logic_powered() && self.gate_driver.drives());
        self.inverter.load(&Duty { enabled, ..*duty });
        self.tripped = self.tripped & enabled;
        self.sensors.advance();
    }

    /// Moves the world forward by one PWM period.
    #[inline]
    pub fn step(&mut self) {
        let speed = self.mechanics.period_speed_rad_s();
        let turning = self.winding.turning(speed);
        let shorted = self
            .winding
            .shorted(self.current, self.rotor, speed, turning);
        let gain = self.winding.gain_a_per_v();
        let enabled = self.inverter.enabled() & !self.tripped;
        if self.is_plain {
            let driven = shorted + self.inverter.voltage_v(self.supply.voltage_v()) * gain;
            self.current = driven;
            if (!enabled).any() {
                let open = diodes::conduct(shorted, self.supply.diode_threshold_v() * gain);
                self.current = Vector::select(enabled, driven, open);
            }
        } else if self.has_dead_time_only {
            self.conduct_with_dead_time(shorted, gain, enabled);
        } else {
            self.conduct_with_effects(shorted, gain);
        }
        let current = self.current;
        let square = current.alpha * current.alpha + current.beta * current.beta;
        self.tripped = self.tripped | (enabled & self.overcurrent_square.lt(square));
        self.inverter.end_period();

        self.mechanics.turn();
        self.rotor = self.rotor + self.rotor.times(turning);
        self.rotor_age += 1;
        if self.rotor_age >= ROTOR_PERIODS {
            self.align_rotor();
            if !self.heat.is_off() {
                self.warm(square, enabled, speed);
            }
        }
        self.torque = self.winding.torque_nm(self.current, self.rotor);
        self.mechanics.accelerate(self.torque);
        self.periods = self.periods.wrapping_add(1);
    }

    /// The current after a period with a dead time and else ideal. By itself, because the shortest way
    /// is slower with it inside.
    #[inline(never)]
    fn conduct_with_dead_time(&mut self, shorted: Vector<R>, gain: R, enabled: R::Mask) {
        let bus = self.supply.voltage_v();
        let driven = shorted + self.inverter.voltage_v(bus) * gain;
        let pull = gain * (bus + self.supply.diode_drops_v()) * self.inverter.dead_part();
        let driven = self.inverter.dead_time(self.current, driven, pull).current;
        self.current = driven;
        if (!enabled).any() {
            let open = diodes::conduct(shorted, self.supply.diode_threshold_v() * gain);
            self.current = Vector::select(enabled, driven, open);
        }
    }

    /// The current after a period in which bridge, supply, wires or sensors are not ideal, and what that does
    /// to the supply; from what the current would be with the terminals shorted and the winding's
    /// gain. Where an effect is absent, it computes the bits of the short way.
    #[inline(never)]
    fn conduct_with_effects(&mut self, shorted: Vector<R>, gain: R) {
        let zero = R::splat(0.0);
        let before = self.current;
        let bus = self.supply.voltage_v();
        let mut fractions = self.inverter.fractions();
        let mut short_circuit = zero;
        let is_sound = self.is_sound;
        let mut shorted = shorted;
        if !is_sound {
            let switching = self.inverter.enabled() & !self.tripped;
            let (bridge, period_s) = (&self.parameters.bridge, self.parameters.pwm_period_s);
            let (trips, mean) = self.wiring.trips(bridge, fractions, bus, period_s as f32);
            self.tripped = self.tripped | (switching & trips);
            short_circuit = R::select(switching, mean, zero);
            fractions = self.wiring.seen(fractions);
            shorted = self.wiring.passes(shorted);
        }
        let enabled = self.inverter.enabled() & !self.tripped;
        let full = gain * (bus + self.supply.diode_drops_v());
        let direction = Vector::of_phases(fractions);
        let driven = shorted + direction * bus * gain;
        let mut next = Pulled {
            current: driven,
            taken: [zero; 3],
        };
        if self.has_dead_time {
            let pull = full * self.inverter.dead_part();
            next = self.inverter.dead_time(before, driven, pull);
        }
        if (!enabled).any() {
            let threshold = self.supply.diode_threshold_v() * gain;
            let drop = self.supply.diode_drops_v() * R::splat(0.5) * gain;
            let open = self.wiring.conduct(shorted, threshold, drop);
            next = Pulled::select(enabled, next, open);
        }
        if !is_sound {
            next.current = self.wiring.passes(next.current);
        }
        self.current = next.current;
        if !self.supply.is_ideal() {
            // Switches connect a phase to the positive rail for its fraction; diodes take from that
            // the part of the bus that they hold against the current.
            let mean = self.winding.mean(before, self.current);
            let [a, b, c] = mean.phases();
            let along = direction.alpha * mean.alpha + direction.beta * mean.beta;
            let switched = (a.abs() + b.abs() + c.abs()) * self.heat.switching_part();
            let by_switches = along * R::splat(1.5) + switched;
            let by_switches = R::select(enabled, by_switches, zero);
            let [taken_a, taken_b, taken_c] = next.taken;
            let taken = taken_a * a + taken_b * b + taken_c * c;
            let by_diodes = taken / R::select(zero.lt(full), full, R::splat(1.0));
            self.bridge_current = by_switches - by_diodes + short_circuit;
            if !self.leaves_supply {
                self.supply.end_period(self.bridge_current);
            }
        }
        if self.sensors.is_filtered() {
            self.sensors.follow(self.current);
        }
    }

    /// Counts what this period has turned into heat, for all since the last one: one of eight, which
    /// goes round all places within a control period of any odd number of periods.
    #[cold]
    #[inline(never)]
    fn warm(&mut self, current_square: R, enabled: R::Mask, speed: R) {
        let [a, b, c] = self.current.phases();
        let magnitudes = a.abs() + b.abs() + c.abs();
        // During dead times the diodes conduct on both edges; with the bridge open, always.
        let drops = self.supply.diode_drops_v();
        let switching = self.supply.voltage_v() * self.heat.switching_part();
        let closed = drops * self.inverter.dead_part() + switching;
        let per_a = R::select(enabled, closed, drops * R::splat(0.5));
        if self.heat.look(current_square, magnitudes * per_a, speed) {
            self.adopt_temperatures();
        }
    }

    /// Gives the winding the resistance and the flux of its temperatures.
    fn adopt_temperatures(&mut self) {
        let motor = &self.parameters.motor;
        let (resistance, flux) = self.heat.factors();
        let real = |value: f64| R::splat(value as f32);
        self.winding.set_warm(
            real(motor.phase_resistance_ohm) * resistance + real(self.parameters.bridge.switch_ohm),
            real(motor.flux_wb) * flux,
        );
    }

    fn set_heat(&mut self) {
        let parameters = &self.parameters;
        self.heat.set_figures(
            parameters.thermal.as_ref(),
            &parameters.motor,
            parameters.bridge.switch_ohm,
            Periods {
                per_look: ROTOR_PERIODS,
                period_s: parameters.pwm_period_s,
            },
        );
        if !self.heat.is_off() {
            self.adopt_temperatures();
        }
    }

    /// What the sensors read now.
    #[inline]
    pub fn sample(&self) -> Sample<R> {
        Sample {
            overcurrent: self.tripped,
            ..self.sensors.sample(&self.sensed())
        }
    }

    #[inline(always)]
    fn sensed(&self) -> Sensed<R> {
        Sensed {
            angle: self.mechanics.angle(),
            speed_rad_s: self.mechanics.speed_rad_s(),
            current: self.current,
            bus_voltage_v: self.supply.voltage_v(),
            temperature_c: self.heat.amplifier(),
        }
    }

    /// What is really the case now.
    pub fn truth(&self) -> Truth<R> {
        let speed = self.mechanics.speed_rad_s();
        Truth {
            angle: self.mechanics.angle(),
            turns: self.mechanics.turns(),
            speed_rad_s: speed,
            load_angle: self.mechanics.load_angle(),
            load_turns: self.mechanics.load_turns(),
            load_speed_rad_s: self.mechanics.load_speed_rad_s(),
            phase_current_a: self.current.phases(),
            phase_emf_v: self.winding.emf_v(self.rotor, speed).phases(),
            torque_nm: self.torque,
            bus_voltage_v: self.supply.voltage_v(),
            switches: self.board.pressed(),
            bridge_current_a: self.bridge_current,
            supply_current_a: self.supply.supply_current_a(),
            brake_current_a: self.supply.brake_current_a(),
            winding_c: self.heat.winding(),
            housing_c: self.heat.housing(),
            amplifier_c: self.heat.amplifier(),
        }
    }

    /// Finds out whether the short way through a period will do.
    fn look_for_effects(&mut self) {
        let bridge = &self.parameters.bridge;
        let dead_time_s = bridge.dead_time_s + self.timer_dead_time_s;
        self.has_dead_time = dead_time_s > 0.0;
        let dead_part = if self.has_dead_time {
            // Held to a quarter, should parameters not have been checked.
            (dead_time_s / self.parameters.pwm_period_s).clamp(0.0, 0.25)
        } else {
            0.0
        };
        self.inverter.set_dead_part(R::splat(dead_part as f32));
        self.is_sound = self.wiring.is_sound();
        let is_ideal = self.supply.is_ideal() && self.is_sound && !self.sensors.is_filtered();
        self.is_plain = is_ideal && !self.has_dead_time;
        self.has_dead_time_only = is_ideal && self.has_dead_time;
    }

    /// Takes the rotor's direction from the shaft's angle.
    #[inline(always)]
    fn align_rotor(&mut self) {
        self.rotor = self.aligned(self.mechanics.angle());
        self.rotor_age = 0;
    }

    /// The rotor's direction at an angle of the shaft.
    #[inline(always)]
    fn aligned(&self, angle: R::Count) -> Vector<R> {
        let electrical_angle = R::count_mul(angle, self.electrical_turns);
        let (sine, cosine) = sin_cos::<R>(electrical_angle);
        Vector {
            alpha: cosine,
            beta: sine,
        }
    }
}

/// The winding in series with the switches.
fn winding_of<R: Real>(parameters: &Parameters) -> Winding<R> {
    let mut motor = parameters.motor;
    motor.phase_resistance_ohm += parameters.bridge.switch_ohm;
    Winding::new(&motor, parameters.pwm_period_s)
}

fn overcurrent_square<R: Real>(parameters: &Parameters) -> R {
    let overcurrent = R::splat(parameters.bridge.overcurrent_a);
    overcurrent * overcurrent
}

/// A position, 2³² per turn.
fn way(angle: i32, turns: i32) -> i64 {
    (i64::from(turns) << 32) + i64::from(angle)
}

impl Plant<f32> {
    /// What the board says beside the sample. To be asked at every control boundary: switches with
    /// hysteresis, and those that bounce, remember what they were.
    pub fn signals(&mut self) -> Signals {
        let way = way(self.mechanics.load_angle(), self.mechanics.load_turns());
        Signals {
            motor_temperature_adc: self.sensors.motor_temperature_adc(self.heat.winding()),
            magnet: self.sensors.magnet(),
            inputs: self.board.inputs(way, self.periods),
            auxiliary_adc: self.board.auxiliary_adc(),
            torque_off: self.board.torque_off(),
            output_encoder: self
                .parameters
                .output_encoder
                .and_then(|encoder| encoder.reading(way)),
        }
    }

    /// What the gate drivers say over their own wires.
    pub fn gate_driver(&self) -> GateDriverWords {
        self.gate_driver.words(self.tripped)
    }

    /// What the encoder on the output says of its magnet, if one is there and answers.
    pub fn output_magnet(&self) -> Option<Magnet> {
        self.parameters.output_encoder?.magnet()
    }
}
