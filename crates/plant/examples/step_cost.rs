//! What a PWM period of the plant costs on this machine: `cargo run --release -p servobus-plant
//! --example step_cost`.

use std::hint::black_box;
use std::time::Instant;

use control::io::Duty;
use plant::{COMPLETE_P3, FULL_P3, Parameters, Plant, VIRTUAL_P3};

/// Short runs, so that some of them have the processor to themselves.
const PERIODS: u32 = 10_000;
const RUNS: u32 = 500;
const STEPS: u32 = 5;

/// Best of several runs, ns per control period: five steps, a load, a sample and the signals.
fn control_period_ns(parameters: &Parameters, enabled: bool) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let mut plant = Plant::<f32>::new(parameters);
        plant.set_motion(0, 200.0);
        let start = Instant::now();
        for period in 0..PERIODS {
            let phase = [0.5 + (period & 7) as f32 * 0.01, 0.5, 0.45];
            plant.load(black_box(&Duty { phase, enabled }));
            plant.run(STEPS);
            black_box((plant.sample(), plant.signals()));
        }
        let ns = start.elapsed().as_nanos() as f64 / f64::from(PERIODS);
        best = if ns < best { ns } else { best };
    }
    best
}

fn main() {
    let cold = Parameters {
        thermal: None,
        ..VIRTUAL_P3
    };
    for (world, parameters) in [
        ("no heat", &cold),
        ("usual", &VIRTUAL_P3),
        ("full electrical", &FULL_P3),
        ("complete", &COMPLETE_P3),
    ] {
        for (name, enabled) in [("switching", true), ("open", false)] {
            let ns = control_period_ns(parameters, enabled);
            println!("{world}, bridge {name}: {ns:.1} ns per control period");
        }
    }
}
