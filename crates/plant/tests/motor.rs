//! The whole machine: no-load speed, mechanical time constant, balance of energy.

mod support;

use plant::{Parameters, Plant};
use support::{Complex, current, electrical_angle, frictionless, prompt, rpm, step_in_rotor_frame};

/// Speed, rad/s, at which the machine settles under a voltage in quadrature to the magnet.
fn settled_speed(parameters: &Parameters, volts: f64, start: f64) -> f64 {
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_motion(0, start as f32);
    let mut sum = 0.0;
    for n in 0..20_000 {
        step_in_rotor_frame(&mut plant, parameters, Complex(0.0, volts));
        if n >= 15_000 {
            sum += f64::from(plant.truth().speed_rad_s);
        }
    }
    sum / 5_000.0
}

#[test]
fn the_no_load_speed_is_kn_times_v_less_i0_r() {
    let volts = 48.0 / 3.0_f64.sqrt();
    // Without friction: 48 V/√3 over the EMF constant of 34.8 mNm/A in block convention.
    let ideal = settled_speed(&frictionless(), volts, 1_200.0);
    println!("ideal no-load speed {:.1} rpm", ideal / rpm(1.0));
    assert!(
        (ideal / rpm(12_578.0) - 1.0).abs() < 1e-4,
        "{}",
        ideal / rpm(1.0)
    );

    // With friction: I0 = (Tc + Bω)/Kt makes n = kn (V - I0 R), a linear equation for the speed.
    let parameters = prompt();
    let motor = &parameters.motor;
    let (r, l) = (motor.phase_resistance_ohm, motor.phase_inductance_h);
    let torque_constant = 1.5 * motor.flux_wb;
    let speed = settled_speed(&parameters, volts, 1_200.0);
    let linear = (volts - motor.coulomb_friction_nm * r / torque_constant)
        / (motor.flux_wb + motor.viscous_friction_nms * r / torque_constant);
    println!(
        "no-load speed {:.1} rpm, kn (V - I0 R) {:.1} rpm",
        speed / rpm(1.0),
        linear / rpm(1.0)
    );
    assert!((speed / linear - 1.0).abs() < 2e-4, "{speed} {linear}");

    // The rest is the inductance, which lets some of the current slip into the d axis, and the
    // voltage that stands still for a period of angle δ: its mean is shorter by δ²/24.
    let current =
        (motor.coulomb_friction_nm + motor.viscous_friction_nms * speed) / torque_constant;
    let step = speed * parameters.pwm_period_s;
    let needed = current * (r + (speed * l).powi(2) / r) + speed * motor.flux_wb;
    let given = volts * (1.0 - step * step / 24.0);
    assert!((needed / given - 1.0).abs() < 1e-5, "{needed} {given}");
}

