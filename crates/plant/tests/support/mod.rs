//! What several of the tests need: impose voltages, read the truth in f64.
#![allow(dead_code, reason = "each test program uses some of it")]

use std::f64::consts::TAU;

use control::io::Duty;
use plant::{Parameters, Plant, Truth, VIRTUAL_P3};

/// A complex number: a vector in the stator plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Complex(pub(crate) f64, pub(crate) f64);

impl Complex {
    pub(crate) fn polar(length: f64, angle: f64) -> Self {
        Self(length * angle.cos(), length * angle.sin())
    }
    pub(crate) fn add(self, o: Self) -> Self {
        Self(self.0 + o.0, self.1 + o.1)
    }
    pub(crate) fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0, self.1 - o.1)
    }
    pub(crate) fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
    }
    pub(crate) fn div(self, o: Self) -> Self {
        let Self(re, im) = self.mul(Self(o.0, -o.1));
        let square = o.0 * o.0 + o.1 * o.1;
        Self(re / square, im / square)
    }
    pub(crate) fn scale(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1 * factor)
    }
    pub(crate) fn dot(self, o: Self) -> f64 {
        self.0 * o.0 + self.1 * o.1
    }
    pub(crate) fn length(self) -> f64 {
        self.dot(self).sqrt()
    }
}

/// The virtual P3 without friction and without delay of the duty, its shaft held at any speed it is
/// given by an inertia of a thousand tonnes square metre.
pub(crate) fn flywheel() -> Parameters {
    let mut parameters = frictionless();
    parameters.load.inertia_kgm2 = 1e6;
    parameters.bridge.overcurrent_a = f32::INFINITY;
    parameters
}

/// The virtual P3 without friction and without delay of the duty.
pub(crate) fn frictionless() -> Parameters {
    let mut parameters = prompt();
    parameters.motor.coulomb_friction_nm = 0.0;
    parameters.motor.static_friction_nm = 0.0;
    parameters.motor.viscous_friction_nms = 0.0;
    parameters
}

/// The virtual P3 without delay of the duty, and always at the temperature of its figures.
pub(crate) fn prompt() -> Parameters {
    Parameters {
        load_delay_periods: 0,
        thermal: None,
        ..VIRTUAL_P3
    }
}

/// The duty whose mean phase voltages are the stator vector `voltage`, V; centred between the rails
/// so that vectors up to bus/√3 fit (min-max injection).
pub(crate) fn duty(voltage: Complex, bus_voltage_v: f64) -> Duty<f32> {
    let half = -0.5 * voltage.0;
    let across = 0.75_f64.sqrt() * voltage.1;
    let phases = [voltage.0, half + across, half - across];
    let highest = phases.iter().copied().fold(f64::MIN, f64::max);
    let lowest = phases.iter().copied().fold(f64::MAX, f64::min);
    let middle = 0.5 * (highest + lowest);
    let phase = phases.map(|volts| ((volts - middle) / bus_voltage_v + 0.5) as f32);
    Duty {
        phase,
        enabled: true,
    }
}

/// All six switches open.
pub(crate) const OPEN: Duty<f32> = Duty {
    phase: [0.5; 3],
    enabled: false,
};

/// All three phases on the same potential.
pub(crate) const SHORTED: Duty<f32> = Duty {
    phase: [0.5; 3],
    enabled: true,
};

/// Stator current of the truth.
pub(crate) fn current(truth: &Truth<f32>) -> Complex {
    let [a, b, c] = truth.phase_current_a.map(f64::from);
    Complex((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt())
}

/// Electrical angle of the magnet, rad.
pub(crate) fn electrical_angle(truth: &Truth<f32>, parameters: &Parameters) -> f64 {
    f64::from(truth.angle) / 4_294_967_296.0 * TAU * f64::from(parameters.motor.pole_pairs)
}

/// One period under a voltage that stands still in the rotor's frame as nearly as a bridge can make
/// it: `dq` volts, turned to the angle of the middle of the period. Returns the stator voltage.
pub(crate) fn step_in_rotor_frame(
    plant: &mut Plant<f32>,
    parameters: &Parameters,
    dq: Complex,
) -> Complex {
    let truth = plant.truth();
    let lead = 0.5
        * f64::from(parameters.motor.pole_pairs)
        * f64::from(truth.speed_rad_s)
        * parameters.pwm_period_s;
    let direction = Complex::polar(1.0, electrical_angle(&truth, parameters) + lead);
    let voltage = dq.mul(direction);
    plant.load(&duty(voltage, parameters.supply_v.into()));
    plant.step();
    voltage
}

/// Speed in rad/s of one in revolutions per minute.
pub(crate) fn rpm(rpm: f64) -> f64 {
    rpm * TAU / 60.0
}
