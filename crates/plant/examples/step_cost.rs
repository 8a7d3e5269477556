//! What a PWM period of the plant costs on this machine: `cargo run --release -p servobus-plant
//! --example step_cost`.

use std::hint::black_box;
use std::time::Instant;

use control::io::Duty;
use plant::{FULL_P3, Parameters, Plant, VIRTUAL_P3};

const PERIODS: u32 = 2_000_000;
const STEPS: u32 = 5;

/// Best of several runs, ns per control period of five steps, a load and a sample.
fn control_period_ns(parameters: &Parameters, enabled: bool) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let mut plant = Plant::<f32>::new(parameters);
        plant.set_motion(0, 200.0);
        let start = Instant::now();
        for period in 0..PERIODS {
            let phase = [0.5 + (period & 7) as f32 * 0.01, 0.5, 0.45];
            plant.load(black_box(&Duty { phase, enabled }));
            for _ in 0..STEPS {
                plant.step();
            }
            black_box(plant.sample());
        }
        let ns = start.elapsed().as_nanos() as f64 / f64::from(PERIODS);
        best = if ns < best { ns } else { best };
    }
    best
}

fn main() {
    for (world, parameters) in [("ideal", VIRTUAL_P3), ("full", FULL_P3)] {
        for (name, enabled) in [("switching", true), ("open", false)] {
            let ns = control_period_ns(&parameters, enabled);
            println!(
                "{world} world, bridge {name}: {ns:.1} ns per control period of {STEPS} steps and a sample"
            );
        }
    }
}