#[test]
fn the_mechanical_time_constant_is_r_j_over_kt_squared() {
    // With a hundredth of the inductance the first-order law is all there is.
    let mut parameters = frictionless();
    parameters.motor.phase_inductance_h /= 100.0;
    let motor = &parameters.motor;
    let tau = motor.phase_resistance_ohm * motor.rotor_inertia_kgm2
        / (1.5 * motor.flux_wb * motor.flux_wb);
    // The sheet's R J/Kt² in block convention is larger by π²/9: 4.81 ms.
    let sheet = 13.1 * 4.45e-7 / 34.8e-3_f64.powi(2);
    assert!((sheet * 1e3 - 4.81).abs() < 0.01);
    assert!((sheet / tau - std::f64::consts::PI.powi(2) / 9.0).abs() < 1e-6);

    let mut plant = Plant::<f32>::new(&parameters);
    let end = 12.0 / motor.flux_wb;
    let mut worst = 0.0_f64;
    for n in 1..=2_500 {
        step_in_rotor_frame(&mut plant, &parameters, Complex(0.0, 12.0));
        let expected = 1.0 - (-f64::from(n) * 10e-6 / tau).exp();
        worst = worst.max((f64::from(plant.truth().speed_rad_s) / end - expected).abs());
    }
    println!(
        "tau {:.3} ms, worst deviation {:.2e} of the final speed",
        tau * 1e3,
        worst
    );
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn with_its_inductance_the_voltage_step_has_the_two_poles_of_a_dc_machine() {
    // The d axis decoupled: L ψ-coupling vd = -ω L iq keeps id at zero, and what remains is linear.
    let parameters = frictionless();
    let motor = &parameters.motor;
    let (r, l, psi, j) = (
        motor.phase_resistance_ohm,
        motor.phase_inductance_h,
        motor.flux_wb,
        motor.rotor_inertia_kgm2,
    );
    // s² + (R/L) s + 1.5 ψ²/(L J) = 0.
    let half = 0.5 * r / l;
    let root = (half * half - 1.5 * psi * psi / (l * j)).sqrt();
    let (slow, fast) = (-half + root, -half - root);
    let mut plant = Plant::<f32>::new(&parameters);
    let end = 12.0 / psi;
    let mut worst = 0.0_f64;
    for n in 1..=2_500 {
        let truth = plant.truth();
        let angle = electrical_angle(&truth, &parameters);
        let iq = current(&truth).mul(Complex::polar(1.0, -angle)).1;
        let vd = -f64::from(truth.speed_rad_s) * l * iq;
        step_in_rotor_frame(&mut plant, &parameters, Complex(vd, 12.0));
        let t = f64::from(n) * 10e-6;
        let left = (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow);
        worst = worst.max((f64::from(plant.truth().speed_rad_s) / end - (1.0 - left)).abs());
    }
    println!("worst deviation {worst:.2e} of the final speed");
    assert!(worst < 2e-4, "{worst}");
}

/// Energies of one run, J.
struct Energies {
    electrical: f64,
    accounted: f64,
}

/// Runs up, loads and reverses the machine, and adds up every joule on the way. Integrals within a
/// period are of fourth order (ends and slopes of the true currents), so that what is measured is
/// the plant and not the bookkeeping.
fn balance(parameters: &Parameters, periods: u32, load_nm: f64) -> Energies {
    let motor = &parameters.motor;
    let (r, l, psi) = (
        motor.phase_resistance_ohm,
        motor.phase_inductance_h,
        motor.flux_wb,
    );
    let p = f64::from(motor.pole_pairs);
    let inertia = motor.rotor_inertia_kgm2 + parameters.load.inertia_kgm2;
    let h = parameters.pwm_period_s;
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_load_torque_nm(load_nm as f32);
    let (mut electrical, mut copper, mut friction, mut load) = (0.0, 0.0, 0.0, 0.0);
    let mut shaft = plant.truth().position_turns();
    for n in 0..periods {
        let before = plant.truth();
        // Up for the first half with some field weakening, then the other way.
        let dq = if n < periods / 2 {
            Complex(-3.0, 20.0)
        } else {
            Complex(2.0, -15.0)
        };
        let voltage = step_in_rotor_frame(&mut plant, parameters, dq);
        let after = plant.truth();
        let slope = |truth: &plant::Truth<f32>, i: Complex| {
            let speed = p * f64::from(truth.speed_rad_s);
            let angle = electrical_angle(truth, parameters);
            let emf = Complex::polar(psi * speed, angle + std::f64::consts::PI / 2.0);
            voltage.sub(i.scale(r)).sub(emf).scale(1.0 / l)
        };
        let (i0, i1) = (current(&before), current(&after));
        let (s0, s1) = (slope(&before, i0), slope(&after, i1));
        let charge = i0
            .add(i1)
            .scale(0.5 * h)
            .add(s0.sub(s1).scale(h * h / 12.0));
        electrical += 1.5 * voltage.dot(charge);
        let square = 0.5 * h * (i0.dot(i0) + i1.dot(i1)) + h * h / 6.0 * (i0.dot(s0) - i1.dot(s1));
        copper += 1.5 * r * square;
        let speeds = [before, after].map(|truth| f64::from(truth.speed_rad_s));
        friction += 0.5
            * h
            * speeds.iter().fold(0.0, |sum, w| {
                sum + motor.coulomb_friction_nm * w.abs() + motor.viscous_friction_nms * w * w
            });
        let turned = after.position_turns();
        load += load_nm * (turned - shaft) * std::f64::consts::TAU;
        shaft = turned;
    }
    let end = plant.truth();
    let magnetic = 0.75 * l * current(&end).length().powi(2);
    let kinetic = 0.5 * inertia * f64::from(end.speed_rad_s).powi(2);
    println!(
        "in {:.3} mJ = copper {:.3} + friction {:.3} + load {:.3} + kinetic {:.3} + field {:.4}",
        electrical * 1e3,
        copper * 1e3,
        friction * 1e3,
        load * 1e3,
        kinetic * 1e3,
        magnetic * 1e3
    );
    Energies {
        electrical,
        accounted: copper + friction + load + kinetic + magnetic,
    }
}

#[test]
fn no_joule_is_made_or_lost() {
    let mut seven_poles = prompt();
    seven_poles.motor.pole_pairs = 7;
    seven_poles.motor.flux_wb /= 7.0;
    let mut heavy = prompt();
    heavy.load.inertia_kgm2 = 2e-6;
    for (parameters, periods, load) in [
        (prompt(), 2_000, 0.0),
        (prompt(), 1_000, 5e-3),
        (heavy, 6_000, 5e-3),
        (seven_poles, 2_000, 0.0),
    ] {
        let Energies {
            electrical,
            accounted,
        } = balance(&parameters, periods, load);
        let error = accounted / electrical - 1.0;
        println!("balance {error:.2e}");
        assert!(error.abs() < 1e-3, "{electrical} {accounted}");
    }
}
