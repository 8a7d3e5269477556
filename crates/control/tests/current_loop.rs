//! The current loop on a motor: the step peaks that exact discretisation predicts.

mod rig;

use control::tuning::Pi;
use control::{Command, FrameSource};
use rig::*;

/// Greatest q current at the control instants after a step to 0.5 A with a locked rotor, as a
/// multiple of it; and the same long after.
fn step(current: Pi, delay: usize) -> (f64, f64) {
    let mut rig = Rig::new(&parameters(current, 100.0, 20.0));
    rig.locked = true;
    rig.quantised = false;
    rig.delay = delay;
    rig.cascade.load(&Command {
        enabled: true,
        current: 0.5,
        ..Command::idle()
    });
    rig.run(0.02);
    let peak = rig.peak_a / 0.5;
    (peak, rig.rotor_current().1 / 0.5)
}

/// Peaks that follow from zero-order hold, the winding's exact decay and forward Euler integration,
/// for a duty that loads one PWM period (0.2 Ts) or a whole control period (1.0 Ts) late.
#[test]
fn step_peaks_are_those_of_the_exact_discrete_loop() {
    for (name, gains, delay, peak) in [
        ("second order 2,000 Hz", second_order(2000.0), 1, 1.09),
        ("second order 3,000 Hz", second_order(3000.0), 1, 1.24),
        ("second order 2,000 Hz", second_order(2000.0), 5, 1.33),
        ("pole-zero 500 Hz", pole_zero(500.0), 1, 1.00),
        ("pole-zero 1,000 Hz", pole_zero(1000.0), 1, 1.01),
        ("pole-zero 2,000 Hz", pole_zero(2000.0), 1, 1.11),
        ("pole-zero 3,000 Hz", pole_zero(3000.0), 1, 1.22),
        ("pole-zero 1,000 Hz", pole_zero(1000.0), 5, 1.12),
        ("pole-zero 2,000 Hz", pole_zero(2000.0), 5, 1.54),
    ] {
        let (got, end) = step(gains, delay);
        println!("{name}, {delay} PWM periods: peak {got:.3}, end {end:.5}");
        assert!((got - peak).abs() < 0.0125, "{name}: {got} for {peak}");
        assert!((end - 1.0).abs() < 1e-3, "{name}: {end}");
    }
}

#[test]
fn with_the_short_delay_5000_hz_is_still_stable() {
    let (_, end) = step(second_order(5000.0), 1);
    assert!((end - 1.0).abs() < 1e-3, "{end}");
}

#[test]
fn a_lower_supply_changes_nothing_but_the_duty() {
    let mut ends = [0.0; 2];
    for (end, bus_v) in ends.iter_mut().zip([24.0, 48.0]) {
        let mut rig = Rig::new(&defaults());
        rig.locked = true;
        rig.bus_v = bus_v;
        rig.cascade.load(&Command {
            enabled: true,
            current: 0.5,
            ..Command::idle()
        });
        rig.run(0.000_2);
        *end = rig.rotor_current().1;
        rig.run(0.02);
        let bus = f64::from(rig.cascade.feedback().bus_voltage_v);
        assert!((bus - bus_v).abs() < 0.01, "{bus}");
    }
    assert!((ends[0] - ends[1]).abs() < 2e-3, "{ends:?}");
}

/// More current than the supply can drive: the loop saturates, and comes back without windup.
#[test]
fn saturation_does_not_wind_up() {
    let mut rig = Rig::new(&defaults());
    rig.locked = true;
    let mut command = Command {
        enabled: true,
        current: 10.0,
        ..Command::idle()
    };
    rig.bus_v = 12.0;
    rig.cascade.load(&command);
    rig.run(0.05);
    let feedback = rig.cascade.feedback();
    assert!(feedback.voltage_limited && feedback.current_limited);
    let stall = 12.0 / 3.0_f64.sqrt() / PHASE_R_OHM;
    assert!((rig.rotor_current().1 - stall).abs() < 0.02 * stall);
    command.current = 0.3;
    rig.cascade.load(&command);
    rig.run(0.000_5);
    let current = rig.rotor_current().1;
    assert!((current - 0.3).abs() < 0.02, "{current}");
    assert!(!rig.cascade.feedback().voltage_limited);
}

/// At speed the frame must be where the rotor will be, or d and q mix.
#[test]
fn at_speed_the_axes_stay_apart() {
    for rpm in [3_000.0, -10_000.0] {
        let mut rig = Rig::new(&defaults());
        rig.speed = rpm * RPM;
        // The load takes what 0.4 A make: the speed stays.
        rig.load = KT_NM_PER_A * 0.4;
        rig.cascade.load(&Command {
            enabled: true,
            current: 0.4,
            ..Command::idle()
        });
        rig.run(0.02);
        let (mut d, mut q) = (0.0, 0.0);
        for _ in 0..2000 {
            rig.period();
            let (id, iq) = rig.rotor_current();
            d += id / 2000.0;
            q += iq / 2000.0;
        }
        println!(
            "{rpm} rpm: d {d:.4} A, q {q:.4} A, speed {:.1} rpm",
            rig.speed / RPM
        );
        assert!(d.abs() < 0.01 && (q - 0.4).abs() < 0.01, "{d} {q}");
    }
}

