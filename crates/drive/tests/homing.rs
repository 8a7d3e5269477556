//! Homing of a whole drive on a simulated motor: switches at places of the shaft, seen by the drive
//! once per control period, and the place that gets the position of 0x607C.

mod machine;

use machine::{Bench, COUNTS, ENCODER_AT_START, HOME_SWITCH, Switches};
use personalities::{p3::P3, p3_extended::P3_EXTENDED};

/// A rail of ten turns: its switches lie at fractions of counts.
const RAIL: Switches = Switches {
    negative_limit: Some(-20_000.4),
    positive_limit: Some(20_000.6),
    home: Some((3_000.3, 6_500.7)),
    inverted: 0,
};

#[test]
fn the_faithful_p3_homes_where_it_stands_and_no_other_way() {
    let mut bench = Bench::new(&P3, RAIL);
    assert_eq!(bench.read(0x2402, 0) & 0xFF, 0);
    bench.write(0x6040, 0, 0x06, 2);
    assert_eq!(bench.try_write(0x6060, 0, 6, 1), Err(0x0800_0022), "P10");
    bench.enable();
    for method in [0, 1, 17, 33, 35, 36, 38, -1] {
        assert_eq!(bench.try_write(0x6098, 0, method, 1), Err(0x0609_0030));
    }
    bench.start(37, -12_345);
    // Before the acknowledge.
    assert_eq!(bench.bits(), (true, true, false));
    assert_eq!(bench.read(0x6064, 0), -12_345);
    assert_eq!(bench.read(0x2402, 0) & 0xFF, 1);
    bench.run_ms(50);
    assert_eq!(bench.bits(), (true, true, false));
    assert!((bench.read(0x6064, 0) + 12_345).abs() <= 1);
    // Another mode clears the bits (l.474), the flag stays.
    bench.write(0x6060, 0, 3, 1);
    bench.run_ms(2);
    let (_, _, error) = bench.bits();
    assert!(!error);
    bench.write(0x6060, 0, 0, 1);
    assert_eq!(bench.bits(), (false, false, false));
    assert_eq!(bench.read(0x2402, 0) & 0xFF, 1);
    // What the switches say has no object in this drive.
    assert_eq!(bench.read(0x6502, 0) & 0x20, 0x20);
}

/// Places of the switches' edges, seen from a direction: the first count beyond.
#[test]
fn every_method_names_the_place_that_it_promises() {
    // Method, place of the edge, direction in which it is crossed.
    let (left, right) = RAIL.home.unwrap();
    let (low, high) = (RAIL.negative_limit.unwrap(), RAIL.positive_limit.unwrap());
    let cases = [
        (1, low, 1.0),
        (2, high, -1.0),
        (3, left, -1.0),
        (4, left, 1.0),
        (5, right, 1.0),
        (6, right, -1.0),
        (7, left, -1.0),
        (8, left, 1.0),
        (9, right, -1.0),
        (10, right, 1.0),
        (11, right, 1.0),
        (12, right, -1.0),
        (13, left, 1.0),
        (14, left, -1.0),
    ];
    let mut worst: f64 = 0.0;
    for (method, edge, direction) in cases {
        // A positive home switch is on up to the end, a negative one from the other end on.
        let home = match method {
            3 | 4 => (left, f64::INFINITY),
            5 | 6 => (f64::NEG_INFINITY, right),
            _ => (left, right),
        };
        let rail = Switches {
            home: Some(home),
            ..RAIL
        };
        for start in [-8_000, 5_000, 12_000] {
            for (number, index) in [(method, true), (method + 16, false)] {
                let mut bench = Bench::new(&P3_EXTENDED, rail);
                bench.enable();
                bench.put(start);
                bench.start(number, 70_000);
                assert_eq!(bench.bits(), (false, false, false));
                assert_eq!(bench.read(0x2402, 0) & 0xFF, 0);
                let context = format!("method {number} from {start}");
                assert_eq!(bench.finish(), (true, true, false), "{context}");
                assert_eq!(bench.read(0x2402, 0) & 0xFF, 1);
                let home = bench.zero() + 70_000.0;
                if index {
                    // The encoder's own zero: to the count.
                    let turns = (edge + ENCODER_AT_START) / COUNTS;
                    let turn = match direction > 0.0 {
                        true => turns.ceil(),
                        false => turns.floor(),
                    };
                    let off = home - (turn * COUNTS - ENCODER_AT_START);
                    assert!(off.abs() < 1.5, "{context}: {off}");
                } else {
                    // One control period at 20,000 counts/s is a count, and the reading one more.
                    let off = (home - edge) * direction;
                    assert!((-1.5..2.5).contains(&off), "{context}: {off}");
                    worst = worst.max(off.abs());
                }
                let speed = bench.plant.truth().speed_rad_s;
                assert!(speed.abs() < 1.0, "{context}: {speed}");
                assert_eq!(bench.read(0x2430, 6) & 0xFF, 0);
            }
        }
    }
    println!("worst edge: {worst:.2} counts off");
}

