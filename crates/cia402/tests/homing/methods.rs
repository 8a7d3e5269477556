//! Where each method ends.

use cia402::{HomingMethod, Mode};

use crate::machine::{
    FAR, Machine, NEGATIVE_LIMIT, NOWHERE, POSITIVE_LIMIT, RAIL, Rail, home, index_from,
};

/// What CiA 402's diagrams show: at which edge, the final direction, and the first direction of an
/// axis that begins beside the switch (0: either).
#[rustfmt::skip]
const DIAGRAMS: [(i8, &str, f64, f64); 14] = [
    (1,  "negative limit", 1.0, -1.0),
    (2,  "positive limit", -1.0, 1.0),
    (3,  "positive home", -1.0, 1.0),
    (4,  "positive home", 1.0, 1.0),
    (5,  "negative home", 1.0, -1.0),
    (6,  "negative home", -1.0, -1.0),
    (7,  "left edge", -1.0, 1.0),
    (8,  "left edge", 1.0, 1.0),
    (9,  "right edge", -1.0, 1.0),
    (10, "right edge", 1.0, 1.0),
    (11, "right edge", 1.0, -1.0),
    (12, "right edge", -1.0, -1.0),
    (13, "left edge", 1.0, -1.0),
    (14, "left edge", -1.0, -1.0),
];

#[test]
fn every_switch_method_ends_at_its_edge_or_index_from_everywhere() {
    let positive_home = Rail {
        home: (10_300, FAR),
        ..RAIL
    };
    let negative_home = Rail {
        home: (-FAR, -7_700),
        ..RAIL
    };
    let wide = Rail {
        home: (-2_345, 6_789),
        ..RAIL
    };
    // Narrower than the axis needs to come to rest: 500 counts.
    let narrow = Rail {
        home: (-2_345, -2_245),
        ..RAIL
    };
    let mut runs = 0;
    for (method, edge, direction, first) in DIAGRAMS {
        let rails: &[Rail] = match edge {
            "positive home" => &[positive_home],
            "negative home" => &[negative_home],
            "left edge" | "right edge" => &[wide, narrow],
            _ => &[RAIL],
        };
        for rail in rails {
            let (left, right) = rail.home;
            let place = match edge {
                "negative limit" => NEGATIVE_LIMIT,
                "positive limit" => POSITIVE_LIMIT,
                "positive home" | "left edge" => left,
                _ => right,
            };
            let starts = [
                -30_100, -30_012, -30_011, -20_000, -8_000, -7_701, -7_700, -3_000, -2_346, -2_345,
                -2_300, -2_246, -2_245, 0, 3_000, 6_788, 6_789, 8_000, 10_299, 10_300, 20_000,
                30_022, 30_023, 30_100,
            ];
            for start in starts {
                for (number, index) in [(method, true), (method + 16, false)] {
                    let machine = home(number, *rail, start);
                    let context = format!("method {number} from {start}");
                    assert_eq!(machine.bits(), (1, 1, 0), "{context}");
                    assert_eq!(machine.rig.sample().velocity, 0.0, "{context}");
                    let velocity = machine.final_velocity.expect("attained");
                    assert_eq!(velocity.signum(), direction, "{context}: {velocity}");
                    if index {
                        // To the count.
                        let home = index_from(place, direction);
                        assert_eq!(machine.home(), home, "{context}");
                    } else {
                        // The way of one control period at the greater speed.
                        let off = f64::from(machine.home() - place) * direction;
                        let most = 20_000.0 * 50e-6;
                        assert!((-1.0..=most).contains(&off), "{context}: {off}");
                    }
                    let beside = !machine.levels_at(start)[match edge {
                        "negative limit" => 0,
                        "positive limit" => 1,
                        _ => 2,
                    }];
                    // An axis that begins at the limit switch turns round at once.
                    if beside && start.abs() < 30_000 {
                        assert_eq!(machine.first_direction, first, "{context}");
                    }
                    assert!(machine.rig.axis.is_homed());
                    assert_eq!(
                        machine.rig.actual.position - machine.place_now(),
                        machine.rig.renamed
                    );
                    runs += 1;
                }
            }
        }
    }
    println!("{runs} runs");
    assert_eq!(runs, (6 + 2 * 8) * 24 * 2);
}

#[test]
fn the_home_edge_is_crossed_slowly_after_the_switch_was_found() {
    // Method 19: right until the switch, back over its edge at 2,000 counts/s.
    let rail = Rail {
        home: (10_300, FAR),
        ..RAIL
    };
    let machine = home(19, rail, 0);
    assert_eq!(
        machine.final_velocity.map(f64::abs).map(|v| v <= 2_000.0),
        Some(true)
    );
    // One period at that speed is a tenth of a count.
    assert!(
        (10_299..=10_300).contains(&machine.home()),
        "{}",
        machine.home()
    );
}

