//! The same voltages on the same motor in motulator, which switches its bridge edge by edge and solves
//! the motor's equations with a Runge-Kutta method: `python/reference/motulator_currents.py`.

mod support;

use std::f64::consts::{PI, TAU};

use plant::{Parameters, Plant};
use support::{Complex, duty, prompt, rpm};

const FIGURES: &str = include_str!("reference/motulator_currents.csv");
const H: f64 = 10e-6;

/// The figures of a scenario: PWM periods since the start, and the phase currents, A.
fn figures(scenario: &str) -> Vec<(usize, [f64; 3])> {
    let rows: Vec<_> = FIGURES
        .lines()
        .filter_map(|line| {
            let mut columns = line.split(',');
            (columns.next() == Some(scenario)).then(|| {
                let mut number = || columns.next().expect("five columns");
                let period = number().parse().expect("a count of periods");
                let currents = std::array::from_fn(|_| number().parse().expect("a current"));
                (period, currents)
            })
        })
        .collect();
    assert!(rows.len() > 30, "{scenario}: {} rows", rows.len());
    rows
}

/// Worst deviation of a phase current as a part of the scenario's greatest.
fn worst(
    scenario: &str,
    parameters: &Parameters,
    speed_rad_s: f64,
    voltage: impl Fn(f64) -> Complex,
) -> f64 {
    parameters.check().expect("possible parameters");
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_motion(0, speed_rad_s as f32);
    let (mut period, mut worst, mut greatest) = (0, 0.0_f64, 0.0_f64);
    for (at, theirs) in figures(scenario) {
        while period < at {
            plant.load(&duty(voltage((period as f64 + 0.5) * H), 48.0));
            plant.step();
            period += 1;
        }
        let ours = plant.truth().phase_current_a.map(f64::from);
        for (ours, theirs) in ours.into_iter().zip(theirs) {
            let off = (ours - theirs).abs();
            worst = if off > worst { off } else { worst };
            greatest = if theirs.abs() > greatest {
                theirs.abs()
            } else {
                greatest
            };
        }
    }
    println!(
        "{scenario}: worst {:.3} mA of {greatest:.3} A, {:.3} %",
        worst * 1e3,
        worst / greatest * 100.0
    );
    worst / greatest
}

/// The bar of two percent, for the motor with the viscous part of its friction alone: motulator's has
/// no Coulomb friction.
const BAR: f64 = 0.02;

fn viscous_only() -> Parameters {
    let mut parameters = prompt();
    parameters.motor.coulomb_friction_nm = 0.0;
    parameters.motor.static_friction_nm = 0.0;
    parameters
}

fn massive() -> Parameters {
    let mut parameters = viscous_only();
    parameters.motor.viscous_friction_nms = 0.0;
    parameters.load.inertia_kgm2 = 1e6;
    parameters
}

#[test]
fn a_locked_rotor() {
    let off = worst("locked", &massive(), 0.0, |time| {
        if time < 1e-3 {
            Complex(4.0, 0.0)
        } else {
            Complex::polar(9.0, 2.0)
        }
    });
    assert!(off < BAR, "{off}");
}

#[test]
fn at_12_900_rpm() {
    let speed = rpm(12_900.0);
    let off = worst("at_speed", &massive(), speed, |time| {
        Complex::polar(24.0, speed * time + PI / 2.0)
    });
    assert!(off < BAR, "{off}");
}

#[test]
fn from_rest_to_6000_rpm_in_step() {
    let parameters = viscous_only();
    let flux = parameters.motor.flux_wb;
    let off = worst("spin_up", &parameters, 0.0, |time| {
        let top = TAU * 100.0;
        let (speed, angle) = if time < 60e-3 {
            let speed = top * time / 60e-3;
            (speed, speed * time / 2.0)
        } else {
            (top, top * (time - 30e-3))
        };
        Complex::polar(2.5 + flux * speed, angle + 0.6)
    });
    assert!(off < BAR, "{off}");
}
