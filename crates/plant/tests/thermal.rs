//! The heat of motor and amplifier against closed forms, and what it does to the motor.

mod support;

use plant::{
    AmplifierThermal, Bridge, EC_MAX_22_283860 as MOTOR, EC_MAX_22_283860_THERMAL as HEAT, Invalid,
    Parameters, Plant, Thermal, VIRTUAL_P3,
};
use support::{Complex, OPEN, duty, rpm, step_in_rotor_frame};

/// The virtual P3 without delay, whose resistance does not grow.
fn constant() -> Parameters {
    let mut parameters = VIRTUAL_P3;
    parameters.load_delay_periods = 0;
    let thermal = parameters.thermal.as_mut().unwrap();
    thermal.motor.resistance_per_k = 0.0;
    thermal.motor.flux_per_k = 0.0;
    parameters
}

/// Rises of winding and housing, K, of two bodies heated by constant powers for a time, from none.
/// By the eigenvalues, in f64, independently of the plant.
fn two_bodies(copper_w: f64, friction_w: f64, seconds: f64) -> (f64, f64) {
    let (rw, rh) = (HEAT.winding_k_per_w, HEAT.housing_k_per_w);
    let cw = HEAT.winding_time_constant_s / rw;
    let ch = HEAT.housing_time_constant_s / rh;
    // dT/dt = -K T + P, K = [[1/rw cw, -1/rw cw], [-1/rw ch, 1/rw ch + 1/rh ch]].
    let (a, b, d) = (
        1.0 / (rw * cw),
        1.0 / (rw * ch),
        1.0 / (rw * ch) + 1.0 / (rh * ch),
    );
    let (trace, det) = (a + d, a * d - a * b);
    let root = (trace * trace - 4.0 * det).sqrt();
    let steady_h = (copper_w + friction_w) * rh;
    let steady_w = steady_h + copper_w * rw;
    // T = steady + u e^(-λ1 t) + v e^(-λ2 t), each mode along (a, a - λ).
    let (l1, l2) = (0.5 * (trace - root), 0.5 * (trace + root));
    // α (a, a - l1) + β (a, a - l2) = -(steady_w, steady_h).
    let beta = ((a - l1) * steady_w / a - steady_h) / (l1 - l2);
    let alpha = -steady_w / a - beta;
    let (e1, e2) = ((-l1 * seconds).exp(), (-l2 * seconds).exp());
    (
        steady_w + a * (alpha * e1 + beta * e2),
        steady_h + (a - l1) * alpha * e1 + (a - l2) * beta * e2,
    )
}

/// A blocked motor with a constant current in phase A, A.
fn heated(parameters: &Parameters, amperes: f64) -> Plant<f32> {
    assert_eq!(parameters.check(), Ok(()));
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_blocked(true);
    let resistance = MOTOR.phase_resistance_ohm + parameters.bridge.switch_ohm;
    plant.load(&duty(Complex(amperes * resistance, 0.0), 48.0));
    // Past the electrical time constant, then as cold as before.
    for _ in 0..2_000 {
        plant.step();
    }
    plant.set_motor_temperature_c(25.0);
    plant.set_amplifier_temperature_c(25.0);
    plant
}

#[test]
fn a_thermal_step_follows_the_two_bodies() {
    let mut parameters = constant();
    // A long period: a minute of heat is 1.2 million of them.
    parameters.pwm_period_s = 50e-6;
    let mut plant = heated(&parameters, 1.0);
    let watts = 1.5 * MOTOR.phase_resistance_ohm;
    let mut worst = 0.0_f64;
    for n in 1..=12_000_000_u32 {
        plant.step();
        if n % 20_000 == 0 {
            let (winding, housing) = two_bodies(watts, 0.0, f64::from(n) * 50e-6);
            let truth = plant.truth();
            for (actual, rise) in [(truth.winding_c, winding), (truth.housing_c, housing)] {
                worst = worst.max((f64::from(actual) - 25.0 - rise).abs());
            }
        }
    }
    let (winding, housing) = two_bodies(watts, 0.0, 600.0);
    println!(
        "after 600 s winding +{winding:.3} K, housing +{housing:.3} K, worst error {worst:.4} K"
    );
    assert!(worst < 0.01, "{worst}");
    assert!((winding - 89.0).abs() < 5.0 && (housing - 70.0).abs() < 5.0);
}

#[test]
fn the_steps_of_a_slow_body_are_not_lost_in_rounding() {
    // A step of a millisecond adds 2e-7 K here, a fortieth of the last bit of 25 °C in an f32.
    let mut parameters = constant();
    let thermal = parameters.thermal.as_mut().unwrap();
    thermal.amplifier = AmplifierThermal {
        k_per_w: 1.0,
        time_constant_s: 5_000.0,
        idle_w: 1.0,
        switching_s: 0.0,
    };
    parameters.pwm_period_s = 1e-3;
    let mut plant = Plant::<f32>::new(&parameters);
    for _ in 0..1_000_000 {
        plant.step();
    }
    let expected = 1.0 - (-1_000.0_f64 / 5_000.0).exp();
    let actual = f64::from(plant.truth().amplifier_c) - 25.0;
    assert!((actual - expected).abs() < 1e-4, "{actual} {expected}");
}

