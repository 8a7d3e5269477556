//! Calibration and tuning, blind: 200 motors that nobody knows, in virtual time. The procedures see
//! the bus and nothing else; what they find is compared with the truth afterwards.

mod busy;
mod ends;
mod motors;
mod refusals;
mod tuning;

use std::sync::atomic::{AtomicU64, Ordering};

use canopen::{Instant, NodeId};
use client::calibrate::Method;
use client::session::{ProcedureError, Session};
use client::{Client, block_on};
use motors::{COUNTS, Individual, enter, individual, is_even};
use personalities::Personality;
use personalities::p3::P3;
use personalities::p3_extended::P3_EXTENDED;
use sim::{Bus, BusSettings, DriveSettings, VirtualLink};

const NODE: NodeId = NodeId::new(1).unwrap();
const MOTORS: u64 = 200;

/// A bus with one drive on this motor, booted.
fn bus(motor: &Individual, personality: &'static Personality, seed: u64) -> Bus {
    let drive = DriveSettings {
        plant: motor.truth,
        ..DriveSettings::new(NODE, personality)
    };
    let mut bus = Bus::new(BusSettings::new(seed, vec![drive]));
    bus.run_until(Instant::ZERO.plus_ms(60));
    bus.take_traffic();
    bus
}

/// Both P3s take turns.
fn personality(seed: u64) -> &'static Personality {
    match seed % 2 {
        0 => &P3,
        _ => &P3_EXTENDED,
    }
}

/// What the procedures found, less the truth.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    bias_counts: f64,
    zero_counts: f64,
    zero_deg: f64,
    polarity_is_wrong: bool,
    inertia_ratio: f64,
    lag_deg: f64,
}

/// Calibrates a motor and compares.
fn calibrate(seed: u64) -> Result<Errors, String> {
    let motor = individual(seed);
    let mut bus = bus(&motor, personality(seed), seed);
    let failed = |error: ProcedureError| {
        let (reversed, swapped) = (
            motor.truth.encoder.reversed,
            motor.truth.motor.wires_swapped,
        );
        format!(
            "motor {seed}: {error}\nreversed {reversed}, swapped {swapped}, {:?}",
            motor.sheet
        )
    };
    let found = {
        let mut client = Client::new(VirtualLink::new(&mut bus, 0));
        block_on(async {
            enter(&mut client, NODE, &motor.sheet).await;
            let mut session = Session::new(&mut client, NODE, ());
            let sensor = session.calibrate_current_sensor().await?;
            let zero = session.calibrate_electrical_zero(Method::Turn).await?;
            let lag = session.calibrate_encoder_lag().await?;
            Ok((sensor, zero, lag, session.save().await))
        })
        .map_err(failed)
    };
    let (sensor, zero, lag, saved) = found?;
    saved.map_err(|error| format!("motor {seed}: {error}"))?;
    let truth = &motor.truth;
    let bias = [0, 1].map(|n| sensor.bias[n].round() - f64::from(truth.current_zero_counts[n]));
    let turn = COUNTS / f64::from(truth.motor.pole_pairs);
    let off = zero.zero_counts.round() - f64::from(truth.encoder.zero_counts);
    let off = (off + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
    let mirrored = truth.encoder.reversed != truth.motor.wires_swapped;
    Ok(Errors {
        bias_counts: bias[0].abs().max(bias[1].abs()),
        zero_counts: off,
        zero_deg: off / turn * 360.0,
        polarity_is_wrong: zero.polarity != Some(if mirrored { -1 } else { 1 }),
        inertia_ratio: zero.inertia_ratio.unwrap_or(f64::NAN),
        lag_deg: (lag.lag_us * 1e-6 - truth.encoder.lag_s) * lag.speed / turn * 360.0,
    })
}

/// Runs `work` for each seed, on all processors.
fn for_each<T: Send>(seeds: u64, work: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicU64::new(0);
    let threads = std::thread::available_parallelism().map_or(2, |n| n.get());
    let mut all: Vec<(u64, T)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut done = Vec::new();
                    loop {
                        let seed = next.fetch_add(1, Ordering::Relaxed);
                        if seed >= seeds {
                            return done;
                        }
                        done.push((seed, work(seed)));
                    }
                })
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap())
            .collect()
    });
    all.sort_by_key(|(seed, _)| *seed);
    all.into_iter().map(|(_, result)| result).collect()
}

/// Worst magnitude and root of the mean square.
fn worst_and_rms(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let worst = values.clone().map(f64::abs).fold(0.0, f64::max);
    let count = values.clone().count() as f64;
    (worst, (values.map(|v| v * v).sum::<f64>() / count).sqrt())
}

#[test]
fn two_hundred_motors_are_calibrated_blind() {
    let began = std::time::Instant::now();
    let results = for_each(MOTORS, calibrate);
    let mut errors = Vec::new();
    let mut failures = Vec::new();
    for result in results {
        match result {
            Ok(found) => errors.push(found),
            Err(text) => failures.push(text),
        }
    }
    type Figure = (&'static str, fn(&Errors) -> f64);
    let figures: [Figure; 5] = [
        ("current bias, counts", |e| e.bias_counts),
        ("electrical zero, counts", |e| e.zero_counts),
        ("electrical zero, electrical degrees", |e| e.zero_deg),
        ("inertia over the sheet's, less 1", |e| {
            e.inertia_ratio - 1.0
        }),
        ("encoder lag, electrical degrees", |e| e.lag_deg),
    ];
    for (what, figure) in figures {
        let (worst, rms) = worst_and_rms(errors.iter().map(figure));
        println!("{what}: worst {worst:.3}, rms {rms:.3}");
    }
    println!(
        "{} motors in {:.1} s",
        errors.len(),
        began.elapsed().as_secs_f64()
    );
    assert!(
        failures.is_empty(),
        "{} failed:\n{}",
        failures.len(),
        failures[..failures.len().min(30)].join("\n")
    );
    for (seed, found) in errors.iter().enumerate() {
        assert!(found.bias_counts <= 1.0, "motor {seed}: {found:?}");
        match is_even(seed as u64) {
            true => assert!(found.zero_counts.abs() <= 2.0, "motor {seed}: {found:?}"),
            false => assert!(found.zero_deg.abs() <= 0.5, "motor {seed}: {found:?}"),
        }
        assert!(found.lag_deg.abs() <= 1.0, "motor {seed}: {found:?}");
        assert!(!found.polarity_is_wrong, "motor {seed}: {found:?}");
    }
}
