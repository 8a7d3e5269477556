//! Missing phases and short circuits in a whole plant.

mod support;

use std::f64::consts::{PI, TAU};

use control::io::Sample;
use plant::{EC_MAX_22_283860 as MOTOR, EncoderFault, Phase, Plant, Short, VIRTUAL_P3};
use support::{Complex, OPEN, SHORTED, current, duty, flywheel, prompt, rpm};

const R: f64 = MOTOR.phase_resistance_ohm;
const L: f64 = MOTOR.phase_inductance_h;
const PSI: f64 = MOTOR.flux_wb;
const H: f64 = 10e-6;
const PHASES: [Phase; 3] = [Phase::A, Phase::B, Phase::C];

#[test]
fn with_a_phase_missing_the_other_two_are_a_loop_of_twice_the_impedance() {
    let mut plant = Plant::<f32>::new(&prompt());
    plant.set_blocked(true);
    plant.set_open_phase(Phase::A, true);
    let voltage = Complex::polar(8.0, 1.1);
    plant.load(&duty(voltage, 48.0));
    // Line voltage B to C.
    let line = 3.0_f64.sqrt() * voltage.1;
    for n in 1..=60 {
        plant.step();
        let [a, b, c] = plant.truth().phase_current_a.map(f64::from);
        let expected = line / (2.0 * R) * (1.0 - (-f64::from(n) * H * R / L).exp());
        assert!(a.abs() < 1e-7 && (b + c).abs() < 1e-6);
        assert!((b - expected).abs() < 2e-6, "{b} {expected}");
    }
    // Mended, it carries its part again.
    plant.set_open_phase(Phase::A, false);
    for _ in 0..100 {
        plant.step();
    }
    assert!(current(&plant.truth()).sub(voltage.scale(1.0 / R)).length() < 1e-5);
    // Two missing: nothing.
    plant.set_open_phase(Phase::B, true);
    plant.set_open_phase(Phase::C, true);
    plant.step();
    assert_eq!(plant.truth().phase_current_a, [0.0; 3]);
}

#[test]
fn a_turning_motor_with_a_missing_phase_brakes_at_twice_the_frequency() {
    // Shorted by the bridge with phase C open: i_ab = √3 ω ψ/|2Z|, of which the torque pulses.
    let speed = 300.0;
    let mut plant = Plant::<f32>::new(&flywheel());
    plant.set_open_phase(Phase::C, true);
    plant.set_motion(0, speed as f32);
    plant.load(&SHORTED);
    let turn = (TAU / speed / H).round() as usize;
    let mut mean = 0.0;
    for n in 0..3 * turn {
        plant.step();
        if n >= 2 * turn {
            mean += f64::from(plant.truth().torque_nm) / turn as f64;
        }
    }
    let square = R * R + speed * speed * L * L;
    // Power (√3 ω ψ)²/2 · 2R/(4 |Z|²), over the speed.
    let expected = -3.0 * speed * PSI * PSI * R / (4.0 * square);
    assert!((mean / expected - 1.0).abs() < 1e-3, "{mean} {expected}");
}

/// Periods that a plant switches before its gate drivers trip; and whether the bridge conducts no
/// more afterwards and a command to switch on does not help.
fn trip(short: Short, voltage: Complex, supply_v: f32) -> Option<u32> {
    let mut plant = Plant::<f32>::new(&prompt());
    plant.set_supply_v(supply_v);
    plant.set_blocked(true);
    plant.load(&duty(voltage, 48.0));
    for _ in 0..20 {
        plant.step();
    }
    assert!(!plant.sample().overcurrent);
    plant.set_short(Some(short));
    let mut periods = None;
    for n in 1..=100 {
        plant.step();
        if plant.sample().overcurrent {
            periods = Some(n);
            break;
        }
    }
    periods?;
    // The diodes have run the current down within 200 µs, but for what circulates in the short.
    plant.load(&duty(voltage, 48.0));
    for _ in 0..200 {
        plant.step();
    }
    assert!(plant.sample().overcurrent, "latched");
    assert!(current(&plant.truth()).length() < 1e-3);
    // Commanded off and on, with the short still there, it trips again; without, it does not.
    for there in [true, false] {
        plant.load(&OPEN);
        plant.step();
        assert!(!plant.sample().overcurrent);
        plant.set_short(there.then_some(short));
        plant.load(&duty(voltage, 48.0));
        for _ in 0..5 {
            plant.step();
        }
        assert_eq!(plant.sample().overcurrent, there);
    }
    periods
}

#[test]
fn a_short_circuit_trips_within_a_period_and_stays_until_the_bridge_is_off() {
    for phase in PHASES {
        for (short, volts) in [
            // So much that even the closest two phases stand apart by more than 1 µs twice.
            (Short::BesidePhase(phase), 27.0),
            // So little that no phase is on a rail for almost all of the time.
            (Short::ToNegative(phase), 12.0),
            (Short::ToPositive(phase), 12.0),
        ] {
            let voltage = Complex::polar(volts, PI / 12.0);
            assert_eq!(trip(short, voltage, 48.0), Some(1), "{short:?}");
        }
        // Hardly any voltage between the shorted phases: no pulse is long enough.
        let little = Complex::polar(0.5, 0.3);
        assert_eq!(trip(Short::BesidePhase(phase), little, 48.0), None);
    }
    // A bus too low for the threshold.
    assert_eq!(
        trip(Short::ToNegative(Phase::A), Complex(3.0, 0.0), 0.5),
        None
    );
}

