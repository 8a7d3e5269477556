//! Hard stops against closed forms: how high a mass bounces, how far it presses, what it loses.

mod support;

use std::f64::consts::{PI, TAU};

use plant::{Invalid, Load, Parameters, Plant, Stops};
use support::{OPEN, frictionless};

const J: f64 = 4.45e-7;

fn stopped(stiffness: f64, damping_ratio: f64) -> Parameters {
    let mut parameters = frictionless();
    parameters.load = Load {
        stops: Some(Stops {
            lowest_turns: -1.25,
            highest_turns: 2.5,
            stiffness_nm_per_rad: stiffness,
            damping_ratio,
        }),
        ..Load::NONE
    };
    parameters
}

fn thrown(parameters: &Parameters, speed: f32) -> Plant<f32> {
    assert_eq!(parameters.check(), Ok(()));
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_supply_v(0.0);
    plant.load(&OPEN);
    plant.set_motion(0, speed);
    plant
}

/// Speed after the bounce over the speed before it, for a spring with a damper that only push.
fn restitution(zeta: f64) -> f64 {
    let root = (1.0 - zeta * zeta).sqrt();
    let phase = PI - (2.0 * zeta * root).atan2(1.0 - 2.0 * zeta * zeta);
    (-zeta / root * phase).exp()
}

#[test]
fn a_bounce_leaves_the_energy_that_its_damping_says() {
    for zeta in [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.65] {
        for stiffness in [0.2, 1.0, 5.0] {
            for speed in [20.0, 150.0, -150.0, -600.0] {
                let mut plant = thrown(&stopped(stiffness, zeta), speed);
                let mut periods = 0;
                while plant.truth().speed_rad_s * speed > 0.0 {
                    plant.step();
                    periods += 1;
                    assert!(periods < 200_000);
                }
                // Off the stop, long after any contact.
                for _ in 0..2_000 {
                    plant.step();
                }
                let back = f64::from(plant.truth().speed_rad_s / -speed);
                let expected = restitution(zeta);
                assert!(
                    (back - expected).abs() < 6e-3,
                    "{zeta} {stiffness} {speed}: {back} {expected}"
                );
            }
        }
    }
}

#[test]
fn the_table_of_the_documentation_is_right() {
    for (zeta, percent) in [
        (0.0, 100.0),
        (0.1, 74.0),
        (0.2, 57.0),
        (0.3, 45.0),
        (0.5, 30.0),
    ] {
        assert!(
            (100.0 * restitution(zeta) - percent).abs() < 0.5,
            "{zeta} {}",
            restitution(zeta)
        );
    }
}

#[test]
fn an_elastic_stop_keeps_the_energy_through_a_hundred_bounces() {
    let mut plant = thrown(&stopped(5.0, 0.0), 300.0);
    let (mut bounces, mut last) = (0, 300.0_f32);
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for _ in 0..2_000_000 {
        plant.step();
        let truth = plant.truth();
        bounces += u32::from(truth.speed_rad_s * last < 0.0);
        last = if truth.speed_rad_s == 0.0 {
            last
        } else {
            truth.speed_rad_s
        };
        let turns = truth.position_turns();
        (low, high) = (low.min(turns), high.max(turns));
    }
    assert!(bounces > 150, "{bounces}");
    assert!((f64::from(last.abs()) / 300.0 - 1.0).abs() < 0.02, "{last}");
    // Half a period of √(J/k) at 300 rad/s goes 0.089 rad into the stop.
    let depth = 300.0 * (J / 5.0).sqrt() / TAU;
    assert!((low + 1.25 + depth).abs() < 0.02 * depth, "{low}");
    assert!((high - 2.5 - depth).abs() < 0.02 * depth, "{high}");
}

