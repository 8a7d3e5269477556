//! A mixed bus of one of each drive, ten simulated minutes at 250 Hz SYNC, without a missed frame.

use bench::mixed_bus::{MIXES, MixedBus, SYNC_HZ};
use sim::ErrorCounters;

const MINUTES: u64 = 10;

#[test]
fn ten_minutes_without_a_missed_frame() {
    let mut bus = MixedBus::new(MIXES, 1).unwrap();
    let cycles = MINUTES * 60 * u64::from(SYNC_HZ);
    let outcome = bus.run(cycles, |_| {});
    assert_eq!(outcome.cycles, cycles);
    assert_eq!(outcome.missed, 0, "{:?}", outcome.answers);
    for (node, identifier, count) in &outcome.answers {
        assert_eq!(*count, cycles, "node {node}, {identifier:03X}");
    }
    assert_eq!(outcome.not_following, 0);
    assert_eq!(
        outcome.lost, 0,
        "no SYNC and no set-point is lost on its way in"
    );
    assert_eq!(outcome.unexpected, [], "no emergency");
    for (node, counters) in &outcome.counters {
        assert_eq!(*counters, ErrorCounters::default(), "node {node}");
    }
    for (node, register) in bus.error_registers().unwrap() {
        assert_eq!(register, 0, "node {node}: 0x1001");
    }
    for (node, axis, turns) in &outcome.moved {
        assert!(*turns > 0.5, "node {node}, axis {axis}: {turns} turns");
    }
    // Of each cycle: the SYNC, the set-points, the actual values.
    let each: usize = MIXES
        .iter()
        .map(|mix| mix.rpdos.len() + mix.tpdos.len())
        .sum();
    let heartbeats = outcome.frames - cycles * (1 + each as u64);
    println!(
        "{cycles} SYNCs, {} TPDOs, {heartbeats} heartbeats, load {:.2} %, {:.1} s of real time, {:?}",
        outcome.answers.len(),
        100.0 * outcome.load,
        outcome.wall.as_secs_f64(),
        outcome.moved
    );
    assert!(outcome.load > 0.1 && outcome.load < 0.9, "{}", outcome.load);
}

/// The judge is awake: it misses what a drive that is held up over a SYNC does not send.
#[test]
fn what_a_drive_leaves_out_is_missed() {
    let mut bus = MixedBus::new(MIXES, 1).unwrap();
    assert_eq!(bus.run(50, |_| {}).missed, 0);
    let until = bus.now().plus_ms(6);
    assert!(bus.drive(2).unwrap().stall_until(until));
    let outcome = bus.run(50, |_| {});
    // Two TPDOs in the first cycle; in the next it hears two SYNCs at once, and sends twice what did not
    // wait for the wire.
    assert!((2..=4).contains(&outcome.missed), "{}", outcome.missed);
    // Its FIFO has 16 places, and more frames come in 6 ms.
    assert_ne!(outcome.lost, 0);
}

#[test]
fn every_drive_is_on_the_bus() {
    for drive in personalities::ALL {
        let family = |name: &str| {
            name.split("-2")
                .next()
                .unwrap()
                .trim_end_matches("-3")
                .to_owned()
        };
        let is_there = MIXES
            .iter()
            .any(|mix| family(mix.drive) == family(drive.name));
        assert!(is_there, "{} is not on the mixed bus", drive.name);
    }
}