#[test]
fn index_methods_find_the_pulse_beside_the_axis() {
    for (method, direction) in [(33, -1.0), (34, 1.0)] {
        for start in [-5_000, 0, 1_002, 1_003, 1_004, 4_000, 5_098, 5_099, 5_100] {
            let machine = home(method, RAIL, start);
            assert_eq!(
                machine.home(),
                index_from(start, direction),
                "{method} from {start}"
            );
            let velocity = machine.final_velocity.expect("attained");
            assert_eq!(velocity.signum(), direction);
        }
    }
}

#[test]
fn the_present_position_is_home_before_the_write_is_acknowledged() {
    for method in [35, 37] {
        let mut machine = Machine::at(RAIL, -777);
        machine.rig.configuration.homing.method = method;
        machine.rig.configuration.homing.offset = 5_000;
        machine.start();
        assert_eq!(machine.bits(), (1, 1, 0));
        assert_eq!(machine.rig.actual.position, 5_000);
        assert_eq!(machine.home(), -777);
        machine.run_ms(20);
        assert_eq!(machine.rig.actual.position, 5_000);
        assert_eq!(machine.bits(), (1, 1, 0));
    }
}

#[test]
fn a_moving_axis_comes_to_rest_before_its_position_is_home() {
    let mut machine = Machine::at(RAIL, 0);
    machine.rig.mode(Mode::PROFILE_VELOCITY).unwrap();
    machine.rig.targets.velocity = 8_000;
    machine.run_ms(200);
    machine.rig.mode(Mode::HOMING).unwrap();
    machine.rig.configuration.homing.method = 37;
    machine.start();
    assert_eq!(machine.bits(), (0, 0, 0));
    machine.finish();
    assert_eq!(machine.bits(), (1, 1, 0));
    assert_eq!(machine.home(), machine.place_now());
    assert!(machine.place_now() > 500);
}

#[test]
fn hard_stops_are_found_and_let_go() {
    let rail = Rail {
        stops: (-9_000, 8_000),
        negative_limit: NOWHERE,
        positive_limit: NOWHERE,
        ..RAIL
    };
    for (method, place, direction) in [(-3, -9_000, 1), (-4, 8_000, -1)] {
        for start in [-9_000, -100, 8_000] {
            let machine = home(method, rail, start);
            assert_eq!(machine.bits(), (1, 1, 0));
            assert_eq!(machine.home(), place, "method {method} from {start}");
            // Backed off, and the torque is the axis's again.
            let back = (machine.place_now() - place) * direction;
            assert!((100..110).contains(&back), "{back}");
            let limit = machine.rig.axis.torque_limit_pm(&machine.rig.configuration);
            assert_eq!(limit, 1000.0);
        }
    }
    for (method, place, direction) in [(-1, -9_000, 1.0), (-2, 8_000, -1.0)] {
        let machine = home(method, rail, 40);
        assert_eq!(
            machine.home(),
            index_from(place, direction),
            "method {method}"
        );
        assert_eq!(machine.bits(), (1, 1, 0));
    }
}

#[test]
fn pressing_shorter_than_the_time_is_no_stop() {
    let rail = Rail {
        stops: (-FAR, 3_000),
        ..RAIL
    };
    let mut machine = Machine::at(rail, 0);
    machine.rig.configuration.homing.method = -4;
    machine.start();
    while machine.place_now() < 3_000 {
        machine.run_ms(1);
    }
    machine.run_ms(40);
    assert_eq!(machine.bits(), (0, 0, 0));
    let limit = machine.rig.axis.torque_limit_pm(&machine.rig.configuration);
    assert_eq!(limit, 300.0, "pressing with the torque of the stop");
    // The obstacle gives way.
    machine.rail.stops.1 = 5_000;
    machine.run_ms(30);
    assert_eq!(machine.bits(), (0, 0, 0));
    machine.finish();
    assert_eq!(machine.home(), 5_000);
}

#[test]
fn every_supported_method_is_run_by_these_tests() {
    let run = |number: i8| {
        DIAGRAMS
            .iter()
            .any(|row| row.0 == number || row.0 + 16 == number)
            || [33, 34, 35, 37, -1, -2, -3, -4].contains(&number)
    };
    assert!(HomingMethod::ALL.into_iter().all(run));
}
