//! The winding and the bridge against closed forms.

mod support;

use std::f64::consts::{PI, TAU};

use plant::{EC_MAX_22_283860 as MOTOR, Plant};
use support::{Complex, OPEN, SHORTED, current, duty, flywheel, frictionless, prompt, rpm};

const R: f64 = MOTOR.phase_resistance_ohm;
const L: f64 = MOTOR.phase_inductance_h;
const PSI: f64 = MOTOR.flux_wb;
const H: f64 = 10e-6;

#[test]
fn a_voltage_step_on_a_locked_rotor_follows_the_exponential() {
    let mut plant = Plant::<f32>::new(&prompt());
    plant.set_blocked(true);
    plant.load(&duty(Complex(4.0, 0.0), 48.0));
    let mut worst = 0.0_f64;
    for n in 1..=100 {
        plant.step();
        let expected = 4.0 / R * (1.0 - (-f64::from(n) * H * R / L).exp());
        worst = worst.max((current(&plant.truth()).0 - expected).abs());
    }
    println!("worst error {:.3} µA of {:.3} A", worst * 1e6, 4.0 / R);
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn a_locked_rotor_draws_v_over_r_and_gives_kt_times_i() {
    let mut plant = Plant::<f32>::new(&prompt());
    plant.set_blocked(true);
    // The voltage stands a quarter turn ahead of the magnet: all of the current makes torque.
    plant.load(&duty(Complex(0.0, 12.0), 48.0));
    for _ in 0..200 {
        plant.step();
    }
    let truth = plant.truth();
    let amperes = 12.0 / 6.55;
    assert!((current(&truth).1 - amperes).abs() < 2e-6);
    // 34.8 mNm/A of block current are π/(3√3) · 1.5 of it per ampere of peak phase current.
    let torque = amperes * 34.8e-3 * PI / (2.0 * 3.0_f64.sqrt());
    assert!((f64::from(truth.torque_nm) - torque).abs() < 1e-7);
    assert_eq!((truth.angle, truth.turns, truth.speed_rad_s), (0, 0, 0.0));
}

#[test]
fn a_new_duty_waits_for_one_pwm_period() {
    let mut plant = Plant::<f32>::new(&plant::VIRTUAL_P3);
    plant.set_blocked(true);
    plant.load(&duty(Complex(4.0, 0.0), 48.0));
    plant.step();
    assert_eq!(current(&plant.truth()), Complex(0.0, 0.0));
    plant.step();
    let expected = 4.0 / R * (1.0 - (-H * R / L).exp());
    assert!((current(&plant.truth()).0 - expected).abs() < 1e-6);
}

/// Worst deviation, A, of the current from the closed form at constant speed over `periods`, with a
/// voltage of constant length in phase with the EMF that stands still within each `hold` periods.
fn worst_against_closed_form(speed_rpm: f64, volts: f64, hold: usize, periods: usize) -> f64 {
    let parameters = flywheel();
    let mut plant = Plant::<f32>::new(&parameters);
    let speed = f64::from(rpm(speed_rpm) as f32);
    plant.set_motion(0, speed as f32);
    let held = hold as f64 * H;
    let left = (-R / L * held).exp();
    let gain = (1.0 - left) / R;
    // Voltage of the k-th hold: V e^(j (ω (k + 1/2) held + π/2)).
    let voltage = |k: f64| Complex::polar(volts, speed * (k + 0.5) * held + PI / 2.0);
    let ratio = Complex::polar(1.0, speed * held);
    let mut worst = 0.0_f64;
    for n in 1..=periods / hold {
        plant.load(&duty(voltage((n - 1) as f64), 48.0));
        for _ in 0..hold {
            plant.step();
        }
        // Superposition from time zero, not step by step. Held voltages: a geometric series of
        // (1 - a)/R V_k a^(n-1-k). Magnet: the response to -jωψ e^(jωt) switched on at zero.
        let decay = left.powi(n as i32);
        let time = n as f64 * held;
        let series = Complex::polar(1.0, speed * time)
            .sub(Complex(decay, 0.0))
            .div(ratio.sub(Complex(left, 0.0)));
        let driven = voltage(0.0).mul(series).scale(gain);
        let induced = Complex(0.0, speed * PSI / L)
            .div(Complex(R / L, speed))
            .mul(Complex::polar(1.0, speed * time).sub(Complex(decay, 0.0)));
        let error = current(&plant.truth()).sub(driven.sub(induced)).length();
        worst = worst.max(error);
    }
    worst
}

#[test]
fn the_current_at_speed_is_the_closed_form() {
    // 50 ms: 10.75 turns at 12,900 rpm, 900 electrical time constants.
    for (speed, volts) in [
        (12_900.0, 24.0),
        (-12_900.0, 24.0),
        (600.0, 1.0),
        (1.0, 0.1),
        (0.0, 1.0),
    ] {
        for hold in [1, 5] {
            let worst = worst_against_closed_form(speed, volts, hold, 5_000);
            println!(
                "{speed} rpm, {volts} V held {} µs: worst {:.2} µA",
                10 * hold,
                worst * 1e6
            );
            assert!(worst < 20e-6, "{speed} rpm: {worst}");
        }
    }
}

#[test]
fn the_open_circuit_emf_is_root_three_p_psi_w_between_lines() {
    let mut plant = Plant::<f32>::new(&flywheel());
    let speed = 500.0;
    plant.set_motion(0, speed as f32);
    let (mut peak, mut worst) = (0.0_f64, 0.0_f64);
    for n in 1..=2_000 {
        plant.step();
        let truth = plant.truth();
        let [a, b, _] = truth.phase_emf_v.map(f64::from);
        peak = peak.max(a - b);
        // The derivative of the flux ψ cos θ linked with phase A.
        let expected = -speed * PSI * (speed * f64::from(n) * H).sin();
        worst = worst.max((a - expected).abs());
    }
    let expected = 3.0_f64.sqrt() * PSI * speed;
    assert!((peak / expected - 1.0).abs() < 1e-4, "{peak} {expected}");
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn an_open_bridge_conducts_only_above_the_bus() {
    let onset = (20.0 + 2.0 * 0.8) / (3.0_f64.sqrt() * PSI);
    let braking = |supply_v: f32, speed: f64| {
        let mut plant = Plant::<f32>::new(&flywheel());
        plant.set_supply_v(supply_v);
        plant.set_motion(0, speed as f32);
        plant.load(&OPEN);
        (0..5_000).fold(0.0_f32, |lowest, _| {
            plant.step();
            let torque = plant.truth().torque_nm;
            if torque < lowest { torque } else { lowest }
        })
    };
    assert_eq!(braking(20.0, 0.999 * onset), 0.0);
    assert_eq!(braking(20.0, -0.999 * onset), 0.0);
    assert!(braking(20.0, 1.02 * onset) < -1e-5);
    // Switched off, the bus is disconnected: nothing conducts at any speed.
    assert_eq!(braking(0.0, 1_300.0), 0.0);
}

#[test]
fn a_rectifying_bridge_agrees_with_a_brute_force_bridge_of_real_diodes() {
    // 1.5 times the speed of onset. Reference: three legs of exponential-free piecewise diodes (10 mΩ
    // on, 100 kΩ off), integrated implicitly in steps of 20 ns.
    let mut parameters = flywheel();
    parameters.supply_v = 20.0;
    let speed = 1.5 * 21.6 / (3.0_f64.sqrt() * PSI);
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_motion(0, speed as f32);
    plant.load(&OPEN);
    let turn = (TAU / speed / H) as usize;
    let (mut torque, mut count) = (0.0, 0.0);
    for n in 0..10 * turn {
        plant.step();
        if n >= 2 * turn {
            torque += f64::from(plant.truth().torque_nm);
            count += 1.0;
        }
    }
    let mean = torque / count;
    let reference = rectified_torque(speed, 20.0, 0.8);
    println!(
        "mean torque {:.4} mNm, reference {:.4} mNm",
        mean * 1e3,
        reference * 1e3
    );
    assert!((mean / reference - 1.0).abs() < 0.02, "{mean} {reference}");
}

/// Mean torque, Nm, of the motor into a diode bridge, from a fine simulation of its own.
fn rectified_torque(speed: f64, bus: f64, drop: f64) -> f64 {
    let step = 50e-9;
    let steps_per_turn = (TAU / speed / step) as usize;
    let mut i = [0.0_f64; 3];
    let (mut sum, mut count) = (0.0, 0.0);
    for n in 0..4 * steps_per_turn {
        let angle = speed * n as f64 * step;
        let emf: [f64; 3] =
            std::array::from_fn(|k| -speed * PSI * (angle - k as f64 * TAU / 3.0).sin());
        // A leg's terminal: within a few mA of zero current it slides from rail to rail.
        let slope = 2e-3;
        let terminal = i.map(|i| {
            let part = (-i / slope).clamp(-1.0, 1.0);
            0.5 * bus + part * (0.5 * bus + drop)
        });
        let star = (0..3).map(|k| terminal[k] - emf[k]).sum::<f64>() / 3.0;
        for k in 0..3 {
            // Implicit in the steep part of the leg, explicit elsewhere.
            let steep = if i[k].abs() < slope {
                (0.5 * bus + drop) / slope
            } else {
                0.0
            };
            let rate = (terminal[k] - star - emf[k] - R * i[k]) / L;
            i[k] += step * rate / (1.0 + step * (R + steep) / L);
        }
        let common = i.iter().sum::<f64>() / 3.0;
        i = i.map(|i| i - common);
        if n >= 2 * steps_per_turn {
            let power: f64 = (0..3).map(|k| emf[k] * i[k]).sum();
            sum += power / speed;
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn an_opened_bridge_runs_the_current_down_against_the_bus_to_exactly_zero() {
    let mut plant = Plant::<f32>::new(&prompt());
    plant.set_blocked(true);
    plant.load(&duty(Complex(13.1, 0.0), 48.0));
    for _ in 0..200 {
        plant.step();
    }
    let start = current(&plant.truth()).0;
    assert!((start - 2.0).abs() < 1e-5);
    plant.load(&OPEN);
    // A hangs on its lower diode, B and C on their upper ones: 2/3 of bus and drops against A.
    let against = (48.0 + 1.6) * 2.0 / 3.0;
    let end = L / R * (1.0 + start * R / against).ln();
    for n in 1..=10 {
        plant.step();
        let time = f64::from(n) * H;
        let expected = if time < end {
            (start + against / R) * (-time * R / L).exp() - against / R
        } else {
            0.0
        };
        let actual = current(&plant.truth()).0;
        assert!(
            (actual - expected).abs() < 5e-6,
            "{time}: {actual} {expected}"
        );
        if time > end {
            assert_eq!(plant.truth().phase_current_a, [0.0; 3]);
        }
    }
    assert!(end > H && end < 5.0 * H, "{end}");
}

#[test]
fn the_short_circuit_brakes_most_at_r_over_pl() {
    let mut parameters = flywheel();
    // Two pole pairs, to see p in the formula.
    parameters.motor.pole_pairs = 2;
    parameters.motor.flux_wb = PSI / 2.0;
    let p = 2.0;
    let flux = PSI / 2.0;
    let critical = R / (p * L);
    let braking = |speed: f64| {
        let mut plant = Plant::<f32>::new(&parameters);
        plant.set_motion(0, speed as f32);
        plant.load(&SHORTED);
        for _ in 0..300 {
            plant.step();
        }
        -f64::from(plant.truth().torque_nm)
    };
    let closed_form = |speed: f64| {
        1.5 * p * p * flux * flux * speed * R / (R * R + p * p * speed * speed * L * L)
    };
    for part in [0.01, 0.1, 0.3, 0.5, 0.9, 1.0, 1.1, 1.5, 2.0] {
        let (actual, expected) = (braking(part * critical), closed_form(part * critical));
        assert!(
            (actual / expected - 1.0).abs() < 1e-5,
            "{part}: {actual} {expected}"
        );
    }
    let peak = 1.5 * p * flux * flux / (2.0 * L);
    assert!((braking(critical) / peak - 1.0).abs() < 1e-5);
    assert!(braking(0.95 * critical) < peak && braking(1.05 * critical) < peak);
}

#[test]
fn a_bridge_without_supply_gives_no_voltage() {
    let mut plant = Plant::<f32>::new(&frictionless());
    plant.set_supply_v(0.0);
    plant.load(&duty(Complex(0.0, 12.0), 48.0));
    for _ in 0..100 {
        plant.step();
    }
    assert_eq!(plant.truth().phase_current_a, [0.0; 3]);
    assert_eq!(plant.sample().bus_adc, 0.0);
    // The logic lives on: encoder and current zeros still read.
    assert_eq!(plant.sample().encoder, 0x0DF8);
    assert_eq!(plant.sample().phase_adc, [1833.0, 2071.0]);
}
