//! Hidden truths: what is drawn, how far, and that it is the same every time.

use control::io::Duty;
use plant::{COMPLETE_P3, Link, Parameters, Plant, Spread, Stops, VIRTUAL_P3};
use std::f64::consts::PI;

const DRAWS: u64 = 2_000;

/// A loaded P3, so that every relative spread has something to spread.
fn nominal() -> Parameters {
    let mut parameters = VIRTUAL_P3;
    parameters.motor.cogging = COMPLETE_P3.motor.cogging;
    parameters.load = COMPLETE_P3.load;
    parameters.switches = COMPLETE_P3.switches;
    parameters.link = Link::SMALL;
    parameters
}

/// Checks that a figure fills its range evenly: both ends are nearly reached, the mean is in the
/// middle.
fn assert_even(name: &str, low: f64, high: f64, figure: impl Fn(&Parameters) -> f64) {
    let nominal = nominal();
    let values: Vec<f64> = (0..DRAWS)
        .map(|seed| figure(&Spread::TYPICAL.draw(&nominal, seed)))
        .collect();
    let least = values.iter().copied().fold(f64::MAX, f64::min);
    let greatest = values.iter().copied().fold(f64::MIN, f64::max);
    let width = high - low;
    let slack = width * 1e-6;
    assert!(
        least >= low - slack && greatest <= high + slack,
        "{name}: {least} to {greatest}"
    );
    assert!(
        least < low + 0.01 * width && greatest > high - 0.01 * width,
        "{name}"
    );
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    // Four standard deviations of the mean of 2,000.
    let tolerance = 4.0 * width / (12.0 * DRAWS as f64).sqrt();
    assert!(
        (mean - 0.5 * (low + high)).abs() < tolerance,
        "{name}: mean {mean}"
    );
}

#[test]
fn every_figure_fills_its_range() {
    let n = nominal();
    let (motor, load) = (n.motor, n.load);
    let around = |value: f64, spread: f64| (value * (1.0 - spread), value * (1.0 + spread));
    type Figure = fn(&Parameters) -> f64;
    let figures: [(&str, (f64, f64), Figure); 33] = [
        ("resistance", around(motor.phase_resistance_ohm, 0.1), |p| {
            p.motor.phase_resistance_ohm
        }),
        ("inductance", around(motor.phase_inductance_h, 0.2), |p| {
            p.motor.phase_inductance_h
        }),
        ("flux", around(motor.flux_wb, 0.05), |p| p.motor.flux_wb),
        ("inertia", around(motor.rotor_inertia_kgm2, 0.1), |p| {
            p.motor.rotor_inertia_kgm2
        }),
        ("coulomb", around(motor.coulomb_friction_nm, 0.5), |p| {
            p.motor.coulomb_friction_nm
        }),
        ("static", around(motor.static_friction_nm, 0.5), |p| {
            p.motor.static_friction_nm
        }),
        ("viscous", around(motor.viscous_friction_nms, 0.5), |p| {
            p.motor.viscous_friction_nms
        }),
        ("load", around(load.inertia_kgm2, 0.2), |p| {
            p.load.inertia_kgm2
        }),
        ("load coulomb", around(load.coulomb_friction_nm, 0.5), |p| {
            p.load.coulomb_friction_nm
        }),
        (
            "load viscous",
            around(load.viscous_friction_nms, 0.5),
            |p| p.load.viscous_friction_nms,
        ),
        ("start", (-0.5, 0.5), |p| p.start_turns),
        ("supply", around(48.0, 0.05), |p| p.supply_v.into()),
        ("diode", around(0.8, 0.1), |p| p.diode_drop_v.into()),
        ("zero", (0.0, 4095.0), |p| p.encoder.zero_counts.into()),
        ("bias", (1833.0 - 40.0, 1833.0 + 40.0), |p| {
            p.current_zero_counts[0].into()
        }),
        ("gain", (0.98, 1.02), |p| p.current_sensors.gain[1].into()),
        ("noise", (0.0, 1.0), |p| {
            p.current_sensors.noise_counts.into()
        }),
        ("noise seed", (0.0, 4_294_967_295.0), |p| {
            p.noise_seed.into()
        }),
        ("eccentricity", (0.0, 4.0), |p| {
            p.encoder.eccentricity_counts.into()
        }),
        ("phase", (-PI, PI), |p| {
            p.encoder.eccentricity_phase_rad.into()
        }),
        ("lag", (0.0, 100e-6), |p| p.encoder.lag_s),
        ("encoder noise", (0.0, 0.5), |p| {
            p.encoder.noise_counts.into()
        }),
        ("dead time", (0.0, 200e-9), |p| p.bridge.dead_time_s),
        ("switches", (0.0, 0.1), |p| p.bridge.switch_ohm),
        ("capacitance", around(220e-6, 0.2), |p| p.link.capacitance_f),
        ("source", around(0.15, 0.2), |p| p.link.source_ohm),
        ("ambient", (15.0, 35.0), |p| p.ambient_c.into()),
        ("housing", around(8.9, 0.2), |p| {
            p.thermal.unwrap().motor.housing_k_per_w
        }),
        ("cogging", around(0.3e-3, 0.3), |p| {
            p.motor.cogging.torque_nm
        }),
        ("stiffness", around(2.0, 0.2), |p| {
            p.load.coupling.unwrap().stiffness_nm_per_rad
        }),
        ("backlash", around(2e-3, 0.2), |p| {
            p.load.coupling.unwrap().backlash_rad
        }),
        ("weight", around(0.5e-3, 0.2), |p| {
            p.load.pendulum.unwrap().torque_nm
        }),
        ("home", (0.09, 0.11), |p| {
            p.switches.home.unwrap().from_turns
        }),
    ];
    for (name, (low, high), figure) in figures {
        assert_even(name, low, high, figure);
    }
}

