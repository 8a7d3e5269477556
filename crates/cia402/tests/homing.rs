//! Homing on a simulated rail with limit switches, home switch, index pulses and hard stops: every
//! method from every kind of beginning, against the places that the diagrams of CiA 402 show.

mod rig;

use cia402::{
    Captured, Edge, HomingError, HomingInputs, HomingMethod, Mode, State, Statusword, Switch,
    Trigger,
};
use rig::{Rig, STANDARD};

/// Where the rail's switches are, in places of the rail. Each is active from its first to below its
/// second place.
#[derive(Clone, Copy)]
struct Rail {
    negative_limit: (i32, i32),
    positive_limit: (i32, i32),
    home: (i32, i32),
    /// Places of the index pulses, this and every turn.
    index: i32,
    /// The rail's ends.
    stops: (i32, i32),
}

const TURN: i32 = 4096;
const FAR: i32 = 1_000_000;
const NEGATIVE_LIMIT: i32 = -30_011;
const POSITIVE_LIMIT: i32 = 30_023;

const RAIL: Rail = Rail {
    negative_limit: (-FAR, NEGATIVE_LIMIT),
    positive_limit: (POSITIVE_LIMIT, FAR),
    home: (FAR, FAR),
    index: 1_003,
    stops: (-FAR, FAR),
};

struct Machine {
    rig: Rig,
    rail: Rail,
    trigger: Option<Trigger>,
    levels: [bool; 3],
    place: i32,
    /// Velocity when home was attained, or the last one before if that is 0 already.
    final_velocity: Option<f64>,
    last_velocity: f64,
    /// The first direction in which it moved.
    first_direction: f64,
}

impl Machine {
    /// In mode 6, standing at a place of the rail.
    fn at(rail: Rail, place: i32) -> Machine {
        let mut rig = Rig::new(&STANDARD);
        rig.configuration.homing.switch_velocity = 20_000.0;
        rig.configuration.homing.zero_velocity = 2_000.0;
        rig.configuration.homing.acceleration = 400_000.0;
        rig.configuration.homing.counts_per_turn = TURN as u32;
        rig.configuration.homing.stop_torque_pm = 300.0;
        rig.configuration.homing.stop_time_ms = 50;
        rig.configuration.homing.back_off = 100;
        rig.configuration.homing.timeout_ms = 60_000;
        rig.place(place);
        let mut machine = Machine {
            rig,
            rail,
            trigger: None,
            levels: [false; 3],
            place,
            final_velocity: None,
            last_velocity: 0.0,
            first_direction: 0.0,
        };
        machine.levels = machine.levels_at(place);
        machine.show();
        machine.rig.word(0x06);
        machine.rig.word(0x0F);
        machine.rig.mode(Mode::HOMING).unwrap();
        machine
    }

    fn levels_at(&self, place: i32) -> [bool; 3] {
        let within = |(from, to): (i32, i32)| (from..to).contains(&place);
        [
            within(self.rail.negative_limit),
            within(self.rail.positive_limit),
            within(self.rail.home),
        ]
    }

    fn show(&mut self) {
        let [negative_limit, positive_limit, home] = self.levels;
        self.rig.actual.homing = HomingInputs {
            negative_limit,
            positive_limit,
            home,
            ..self.rig.actual.homing
        };
    }

    /// The place on the rail, whatever it is called.
    fn place_now(&self) -> i32 {
        self.rig.actual.position - self.rig.renamed
    }

    /// What the control half sees each period.
    fn period(&mut self) {
        self.rig.period();
        let (low, high) = self.rail.stops;
        let named = f64::from(self.rig.renamed);
        let (low, high) = (f64::from(low) + named, f64::from(high) + named);
        let held = self.rig.unwrapped.clamp(low, high);
        let stopped = held != self.rig.unwrapped;
        self.rig.unwrapped = held;
        if stopped {
            self.rig.actual.position = held as i32;
            self.rig.actual.velocity = 0.0;
        }
        self.rig.actual.torque_pm = if stopped {
            self.rig.axis.torque_limit_pm(&self.rig.configuration)
        } else {
            0.0
        };
        let place = self.place_now();
        let before = core::mem::replace(&mut self.place, place);
        let levels = self.levels_at(place);
        let old = core::mem::replace(&mut self.levels, levels);
        self.show();
        let Some(trigger) = self.trigger else { return };
        let captured = &mut self.rig.actual.homing.captured;
        let position = self.rig.actual.position;
        let waits_for_index = trigger.index && (trigger.edge.is_none() || captured.edge.is_some());
        if waits_for_index && captured.index.is_none() {
            let turns = |place: i32| (place - self.rail.index).div_euclid(TURN);
            if place > before && turns(place) != turns(before) {
                captured.index = Some(position - (place - self.rail.index).rem_euclid(TURN));
            } else if place < before && turns(place - 1) != turns(before - 1) {
                captured.index = Some(position + (self.rail.index - place).rem_euclid(TURN));
            }
        }
        if let Some((switch, edge)) = trigger.edge
            && captured.edge.is_none()
        {
            let number = match switch {
                Switch::NegativeLimit => 0,
                Switch::PositiveLimit => 1,
                Switch::Home => 2,
            };
            let changed = (old[number], levels[number]);
            let wanted = match edge {
                Edge::Rising => (false, true),
                Edge::Falling => (true, false),
            };
            if changed == wanted {
                captured.edge = Some(position);
            }
        }
    }

