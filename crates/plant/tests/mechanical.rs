//! The shaft against closed forms.

mod support;

use std::f64::consts::TAU;

use plant::{Parameters, Plant};
use support::{OPEN, frictionless, rpm};

const J: f64 = 4.45e-7;
const H: f64 = 10e-6;

fn coasting(parameters: &Parameters, speed: f64) -> Plant<f32> {
    let mut plant = Plant::<f32>::new(parameters);
    plant.load(&OPEN);
    plant.set_motion(0, speed as f32);
    plant
}

fn with_friction(coulomb: f64, viscous: f64) -> Parameters {
    let mut parameters = frictionless();
    parameters.motor.coulomb_friction_nm = coulomb;
    parameters.motor.static_friction_nm = coulomb;
    parameters.motor.viscous_friction_nms = viscous;
    parameters
}

fn speed(plant: &Plant<f32>) -> f64 {
    plant.truth().speed_rad_s.into()
}

/// Time since the shaft had its first speed: `set_motion` gives the mean of the first period, which
/// is the speed in the middle of it.
fn time(periods: u32) -> f64 {
    (f64::from(periods) - 0.5) * H
}

#[test]
fn viscous_friction_coasts_down_exponentially() {
    let viscous = 2e-6;
    let mut plant = coasting(&with_friction(0.0, viscous), 500.0);
    for n in 1..=100_000 {
        plant.step();
        if n % 1_000 == 0 {
            let expected = 500.0 * (-viscous / J * time(n)).exp();
            let actual = f64::from(plant.truth().speed_rad_s);
            assert!(
                (actual / expected - 1.0).abs() < 3e-5,
                "{n}: {actual} {expected}"
            );
        }
    }
    // A second later: 1.1 % of the speed is left.
    assert!((speed(&plant) / 500.0 - 0.0112).abs() < 1e-4);
}

#[test]
fn coulomb_friction_coasts_down_in_a_straight_line_and_stops() {
    let coulomb = 1.2e-3;
    let mut plant = coasting(&with_friction(coulomb, 0.0), 300.0);
    let stop = 300.0 * J / coulomb;
    for n in 1..=20_000 {
        plant.step();
        if time(n) < stop - H {
            let expected = 300.0 - coulomb / J * time(n);
            assert!(
                (speed(&plant) - expected).abs() < 1e-3,
                "{n}: {}",
                speed(&plant)
            );
        } else if time(n) > stop + H {
            assert_eq!(speed(&plant), 0.0);
        }
    }
    // The way is ω²J/2T, and the half period before.
    let way = (300.0_f64.powi(2) * J / (2.0 * coulomb) + 300.0 * 0.5 * H) / TAU;
    let turns = plant.truth().position_turns();
    assert!((turns - way).abs() < 1e-5, "{turns} {way}");
}

#[test]
fn both_frictions_coast_down_on_the_shifted_exponential() {
    let (coulomb, viscous) = (1.2e-3, 0.76e-6);
    let mut plant = coasting(&with_friction(coulomb, viscous), 1_300.0);
    // Below the bus: no diode conducts at 1,300 rad/s and 48 V.
    let ratio = coulomb / viscous;
    for n in 1..=40_000 {
        plant.step();
        let expected = (1_300.0 + ratio) * (-viscous / J * time(n)).exp() - ratio;
        if expected > 0.1 {
            assert!(
                (speed(&plant) - expected).abs() < 1e-3,
                "{n}: {} {expected}",
                speed(&plant)
            );
        }
    }
    assert_eq!(speed(&plant), 0.0);
}

#[test]
fn stiction_holds_and_lets_go() {
    let mut parameters = with_friction(1.2e-3, 0.0);
    parameters.motor.static_friction_nm = 1.5e-3;
    let mut plant = coasting(&parameters, 0.0);
    for torque in [1.0e-3, 1.49e-3, -1.49e-3] {
        plant.set_load_torque_nm(torque);
        for _ in 0..100_000 {
            plant.step();
        }
        let truth = plant.truth();
        assert_eq!(
            (truth.angle, truth.turns, truth.speed_rad_s),
            (0, 0, 0.0),
            "{torque}"
        );
    }
    // Past the break-away the lower Coulomb friction acts: 0.31 mNm accelerate, backward.
    plant.set_load_torque_nm(1.51e-3);
    for _ in 0..1_000 {
        plant.step();
    }
    let expected = -0.31e-3 / J * 10e-3;
    assert!(
        (speed(&plant) / expected - 1.0).abs() < 1e-3,
        "{} {expected}",
        speed(&plant)
    );
    // And below it, but above Coulomb, a moving shaft goes on.
    plant.set_load_torque_nm(1.3e-3);
    let before = speed(&plant);
    for _ in 0..1_000 {
        plant.step();
    }
    assert!(speed(&plant) < before);
}