#[test]
fn friction_heats_the_housing() {
    let mut parameters = constant();
    parameters.load.inertia_kgm2 = 1e3;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_supply_v(0.0);
    plant.load(&OPEN);
    let speed = rpm(12_900.0);
    plant.set_motion(0, speed as f32);
    for _ in 0..2_000_000 {
        plant.step();
    }
    let watts = (MOTOR.coulomb_friction_nm + MOTOR.viscous_friction_nms * speed) * speed;
    let (winding, housing) = two_bodies(0.0, watts, 20.0);
    let truth = plant.truth();
    assert!(
        (f64::from(truth.housing_c) - 25.0 - housing).abs() < 0.01,
        "{housing}"
    );
    assert!(
        (f64::from(truth.winding_c) - 25.0 - winding).abs() < 0.01,
        "{winding}"
    );
    assert!(housing > 1.0, "{housing}");
}

#[test]
fn the_amplifier_is_heated_by_conduction_dead_time_and_switching() {
    let amperes = 1.5;
    for (switch_ohm, dead_time_s, switching_s) in [
        (0.0, 0.0, 0.0),
        (0.5, 0.0, 0.0),
        (0.0, 200e-9, 0.0),
        (0.0, 0.0, 50e-9),
        (0.2, 100e-9, 20e-9),
    ] {
        let mut parameters = constant();
        parameters.bridge = Bridge {
            switch_ohm,
            dead_time_s,
            ..Bridge::IDEAL
        };
        let amplifier = &mut parameters.thermal.as_mut().unwrap().amplifier;
        amplifier.switching_s = switching_s;
        let mut plant = heated(&parameters, amperes);
        let phases = plant.truth().phase_current_a.map(f64::from);
        for _ in 0..1_000_000 {
            plant.step();
        }
        let squares: f64 = phases.iter().map(|i| i * i).sum();
        let magnitudes: f64 = phases.iter().map(|i| i.abs()).sum();
        let watts = 0.6
            + switch_ohm * squares
            + (2.0 * 0.8 * dead_time_s + 48.0 * switching_s) / 10e-6 * magnitudes;
        let rise = 10.0 * watts * (1.0 - (-10.0_f64 / 60.0).exp());
        let actual = f64::from(plant.truth().amplifier_c) - 25.0;
        assert!(
            (actual - rise).abs() < 0.01,
            "{switch_ohm} {dead_time_s}: {actual} {rise}"
        );
    }
}

#[test]
fn a_warm_winding_has_more_resistance_and_a_warm_magnet_less_flux() {
    for celsius in [-20.0, 25.0, 80.0, 155.0] {
        let mut parameters = VIRTUAL_P3;
        parameters.load_delay_periods = 0;
        let mut plant = Plant::<f32>::new(&parameters);
        plant.set_ambient_c(celsius);
        plant.set_motor_temperature_c(celsius);
        plant.set_blocked(true);
        plant.load(&duty(Complex(0.0, 5.0), 48.0));
        for _ in 0..100 {
            plant.step();
        }
        let rise = f64::from(celsius) - 25.0;
        let resistance = MOTOR.phase_resistance_ohm * (1.0 + 0.00393 * rise);
        let current = 5.0 / resistance;
        let truth = plant.truth();
        let actual = support::current(&truth).length();
        assert!(
            (actual / current - 1.0).abs() < 1e-5,
            "{celsius}: {actual} {current}"
        );
        let constant = 1.5 * MOTOR.flux_wb * (1.0 - 0.0011 * rise);
        let torque = f64::from(truth.torque_nm);
        assert!(
            (torque / (constant * actual) - 1.0).abs() < 1e-5,
            "{celsius}: {torque}"
        );
        // And the transient has the time constant of that resistance.
        plant.load(&support::SHORTED);
        plant.step();
        let left = support::current(&plant.truth()).length() / actual;
        let expected = (-resistance * 10e-6 / MOTOR.phase_inductance_h).exp();
        assert!(
            (left / expected - 1.0).abs() < 1e-5,
            "{celsius}: {left} {expected}"
        );
    }
}

