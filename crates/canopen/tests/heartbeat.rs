//! Heartbeat producer against CiA 301 7.2.8.3.2.2, and the node's deadlines.

mod harness;

use canopen::Instant;
use harness::{Bench, P3_LIKE, STANDARD, devices};

const PERIOD: canopen::Handle<u16> = devices::OBJECTS_CONST.handle(0x1017, 0);

/// Without a period there is no heartbeat and no deadline.
#[test]
fn off() {
    let mut bench = Bench::new(&STANDARD);
    assert_eq!(bench.node.next_deadline(), Instant::NEVER);
    assert_eq!(bench.after_ms(10_000_000), []);
}

/// Boot-up counts as the first heartbeat: the next comes one period later, with the state's number.
#[test]
fn period_and_state() {
    for (device, booted) in [(&STANDARD, 0x7F), (&P3_LIKE, 0x05)] {
        for period in [1u16, 100, 65535] {
            let mut bench = Bench::unstarted(device);
            bench.node.image().set(PERIOD, period);
            bench.node.start(bench.now);
            assert_eq!(bench.drain(), [(0x705, vec![0])]);
            let ms = u64::from(period);
            for (command, state) in [(None, booted), (Some(0x01), 0x05), (Some(0x02), 0x04)] {
                if let Some(command) = command {
                    bench.nmt(command);
                }
                assert_eq!(bench.node.next_deadline(), bench.now.plus_ms(ms));
                assert_eq!(bench.after_ms(ms), [(0x705, vec![state])]);
            }
        }
    }
}

/// The deadline is exact: a nanosecond before it nothing happens, and any number of early polls
/// changes nothing.
#[test]
fn exact_deadline() {
    let mut bench = Bench::new(&STANDARD);
    bench.write(0x1017, 0, &[10, 0]).expect("10 ms");
    let due = bench.now.plus_ms(10);
    assert_eq!(bench.node.next_deadline(), due);
    for early in [0, 1, 5_000_000, 9_999_998, 9_999_999] {
        let bytes = bench.node.bytes().to_vec();
        for _ in 0..3 {
            bench.node.poll(bench.now.plus_ns(early), &mut bench.owner);
            assert_eq!(bench.drain(), []);
            assert_eq!(bench.node.next_deadline(), due);
        }
        assert_eq!(bench.node.bytes(), bytes);
    }
    bench.node.poll(due, &mut bench.owner);
    assert_eq!(bench.drain(), [(0x705, vec![0x7F])]);
    // A second poll at the same time is a spurious one.
    bench.node.poll(due, &mut bench.owner);
    assert_eq!(bench.drain(), []);
    assert_eq!(bench.node.next_deadline(), due.plus_ms(10));
}

/// A late poll keeps the raster if it is late by less than a period; after a longer pause there is
/// one heartbeat, not a burst, and the raster starts anew.
#[test]
fn late_polls() {
    for (late_us, next_us) in [
        (0, 20_000),
        (1, 20_000),
        (9_999, 20_000),
        (10_000, 30_000),
        (10_001, 30_001),
        (1_234_567, 1_254_567),
    ] {
        let mut bench = Bench::new(&STANDARD);
        bench.write(0x1017, 0, &[10, 0]).expect("10 ms");
        let start = bench.now;
        bench
            .node
            .poll(start.plus_us(10_000 + late_us), &mut bench.owner);
        assert_eq!(bench.drain(), [(0x705, vec![0x7F])]);
        bench
            .node
            .poll(start.plus_us(10_000 + late_us), &mut bench.owner);
        assert_eq!(bench.drain(), []);
        assert_eq!(
            bench.node.next_deadline(),
            start.plus_us(next_us),
            "{late_us}"
        );
    }
}

/// A new period counts from its write; 0 ends it.
#[test]
fn period_changes() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.write(0x1017, 0, &[100, 0]).expect("100 ms");
        assert_eq!(bench.after_ms(60), []);
        bench.write(0x1017, 0, &[50, 0]).expect("50 ms");
        assert_eq!(bench.after_ms(49), []);
        assert_eq!(bench.after_ms(1), [(0x705, vec![0x05])]);
        bench.write(0x1017, 0, &[0, 1]).expect("256 ms");
        assert_eq!(bench.after_ms(255), []);
        assert_eq!(bench.after_ms(1), [(0x705, vec![0x05])]);
        bench.write(0x1017, 0, &[0, 0]).expect("off");
        assert_eq!(bench.node.next_deadline(), Instant::NEVER);
        assert_eq!(bench.after_ms(1_000_000), []);
    }
}

/// A heartbeat that was not fetched is replaced by the next, not doubled; it says the state at the
/// time it is fetched.
#[test]
fn not_fetched() {
    let mut bench = Bench::new(&STANDARD);
    bench.write(0x1017, 0, &[10, 0]).expect("10 ms");
    bench.node.poll(bench.now.plus_ms(10), &mut bench.owner);
    bench.node.poll(bench.now.plus_ms(20), &mut bench.owner);
    let nmt = can::Frame::classic(0, [0x01, harness::ID, 0, 0, 0, 0, 0, 0], 2);
    bench.node.receive(&nmt, bench.now, &mut bench.owner);
    assert_eq!(bench.drain(), [(0x705, vec![0x05])]);
    assert_eq!(bench.node.lost_transmissions(), 1);
}

/// The end of time is no deadline that can be reached by adding.
#[test]
fn end_of_time() {
    let mut bench = Bench::new(&STANDARD);
    bench.now = Instant(u64::MAX - 1);
    bench.write(0x1017, 0, &[10, 0]).expect("10 ms");
    assert_eq!(bench.node.next_deadline(), Instant::NEVER);
    for now in [bench.now, Instant::NEVER, Instant::NEVER] {
        bench.node.poll(now, &mut bench.owner);
        assert_eq!(bench.drain(), []);
    }
}

/// Boot-up goes before the first heartbeat when both wait, and counts of milliseconds, micro- and
/// nanoseconds agree.
#[test]
fn boot_up_first() {
    let mut bench = Bench::unstarted(&P3_LIKE);
    bench.node.image().set(PERIOD, 1);
    bench.node.start(bench.now);
    bench.node.poll(bench.now.plus_ms(1), &mut bench.owner);
    assert_eq!(bench.drain(), [(0x705, vec![0x00]), (0x705, vec![0x05])]);
    let t = Instant(5);
    assert_eq!(t.plus_ms(2), t.plus_us(2_000));
    assert_eq!(t.plus_us(2), t.plus_ns(2_000));
    assert_eq!(t.plus_ns(7).since_ns(t), 7);
    assert_eq!(t.since_ns(t.plus_ns(7)), 0);
    assert_eq!(Instant::NEVER.plus_ms(1), Instant::NEVER);
}