#[test]
fn every_second_motor_is_wired_and_every_second_encoder_glued_the_other_way() {
    let mut seen = [[0; 2]; 2];
    for seed in 0..DRAWS {
        let drawn = Spread::TYPICAL.draw(&nominal(), seed);
        seen[usize::from(drawn.motor.wires_swapped)][usize::from(drawn.encoder.reversed)] += 1;
    }
    for count in seen.concat() {
        assert!((400..600).contains(&count), "{seen:?}");
    }
}

#[test]
fn what_is_drawn_makes_sense_and_is_the_same_every_time() {
    for seed in (0..DRAWS).chain([u64::MAX, 1 << 63]) {
        let drawn = Spread::TYPICAL.draw(&nominal(), seed);
        assert_eq!(drawn.check(), Ok(()), "{seed}");
        assert_eq!(drawn, Spread::TYPICAL.draw(&nominal(), seed));
        assert_ne!(
            drawn,
            Spread::TYPICAL.draw(&nominal(), seed.wrapping_add(1))
        );
        assert_eq!(Spread::NONE.draw(&nominal(), seed), nominal());
    }
}

#[test]
fn a_figure_does_not_depend_on_how_others_are_spread() {
    let alone = Spread {
        flux: 0.05,
        ..Spread::NONE
    };
    for seed in 0..100 {
        let (one, all) = (
            alone.draw(&nominal(), seed),
            Spread::TYPICAL.draw(&nominal(), seed),
        );
        assert_eq!(one.motor.flux_wb, all.motor.flux_wb);
        assert_eq!(
            one.motor.phase_resistance_ohm,
            nominal().motor.phase_resistance_ohm
        );
    }
}

#[test]
fn figures_are_drawn_independently() {
    // Correlation of every pair of some figures over the draws.
    let unit = |value: f64, low: f64, high: f64| (value - low) / (high - low) - 0.5;
    let n = nominal();
    let draws: Vec<[f64; 5]> = (0..DRAWS)
        .map(|seed| {
            let p = Spread::TYPICAL.draw(&n, seed);
            [
                unit(
                    p.motor.phase_resistance_ohm / n.motor.phase_resistance_ohm,
                    0.9,
                    1.1,
                ),
                unit(
                    p.motor.phase_inductance_h / n.motor.phase_inductance_h,
                    0.8,
                    1.2,
                ),
                unit(p.motor.flux_wb / n.motor.flux_wb, 0.95, 1.05),
                unit(p.start_turns, -0.5, 0.5),
                unit(p.current_zero_counts[1].into(), 2031.0, 2111.0),
            ]
        })
        .collect();
    for a in 0..5 {
        for b in 0..a {
            let sum: f64 = draws.iter().map(|d| d[a] * d[b]).sum();
            let correlation = 12.0 * sum / DRAWS as f64;
            assert!(correlation.abs() < 0.09, "{a} {b}: {correlation}");
        }
    }
}

