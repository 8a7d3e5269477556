//! What the statusword tells in between, and why homing fails.

use cia402::{HomingError, Mode, State};

use crate::machine::{FAR, Machine, NOWHERE, RAIL, Rail};

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