#[test]
fn a_mass_pressed_against_a_stop_comes_to_rest_where_the_spring_holds_it() {
    for (torque, end) in [(30e-3, 2.5), (-30e-3, -1.25)] {
        let mut plant = thrown(&stopped(5.0, 0.3), 0.0);
        plant.set_load_torque_nm(-torque as f32);
        let mut rattling = 0;
        for n in 0..60_000 {
            plant.step();
            rattling += u32::from(n > 50_000 && plant.truth().speed_rad_s.abs() > 1e-3);
        }
        let rest = end + torque / 5.0 / TAU;
        let turns = plant.truth().position_turns();
        assert!((turns - rest).abs() < 1e-6, "{turns} {rest}");
        assert_eq!(rattling, 0);
    }
}

#[test]
fn a_stop_never_pulls_and_never_gives_energy() {
    // Thrown against the stop with friction, damping beyond critical: it does not bounce, and the
    // damper does not hold it back either.
    for zeta in [1.0, 3.0, 50.0] {
        let mut plant = thrown(&stopped(2.0, zeta), 200.0);
        let mut fastest_back = 0.0_f32;
        for _ in 0..50_000 {
            plant.step();
            let speed = plant.truth().speed_rad_s;
            fastest_back = if speed < fastest_back {
                speed
            } else {
                fastest_back
            };
        }
        // e^-2 of the speed at critical damping, less beyond.
        assert!(
            (-28.0..=0.0).contains(&fastest_back),
            "{zeta} {fastest_back}"
        );
        // A weight pulls it off without resistance.
        plant.set_motion(0x4000_0000, 0.0);
        let before = plant.truth().position_turns();
        plant.set_load_torque_nm(1e-3);
        for _ in 0..1_000 {
            plant.step();
        }
        let way = before - plant.truth().position_turns();
        assert!(
            (way / (1e-3 / J * 1e-4 / 2.0 / TAU) - 1.0).abs() < 1e-2,
            "{way}"
        );
    }
}

#[test]
fn a_stop_too_stiff_for_the_steps_still_bounces_honestly() {
    for stiffness in [1e3, 1e6, 1e12] {
        for zeta in [0.0, 0.3] {
            let mut plant = thrown(&stopped(stiffness, zeta), 400.0);
            for _ in 0..1_000_000 {
                plant.step();
                assert!(plant.truth().speed_rad_s.abs() < 410.0);
            }
            let turns = plant.truth().position_turns();
            assert!((-1.3..2.55).contains(&turns), "{turns}");
        }
    }
}

#[test]
fn without_a_stop_on_one_side_it_goes_on() {
    let mut parameters = stopped(5.0, 0.3);
    if let Some(stops) = &mut parameters.load.stops {
        stops.lowest_turns = f64::NEG_INFINITY;
    }
    let mut plant = thrown(&parameters, -1_000.0);
    for _ in 0..1_000_000 {
        plant.step();
    }
    let turns = plant.truth().position_turns();
    assert!((turns + 1_000.0 * 10.0 / TAU).abs() < 1.0, "{turns}");
}

#[test]
fn another_pwm_period_keeps_the_stops() {
    let mut plant = thrown(&stopped(5.0, 0.2), 100.0);
    plant.set_pwm_period_s(25e-6);
    for _ in 0..20_000 {
        plant.step();
        assert!((-1.3..2.55).contains(&plant.truth().position_turns()));
    }
}

#[test]
fn stops_that_cannot_be_are_refused() {
    let with = |change: fn(&mut Stops)| {
        let mut parameters = stopped(5.0, 0.3);
        if let Some(stops) = &mut parameters.load.stops {
            change(stops);
        }
        parameters.check()
    };
    assert_eq!(with(|_| ()), Ok(()));
    assert_eq!(
        with(|s| s.lowest_turns = 3.0),
        Err(Invalid::Stops(3.0, 2.5))
    );
    // The shaft starts at 0.
    assert_eq!(
        with(|s| s.lowest_turns = 0.1),
        Err(Invalid::Stops(0.1, 2.5))
    );
    assert!(with(|s| s.highest_turns = f64::NAN).is_err());
    assert_eq!(
        with(|s| s.stiffness_nm_per_rad = 0.0),
        Err(Invalid::Stop(0.0))
    );
    assert_eq!(with(|s| s.damping_ratio = -1.0), Err(Invalid::Stop(-1.0)));
}
