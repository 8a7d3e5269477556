//! What the motor gives to the shaft is found again in friction, dampers, springs, weights and masses.

mod support;

use std::f64::consts::TAU;

use plant::{COMPLETE_P3, Coupling, Parameters, Plant, Stops, Truth};
use support::{Complex, step_in_rotor_frame};

/// What the shaft's parts hold, J.
fn stored(p: &Parameters, truth: &Truth<f32>) -> f64 {
    let (shaft, load) = (truth.position_turns(), truth.load_position_turns());
    let kinetic = |inertia: f64, speed: f32| 0.5 * inertia * f64::from(speed).powi(2);
    let mut sum = kinetic(p.motor.rotor_inertia_kgm2, truth.speed_rad_s)
        + kinetic(p.load.inertia_kgm2, truth.load_speed_rad_s);
    let cogging = &p.motor.cogging;
    let periods = f64::from(cogging.periods_per_turn);
    let rest = (shaft - cogging.rest_turns) * TAU * periods;
    sum -= cogging.torque_nm / periods * rest.cos();
    if let Some(coupling) = &p.load.coupling {
        let twist = (shaft - load) * TAU;
        let bent = (twist.abs() - 0.5 * coupling.backlash_rad).max(0.0);
        sum += 0.5 * coupling.stiffness_nm_per_rad * bent * bent;
    }
    if let Some(pendulum) = &p.load.pendulum {
        sum -= pendulum.torque_nm * ((load - pendulum.hanging_turns) * TAU).cos();
    }
    if let Some(stops) = &p.load.stops {
        let above = (load - stops.highest_turns).max(0.0);
        let below = (stops.lowest_turns - load).max(0.0);
        let depth = (above + below) * TAU;
        sum += 0.5 * stops.stiffness_nm_per_rad * depth * depth;
    }
    sum
}

/// To and fro with 12 V in quadrature, under a load torque; returns what is missing of the energy
/// that the motor has given and taken.
fn missing(name: &str, parameters: &Parameters) -> f64 {
    assert_eq!(parameters.check(), Ok(()));
    let p = parameters;
    let (h, hoisted) = (p.pwm_period_s, 0.7e-3);
    let mut plant = Plant::<f32>::new(p);
    plant.set_load_torque_nm(hoisted as f32);
    let start = stored(p, &plant.truth());
    let (mut given, mut exchanged, mut lost, mut lifted) = (0.0, 0.0, 0.0, 0.0);
    for n in 0..100_000 {
        let before = plant.truth();
        let volts = if (n / 4_000) % 2 == 0 { 12.0 } else { -12.0 };
        step_in_rotor_frame(&mut plant, p, Complex(0.0, volts));
        let after = plant.truth();
        let work = f64::from(after.torque_nm) * f64::from(after.speed_rad_s) * h;
        given += work;
        exchanged += work.abs();
        let shaft = (after.position_turns() - before.position_turns()) * TAU;
        let load = (after.load_position_turns() - before.load_position_turns()) * TAU;
        lost += p.motor.coulomb_friction_nm * shaft.abs()
            + p.motor.viscous_friction_nms * shaft * shaft / h
            + p.load.coulomb_friction_nm * load.abs()
            + p.load.viscous_friction_nms * load * load / h;
        if let Some(coupling) = &p.load.coupling {
            lost += coupling.damping_nms * (shaft - load).powi(2) / h;
        }
        lifted += hoisted * load;
    }
    let gained = stored(p, &plant.truth()) - start;
    let missing = (given - lost - lifted - gained) / exchanged;
    println!(
        "{name}: exchanged {:.1} mJ, lost {:.1}, lifted {:.1}, stored {:.1}, missing {:.4} %",
        exchanged * 1e3,
        lost * 1e3,
        lifted * 1e3,
        gained * 1e3,
        missing * 100.0
    );
    missing
}

/// All effects, but either play or a damper: how much of a flank's push is the damper's, cannot be
/// seen from outside.
fn with(coupling: Option<Coupling>, stops: Option<Stops>) -> Parameters {
    let mut parameters = COMPLETE_P3;
    parameters.load_delay_periods = 0;
    parameters.motor.static_friction_nm = parameters.motor.coulomb_friction_nm;
    parameters.load.coupling = coupling;
    parameters.load.stops = stops;
    parameters
}

#[test]
fn the_energy_of_the_shaft_is_all_there() {
    let elastic_stops = Stops {
        damping_ratio: 0.0,
        ..Stops::between(-0.4, 0.9)
    };
    let coupling = |damping_nms, backlash_rad| Coupling {
        stiffness_nm_per_rad: 2.0,
        damping_nms,
        backlash_rad,
    };
    for (name, coupling, stops) in [
        ("rigid", None, None),
        ("rigid, between stops", None, Some(elastic_stops)),
        ("damped coupling", Some(coupling(50e-6, 0.0)), None),
        ("play", Some(coupling(0.0, 0.02)), None),
        (
            "damped coupling, stops",
            Some(coupling(50e-6, 0.0)),
            Some(elastic_stops),
        ),
        (
            "play, stops",
            Some(coupling(0.0, 0.02)),
            Some(elastic_stops),
        ),
    ] {
        let mut parameters = with(coupling, stops);
        if coupling.is_none() {
            // One mass: its friction is one friction.
            parameters.load.coulomb_friction_nm = 0.5e-3;
        }
        let missing = missing(name, &parameters);
        assert!(missing.abs() < 1e-3, "{name}: {missing}");
    }
}