    fn arm(&mut self) {
        if let Some(trigger) = self.rig.axis.take_trigger() {
            self.trigger = Some(trigger);
            self.rig.actual.homing.captured = Captured {
                serial: trigger.serial,
                ..Captured::default()
            };
        }
    }

    fn run_ms(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.rig.tick();
            self.arm();
            for _ in 0..1_000_000 / rig::PERIOD_NS {
                self.period();
            }
            let velocity = self.rig.sample().velocity;
            if self.first_direction == 0.0 {
                self.first_direction = if velocity == 0.0 {
                    0.0
                } else {
                    velocity.signum()
                };
            }
            if self.final_velocity.is_none() && velocity != 0.0 {
                self.last_velocity = velocity;
            }
            if self.status().homing_attained() && self.final_velocity.is_none() {
                self.final_velocity = Some(self.last_velocity);
            }
        }
    }

    fn start(&mut self) {
        self.rig.word(0x1F);
        self.arm();
    }

    fn status(&self) -> Statusword {
        self.rig.axis.statusword()
    }

    /// Bits 10, 12 and 13 as digits.
    fn bits(&self) -> (u8, u8, u8) {
        let status = self.status();
        let digit = |n| u8::from(status.bit(n));
        (digit(10), digit(12), digit(13))
    }

    /// Until it is done or has failed, and stands.
    fn finish(&mut self) {
        for _ in 0..30_000 {
            self.run_ms(1);
            if matches!(self.bits(), (1, ..)) {
                return;
            }
        }
        panic!("no end: {:?}", self.status());
    }

    /// The place that got the position 0x607C.
    fn home(&self) -> i32 {
        self.rig.configuration.homing.offset - self.rig.renamed
    }
}

fn home(method: i8, rail: Rail, place: i32) -> Machine {
    let mut machine = Machine::at(rail, place);
    machine.rig.configuration.homing.method = method;
    machine.rig.configuration.homing.offset = 123_456;
    assert_eq!(machine.bits(), (1, 0, 0), "not started");
    machine.start();
    machine.finish();
    machine
}

/// A switch that is nowhere.
const NOWHERE: (i32, i32) = (FAR, FAR);

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

/// The first index pulse from a place on, in a direction.
fn index_from(place: i32, direction: f64) -> i32 {
    let turns = |x: i32| (x - RAIL.index).div_euclid(TURN);
    if direction > 0.0 {
        RAIL.index + (turns(place) + 1) * TURN
    } else {
        RAIL.index + turns(place - 1) * TURN
    }
}

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

