//! Leaving operation enabled, 0x605B and 0x605C; the reaction to faults, 0x605E; and to a lost
//! connection, 0x6007.

mod rig;

use cia402::{Demand, Dialect, Mode, State, Target};
use rig::{P3, Rig, STANDARD};

const REACHED: u16 = 0x0400;

const MOVING_MODES: [Mode; 4] = [
    Mode::PROFILE_POSITION,
    Mode::PROFILE_VELOCITY,
    Mode::CYCLIC_POSITION,
    Mode::CYCLIC_VELOCITY,
];

/// Moving with 10,000 counts/s.
fn moving_as(dialect: &'static Dialect, mode: Mode) -> Rig {
    let mut rig = Rig::enabled(dialect, mode);
    rig.configuration.disable_option = 1;
    if mode == Mode::CYCLIC_POSITION {
        for n in 1..=20 {
            rig.targets.position = n * 10;
            rig.receive(Target::Position);
            rig.run_ms(1);
        }
    } else {
        rig.targets.position = 1_000_000;
        rig.targets.velocity = 10_000;
        rig.receive(Target::Velocity);
        rig.word(0x1F);
        rig.run_ms(200);
    }
    assert!((rig.sample().velocity - 10_000.0).abs() < 1.0, "{mode}");
    rig
}

fn moving(mode: Mode) -> Rig {
    moving_as(&STANDARD, mode)
}

/// No step of the velocity beyond `rate`.
#[track_caller]
fn continuous(rig: &Rig, rate: f64) {
    for pair in rig.trace.windows(2) {
        let step = (pair[1].velocity - pair[0].velocity).abs();
        assert!(step <= rate * 50e-6 + 1.0, "{pair:?}");
    }
}

#[test]
fn disable_operation_and_shutdown_slow_down_first() {
    // 200,000 counts/s²: 50 ms and 250 counts.
    for mode in MOVING_MODES {
        for (word, state) in [(0x07, State::SwitchedOn), (0x06, State::ReadyToSwitchOn)] {
            let case = format!("{mode} {word:#x}");
            let mut rig = moving(mode);
            rig.configuration.shutdown_option = 1;
            let start = rig.sample().position;
            rig.trace.clear();
            let outcome = rig.word(word);
            assert_eq!(outcome.after, State::OperationEnabled, "{case}");
            rig.run_ms(48);
            assert_eq!(rig.axis.state(), State::OperationEnabled, "{case}");
            assert_eq!(rig.status() & REACHED, 0, "{case}");
            continuous(&rig, 200_000.0);
            rig.run_ms(5);
            assert_eq!(rig.axis.state(), state, "{case}");
            assert_eq!(rig.demand, Demand::Off, "{case}");
            let way = rig.sample().position - start;
            assert!((way - 250.0).abs() < 3.0, "{case}: {way}");
            // It comes back as it went.
            rig.word(0x0F);
            assert_eq!(rig.axis.state(), State::OperationEnabled, "{case}");
            assert_eq!(rig.axis.mode(), mode, "{case}");
        }
    }
}

#[test]
fn code_0_frees_the_motor_and_so_does_a_drive_without_ramps() {
    for mode in MOVING_MODES {
        for (dialect, disable, shutdown) in [(&STANDARD, 0, 0), (&P3, 1, 1)] {
            for (word, state) in [(0x07, State::SwitchedOn), (0x06, State::ReadyToSwitchOn)] {
                let mut rig = moving_as(dialect, mode);
                rig.configuration.disable_option = disable;
                rig.configuration.shutdown_option = shutdown;
                assert_eq!(rig.word(word).after, state, "{mode}");
                assert_eq!(rig.demand, Demand::Off, "{mode}");
            }
        }
    }
}

#[test]
fn at_rest_there_is_nothing_to_wait_for() {
    for mode in (0..=10)
        .map(Mode)
        .filter(|mode| STANDARD.modes().contains(*mode))
    {
        let mut rig = Rig::enabled(&STANDARD, mode);
        rig.configuration.shutdown_option = 1;
        rig.run_ms(5);
        assert_eq!(rig.word(0x07).after, State::SwitchedOn, "{mode}");
        rig.word(0x0F);
        rig.run_ms(5);
        assert_eq!(rig.word(0x06).after, State::ReadyToSwitchOn, "{mode}");
    }
}

