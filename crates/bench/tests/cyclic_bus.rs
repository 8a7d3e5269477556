//! Ten simulated minutes of cyclic synchronous position on one bus of 1 Mbit/s.

use bench::cyclic_bus::{Cycle, CyclicBus, Outcome};

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
