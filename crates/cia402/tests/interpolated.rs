//! Mode 7, interpolated position: the buffer, its clocks, and its end.

mod rig;

use cia402::{Axis, Demand, Mode, State};
use rig::{PERIOD_NS, Random, Rig, STANDARD};

const REACHED: u16 = 0x0400;
const LIMIT: u16 = 0x0800;
const ACTIVE: u16 = 0x1000;

/// Operation enabled, without and with bit 4.
const READY: u16 = 0x0F;
const GO: u16 = 0x1F;

/// Enabled in mode 7 with set-points every `period_ms`.
fn rig(period_ms: u32) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, Mode::INTERPOLATED_POSITION);
    rig.configuration.interpolation_period_ns = period_ms * 1_000_000;
    rig.word(READY);
    rig
}

fn push(rig: &mut Rig, position: i32) -> bool {
    let taken = rig
        .axis
        .push_set_point(position, &rig.configuration, &rig.targets, &rig.actual);
    rig.fetch();
    taken
}

fn sync(rig: &mut Rig) {
    rig.axis.sync(&rig.configuration, &rig.targets, &rig.actual);
    rig.fetch();
}

#[test]
fn a_filled_buffer_is_passed_by_the_drives_own_clock() {
    for period_ms in [1, 2, 5, 10] {
        let mut rig = rig(period_ms);
        let way = [10, 40, 90, 160, 160, 160, 100, -50];
        for position in way {
            assert!(push(&mut rig, position));
        }
        assert_eq!(rig.axis.buffered(), 8);
        rig.run_ms(20);
        assert_eq!(rig.status() & (ACTIVE | REACHED), 0, "bit 4 is 0");
        assert_eq!(rig.sample().position, 0.0);
        rig.word(GO);
        rig.trace.clear();
        for (number, position) in way.into_iter().enumerate() {
            rig.run_ms(period_ms);
            assert_eq!(rig.status() & ACTIVE, ACTIVE, "{number}");
            let seen = rig.sample().position;
            assert!(
                (seen - f64::from(position)).abs() < 1e-2,
                "{number}: {seen}"
            );
            assert_eq!(rig.axis.buffered(), 7 - number as u8);
        }
        // Straight lines: the velocity is constant within each period.
        let periods = (period_ms * 1_000_000 / PERIOD_NS) as usize;
        let mut from = 0;
        for (position, part) in way.into_iter().zip(rig.trace.chunks(periods)) {
            let velocity = f64::from(position - from) / (f64::from(period_ms) * 1e-3);
            for sample in part {
                assert!((sample.velocity - velocity).abs() < 1e-6 * velocity.abs() + 1e-6);
            }
            from = position;
        }
        // It runs empty: the last set-point is held, and counts as reached.
        rig.run_ms(4);
        assert_eq!(rig.status() & (ACTIVE | REACHED), REACHED);
        assert!((rig.sample().position + 50.0).abs() < 1e-2);
        // And goes on when there is more.
        assert!(push(&mut rig, 0));
        rig.run_ms(1);
        assert_eq!(rig.status() & (ACTIVE | REACHED), ACTIVE);
        rig.run_ms(period_ms);
        assert!(rig.sample().position.abs() < 1e-2);
    }
}

#[test]
fn periods_that_are_no_whole_milliseconds_keep_their_time() {
    let mut rig = rig(1);
    rig.configuration.interpolation_period_ns = 2_500_000;
    for n in 1..=12 {
        assert!(push(&mut rig, n * 25));
    }
    rig.word(GO);
    for ms in [10, 20, 30] {
        rig.run_ms(10);
        // Each set-point is passed at a tick, half a millisecond late at most.
        let seen = rig.sample().position;
        assert!(
            (seen - f64::from(ms) * 10.0).abs() <= 5.0 + 1e-2,
            "{ms}: {seen}"
        );
    }
}

