//! Ten simulated minutes of cyclic synchronous position on one bus of 1 Mbit/s.

use std::process::Command;

use bench::cyclic_bus::{Cycle, CyclicBus, NoCycle, Outcome};

const SECONDS: u64 = 600;

fn run(cycle: Cycle) -> Outcome {
    let mut bus = CyclicBus::new(cycle, 1).unwrap();
    let outcome = bus.run(SECONDS * u64::from(cycle.sync_hz), |_| {});
    println!("{cycle:?}: {outcome:.4?}");
    outcome
}

fn check(outcome: &Outcome, cycle: Cycle) {
    assert_eq!(outcome.cycles, SECONDS * u64::from(cycle.sync_hz));
    assert_eq!(outcome.missed, 0);
    assert_eq!(outcome.not_following, 0);
    // A SYNC, a target and an answer of each drive, nothing else.
    let frames = outcome.cycles * (1 + 2 * u64::from(cycle.drives));
    assert_eq!(outcome.frames, frames);
    // The sine accelerates by up to 158,000 counts/s², which no feed-forward tells the velocity loop
    // (P3 change AR knows velocity feed-forward only).
    assert!(outcome.following_error_counts < 25.0, "{outcome:?}");
}

#[test]
fn four_drives_at_1_khz() {
    let outcome = run(Cycle::FAST);
    check(&outcome, Cycle::FAST);
    assert!((0.70..0.95).contains(&outcome.load), "{outcome:?}");
}

#[test]
fn six_drives_at_500_hz() {
    let outcome = run(Cycle::WIDE);
    check(&outcome, Cycle::WIDE);
    assert!((0.50..0.75).contains(&outcome.load), "{outcome:?}");
}

#[test]
fn a_bus_that_cannot_carry_it_misses() {
    // Seven drives at 1 kHz are 1.4 Mbit/s.
    let cycle = Cycle {
        drives: 7,
        sync_hz: 1000,
    };
    let outcome = CyclicBus::new(cycle, 1).unwrap().run(1000, |_| {});
    assert!(outcome.missed > 100, "{outcome:?}");
}

/// Whole milliseconds in a byte, nothing else.
const RATES: [u32; 14] = [4, 5, 8, 10, 20, 25, 40, 50, 100, 125, 200, 250, 500, 1000];

#[test]
fn only_rates_that_the_drives_can_be_told_are_taken() {
    for sync_hz in (0..=2000).chain([1_000_000, u32::MAX]) {
        let cycle = Cycle { drives: 1, sync_hz };
        let expected = match RATES.contains(&sync_hz) {
            true => Ok((1000 / sync_hz) as u8),
            false => Err(NoCycle::Rate { sync_hz }),
        };
        assert_eq!(cycle.period_ms(), expected);
        if expected.is_err() {
            assert!(CyclicBus::new(cycle, 1).is_err(), "{sync_hz}");
        }
    }
}

#[test]
fn a_slow_bus_follows_as_well() {
    for sync_hz in [4, 125] {
        let cycle = Cycle { drives: 1, sync_hz };
        let outcome = CyclicBus::new(cycle, 1).unwrap().run(40, |_| {});
        assert_eq!((outcome.missed, outcome.not_following), (0, 0), "{sync_hz}");
    }
}

#[test]
fn the_command_says_which_rates_there_are() {
    for rate in ["3", "300", "0"] {
        let words = ["--drives", "1", "--seconds", "1", "--sync-hz", rate];
        let output = Command::new(env!("CARGO_BIN_EXE_servobus-cyclic"))
            .args(words)
            .output()
            .unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success(), "{rate}");
        assert!(
            error.starts_with(&format!("servobus-cyclic: {rate} SYNC per second"))
                && error.contains("125, 200, 250"),
            "{error}"
        );
    }
}
