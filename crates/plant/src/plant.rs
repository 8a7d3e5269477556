//! One drive's world, put together.

use control::io::{Duty, Sample, Signals};
use control::{Mask, Real, sin_cos};

use crate::{Inverter, Mechanics, Parameters, Sensors, Supply, Vector, Winding, diodes};

/// The world of one drive (or of a batch).
///
/// At every control boundary: [`Plant::sample`], compute, [`Plant::load`]; then one [`Plant::step`]
/// per PWM period until the next boundary.
///
/// ```
/// use control::io::Duty;
/// use plant::{Parameters, Plant};
///
/// let mut plant = Plant::<f32>::new(&Parameters::default());
/// let sample = plant.sample();
/// assert_eq!(sample.encoder, 0x0DF8);
/// plant.load(&Duty { phase: [0.55, 0.5, 0.5], enabled: true });
/// for _ in 0..5 {
///     plant.step();
/// }
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
    electrical_turns: R::Count,
    amplifier_temperature: R,
    current: Vector<R>,
    /// Unit vector along the magnet.
    rotor: Vector<R>,
    /// Periods until `rotor` is taken from the angle again.
    rotor_age: u8,
    torque: R,
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
    /// Current into phases A, B, C, A.
    pub phase_current_a: [R; 3],
    /// Electromotive force of phases A, B, C, V.
    pub phase_emf_v: [R; 3],
    /// Torque of the motor on the rotor, before friction, Nm.
    pub torque_nm: R,
    /// Voltage of the motor supply, V.
    pub bus_voltage_v: R,
}

impl Truth<f32> {
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
        let mut plant = Self {
            parameters: *parameters,
            supply: Supply::new(
                R::splat(parameters.supply_v),
                R::splat(parameters.diode_drop_v),
            ),
            inverter: Inverter::new(parameters.load_delay_periods),
            winding: Winding::new(motor, period_s),
            mechanics: Mechanics::new(motor, &parameters.load, period_s),
            sensors: Sensors::new(
                &parameters.encoder,
                &parameters.scales,
                parameters.current_zero_counts,
            ),
            electrical_turns: R::count(motor.electrical_turns().into()),
            amplifier_temperature: R::splat(parameters.amplifier_temperature_c),
            current: Vector::zero(),
            rotor: Vector::zero(),
            rotor_age: 0,
            torque: R::splat(0.0),
        };
        let (angle, turns) = angle_and_turns(parameters.start_turns);
        plant
            .mechanics
            .set_position(R::count(angle), R::count(turns));
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
    /// [`Inverter::load`].
    pub fn load(&mut self, duty: &Duty<R>) {
        self.inverter.load(duty);
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
        let driven = shorted + self.inverter.voltage_v(self.supply.voltage_v()) * gain;
        let enabled = self.inverter.enabled();
        self.current = driven;
        if (!enabled).any() {
            let open = diodes::conduct(shorted, self.supply.diode_threshold_v() * gain);
            self.current = Vector::select(enabled, driven, open);
        }
        self.inverter.end_period();

        self.mechanics.turn();
        self.rotor = self.rotor + self.rotor.times(turning);
        self.rotor_age += 1;
        if self.rotor_age >= ROTOR_PERIODS {
            self.align_rotor();
        }
        self.torque = self.winding.torque_nm(self.current, self.rotor);
        self.mechanics.accelerate(self.torque);
    }

    /// What the sensors read now.
    #[inline]
    pub fn sample(&self) -> Sample<R> {
        self.sensors.sample(
            self.mechanics.angle(),
            self.current,
            self.supply.voltage_v(),
            self.amplifier_temperature,
        )
    }

    /// What is really the case now.
    pub fn truth(&self) -> Truth<R> {
        let speed = self.mechanics.speed_rad_s();
        Truth {
            angle: self.mechanics.angle(),
            turns: self.mechanics.turns(),
            speed_rad_s: speed,
            phase_current_a: self.current.phases(),
            phase_emf_v: self.winding.emf_v(self.rotor, speed).phases(),
            torque_nm: self.torque,
            bus_voltage_v: self.supply.voltage_v(),
        }
    }

    /// Sets the motor supply, V; 0 (or less) disconnects it. The sensors stay alive.
    pub fn set_supply_v(&mut self, voltage_v: R) {
        self.supply.set_voltage_v(voltage_v);
    }

    /// Sets the torque of the load, Nm; positive opposes positive rotation.
    pub fn set_load_torque_nm(&mut self, torque_nm: R) {
        self.mechanics.set_load_torque_nm(torque_nm);
    }

    /// Blocks the shaft where it is, or frees it.
    pub fn set_blocked(&mut self, blocked: R::Mask) {
        self.mechanics.set_blocked(blocked);
    }

    /// Puts the shaft at an angle (2³² per turn, turn zero) with a speed, rad/s.
    pub fn set_motion(&mut self, angle: R::Count, speed_rad_s: R) {
        self.mechanics.set_motion(angle, speed_rad_s);
        self.align_rotor();
        self.torque = self.winding.torque_nm(self.current, self.rotor);
    }

    /// Sets the temperature of the amplifier, °C; an undefined value reads as the converter's zero.
    pub fn set_amplifier_temperature_c(&mut self, temperature_c: R) {
        self.amplifier_temperature = temperature_c;
    }

    /// Changes the PWM period, s, between two steps (the P3's 0x3001,1). Motion and currents go on.
    /// The period is held between 1 µs and 1 ms.
    pub fn set_pwm_period_s(&mut self, period_s: f64) {
        let period_s = if period_s > 1e-6 { period_s } else { 1e-6 };
        let period_s = if period_s < 1e-3 { period_s } else { 1e-3 };
        self.parameters.pwm_period_s = period_s;
        let (motor, load) = (&self.parameters.motor, &self.parameters.load);
        self.winding = Winding::new(motor, period_s);
        self.mechanics.set_period_s(motor, load, period_s);
    }

    /// Takes the rotor's direction from the shaft's angle.
    #[inline(always)]
    fn align_rotor(&mut self) {
        let electrical_angle = R::count_mul(self.mechanics.angle(), self.electrical_turns);
        let (sine, cosine) = sin_cos::<R>(electrical_angle);
        self.rotor = Vector {
            alpha: cosine,
            beta: sine,
        };
        self.rotor_age = 0;
    }
}

/// A position in turns as the shaft counts it: within the turn, 2³² per turn and wrapping at half a
/// turn, and whole turns; up to 2³⁰ turns to either side, at zero if undefined.
fn angle_and_turns(turns: f64) -> (i32, i32) {
    let held = turns.clamp(-1_073_741_824.0, 1_073_741_824.0);
    // Both casts are toward zero; the offset of whole turns makes that down, to the nearest step.
    let steps = (held * 4_294_967_296.0) as i64;
    let whole = (steps + 0x8000_0000) >> 32;
    (steps as i32, whole as i32)
}

impl Plant<f32> {
    /// What the board says beside the sample.
    pub fn signals(&self) -> Signals {
        Signals::QUIET
    }
}