/// The statusword in each phase, digits of bits 10, 12 and 13.
#[test]
fn statusword_bits_tell_each_phase() {
    let rail = Rail {
        home: (10_300, FAR),
        ..RAIL
    };
    let mut machine = Machine::at(rail, 0);
    machine.rig.configuration.homing.method = 20;
    assert_eq!(machine.bits(), (1, 0, 0), "not started");
    machine.run_ms(10);
    assert_eq!(machine.bits(), (1, 0, 0), "not started");
    machine.start();
    assert_eq!(
        machine.bits(),
        (0, 0, 0),
        "running as soon as it is written"
    );
    machine.run_ms(100);
    assert_eq!(machine.bits(), (0, 0, 0), "running");
    assert!(!machine.rig.axis.is_homed());
    // Interrupted, and at rest.
    machine.rig.word(0x0F);
    assert_eq!(machine.bits(), (1, 0, 0), "interrupted");
    machine.run_ms(100);
    assert_eq!(machine.rig.sample().velocity, 0.0);
    assert_eq!(machine.bits(), (1, 0, 0), "interrupted");
    // Halted: bit 10 when it stands.
    machine.start();
    machine.run_ms(100);
    machine.rig.word(0x11F);
    assert_eq!(machine.bits(), (0, 0, 0), "slowing down");
    machine.run_ms(200);
    assert_eq!(machine.bits(), (1, 0, 0), "halted");
    let place = machine.place_now();
    machine.run_ms(100);
    assert_eq!(machine.place_now(), place);
    // And on.
    machine.rig.word(0x1F);
    machine.run_ms(1);
    assert_eq!(machine.bits(), (0, 0, 0), "running");
    while !machine.status().homing_attained() {
        machine.run_ms(1);
    }
    assert_eq!(machine.bits(), (0, 1, 0), "attained, moving");
    assert_ne!(machine.rig.sample().velocity, 0.0);
    machine.finish();
    assert_eq!(machine.bits(), (1, 1, 0), "done");
    // Bit 4 may fall now.
    machine.rig.word(0x0F);
    machine.run_ms(10);
    assert_eq!(machine.bits(), (1, 1, 0), "done");
    // A method that finds a limit switch in its way.
    machine.rig.configuration.homing.method = 34;
    machine.rail.positive_limit = (machine.place_now() + 1_000, FAR);
    machine.rail.index = machine.place_now() - 10;
    machine.start();
    assert_eq!(machine.bits(), (0, 0, 0), "running anew");
    assert!(!machine.rig.axis.is_homed());
    while machine.rig.axis.homing_error().is_none() {
        machine.run_ms(1);
    }
    assert_eq!(machine.bits(), (0, 0, 1), "error, moving");
    machine.run_ms(100);
    assert_eq!(machine.bits(), (1, 0, 1), "error, standing");
    assert!(machine.rig.axis.conditions().homing_failed);
    // Another mode clears the bits.
    machine.rig.mode(Mode::PROFILE_POSITION).unwrap();
    assert_eq!(machine.bits(), (0, 0, 0));
    machine.rig.mode(Mode::HOMING).unwrap();
    assert_eq!(machine.bits(), (1, 0, 0), "not started");
}

#[test]
fn what_cannot_succeed_fails_with_its_reason() {
    let none = Rail {
        home: (FAR, FAR),
        ..RAIL
    };
    let without_index = Rail { index: FAR, ..RAIL };
    let both = Rail {
        negative_limit: (-FAR, FAR),
        positive_limit: (-FAR, FAR),
        ..RAIL
    };
    // Method, rail, start, error; then a change of the configuration.
    type Change = fn(&mut cia402::HomingConfiguration);
    let as_it_is: Change = |_| {};
    let obstacle = Rail {
        home: NOWHERE,
        stops: (-FAR, 2_000),
        ..RAIL
    };
    let cases: [(i8, Rail, i32, HomingError, Change); 17] = [
        (-4, obstacle, 0, HomingError::TooNear, |homing| {
            homing.least_way = 2_001;
        }),
        (0, RAIL, 0, HomingError::NoMethod, as_it_is),
        (15, RAIL, 0, HomingError::NoMethod, as_it_is),
        (36, RAIL, 0, HomingError::NoMethod, as_it_is),
        (17, RAIL, 0, HomingError::NoSpeed, |homing| {
            homing.switch_velocity = 0.0
        }),
        (17, RAIL, 0, HomingError::NoSpeed, |homing| {
            homing.zero_velocity = f32::NAN
        }),
        (17, RAIL, 0, HomingError::NoSpeed, |homing| {
            homing.acceleration = -1.0
        }),
        (17, both, 0, HomingError::BothLimits, as_it_is),
        // The home switch is nowhere: the first limit, the other after it.
        (19, none, 0, HomingError::PositiveLimit, as_it_is),
        (22, none, 0, HomingError::NegativeLimit, as_it_is),
        (24, none, 0, HomingError::NegativeLimit, as_it_is),
        (28, none, 0, HomingError::PositiveLimit, as_it_is),
        (34, none, 30_023, HomingError::PositiveLimit, as_it_is),
        (-3, none, 0, HomingError::NegativeLimit, as_it_is),
        (33, without_index, 0, HomingError::NoIndex, |homing| {
            homing.counts_per_turn = 100
        }),
        (20, none, 0, HomingError::TimedOut, |homing| {
            homing.timeout_ms = 100
        }),
        (20, none, 0, HomingError::OutOfRange, |homing| {
            homing.range = 9_000
        }),
    ];
    for (method, rail, start, error, change) in cases {
        let mut machine = Machine::at(rail, start);
        machine.rig.configuration.homing.method = method;
        change(&mut machine.rig.configuration.homing);
        machine.start();
        machine.finish();
        assert_eq!(
            machine.rig.axis.homing_error(),
            Some(error),
            "method {method}"
        );
        assert_eq!(machine.bits(), (1, 0, 1));
        assert_eq!(machine.rig.renamed, 0);
        assert!(!machine.rig.axis.is_homed());
        assert_eq!(machine.rig.axis.state(), State::OperationEnabled);
        // It can be started again.
        machine.rig.configuration.homing.method = 37;
        machine.rig.word(0x0F);
        machine.start();
        assert_eq!(machine.bits(), (1, 1, 0));
    }
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