#[test]
fn with_sync_a_set_point_begins_with_it() {
    // As a master does it: a set-point, then SYNC, each 4 ms; the drive's ticks lie in between.
    let mut rig = rig(4);
    rig.word(GO);
    rig.run_ms(1);
    let step = |rig: &mut Rig, position: i32, periods: u32| {
        assert!(push(rig, position));
        sync(rig);
        assert_eq!(rig.axis.buffered(), 0, "taken at once");
        for period in 0..periods {
            if period % 20 == 7 {
                rig.tick();
            }
            rig.period();
        }
    };
    for n in 1..=50 {
        step(&mut rig, n * 40, 80);
        assert_eq!(rig.status() & ACTIVE, ACTIVE);
        let seen = rig.sample().position;
        assert!((seen - f64::from(n) * 40.0).abs() < 1e-2, "{n}: {seen}");
    }
    // SYNC jitters by a tenth of a period: no step of the velocity beyond that.
    rig.trace.clear();
    for n in 51..=90 {
        step(&mut rig, n * 40, [72, 88, 80, 80][n as usize % 4]);
    }
    for sample in &rig.trace {
        assert!(sample.velocity == 0.0 || (8_000.0..13_000.0).contains(&sample.velocity));
    }
    // A SYNC without a set-point is missed, not the end: the next one goes on.
    sync(&mut rig);
    rig.run_ms(3);
    step(&mut rig, 91 * 40, 80);
    assert!((rig.sample().position - 3640.0).abs() < 1e-2);
    // Without SYNC the drive's own clock takes over, two periods later.
    for n in 1..=4 {
        assert!(push(&mut rig, 3640 + n * 40));
    }
    rig.run_ms(9 + 16 + 4);
    assert!((rig.sample().position - 3800.0).abs() < 1e-2);
    assert_eq!(rig.axis.buffered(), 0);
}

#[test]
fn what_is_buffered_does_not_wait_for_a_late_sync() {
    let mut rig = rig(4);
    for n in 1..=6 {
        assert!(push(&mut rig, n * 40));
    }
    rig.word(GO);
    sync(&mut rig);
    rig.run_ms(4);
    sync(&mut rig);
    rig.run_ms(4);
    assert_eq!(rig.axis.buffered(), 4);
    // Now it is late.
    rig.run_ms(1);
    assert_eq!(rig.axis.buffered(), 3);
    assert_eq!(rig.status() & ACTIVE, ACTIVE);
    // When it comes, the period that has begun is not cut short.
    sync(&mut rig);
    rig.run_ms(3);
    assert_eq!(rig.axis.buffered(), 3);
    assert!((rig.sample().position - 120.0).abs() < 1e-2);
}

#[test]
fn a_stream_with_a_jittering_sync_does_not_pile_up() {
    // Set-points come between SYNCs, one each; SYNC is early or late by up to 2 ms of 5.
    let mut random = Random(60);
    let mut rig = rig(5);
    rig.word(GO);
    let mut most = 0;
    let mut until_tick = 20;
    for n in 1..=4000 {
        assert!(push(&mut rig, n * 20), "full at {n}");
        // ms/20: each SYNC within 2 ms around its time.
        let late = random.below(80) as u32;
        for period in 0..100 {
            if period == late {
                sync(&mut rig);
            }
            until_tick -= 1;
            if until_tick == 0 {
                until_tick = 20;
                rig.tick();
            }
            rig.period();
        }
        most = most.max(rig.axis.buffered());
        rig.trace.clear();
    }
    assert!(most <= 3, "{most}");
    rig.run_ms(40);
    assert!((rig.sample().position - 80_000.0).abs() < 1e-2);
    assert_eq!(rig.status() & (ACTIVE | REACHED), REACHED);
}

#[test]
fn the_pace_is_that_of_sync() {
    // The master's clock is 2 % fast or slow, and two set-points are always waiting.
    for periods in [98, 102] {
        let mut rig = rig(5);
        rig.word(GO);
        assert!(push(&mut rig, 20) && push(&mut rig, 40));
        for n in 3..=4000 {
            assert!(push(&mut rig, n * 20), "{periods}: full at {n}");
            sync(&mut rig);
            for period in 0..periods {
                if (n * periods + period) % 20 == 0 {
                    rig.tick();
                }
                rig.period();
            }
            rig.trace.clear();
            assert!(rig.axis.buffered() <= 4, "{periods}: {n}");
        }
        rig.run_ms(40);
        assert!((rig.sample().position - 80_000.0).abs() < 1e-2);
    }
}

#[test]
fn a_faster_sync_does_not_hurry() {
    // SYNC each millisecond, set-points for 4 ms each.
    let mut rig = rig(4);
    for n in 1..=16 {
        assert!(push(&mut rig, n * 40));
    }
    rig.word(GO);
    for _ in 0..32 {
        sync(&mut rig);
        rig.run_ms(1);
    }
    let seen = rig.sample().position;
    assert!((seen - 320.0).abs() <= 11.0, "{seen}");
}

