//! The dead time against its formula and against a bridge simulated switch by switch.

mod support;

use std::f64::consts::{PI, TAU};

use plant::{Bridge, EC_MAX_22_283860 as MOTOR, Parameters, Plant};
use support::{Complex, current, duty, flywheel, prompt};

const R: f64 = MOTOR.phase_resistance_ohm;
const L: f64 = MOTOR.phase_inductance_h;
const PSI: f64 = MOTOR.flux_wb;
const H: f64 = 10e-6;
const BUS: f64 = 48.0;
const DEAD: f64 = 200e-9;

fn with_dead_time(mut parameters: Parameters, diode_drop_v: f32) -> Parameters {
    parameters.bridge = Bridge {
        dead_time_s: DEAD,
        ..parameters.bridge
    };
    parameters.diode_drop_v = diode_drop_v;
    parameters.check().expect("possible parameters");
    parameters
}

/// Current of a locked rotor after 2 ms under a voltage, from 0.
fn locked(parameters: &Parameters, voltage: Complex) -> Complex {
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_blocked(true);
    plant.load(&duty(voltage, BUS));
    for _ in 0..200 {
        plant.step();
    }
    current(&plant.truth())
}

#[test]
fn a_direct_current_loses_four_thirds_of_the_dead_time_voltage() {
    // A takes what B and C give back: signs +, -, - are a vector of 4/3 along A.
    for drop in [0.0, 0.8] {
        let parameters = with_dead_time(prompt(), drop);
        let lost = DEAD / H * (BUS + 2.0 * f64::from(drop));
        for volts in [4.0, 10.0, -10.0, 20.0] {
            let got = locked(&parameters, Complex(volts, 0.0)).0;
            let error = volts - R * got;
            let theory = 4.0 / 3.0 * lost * volts.signum();
            println!("{volts} V, diodes {drop} V: {error:.5} V lost, theory {theory:.5} V");
            assert!((error / theory - 1.0).abs() < 1e-3, "{error} {theory}");
        }
    }
}

#[test]
fn a_voltage_below_the_dead_time_s_drives_nothing_and_nothing_chatters() {
    let parameters = with_dead_time(prompt(), 0.0);
    // Phase to phases: the error is 4/3 of 0.96 V.
    for volts in [0.3, 1.0, 1.27] {
        assert_eq!(locked(&parameters, Complex(volts, 0.0)), Complex(0.0, 0.0));
    }
    assert!(locked(&parameters, Complex(1.3, 0.0)).0 > 1e-3);
    // Between two phases: twice 0.96 V of line voltage, and the third floats.
    let between = |volts: f64| locked(&parameters, Complex(0.0, volts / 3.0_f64.sqrt()));
    assert_eq!(between(1.91), Complex(0.0, 0.0));
    let got = between(4.0);
    assert_eq!(got.0, 0.0);
    let expected = (4.0 - 2.0 * 0.96) / (2.0 * R) * 2.0 / 3.0_f64.sqrt();
    assert!(
        (got.1 / expected - 1.0).abs() < 1e-3,
        "{} {expected}",
        got.1
    );
}