#[test]
fn on_the_way_out_other_commands_act() {
    for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        // Enable operation: on as if nothing had been.
        let mut rig = moving(mode);
        rig.trace.clear();
        rig.word(0x07);
        rig.run_ms(20);
        assert!((rig.sample().velocity - 6000.0).abs() < 250.0);
        // Neither a target nor a mode changes that.
        rig.receive(Target::Velocity);
        rig.mode(mode).expect("the mode in force");
        rig.word(0x0F);
        rig.run_ms(100);
        assert_eq!(rig.axis.state(), State::OperationEnabled);
        assert!((rig.sample().velocity - 10_000.0).abs() < 1.0, "{mode}");
        continuous(&rig, 200_000.0);
        // Shutdown, without a ramp of its own, acts at once.
        rig.word(0x07);
        rig.run_ms(20);
        assert_eq!(rig.word(0x06).after, State::ReadyToSwitchOn);
        // With one, the ramp goes on and ends there.
        let mut rig = moving(mode);
        rig.configuration.shutdown_option = 1;
        rig.word(0x07);
        rig.run_ms(20);
        rig.word(0x06);
        rig.run_ms(35);
        assert_eq!(rig.axis.state(), State::ReadyToSwitchOn);
        // Disable voltage and quick stop do not wait.
        for (word, state) in [
            (0x00, State::SwitchOnDisabled),
            (0x02, State::QuickStopActive),
        ] {
            let mut rig = moving(mode);
            rig.word(0x07);
            rig.run_ms(20);
            assert_eq!(rig.word(word).after, state);
            rig.run_ms(60);
            assert_eq!(rig.axis.state(), State::SwitchOnDisabled);
        }
        // Another mode waits for the next enabling.
        let mut rig = moving(mode);
        rig.word(0x07);
        rig.run_ms(20);
        rig.mode(Mode::PROFILE_TORQUE).expect("mode 4");
        assert!((rig.sample().velocity - 6000.0).abs() < 250.0);
        rig.run_ms(35);
        assert_eq!(rig.axis.state(), State::SwitchedOn);
        assert_eq!(rig.axis.mode(), Mode::PROFILE_TORQUE);
    }
}

#[test]
fn a_halt_goes_over_into_the_way_out() {
    for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        let mut rig = moving(mode);
        rig.word(0x10F);
        rig.run_ms(10);
        rig.trace.clear();
        assert_eq!(rig.word(0x107).after, State::OperationEnabled);
        rig.run_ms(45);
        assert_eq!(rig.axis.state(), State::SwitchedOn, "{mode}");
        continuous(&rig, 200_000.0);
    }
}

fn react(rig: &mut Rig) {
    rig.axis
        .fault_reaction(&rig.configuration, &rig.targets, &rig.actual);
    rig.fetch();
}

#[test]
fn faults_are_reacted_to_as_0x605e_says() {
    // Slow-down 200,000: 50 ms and 250 counts; quick stop 400,000: 25 ms and 125 counts.
    for mode in MOVING_MODES {
        for (option, ms, counts) in [(1, 50, 250.0), (2, 25, 125.0), (7, 25, 125.0)] {
            let case = format!("{mode} {option}");
            let mut rig = moving(mode);
            rig.configuration.fault_reaction_option = option;
            let start = rig.sample().position;
            rig.trace.clear();
            react(&mut rig);
            assert_eq!(rig.axis.state(), State::FaultReactionActive, "{case}");
            assert_eq!(rig.status() & 0x4F, 0x0F, "{case}");
            rig.run_ms(ms - 2);
            assert_eq!(rig.axis.state(), State::FaultReactionActive, "{case}");
            // No command interferes.
            for word in [0x80, 0x00, 0x02, 0x06, 0x0F] {
                assert_eq!(rig.word(word).after, State::FaultReactionActive, "{case}");
            }
            continuous(&rig, if option == 1 { 200_000.0 } else { 400_000.0 });
            rig.run_ms(5);
            assert_eq!(rig.axis.state(), State::Fault, "{case}");
            assert_eq!(rig.demand, Demand::Off, "{case}");
            let way = rig.sample().position - start;
            assert!((way - counts).abs() < 3.0, "{case}: {way}");
        }
    }
}