#[test]
fn a_blocked_motor_at_its_peak_current_burns_within_a_minute() {
    // 2 A by a current loop: the voltage follows the resistance.
    let mut parameters = VIRTUAL_P3;
    parameters.load_delay_periods = 0;
    parameters.pwm_period_s = 50e-6;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_blocked(true);
    let mut seconds = 0.0;
    while plant.truth().winding_c < 155.0 {
        let rise = f64::from(plant.truth().winding_c) - 25.0;
        let resistance = MOTOR.phase_resistance_ohm * (1.0 + 0.00393 * rise);
        plant.load(&duty(Complex(2.0 * resistance, 0.0), 48.0));
        plant.step();
        seconds += 50e-6;
        assert!(seconds < 120.0);
    }
    println!("2 A: from 25 to 155 °C in {seconds:.1} s");
    assert!((10.0..40.0).contains(&seconds), "{seconds}");
    let adc = plant.signals().motor_temperature_adc;
    // 0.075 K a count from -50 °C.
    assert!((adc - (155.0 + 50.0) / 0.075).abs() <= 1.0, "{adc}");
    // It cools down, the winding first.
    plant.load(&OPEN);
    for _ in 0..400_000 {
        plant.step();
    }
    let truth = plant.truth();
    assert!(
        truth.winding_c < 70.0 && truth.winding_c > truth.housing_c,
        "{truth:?}"
    );
}

#[test]
fn at_the_continuous_torque_the_motor_stays_within_its_limit() {
    // 0.716 A of block current make the torque of 0.79 A of phase current; at 8,000 rpm.
    let mut parameters = VIRTUAL_P3;
    parameters.load_delay_periods = 0;
    parameters.pwm_period_s = 50e-6;
    parameters.load.inertia_kgm2 = 1e3;
    parameters.supply_v = 60.0;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_motion(0, rpm(8_000.0) as f32);
    // From warm on, or it would take half an hour.
    plant.set_motor_temperature_c(100.0);
    let wanted = 0.716 * 34.8e-3;
    for _ in 0..16_000_000 {
        let truth = plant.truth();
        let rise = f64::from(truth.winding_c) - 25.0;
        let flux = MOTOR.flux_wb * (1.0 - 0.0011 * (f64::from(truth.housing_c) - 25.0));
        let current = wanted / (1.5 * flux);
        let speed = f64::from(truth.speed_rad_s);
        let resistance = MOTOR.phase_resistance_ohm * (1.0 + 0.00393 * rise);
        let reactance = -speed * MOTOR.phase_inductance_h * current;
        let volts = Complex(reactance, current * resistance + speed * flux);
        step_in_rotor_frame(&mut plant, &parameters, volts);
    }
    let truth = plant.truth();
    println!(
        "continuous torque at 8,000 rpm: winding {} °C, housing {} °C",
        truth.winding_c, truth.housing_c
    );
    assert!(
        (135.0..170.0).contains(&truth.winding_c),
        "{}",
        truth.winding_c
    );
}

#[test]
fn without_heat_temperatures_stay_as_they_are_set() {
    let mut parameters = VIRTUAL_P3;
    parameters.thermal = None;
    parameters.ambient_c = 40.0;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_blocked(true);
    plant.load(&duty(Complex(10.0, 0.0), 48.0));
    plant.set_amplifier_temperature_c(90.0);
    for _ in 0..100_000 {
        plant.step();
    }
    let truth = plant.truth();
    assert_eq!(
        (truth.winding_c, truth.housing_c, truth.amplifier_c),
        (40.0, 40.0, 90.0)
    );
    assert_eq!(plant.sample().temperature_adc, (90.0 + 50.0) / 0.05);
    plant.set_amplifier_temperature_c(f32::NAN);
    assert_eq!(plant.truth().amplifier_c, 90.0);
}

#[test]
fn another_pwm_period_keeps_temperatures_and_their_effect() {
    let mut plant = Plant::<f32>::new(&VIRTUAL_P3);
    plant.set_motor_temperature_c(125.0);
    plant.set_blocked(true);
    plant.set_pwm_period_s(12.5e-6);
    plant.load(&duty(Complex(5.0, 0.0), 48.0));
    for _ in 0..100 {
        plant.step();
    }
    let current = support::current(&plant.truth()).length();
    let expected = 5.0 / (MOTOR.phase_resistance_ohm * 1.393);
    assert!(
        (current / expected - 1.0).abs() < 1e-4,
        "{current} {expected}"
    );
}

#[test]
fn heat_that_cannot_be_is_refused() {
    let with = |change: fn(&mut Thermal)| {
        let mut parameters = VIRTUAL_P3;
        change(parameters.thermal.as_mut().unwrap());
        parameters.check()
    };
    assert_eq!(with(|_| ()), Ok(()));
    assert_eq!(
        with(|t| t.motor.housing_k_per_w = 0.0),
        Err(Invalid::Thermal(0.0))
    );
    assert_eq!(
        with(|t| t.amplifier.idle_w = -1.0),
        Err(Invalid::Thermal(-1.0))
    );
    assert!(with(|t| t.motor.winding_time_constant_s = f64::NAN).is_err());
    assert!(with(|t| t.motor.resistance_per_k = f64::INFINITY).is_err());
    let mut parameters = VIRTUAL_P3;
    parameters.ambient_c = f32::NAN;
    assert!(parameters.check().is_err());
}