#[test]
fn enabling_at_speed_draws_no_surge() {
    for feed_forward in [0.0, 1.0] {
        let mut parameters = defaults();
        parameters.gains.emf_feed_forward = feed_forward;
        let mut rig = Rig::new(&parameters);
        rig.speed = 8_000.0 * RPM;
        rig.run(0.02);
        assert_eq!(rig.peak_a, 0.0);
        rig.cascade.load(&Command {
            enabled: true,
            ..Command::idle()
        });
        rig.run(0.02);
        // Without presetting the integrator it would be ωψ/R = 2.7 A.
        println!("peak {:.3} A", rig.peak_a);
        assert!(rig.peak_a < 0.15, "{}", rig.peak_a);
    }
}

/// P3 mode 12, with which the electrical zero is calibrated (P3 l.256): the rotor comes to rest
/// under the given angle, with V/R in the phase.
#[test]
fn a_given_voltage_and_angle_hold_the_rotor_there() {
    for (angle, turn) in [(0, 0.0), (1 << 30, 0.25), (-(1 << 29), -0.125)] {
        let mut rig = Rig::new(&defaults());
        rig.angle = 1.0;
        rig.friction = 2e-5;
        rig.cascade.load(&Command {
            enabled: true,
            frame: FrameSource {
                angle_given: true,
                angle,
                turn: 0,
                voltage_given: true,
                voltage_d_v: 0.358 * 6.55,
                voltage_q_v: 0.0,
            },
            ..Command::idle()
        });
        rig.run(1.0);
        let rest = rig.angle / std::f64::consts::TAU;
        assert!((rest - turn).abs() < 1e-3, "{rest} {turn}");
        let (d, q) = rig.rotor_current();
        assert!((d - 0.358).abs() < 1e-3 && q.abs() < 1e-3, "{d} {q}");
        let feedback = rig.cascade.feedback();
        assert!((feedback.current_d_a - 0.358).abs() < 5e-3);
        assert_eq!(feedback.demand_current_a, 0.0);
        assert!((feedback.voltage_v[0] - 2.3449).abs() < 1e-3);
    }
}

/// A voltage for six times the limit: the current stays within it but for the first moments, with
/// the rotor locked and while it swings, and the whole voltage is back when the limit is.
#[test]
fn a_given_voltage_gives_way_to_the_current_limit() {
    for (locked, limit) in [(true, 0.7), (false, 0.7), (true, 2.0)] {
        let mut rig = Rig::new(&defaults());
        rig.locked = locked;
        rig.friction = 2e-5;
        let mut command = Command {
            enabled: true,
            current_limit: limit,
            frame: FrameSource {
                angle_given: true,
                voltage_given: true,
                voltage_d_v: 4.2 * 6.55,
                ..FrameSource::rotor()
            },
            ..Command::idle()
        };
        rig.cascade.load(&command);
        rig.run(0.02);
        let first = rig.peak_a;
        rig.peak_a = 0.0;
        rig.run(0.5);
        let (d, _) = rig.rotor_current();
        println!(
            "locked {locked}, limit {limit}: first {first:.3}, then {:.3} A",
            rig.peak_a
        );
        assert!(first < 4.3, "{first}");
        assert!(rig.peak_a < 1.02 * f64::from(limit), "{}", rig.peak_a);
        assert!((d - f64::from(limit)).abs() < 0.01, "{d}");
        assert!(rig.cascade.feedback().current_limited);

        command.current_limit = 5.0;
        rig.cascade.load(&command);
        rig.run(0.5);
        let (d, _) = rig.rotor_current();
        assert!((d - 4.2).abs() < 0.01, "{d}");
        assert!(!rig.cascade.feedback().current_limited);

        // Nothing allowed is nothing applied.
        command.current_limit = 0.0;
        rig.cascade.load(&command);
        rig.run(0.01);
        let (d, q) = rig.rotor_current();
        assert!(d.abs() < 0.02 && q.abs() < 0.02, "{d} {q}");
    }
}

/// Mode 12 counts for I²t, too: 1 A of 0.716 A continuous, until the sum reaches Ip·t, and then the
/// continuous current.
#[test]
fn a_given_voltage_is_limited_by_i2t() {
    let mut parameters = defaults();
    parameters.i2t.enabled = true;
    let mut rig = Rig::new(&parameters);
    rig.locked = true;
    rig.cascade.load(&Command {
        enabled: true,
        frame: FrameSource {
            angle_given: true,
            voltage_given: true,
            voltage_d_v: 1.0 * 6.55,
            ..FrameSource::rotor()
        },
        ..Command::idle()
    });
    // (1.0² − 0.716²)·t = 3.5·0.5
    let trips = 1.75 / (1.0 - 0.716 * 0.716);
    rig.run(trips - 0.03);
    assert!(!rig.cascade.feedback().i2t_active);
    assert!((rig.rotor_current().0 - 1.0).abs() < 5e-3);
    rig.run(0.06);
    assert!(rig.cascade.feedback().i2t_active);
    assert!(
        (rig.rotor_current().0 - 0.716).abs() < 5e-3,
        "{:?}",
        rig.rotor_current()
    );
}