#[test]
fn an_overcurrent_of_the_motor_itself_trips_too() {
    let mut parameters = prompt();
    parameters.bridge.overcurrent_a = 2.0;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_blocked(true);
    plant.load(&duty(Complex(0.0, 12.9), 48.0));
    for _ in 0..200 {
        plant.step();
    }
    assert!(!plant.sample().overcurrent);
    plant.load(&duty(Complex(0.0, 13.3), 48.0));
    for _ in 0..200 {
        plant.step();
    }
    assert!(plant.sample().overcurrent);
    assert_eq!(plant.truth().phase_current_a, [0.0; 3]);
}

#[test]
fn shorted_wires_of_a_turning_motor_carry_what_the_formula_says() {
    // Two phases tied, bridge open: the EMF between them over their impedance, √3 ω ψ/|2Z|.
    let speed = rpm(3_000.0);
    let mut plant = Plant::<f32>::new(&flywheel());
    plant.set_short(Some(Short::BesidePhase(Phase::A)));
    plant.set_motion(0, speed as f32);
    plant.load(&OPEN);
    let turn = (TAU / speed / H).round() as usize;
    let mut peak = 0.0_f32;
    for n in 0..2 * turn {
        plant.step();
        let [a, b, c] = plant.truth().phase_current_a;
        assert!(a.abs() < 1e-6 && (b + c).abs() < 1e-6);
        if n >= turn && b > peak {
            peak = b;
        }
    }
    let expected = 3.0_f64.sqrt() * speed * PSI / (2.0 * R.hypot(speed * L));
    assert!(
        (f64::from(peak) / expected - 1.0).abs() < 1e-3,
        "{peak} {expected}"
    );
}

#[test]
fn without_motor_power_the_sensors_live_and_without_logic_the_bridge_is_open() {
    let mut plant = Plant::<f32>::new(&VIRTUAL_P3);
    plant.set_motion(1 << 20, 100.0);
    plant.set_supply_v(0.0);
    for _ in 0..100 {
        plant.step();
    }
    let sample = plant.sample();
    assert!(plant.logic_powered() && sample.encoder_valid);
    assert!(sample.encoder > 0x0DF8 && sample.bus_adc == 0.0);
    plant.set_supply_v(48.0);
    plant.set_logic_supply_v(5.0);
    assert!(!plant.logic_powered());
    plant.set_blocked(true);
    plant.load(&duty(Complex(4.0, 0.0), 48.0));
    for _ in 0..10 {
        plant.step();
    }
    assert_eq!(plant.truth().phase_current_a, [0.0; 3]);
    plant.set_logic_supply_v(24.0);
    plant.load(&duty(Complex(4.0, 0.0), 48.0));
    for _ in 0..10 {
        plant.step();
    }
    assert!(plant.logic_powered() && plant.truth().phase_current_a[0] > 0.1);
}

#[test]
fn a_sagging_supply_lowers_the_bus_by_its_resistance() {
    let mut parameters = prompt();
    parameters.link = plant::Link::SMALL;
    parameters.link.source_ohm = 2.0;
    let mut plant = Plant::<f32>::new(&parameters);
    plant.set_blocked(true);
    plant.load(&duty(Complex(0.0, 20.0), 48.0));
    for _ in 0..2_000 {
        plant.step();
    }
    // Duty-fixed: phase voltage and bus scale together. P = 1.5 (k u)²/R, k = 20/48.
    let k = 20.0 / 48.0;
    let conductance = 1.5 * k * k / R + 1.0 / 10e3;
    let expected = 48.0 / (1.0 + 2.0 * conductance);
    let bus = f64::from(plant.truth().bus_voltage_v);
    assert!((bus / expected - 1.0).abs() < 1e-4, "{bus} {expected}");
    // Cut: the bus falls, the position is still read.
    plant.set_supply_v(0.0);
    for _ in 0..4_000 {
        plant.step();
    }
    let sample: Sample<f32> = plant.sample();
    assert!(plant.truth().bus_voltage_v < 1.0);
    assert!(sample.encoder_valid && sample.encoder == 0x0DF8);
    // And back.
    plant.set_supply_v(48.0);
    for _ in 0..2_000 {
        plant.step();
    }
    assert!((f64::from(plant.truth().bus_voltage_v) / expected - 1.0).abs() < 1e-4);
}

#[test]
fn encoder_faults_reach_the_sample() {
    let mut plant = Plant::<f32>::new(&VIRTUAL_P3);
    plant.set_encoder_fault(EncoderFault::NoAnswer);
    assert!(!plant.sample().encoder_valid);
    plant.set_encoder_fault(EncoderFault::None);
    plant.slip_magnet(1 << 30);
    assert_eq!(plant.sample().encoder, (0x0DF8 + 1024) % 4096);
    plant.set_magnet_mm(3.0);
    assert_eq!(plant.signals().magnet, control::io::Magnet::TooWeak);
}