#[test]
fn exchanged_wires_are_exchanged_duties() {
    let mut straight = VIRTUAL_P3;
    straight.start_turns = 0.3;
    let mut crossed = straight;
    crossed.motor.wires_swapped = true;
    let mut straight = Plant::<f32>::new(&straight);
    let mut crossed = Plant::<f32>::new(&crossed);
    for n in 0..40_000_u32 {
        // A field that turns ever faster, and lets go at the end.
        let angle = 1e-9 * f64::from(n) * f64::from(n) * 3.0;
        let phase = [0.0, 1.0, 2.0].map(|third: f64| {
            (0.5 + 0.25 * (angle - third * std::f64::consts::TAU / 3.0).cos()) as f32
        });
        let enabled = n < 35_000;
        let [a, b, c] = phase;
        straight.load(&Duty { phase, enabled });
        crossed.load(&Duty {
            phase: [a, c, b],
            enabled,
        });
        straight.step();
        crossed.step();
        let (one, other) = (straight.truth(), crossed.truth());
        let apart = one.position_turns() - other.position_turns();
        assert!(apart.abs() < 1e-5, "{n}: {apart}");
        assert!((one.torque_nm - other.torque_nm).abs() < 1e-6, "{n}");
        let [a, b, c] = one.phase_current_a;
        let [x, y, z] = other.phase_current_a;
        assert!((a - x).abs() + (b - z).abs() + (c - y).abs() < 3e-5, "{n}");
        let [a, b, c] = one.phase_emf_v;
        let [x, y, z] = other.phase_emf_v;
        assert!((a - x).abs() + (b - z).abs() + (c - y).abs() < 1e-3, "{n}");
    }
    assert!((straight.truth().position_turns() - 0.3).abs() > 0.2);
    // The same duties turn the two against each other.
    let mut turned = [straight, crossed].map(|_| 0.0);
    for (turned, swapped) in turned.iter_mut().zip([false, true]) {
        let mut parameters = VIRTUAL_P3;
        parameters.motor.wires_swapped = swapped;
        let mut plant = Plant::<f32>::new(&parameters);
        for n in 0..100_000 {
            let angle = 2.0 * f64::from(n) * 1e-5 * std::f64::consts::TAU;
            let phase = [0.0, 1.0, 2.0].map(|third: f64| {
                (0.5 + 0.1 * (angle - third * std::f64::consts::TAU / 3.0).cos()) as f32
            });
            plant.load(&Duty {
                phase,
                enabled: true,
            });
            plant.step();
        }
        *turned = plant.truth().position_turns();
    }
    assert!(
        (turned[0] - 2.0).abs() < 0.1 && (turned[1] + 2.0).abs() < 0.1,
        "{turned:?}"
    );
}

#[test]
fn a_world_starts_where_it_is_told() {
    for (start, angle, turns) in [
        (0.0, 0, 0),
        (0.25, 1 << 30, 0),
        (0.5, i32::MIN, 1),
        (-0.5, i32::MIN, 0),
        (-3.25, -1 << 30, -3),
        (1e3 + 0.125, 1 << 29, 1_000),
        (f64::NAN, 0, 0),
        (f64::INFINITY, 0, 1 << 30),
    ] {
        let mut parameters = VIRTUAL_P3;
        parameters.start_turns = start;
        let plant = Plant::<f32>::new(&parameters);
        let truth = plant.truth();
        assert_eq!((truth.angle, truth.turns), (angle, turns), "{start}");
        if start.abs() < 1e6 {
            assert_eq!(truth.position_turns(), start);
        }
    }
}

#[test]
fn a_motor_without_cogging_may_get_some_and_a_machine_starts_between_its_stops() {
    let spread = Spread {
        cogging_nm: 1e-3,
        start_turns: 5.0,
        ..Spread::NONE
    };
    let mut nominal = VIRTUAL_P3;
    nominal.motor.cogging.periods_per_turn = 12;
    nominal.load.stops = Some(Stops::between(-2.0, 1.0));
    for seed in 0..DRAWS {
        let drawn = spread.draw(&nominal, seed);
        assert_eq!(drawn.check(), Ok(()));
        let cogging = drawn.motor.cogging;
        assert!((0.0..1e-3).contains(&cogging.torque_nm) && cogging.rest_turns.abs() <= 0.5);
    }
}
