//! Quick stop, 0x605A, for every option code, mode and dialect.

mod rig;

use cia402::{Demand, Mode, State, Target};
use rig::{P3, Rig, STANDARD};

/// Moving with 10,000 counts/s at a known place.
fn moving(mode: Mode) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.targets.position = 1_000_000;
    rig.targets.velocity = 10_000;
    rig.word(0x1F);
    rig.run_ms(200);
    assert!((rig.sample().velocity - 10_000.0).abs() < 1.0);
    rig
}

#[test]
fn ramps_of_the_standard() {
    // Slow-down 200,000: 50 ms and 250 counts; quick stop 400,000: 25 ms and 125 counts.
    for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        for (option, ms, counts) in [
            (1, 50, 250.0),
            (2, 25, 125.0),
            (5, 50, 250.0),
            (6, 25, 125.0),
            (-1, 25, 125.0),
        ] {
            let mut rig = moving(mode);
            rig.configuration.quick_stop_option = option;
            let start = rig.sample().position;
            rig.trace.clear();
            let outcome = rig.word(0x02);
            assert_eq!(outcome.after, State::QuickStopActive);
            assert_eq!(rig.status() & 0x046F, 0x0007, "{mode} {option}");
            rig.run_ms(ms);
            assert_eq!(rig.axis.state(), State::QuickStopActive, "{mode} {option}");
            assert_eq!(rig.status() & 0x0400, 0, "{mode} {option}");
            assert!(rig.sample().velocity.abs() < 1.0);
            let way = rig.sample().position - start;
            assert!((way - counts).abs() < 2.0, "{mode} {option}: {way}");
            for pair in rig.trace.windows(2) {
                assert!(
                    (pair[0].velocity - pair[1].velocity).abs() <= 21.0,
                    "{pair:?}"
                );
            }
            rig.run_ms(2);
            if (5..=8).contains(&option) {
                assert_eq!(rig.status() & 0x046F, 0x0407, "{mode} {option}");
                assert!(matches!(rig.demand, Demand::Position { .. }));
                rig.run_ms(100);
                assert!((rig.sample().position - start - counts).abs() < 2.0);
                // 16
                rig.word(0x0F);
                assert_eq!(rig.axis.state(), State::OperationEnabled);
                assert_eq!(rig.axis.mode(), mode);
            } else {
                assert_eq!(rig.axis.state(), State::SwitchOnDisabled, "{mode} {option}");
                assert_eq!(rig.demand, Demand::Off);
                // No 16.
                rig.word(0x0F);
                assert_eq!(rig.axis.state(), State::SwitchOnDisabled);
            }
        }
    }
}

#[test]
fn code_0_frees_the_motor() {
    let mut rig = moving(Mode::PROFILE_VELOCITY);
    rig.configuration.quick_stop_option = 0;
    assert_eq!(rig.word(0x02).after, State::SwitchOnDisabled);
    assert_eq!(rig.demand, Demand::Off);
}

#[test]
fn limits_brake_with_all_they_have() {
    // 3, 7 current limit; 4, 8 voltage limit: the set-point drops to zero, the motor takes time.
    for option in [3, 4, 7, 8] {
        for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
            let mut rig = moving(mode);
            rig.configuration.quick_stop_option = option;
            rig.stuck = true;
            rig.word(0x02);
            let zero = Demand::Velocity {
                start: 0.0,
                acceleration: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            };
            for velocity in [10_000.0, 5000.0, 1.0] {
                rig.actual.velocity = velocity;
                rig.run_ms(3);
                assert_eq!(rig.demand, zero, "{option}");
                assert_eq!(rig.axis.state(), State::QuickStopActive);
            }
            rig.actual.velocity = -0.5; // stopped
            rig.run_ms(1);
            let expected = if option > 4 {
                State::QuickStopActive
            } else {
                State::SwitchOnDisabled
            };
            assert_eq!(rig.axis.state(), expected, "{option}");
            assert_eq!(matches!(rig.demand, Demand::Position { .. }), option > 4);
        }
    }
}

#[test]
fn the_code_is_that_of_the_beginning() {
    let mut rig = moving(Mode::PROFILE_POSITION);
    rig.configuration.quick_stop_option = 6;
    rig.word(0x02);
    rig.configuration.quick_stop_option = 2;
    rig.run_ms(100);
    assert_eq!(rig.axis.state(), State::QuickStopActive);
    // While it still slows down, 16 goes on without a jump.
    let mut rig = moving(Mode::PROFILE_VELOCITY);
    rig.configuration.quick_stop_option = 6;
    rig.word(0x02);
    rig.run_ms(10);
    rig.trace.clear();
    rig.word(0x0F);
    rig.run_ms(100);
    assert!(
        (rig.trace[0].velocity - 6000.0).abs() < 100.0,
        "{:?}",
        rig.trace[0]
    );
    assert!((rig.sample().velocity - 10_000.0).abs() < 1.0);
}

#[test]
fn disable_voltage_ends_a_quick_stop_at_once() {
    let mut rig = moving(Mode::PROFILE_POSITION);
    rig.word(0x02);
    rig.run_ms(5);
    assert_eq!(rig.word(0x00).after, State::SwitchOnDisabled);
    assert_eq!(rig.demand, Demand::Off);
}

#[test]
fn the_p3_has_no_ramps() {
    for option in 0..=8 {
        let mut rig = Rig::enabled(&P3, Mode::PROFILE_VELOCITY);
        rig.targets.velocity = 10_000;
        rig.receive(Target::Velocity);
        rig.run_ms(150);
        rig.configuration.quick_stop_option = option;
        rig.stuck = true;
        let here = rig.actual.position;
        rig.word(0x02);
        if option < 5 {
            assert_eq!(rig.axis.state(), State::SwitchOnDisabled, "{option}");
            assert_eq!(rig.demand, Demand::Off, "{option}");
        } else {
            assert_eq!(rig.axis.state(), State::QuickStopActive, "{option}");
            let held = Demand::Position {
                start: here,
                fraction: 0.0,
                velocity: 0.0,
                acceleration: 0.0,
                velocity_offset: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            };
            assert_eq!(rig.demand, held, "{option}");
            rig.run_ms(50);
            assert_eq!(rig.demand, held, "{option}");
            // 16, and with it mode 0.
            rig.word(0x0F);
            assert_eq!(rig.axis.state(), State::OperationEnabled);
            assert_eq!(rig.axis.mode_display(), 0);
            assert_eq!(rig.demand, Demand::Idle);
        }
    }
}