#[test]
fn limits_brake_until_the_motor_stands_or_for_10_s() {
    for option in [3, 4] {
        for stands in [true, false] {
            let mut rig = moving(Mode::PROFILE_VELOCITY);
            rig.configuration.fault_reaction_option = option;
            rig.stuck = true;
            react(&mut rig);
            let brake = Demand::Velocity {
                start: 0.0,
                acceleration: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            };
            rig.run_ms(9_000);
            assert_eq!(rig.demand, brake);
            assert_eq!(rig.axis.state(), State::FaultReactionActive);
            if stands {
                rig.actual.velocity = 0.0;
                rig.run_ms(2);
            } else {
                rig.run_ms(1_000);
            }
            assert_eq!(rig.axis.state(), State::Fault);
            assert_eq!(rig.demand, Demand::Off);
        }
    }
}

#[test]
fn what_cannot_be_braked_is_freed() {
    // The fault's kind, the code, the dialect, the mode.
    let mut rig = moving(Mode::PROFILE_POSITION);
    rig.axis.fault();
    rig.fetch();
    assert_eq!(rig.demand, Demand::Off);
    for (dialect, option, mode) in [
        (&STANDARD, 0, Mode::PROFILE_POSITION),
        (&P3, 2, Mode::PROFILE_POSITION),
        (&STANDARD, 2, Mode::IDLE),
    ] {
        let mut rig = if mode == Mode::IDLE {
            Rig::enabled(dialect, mode)
        } else {
            moving_as(dialect, mode)
        };
        rig.configuration.fault_reaction_option = option;
        react(&mut rig);
        assert_eq!(rig.demand, Demand::Off, "{option}");
        assert_eq!(rig.axis.state(), State::FaultReactionActive);
        rig.tick();
        assert_eq!(rig.axis.state(), State::Fault);
    }
    // A worse fault in the midst of a reaction.
    let mut rig = moving(Mode::PROFILE_POSITION);
    react(&mut rig);
    rig.run_ms(10);
    react(&mut rig); // a further one of the same kind changes nothing
    assert!(rig.sample().velocity < 7000.0);
    assert!(rig.axis.is_powered());
    rig.axis.fault();
    rig.fetch();
    assert_eq!(rig.demand, Demand::Off);
    rig.tick();
    assert_eq!(rig.axis.state(), State::Fault);
    // Without power there is nothing to brake.
    let mut rig = Rig::new(&STANDARD);
    rig.word(0x06);
    react(&mut rig);
    rig.tick();
    assert_eq!(rig.axis.state(), State::Fault);
}

#[test]
fn a_lost_connection_is_reacted_to_as_0x6007_says() {
    for (option, is_fault, state) in [
        (0, false, State::OperationEnabled),
        (1, true, State::OperationEnabled), // the owner makes it a fault
        (2, false, State::SwitchOnDisabled),
        (3, false, State::QuickStopActive),
        (4, false, State::OperationEnabled),
        (-1, false, State::OperationEnabled),
    ] {
        let mut rig = moving(Mode::PROFILE_VELOCITY);
        rig.configuration.abort_connection_option = option;
        let lost = |rig: &mut Rig| {
            let seen = rig
                .axis
                .connection_lost(&rig.configuration, &rig.targets, &rig.actual);
            rig.fetch();
            seen
        };
        assert_eq!(lost(&mut rig), is_fault, "{option}");
        assert_eq!(rig.axis.state(), state, "{option}");
        assert_eq!(rig.demand == Demand::Off, option == 2, "{option}");
        // Without power nothing happens.
        let mut rig = Rig::new(&STANDARD);
        rig.configuration.abort_connection_option = option;
        rig.word(0x06);
        assert!(!lost(&mut rig), "{option}");
        assert_eq!(rig.axis.state(), State::ReadyToSwitchOn, "{option}");
    }
}