#[test]
fn a_torque_that_trembles_below_the_break_away_moves_nothing() {
    let mut plant = Plant::<f32>::new(&with_friction(1.2e-3, 0.76e-6));
    for n in 0..100_000 {
        // ±0.2 V in quadrature: ±30 mA, ±0.96 mNm; and a load of 0.2 mNm.
        let volts = if (n / 50) % 2 == 0 { 0.2 } else { -0.2 };
        plant.load(&support::duty(support::Complex(0.0, volts), 48.0));
        plant.set_load_torque_nm(0.2e-3);
        plant.step();
    }
    assert_eq!((plant.truth().angle, plant.truth().speed_rad_s), (0, 0.0));
}

#[test]
fn friction_never_speeds_a_shaft_up_nor_turns_it_round() {
    for start in [1e-6, 0.013, -0.5, 7.0, -1_250.0] {
        let mut plant = coasting(&with_friction(1e-5, 3e-7), start);
        let mut last = speed(&plant).abs();
        for _ in 0..60_000 {
            plant.step();
            let now = speed(&plant);
            assert!(
                now.abs() <= last && now * start >= 0.0,
                "{start}: {last} {now}"
            );
            last = now.abs();
        }
    }
}

#[test]
fn a_shaft_of_a_hundredth_rpm_does_not_stall_in_a_minute() {
    let slow = rpm(0.01);
    for direction in [1.0, -1.0] {
        let mut plant = coasting(&frictionless(), direction * slow);
        for _ in 0..6_000_000 {
            plant.step();
        }
        let turns = plant.truth().position_turns();
        assert!((turns * direction / 0.01 - 1.0).abs() < 1e-6, "{turns}");
    }
}

#[test]
fn a_feeble_torque_on_a_fast_heavy_shaft_is_not_lost() {
    // 22 nrad/s a period at 1,000 rad/s, where the last bit of an f32 is 61 µrad/s.
    let mut parameters = frictionless();
    parameters.load.inertia_kgm2 = 1e-2 - J;
    let mut plant = coasting(&parameters, 1_000.0);
    plant.set_load_torque_nm(-2e-5);
    for _ in 0..1_000_000 {
        plant.step();
    }
    let gained = speed(&plant) - 1_000.0;
    // 20 µNm for 10 s on 0.01 kg m².
    assert!((gained - 0.02).abs() < 1.3e-4, "{gained}");
}

#[test]
fn turns_are_counted_through_every_wrap_in_both_directions() {
    // Thrown up against a weight: 72 turns forward, then backward through zero to -215. The supply
    // is off, or the diodes would brake.
    let mut plant = coasting(&frictionless(), 3_000.0);
    plant.set_supply_v(0.0);
    plant.set_load_torque_nm(4.45e-3);
    let (mut lowest, mut highest) = (0.0_f64, 0.0_f64);
    for n in 1..=90_000 {
        plant.step();
        // The speed of the first period is the one given, so 3,000 rad/s is the speed at H/2 and
        // the parabola's zero lies where the sum of the periods' mean speeds puts it.
        let n = f64::from(n);
        let way = (3_000.0 * n - 1e4 * H * 0.5 * n * (n - 1.0)) * H / TAU;
        let turns = plant.truth().position_turns();
        assert!((turns - way).abs() < 1e-4, "{n}: {turns} {way}");
        (lowest, highest) = (lowest.min(turns), highest.max(turns));
    }
    assert!(highest > 71.0 && lowest < -214.0, "{lowest} {highest}");
}

#[test]
fn a_blocked_shaft_stays_and_a_freed_one_moves() {
    let mut plant = coasting(&frictionless(), 100.0);
    for _ in 0..10 {
        plant.step();
    }
    plant.set_blocked(true);
    let angle = plant.truth().angle;
    plant.set_load_torque_nm(-1.0);
    for _ in 0..100 {
        plant.step();
        assert_eq!(
            (plant.truth().angle, plant.truth().speed_rad_s),
            (angle, 0.0)
        );
    }
    plant.set_blocked(false);
    for _ in 0..10 {
        plant.step();
    }
    assert!(plant.truth().speed_rad_s > 100.0);
}

#[test]
fn another_pwm_period_keeps_the_motion() {
    let viscous = 2e-6;
    let mut plant = coasting(&with_friction(0.0, viscous), 500.0);
    for _ in 0..10_000 {
        plant.step();
    }
    plant.set_pwm_period_s(12.5e-6);
    for _ in 0..8_000 {
        plant.step();
    }
    let expected = 500.0 * (-viscous / J * 0.2).exp();
    assert!((speed(&plant) / expected - 1.0).abs() < 1e-4);
    assert_eq!(plant.parameters().pwm_period_s, 12.5e-6);
}

#[test]
fn the_encoder_follows_the_shaft() {
    let mut plant = coasting(&frictionless(), 10.0);
    let mut last = plant.sample().encoder;
    let mut travelled = 0;
    for _ in 0..100_000 {
        plant.step();
        let now = plant.sample().encoder;
        let change = (now - last + 2048).rem_euclid(4096) - 2048;
        assert!((0..=1).contains(&change), "{last} {now}");
        travelled += change;
        last = now;
    }
    // One second at 10 rad/s.
    assert_eq!(travelled, (10.0 / TAU * 4096.0_f64).round() as i32);
}