#[test]
fn the_buffer_has_a_size_and_an_entrance() {
    let mut rig = rig(1);
    for n in 0..i32::from(Axis::BUFFER_SIZE) {
        assert!(push(&mut rig, n), "{n}");
    }
    assert!(!push(&mut rig, 99), "full");
    rig.axis.clear_buffer(true);
    assert_eq!(rig.axis.buffered(), 0);
    rig.configuration.interpolation_buffer = 2;
    assert!(push(&mut rig, 5) && push(&mut rig, 6));
    assert!(!push(&mut rig, 7), "as full as it may be");
    rig.configuration.interpolation_buffer = 200;
    for n in 2..Axis::BUFFER_SIZE {
        assert!(push(&mut rig, i32::from(n)));
    }
    assert!(!push(&mut rig, 99));
    rig.axis.clear_buffer(false);
    assert_eq!(rig.axis.buffered(), 0);
    assert!(!push(&mut rig, 1), "closed");
    rig.axis.clear_buffer(true);
    // First in, first out, also around the end of the memory.
    rig.word(GO);
    for n in 1..=40 {
        assert!(push(&mut rig, n * 10));
        rig.run_ms(1);
        assert!((rig.sample().position - f64::from(n) * 10.0).abs() < 1e-2);
    }
    // Only in this mode, in operation enabled.
    rig.word(0x06);
    assert!(!push(&mut rig, 0));
    let mut rig = Rig::enabled(&STANDARD, Mode::CYCLIC_POSITION);
    assert!(!push(&mut rig, 0));
    assert_eq!(rig.axis.buffered(), 0);
}

#[test]
fn bit_4_stops_on_the_slow_down_ramp_and_keeps_the_rest() {
    let mut rig = rig(2);
    for n in 1..=16 {
        assert!(push(&mut rig, n * 20));
    }
    rig.word(GO);
    rig.run_ms(10);
    assert!((rig.sample().velocity - 10_000.0).abs() < 1.0);
    rig.trace.clear();
    rig.word(READY);
    assert_eq!(rig.status() & ACTIVE, 0);
    // 200,000 counts/s²: 50 ms and 250 counts.
    rig.run_ms(60);
    assert_eq!(rig.sample().velocity, 0.0);
    assert!((rig.sample().position - 350.0).abs() < 10.0);
    for pair in rig.trace.windows(2) {
        assert!(
            (pair[1].velocity - pair[0].velocity).abs() <= 11.0,
            "{pair:?}"
        );
    }
    let held = rig.axis.buffered();
    assert!((10..=11).contains(&held), "{held}");
    rig.word(GO);
    rig.run_ms(1);
    assert_eq!(rig.axis.buffered(), held - 1);
}

#[test]
fn a_halt_holds_and_goes_on() {
    let mut rig = rig(2);
    for n in 1..=16 {
        assert!(push(&mut rig, n * 20));
    }
    rig.word(GO);
    rig.run_ms(10);
    rig.word(GO | 0x100);
    rig.run_ms(60);
    assert_eq!(rig.axis.state(), State::OperationEnabled);
    assert_eq!(rig.status() & REACHED, REACHED, "it stands");
    let held = rig.axis.buffered();
    rig.run_ms(50);
    assert_eq!(rig.axis.buffered(), held);
    rig.word(GO);
    rig.run_ms(2 * u32::from(held) + 4);
    assert!((rig.sample().position - 320.0).abs() < 1e-2);
    assert_eq!(rig.status() & (ACTIVE | REACHED), REACHED);
}

#[test]
fn limits_bind() {
    let mut rig = rig(2);
    rig.configuration.max_velocity = Some(10_000.0);
    rig.configuration.position_limits = Some((-100, 100));
    // 50,000 counts/s wanted.
    assert!(push(&mut rig, 100));
    rig.word(GO);
    rig.run_ms(4);
    assert!((rig.sample().position - 40.0).abs() < 1e-2);
    assert_eq!(rig.status() & (LIMIT | ACTIVE), LIMIT | ACTIVE);
    rig.run_ms(10);
    assert!((rig.sample().position - 100.0).abs() < 1e-2);
    assert_eq!(rig.status() & (LIMIT | ACTIVE | REACHED), REACHED);
    assert!(push(&mut rig, 200));
    rig.run_ms(4);
    assert!((rig.sample().position - 100.0).abs() < 1e-2);
    assert_eq!(rig.status() & LIMIT, LIMIT);
}

#[test]
fn another_name_for_the_position_moves_nothing() {
    let mut rig = rig(2);
    assert!(push(&mut rig, 40));
    rig.word(GO);
    rig.run_ms(10);
    rig.axis.preset_position(1000);
    rig.place(1000);
    rig.actual.demand_position += 1000;
    rig.demand = *rig.axis.demand();
    rig.run_ms(2);
    assert_eq!(rig.status() & REACHED, REACHED);
    assert!(push(&mut rig, 1080));
    rig.run_ms(1);
    assert!(matches!(rig.demand, Demand::Position { start: 1040, .. }));
    rig.run_ms(4);
    assert_eq!(rig.actual.position, 1080);
}
