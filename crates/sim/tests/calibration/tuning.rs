//! The loops after tuning, against the motor's own figures.

use std::f64::consts::TAU;

use canopen::{Address, DataType};
use cia402::Mode;
use client::Value;
use client::axis::Axis;
use client::tune::{Asked, Tuned};
use plant::Parameters;

use super::*;

/// What was asked for, what the tool says, and what the loop is.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    asked_hz: f64,
    told_hz: f64,
    true_hz: f64,
}

/// A motor as in the other test, with a load for every second one.
fn loaded(seed: u64) -> Individual {
    let mut motor = individual(seed);
    let mut dice = motors::Dice::new(seed ^ 0xABCD);
    if dice.roll() < 0.5 {
        motor.truth.load.inertia_kgm2 =
            motor.truth.motor.rotor_inertia_kgm2 * dice.between(0.2, 3.0);
    }
    motor
}

fn tune(seed: u64) -> Result<[Outcome; 2], String> {
    let motor = loaded(seed);
    let mut dice = motors::Dice::new(seed ^ 0x1234);
    let velocity = Asked {
        bandwidth_hz: dice.between(20.0, 50.0),
        damping: dice.between(0.7, 1.1),
    };
    let position = Asked {
        bandwidth_hz: velocity.bandwidth_hz * dice.between(0.12, 0.22),
        damping: 1.0,
    };
    let mut bus = bus(&motor, personality(seed), seed);
    let told = {
        let mut client = Client::new(VirtualLink::new(&mut bus, 0));
        block_on(async {
            enter(&mut client, NODE, &motor.sheet).await;
            motors::calibrated(&mut client, NODE, &motor.truth).await;
            let mut session = Session::new(&mut client, NODE, ());
            let velocity = session.tune_velocity(velocity).await?;
            let position = session.tune_position(position).await?;
            Ok((velocity, position, session.save().await))
        })
        .map_err(|error: ProcedureError| format!("motor {seed}: {error}"))
    };
    let (velocity_told, position_told, saved) = told?;
    saved.map_err(|error| format!("motor {seed}: {error}"))?;
    let told: (Tuned, Tuned) = (velocity_told, position_told);
    // The loop as it was tuned, on the same motor but for its cogging, which would bend the measure,
    // and for its dry friction, which would end the way back before it is over.
    let tuned = [5, 6, 10, 11].map(|sub| (sub, gain(&mut bus, sub)));
    let mut smooth = motor;
    smooth.truth.motor.cogging = plant::Cogging::NONE;
    smooth.truth.motor.coulomb_friction_nm = 0.0;
    smooth.truth.motor.static_friction_nm = 0.0;
    smooth.truth.load.coulomb_friction_nm = 0.0;
    let mut bus = super::bus(&smooth, personality(seed), seed);
    {
        let mut client = Client::new(VirtualLink::new(&mut bus, 0));
        block_on(async {
            enter(&mut client, NODE, &smooth.sheet).await;
            motors::calibrated(&mut client, NODE, &smooth.truth).await;
            for (sub, value) in tuned {
                let data = Value::Integer(value).encode(DataType::U16).unwrap();
                let object = Address::new(0x3019, sub);
                client.download(NODE, object, data).await.unwrap();
            }
        });
    }
    let rated_nm = motor.sheet.rated_torque_mnm as f64 * 1e-3;
    let mut truth = |which: Loop| natural_hz(&mut bus, &motor.truth, rated_nm, which);
    Ok([
        Outcome {
            asked_hz: velocity.bandwidth_hz,
            told_hz: told.0.natural_hz,
            true_hz: truth(Loop::Velocity(velocity.bandwidth_hz)),
        },
        Outcome {
            asked_hz: position.bandwidth_hz,
            told_hz: told.1.natural_hz,
            true_hz: truth(Loop::Position(position.bandwidth_hz)),
        },
    ])
}

#[derive(Clone, Copy, Debug)]
enum Loop {
    Velocity(f64),
    Position(f64),
}

/// The loop as it is: by the shaft's true motion, and by another definition than the tool's.
///
/// The velocity loop answers a torque on its shaft with s / J(s² + 2ζωs + ω²), which is in phase
/// with the torque at ω alone. The position loop is of first order: it comes back with e^(−ωt).
fn natural_hz(bus: &mut Bus, truth: &Parameters, rated_nm: f64, which: Loop) -> f64 {
    let inertia = truth.motor.rotor_inertia_kgm2 + truth.load.inertia_kgm2;
    match which {
        Loop::Velocity(asked_hz) => {
            let turns_s = 8.0;
            command(bus, 9, &[(0x60FF, (turns_s * COUNTS) as i64)]);
            wait(bus, 400);
            let (mut low, mut high) = (asked_hz * 0.4, asked_hz * 2.5);
            for _ in 0..7 {
                let hz = (low * high).sqrt();
                let omega = hz * TAU;
                let torque = 0.3 * turns_s * TAU * 1.4 * omega * inertia;
                match phase(bus, hz, torque.min(0.3 * rated_nm)) > 0.0 {
                    true => low = hz,
                    false => high = hz,
                }
            }
            command(bus, 0, &[]);
            wait(bus, 300);
            (low * high).sqrt()
        }
        Loop::Position(asked_hz) => {
            let offset = 40_000;
            let start = position(bus);
            command(bus, 8, &[(0x60B1, offset), (0x607A, start)]);
            let settles = (1.5 / asked_hz * 1e3) as u64;
            wait(bus, settles);
            // Back to where it was, on the way of e^(−ωt) once the velocity loop has had its time.
            command(bus, 8, &[(0x60B1, -offset), (0x607A, start)]);
            let way: Vec<f64> = (0..settles)
                .map(|_| {
                    wait(bus, 1);
                    turns(bus)
                })
                .collect();
            command(bus, 0, &[]);
            let end = way[way.len() - 1];
            // Between two looks: a millisecond is up to 4 % of what is measured.
            let left = |part: f64| {
                let size = (way[0] - end).abs();
                let is_left = |x: f64| (x - end).abs() / size;
                let after = way.iter().position(|x| is_left(*x) < part).unwrap();
                let (before, then) = (is_left(way[after - 1]), is_left(way[after]));
                after as f64 - (part - then) / (before - then)
            };
            (0.2_f64 / 0.02).ln() / ((left(0.02) - left(0.2)) * 1e-3) / TAU
        }
    }
}