#[test]
fn an_inverted_switch_is_a_switch_all_the_same() {
    let mut bench = Bench::new(
        &P3_EXTENDED,
        Switches {
            inverted: 0b11,
            ..RAIL
        },
    );
    bench.run_ms(2);
    assert_eq!(bench.read(0x60FD, 0), 0b11);
    bench.write(0x2431, 1, 0b11, 4);
    bench.run_ms(2);
    assert_eq!(bench.read(0x60FD, 0), 0);
    bench.enable();
    bench.start(17, 0);
    assert_eq!(bench.finish(), (true, true, false));
    let off = bench.zero() - RAIL.negative_limit.unwrap();
    assert!((-1.5..2.5).contains(&off), "{off}");
}

#[test]
fn hard_stops_are_pressed_with_the_torque_of_the_object() {
    for (method, stop, direction) in [(-3, -9_000.0, 1.0), (-4, 7_000.0, -1.0)] {
        let mut bench = Bench::new(&P3_EXTENDED, Switches::default());
        bench.stops = Some((-9_000.0, 7_000.0));
        bench.enable();
        bench.start(method, 0);
        let mut greatest = 0;
        let bits = loop {
            bench.run_ms(1);
            greatest = greatest.max((bench.read(0x6077, 0) as i16).abs());
            let bits = bench.bits();
            if bits.0 {
                break bits;
            }
        };
        assert_eq!(bits, (true, true, false), "{}", bench.read(0x2430, 6));
        // 300 per mille and the ripple of the current.
        assert!((280..350).contains(&greatest), "{greatest}");
        // The spring gives way by 3.5 counts under this torque.
        let off = bench.zero() - stop;
        assert!(off.abs() < 1.0 + 0.0069 / 0.002, "{off}");
        let back = (bench.place() - stop) * direction;
        assert!((190.0..300.0).contains(&back), "{back}");
        // Nothing presses any more.
        bench.run_ms(200);
        let torque = (bench.read(0x6077, 0) as i16).abs();
        assert!(torque < 30, "{torque}");
    }
}

#[test]
fn a_homing_error_is_a_fault_where_it_is_looked_for() {
    // No home switch: the positive limit, then the negative one.
    let switches = Switches { home: None, ..RAIL };
    for looked_for in [false, true] {
        let mut bench = Bench::new(&P3_EXTENDED, switches);
        bench.write(0x2410, 12, i32::from(looked_for), 1);
        bench.enable();
        bench.start(23, 0);
        if looked_for {
            for _ in 0..20_000 {
                bench.run_ms(1);
                if bench.read(0x6041, 0) & 0x4F == 0x08 {
                    break;
                }
            }
            assert_eq!(bench.read(0x6041, 0) & 0x4F, 0x08);
            assert_eq!(bench.read(0x603F, 0) & 0xFFFF, 0x8613);
        } else {
            assert_eq!(bench.finish(), (true, false, true));
            assert_eq!(bench.read(0x6041, 0) & 0x6F, 0x27);
            assert_eq!(bench.read(0x2430, 6) & 0xFF, 4, "the negative limit");
            assert_eq!(bench.read(0x2402, 0) & 0xFF, 0);
        }
    }
}

#[test]
fn switches_are_faults_outside_homing_where_they_are_looked_for() {
    for (sub, switch, code) in [
        (6, 1 << 1, 0x7380),
        (7, 1 << 0, 0x7381),
        (8, HOME_SWITCH, 0x7382),
    ] {
        let mut bench = Bench::new(&P3_EXTENDED, Switches::default());
        bench.enable();
        bench.extra_inputs = switch;
        // Not enabled.
        bench.write(0x6060, 0, 3, 1);
        bench.run_ms(5);
        assert_eq!(bench.read(0x6041, 0) & 0x6F, 0x27);
        // Ignored in idle and homing (l.998).
        for mode in [0, 6] {
            bench.write(0x6060, 0, mode, 1);
            bench.write(0x2410, sub, 1, 1);
            bench.run_ms(5);
            assert_eq!(bench.read(0x6041, 0) & 0x6F, 0x27);
        }
        bench.write(0x6060, 0, 3, 1);
        bench.run_ms(2);
        assert_eq!(bench.read(0x6041, 0) & 0x4F, 0x08);
        assert_eq!(bench.read(0x603F, 0) & 0xFFFF, code);
        // It goes with a reset, and comes again only with power and mode.
        bench.write(0x6040, 0, 0x80, 2);
        bench.run_ms(5);
        assert_eq!(bench.read(0x6041, 0) & 0x4F, 0x40);
        assert_eq!(bench.read(0x603F, 0) & 0xFFFF, 0);
    }
}

#[test]
fn the_index_is_the_same_place_with_the_direction_turned_round() {
    for (polarity, method) in [(1, 33), (1, 34), (-1, 33), (-1, 34)] {
        let mut bench = Bench::new(&P3_EXTENDED, Switches::default());
        bench.write(0x607E, 0, polarity, 1);
        bench.enable();
        bench.start(method, 0);
        assert_eq!(bench.finish(), (true, true, false));
        let position = bench.read(0x6064, 0) * polarity;
        // Behind the index the encoder reads as far beyond its zero as the position is.
        let raw = bench.read(0x3012, 1);
        assert!(
            ((position - raw + 1).rem_euclid(4096)) <= 2,
            "{polarity} {method}: {position} {raw}"
        );
        // Upwards it is passed going up, downwards going down.
        let sign = if method == 34 { polarity } else { -polarity };
        assert!(position * sign > 0 && position * sign < 200, "{position}");
    }
}