#[test]
fn the_fundamental_is_four_over_pi_of_it_and_opposes_the_current() {
    // 100 Hz: 1,000 periods a turn. Some amperes of amplitude, against an EMF of 13 V.
    let periods = 1_000;
    let speed = TAU / (f64::from(periods) * H);
    let z = Complex::polar(1.0, speed * H);
    let left = (-R / L * H).exp();
    let gain = (1.0 - left) / R;
    let induced = Complex(0.0, speed * PSI / L)
        .div(Complex(R / L, speed))
        .mul(z.sub(Complex(left, 0.0)));
    for (drop, volts) in [(0.0, 24.0), (0.0, 5.0), (0.8, 24.0)] {
        let mut parameters = with_dead_time(flywheel(), drop);
        parameters.load_delay_periods = 0;
        let mut plant = Plant::<f32>::new(&parameters);
        plant.set_motion(0, speed as f32);
        let given = |n: f64| Complex::polar(volts, speed * n * H + 0.5 * PI);
        let mut fundamental = Complex(0.0, 0.0);
        for n in 0..4 * periods {
            if n >= 3 * periods {
                let back = Complex::polar(1.0 / f64::from(periods), -speed * f64::from(n) * H);
                fundamental = fundamental.add(current(&plant.truth()).mul(back));
            }
            plant.load(&duty(given(n.into()), BUS));
            plant.step();
        }
        // What voltage makes this current: the exact step, at this one frequency.
        let wanted = fundamental
            .mul(z.sub(Complex(left, 0.0)))
            .add(induced)
            .scale(1.0 / gain);
        let error = given(0.0).sub(wanted);
        let theory = 4.0 / PI * DEAD / H * (BUS + 2.0 * f64::from(drop));
        let along = error.dot(fundamental) / fundamental.length();
        println!(
            "{:.3} A, diodes {drop} V: {:.4} V lost, {along:.4} V of it along the current, theory {theory:.4} V",
            fundamental.length(),
            error.length(),
        );
        assert!((error.length() / theory - 1.0).abs() < 0.02);
        assert!((along / theory - 1.0).abs() < 0.02);
    }
}

/// Mean terminal voltages over a period in the steady state, from a bridge of switches and diodes
/// with its dead time, 2.5 ns a step, and the current's mean.
fn switched(fractions: [f64; 3], drop: f64) -> Complex {
    let step = 2.5e-9;
    let steps = (H / step) as usize;
    let mut i = [0.0_f64; 3];
    let mut mean = [0.0; 3];
    let periods = 150;
    for period in 0..periods {
        for n in 0..steps {
            let time = (n as f64 + 0.5) * step;
            let terminal: [f64; 3] = std::array::from_fn(|k| {
                // Centre-aligned: the upper switch is closed about the middle of the period, each
                // closing delayed by the dead time.
                let rise = 0.5 * H * (1.0 - fractions[k]);
                let fall = H - rise;
                let upper = time > rise + DEAD && time < fall;
                let lower = time < rise || time > fall + DEAD;
                if upper {
                    BUS
                } else if lower {
                    0.0
                } else {
                    // Within a milliampere of zero the terminal slides from rail to rail.
                    let part = (-i[k] / 1e-3).clamp(-1.0, 1.0);
                    0.5 * BUS + part * (0.5 * BUS + drop)
                }
            });
            let star = terminal.iter().sum::<f64>() / 3.0;
            for k in 0..3 {
                i[k] += step / L * (terminal[k] - star - R * i[k]);
                if period == periods - 1 {
                    mean[k] += i[k] / steps as f64;
                }
            }
        }
    }
    let [a, b, c] = mean;
    Complex((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt())
}

#[test]
fn a_bridge_switched_edge_by_edge_loses_the_same() {
    for (drop, voltage) in [
        (0.0, Complex(8.0, 0.0)),
        (0.8, Complex(8.0, 0.0)),
        (0.8, Complex::polar(12.0, 0.4)),
        // With a phase that spends almost the whole period on a rail: pulses of 150 and 50 ns.
        (0.0, Complex::polar(27.3, PI / 6.0)),
        (0.0, Complex::polar(27.6, PI / 6.0)),
    ] {
        let parameters = with_dead_time(prompt(), drop);
        let given = duty(voltage, BUS);
        let reference = switched(given.phase.map(f64::from), drop.into());
        let got = locked(&parameters, voltage);
        let (lost, theirs) = (
            voltage.sub(got.scale(R)).length(),
            voltage.sub(reference.scale(R)).length(),
        );
        println!(
            "{:.1} V at {:.1} rad: {lost:.4} V lost, switch by switch {theirs:.4} V",
            voltage.length(),
            voltage.1.atan2(voltage.0)
        );
        assert!((lost / theirs - 1.0).abs() < 0.02, "{lost} {theirs}");
        assert!(got.sub(reference).length() < 0.01 * got.length());
    }
}