/// By how much the speed leads a torque of this frequency, rad.
fn phase(bus: &mut Bus, hz: f64, torque_nm: f64) -> f64 {
    let step_s = 100e-6;
    let settles = (4.0 / hz / step_s) as usize;
    let counts = ((hz * 0.25).ceil() / hz / step_s).round() as usize;
    let (mut with, mut across) = (0.0, 0.0);
    for n in 0..settles + counts {
        let (sine, cosine) = (hz * TAU * n as f64 * step_s).sin_cos();
        let now = bus.now();
        let plant = bus.drive(NODE).unwrap().plant();
        if n >= settles {
            let speed = f64::from(plant.truth().speed_rad_s);
            with -= speed * sine;
            across -= speed * cosine;
        }
        plant.set_load_torque_nm((torque_nm * sine) as f32);
        bus.run_until(now.plus_ns(100_000));
    }
    bus.take_traffic();
    bus.drive(NODE).unwrap().plant().set_load_torque_nm(0.0);
    // The user's direction may be the shaft's negative one; a speed is in phase either way.
    across.atan2(with)
}

fn turns(bus: &mut Bus) -> f64 {
    bus.drive(NODE).unwrap().plant().truth().position_turns()
}

fn position(bus: &mut Bus) -> i64 {
    number(bus, Address::new(0x6064, 0), DataType::I32)
}

fn gain(bus: &mut Bus, sub: u8) -> i64 {
    number(bus, Address::new(0x3019, sub), DataType::U16)
}

fn number(bus: &mut Bus, object: Address, data_type: DataType) -> i64 {
    let mut client = Client::new(VirtualLink::new(bus, 0));
    match block_on(client.read(NODE, object, data_type)).unwrap() {
        Value::Integer(value) => value,
        other => panic!("{other:?}"),
    }
}

/// Enables a mode and writes 32-bit objects.
fn command(bus: &mut Bus, mode: i8, objects: &[(u16, i64)]) {
    let mut client = Client::new(VirtualLink::new(bus, 0));
    let axis = Axis::new(NODE);
    block_on(async {
        axis.enable(&mut client).await.unwrap();
        axis.set_mode(&mut client, Mode(mode)).await.unwrap();
        for (index, value) in objects {
            axis.write(&mut client, *index, DataType::I32, *value)
                .await
                .unwrap();
        }
    });
}

fn wait(bus: &mut Bus, ms: u64) {
    bus.run_until(bus.now().plus_ms(ms));
    bus.take_traffic();
}

#[test]
fn two_hundred_loops_become_as_asked() {
    let began = std::time::Instant::now();
    let mut failures = Vec::new();
    let mut outcomes = Vec::new();
    for result in for_each(MOTORS, tune) {
        match result {
            Ok(found) => outcomes.push(found),
            Err(text) => failures.push(text),
        }
    }
    for (place, name) in ["velocity", "position"].into_iter().enumerate() {
        let all = outcomes.iter().map(|o| o[place]);
        let (worst, rms) = worst_and_rms(all.clone().map(|o| o.told_hz / o.asked_hz - 1.0));
        println!("{name}, fitted over asked: worst {worst:.3}, rms {rms:.3}");
        let (worst, rms) = worst_and_rms(all.map(|o| o.true_hz / o.asked_hz - 1.0));
        println!("{name}, true over asked: worst {worst:.3}, rms {rms:.3}");
    }
    println!(
        "{} in {:.1} s",
        outcomes.len(),
        began.elapsed().as_secs_f64()
    );
    let some = failures.iter().take(12).cloned().collect::<Vec<_>>();
    assert!(
        failures.is_empty(),
        "{} failed:\n{}",
        failures.len(),
        some.join("\n")
    );
    for (seed, both) in outcomes.iter().enumerate() {
        for outcome in both {
            for hz in [outcome.told_hz, outcome.true_hz] {
                let off = hz / outcome.asked_hz - 1.0;
                assert!(off.abs() <= 0.1, "motor {seed}: {both:?}");
            }
        }
    }
}
