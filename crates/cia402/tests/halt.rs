//! Halt, controlword bit 8, for every mode and option code (0x605D), and going on behind it.

mod rig;

use cia402::{Demand, Mode, State, Target};
use rig::{P3, Random, Rig, STANDARD};

/// Operation enabled with and without halt.
const RUN: u16 = 0x0F;
const HALT: u16 = 0x10F;

const REACHED: u16 = 0x0400;
const ACKNOWLEDGE: u16 = 0x1000;

const HALTING_MODES: [Mode; 3] = [
    Mode::PROFILE_POSITION,
    Mode::PROFILE_VELOCITY,
    Mode::PROFILE_TORQUE,
];

/// No velocity: the controllers brake with all they may use.
const BRAKE: Demand = Demand::Velocity {
    start: 0.0,
    acceleration: 0.0,
    torque_offset_pm: 0.0,
    duration_ns: 0,
};

/// Moving with 10,000 counts/s, or pushing with 500 per mille.
fn moving(mode: Mode) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.targets.position = 20_000;
    rig.targets.velocity = 10_000;
    rig.targets.torque_pm = 500;
    rig.configuration.torque_slope_pm_per_s = Some(5000.0);
    rig.word(0x1F);
    rig.run_ms(200);
    if mode == Mode::PROFILE_TORQUE {
        assert_eq!(rig.sample().torque_pm, 500.0);
    } else {
        assert!((rig.sample().velocity - 10_000.0).abs() < 1.0);
    }
    rig
}

/// No step in what has been demanded since the trace was cleared, at these rates at most.
#[track_caller]
fn continuous(rig: &Rig, rate: f64, torque_pm_per_s: f64) {
    let period = f64::from(rig::PERIOD_NS) * 1e-9;
    for pair in rig.trace.windows(2) {
        let step = (pair[1].velocity - pair[0].velocity).abs();
        assert!(step <= rate * period + 1.0, "{pair:?}");
        let torque = (pair[1].torque_pm - pair[0].torque_pm).abs();
        assert!(torque <= torque_pm_per_s * period + 1e-3, "{pair:?}");
        let way = pair[1].position - pair[0].position;
        let speed = pair[0].velocity.abs().max(pair[1].velocity.abs());
        // Velocity control hands over to position control at a whole count.
        assert!(way.abs() <= speed * period + 1.0, "{pair:?}");
    }
}

#[test]
fn ramps_to_rest_and_on() {
    // Slow-down 200,000: 50 ms and 250 counts; quick stop 400,000: 25 ms and 125 counts.
    for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        for (option, ms, counts, rate) in [
            (1, 50, 250.0, 200_000.0),
            (2, 25, 125.0, 400_000.0),
            (0, 50, 250.0, 200_000.0),
            (5, 50, 250.0, 200_000.0),
            (-1, 50, 250.0, 200_000.0),
        ] {
            let case = format!("{mode} {option}");
            let mut rig = moving(mode);
            rig.configuration.halt_option = option;
            let start = rig.sample().position;
            rig.trace.clear();
            rig.word(HALT);
            assert_eq!(rig.axis.state(), State::OperationEnabled, "{case}");
            rig.run_ms(ms - 2);
            assert!(rig.sample().velocity > 100.0, "{case}");
            assert_eq!(rig.status() & REACHED, 0, "{case}");
            rig.run_ms(4);
            assert_eq!(rig.sample().velocity, 0.0, "{case}");
            assert_eq!(rig.status() & 0x066F, 0x0627, "{case}");
            let way = rig.sample().position - start;
            assert!((way - counts).abs() < 2.0, "{case}: {way}");
            // It stays there.
            rig.run_ms(100);
            assert!((rig.sample().position - start - way).abs() < 0.5, "{case}");
            assert_eq!(rig.status() & REACHED, REACHED, "{case}");
            continuous(&rig, rate, 0.0);
            // And goes on, as if nothing had been.
            rig.trace.clear();
            rig.word(RUN);
            assert_eq!(rig.status() & REACHED, 0, "{case}");
            rig.run_ms(101);
            assert!((rig.sample().velocity - 10_000.0).abs() < 1.0, "{case}");
            continuous(&rig, 200_000.0, 0.0);
            if mode == Mode::PROFILE_POSITION {
                rig.run_ms(3000);
                assert_eq!(rig.actual.position, 20_000, "{case}");
            }
            assert_eq!(rig.status() & REACHED, REACHED, "{case}");
        }
    }
}

#[test]
fn limits_brake_with_all_they_have() {
    for option in [3, 4] {
        for mode in HALTING_MODES {
            let case = format!("{mode} {option}");
            let mut rig = moving(mode);
            rig.configuration.halt_option = option;
            rig.stuck = true;
            rig.actual.velocity = 10_000.0;
            rig.word(HALT);
            for velocity in [10_000.0, 5000.0, 1.0] {
                rig.actual.velocity = velocity;
                rig.run_ms(3);
                assert_eq!(rig.demand, BRAKE, "{case}");
                assert_eq!(rig.axis.state(), State::OperationEnabled, "{case}");
                assert_eq!(rig.status() & REACHED, 0, "{case}");
            }
            rig.actual.velocity = -0.5; // stopped
            rig.actual.position = 4711;
            rig.actual.torque_pm = 0.0;
            rig.run_ms(1);
            rig.actual.velocity = 0.0;
            rig.run_ms(1);
            let held = Demand::Position {
                start: 4711,
                fraction: 0.0,
                velocity: 0.0,
                acceleration: 0.0,
                velocity_offset: 0.0,
                torque_offset_pm: 0.0,
                duration_ns: 0,
            };
            assert_eq!(rig.demand, held, "{case}");
            assert_eq!(rig.status() & REACHED, REACHED, "{case}");
            rig.run_ms(50);
            assert_eq!(rig.demand, held, "{case}");
            rig.word(RUN);
            rig.run_ms(1);
            assert_eq!(rig.status() & REACHED, 0, "{case}");
            let kind = match mode {
                Mode::PROFILE_POSITION => matches!(rig.demand, Demand::Position { .. }),
                Mode::PROFILE_VELOCITY => matches!(rig.demand, Demand::Velocity { .. }),
                _ => matches!(rig.demand, Demand::Torque { .. }),
            };
            assert!(kind, "{case}: {:?}", rig.demand);
        }
    }
}

#[test]
fn torque_runs_to_zero_on_its_slope() {
    for option in [1, 2] {
        let mut rig = moving(Mode::PROFILE_TORQUE);
        rig.configuration.halt_option = option;
        rig.actual.velocity = 3000.0;
        rig.trace.clear();
        rig.word(HALT);
        // 500 per mille at 5000 per mille/s.
        rig.run_ms(99);
        assert!((rig.sample().torque_pm - 5.0).abs() < 1e-3);
        rig.run_ms(3);
        assert_eq!(rig.sample().torque_pm, 0.0);
        // No torque, but the motor still turns: not at rest.
        assert_eq!(rig.status() & REACHED, 0);
        rig.actual.velocity = 0.0;
        rig.run_ms(1);
        assert_eq!(rig.status() & REACHED, REACHED);
        rig.word(RUN);
        assert_eq!(rig.status() & REACHED, 0);
        rig.run_ms(50);
        assert!((rig.sample().torque_pm - 250.0).abs() < 1e-3);
        // Halted again half way.
        rig.word(HALT);
        rig.run_ms(25);
        assert!((rig.sample().torque_pm - 125.0).abs() < 1e-3);
        rig.word(RUN);
        rig.run_ms(77);
        assert_eq!(rig.sample().torque_pm, 500.0);
        assert_eq!(rig.status() & REACHED, REACHED);
        continuous(&rig, 0.0, 5000.0);
    }
}

#[test]
fn without_a_slope_torque_steps() {
    let mut rig = moving(Mode::PROFILE_TORQUE);
    rig.configuration.torque_slope_pm_per_s = None;
    rig.word(HALT);
    rig.run_ms(1);
    assert_eq!(rig.sample().torque_pm, 0.0);
    // A target that comes now waits.
    rig.targets.torque_pm = -300;
    rig.receive(Target::Torque);
    assert_eq!(rig.sample().torque_pm, 0.0);
    rig.run_ms(5);
    assert_eq!(rig.sample().torque_pm, 0.0);
    rig.word(RUN);
    rig.run_ms(1);
    assert_eq!(rig.sample().torque_pm, -300.0);
}

#[test]
fn other_modes_and_drives_do_not_look_at_the_bit() {
    for mode in [
        Mode::IDLE,
        Mode::CYCLIC_POSITION,
        Mode::CYCLIC_VELOCITY,
        Mode::CYCLIC_TORQUE,
        Mode::CYCLIC_TORQUE_WITH_ANGLE,
        Mode::PHASE_VOLTAGE_WITH_ANGLE,
    ] {
        let run = |word: u16| {
            let mut rig = Rig::enabled(&STANDARD, mode);
            rig.word(word);
            for n in 1..20 {
                rig.targets.position = n * 10;
                rig.targets.velocity = n * 10;
                rig.targets.torque_pm = n as i16;
                for target in [Target::Position, Target::Velocity, Target::Torque] {
                    rig.receive(target);
                }
                rig.run_ms(1);
            }
            (format!("{:?}", rig.trace), rig.status())
        };
        assert_eq!(run(RUN), run(HALT), "{mode}");
    }
    for mode in HALTING_MODES {
        let run = |word: u16| {
            let mut rig = Rig::enabled(&P3, mode);
            rig.targets.position = 1000;
            rig.targets.velocity = 5000;
            rig.targets.torque_pm = 100;
            rig.word(word | 0x10);
            rig.run_ms(30);
            rig.word(word);
            rig.run_ms(300);
            (format!("{:?}", rig.trace), rig.status())
        };
        assert_eq!(run(RUN), run(HALT), "{mode}");
    }
}

#[test]
fn a_mode_begins_halted() {
    // As ros2_canopen changes modes: halt, new mode, go.
    for from in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        for to in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
            let mut rig = moving(from);
            rig.trace.clear();
            rig.word(HALT);
            rig.run_ms(10);
            rig.mode(to).unwrap();
            assert_eq!(rig.axis.mode_display(), to.0);
            rig.run_ms(100);
            assert_eq!(rig.sample().velocity, 0.0, "{from} {to}");
            assert_eq!(rig.status() & REACHED, REACHED, "{from} {to}");
            let here = rig.sample().position;
            rig.word(RUN);
            rig.run_ms(150);
            let moves = match (from, to) {
                // A mode without a set-point of its own stays where it is.
                (Mode::PROFILE_VELOCITY, Mode::PROFILE_POSITION) => 0.0,
                _ => 10_000.0,
            };
            assert!(
                (rig.sample().velocity - moves).abs() < 1.0,
                "{from} {to}: {:?}",
                rig.sample()
            );
            if moves == 0.0 {
                assert!((rig.sample().position - here).abs() < 0.5);
            }
            continuous(&rig, 200_000.0, 0.0);
        }
    }
}

#[test]
fn enabled_halted_it_waits() {
    for mode in HALTING_MODES {
        let mut rig = Rig::new(&STANDARD);
        rig.targets.velocity = 10_000;
        rig.targets.torque_pm = 500;
        rig.targets.position = 5000;
        rig.mode(mode).unwrap(); // in switch on disabled
        assert_eq!(rig.axis.mode_display(), mode.0);
        rig.word(0x06);
        rig.word(HALT | 0x10);
        rig.run_ms(50);
        assert_eq!(rig.axis.state(), State::OperationEnabled);
        assert!(
            rig.trace
                .iter()
                .all(|sample| sample.velocity == 0.0 && sample.torque_pm == 0.0)
        );
        assert_eq!(rig.status() & REACHED, REACHED, "{mode}");
        rig.word(RUN);
        rig.run_ms(1500);
        match mode {
            Mode::PROFILE_POSITION => assert_eq!(rig.actual.position, 5000),
            Mode::PROFILE_VELOCITY => assert_eq!(rig.sample().velocity, 10_000.0),
            _ => assert_eq!(rig.sample().torque_pm, 500.0),
        }
    }
}

#[test]
fn set_points_are_taken_and_wait() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    rig.word(HALT);
    rig.targets.position = 1000;
    rig.word(HALT | 0x10);
    assert_eq!(rig.status() & ACKNOWLEDGE, ACKNOWLEDGE);
    rig.word(HALT);
    assert_eq!(rig.status() & ACKNOWLEDGE, 0);
    // The first is in process, so the next is buffered and the acknowledge stays.
    rig.targets.position = 3000;
    rig.word(HALT | 0x10);
    rig.word(HALT);
    assert_eq!(rig.status() & ACKNOWLEDGE, ACKNOWLEDGE);
    rig.run_ms(500);
    assert_eq!(rig.actual.position, 0);
    rig.trace.clear();
    rig.word(RUN);
    rig.run_ms(1000);
    assert_eq!(rig.actual.position, 3000);
    assert_eq!(rig.status() & (ACKNOWLEDGE | REACHED), REACHED);
    // It stopped at 1000 on the way.
    assert!(
        rig.trace
            .iter()
            .any(|sample| sample.velocity == 0.0 && (sample.position - 1000.0).abs() < 0.5)
    );
    continuous(&rig, 200_000.0, 0.0);
}

#[test]
fn a_target_of_the_halt_counts_behind_it() {
    let mut rig = moving(Mode::PROFILE_VELOCITY);
    rig.word(HALT);
    rig.targets.velocity = -4000;
    rig.receive(Target::Velocity);
    rig.run_ms(100);
    assert_eq!(rig.sample().velocity, 0.0);
    assert_eq!(rig.status() & ACKNOWLEDGE, ACKNOWLEDGE, "speed is zero");
    rig.word(RUN);
    rig.run_ms(100);
    assert_eq!(rig.sample().velocity, -4000.0);
    assert_eq!(rig.status() & (ACKNOWLEDGE | REACHED), REACHED);
}

#[test]
fn a_relative_set_point_counts_from_where_the_halt_led() {
    let mut rig = moving(Mode::PROFILE_VELOCITY);
    rig.word(HALT);
    rig.mode(Mode::PROFILE_POSITION).unwrap();
    rig.run_ms(100);
    let here = rig.actual.demand_position;
    rig.targets.position = 700;
    rig.word(HALT | 0x50);
    rig.word(RUN);
    rig.run_ms(1000);
    assert_eq!(rig.actual.position, here + 700);
}

#[test]
fn a_reached_target_stays_reached() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    rig.targets.position = 1000;
    rig.word(0x1F);
    rig.run_ms(1000);
    rig.word(HALT);
    rig.run_ms(10);
    rig.word(RUN);
    rig.run_ms(10);
    assert_eq!(rig.actual.position, 1000);
    assert_eq!(rig.status() & REACHED, REACHED);
}

#[test]
fn the_code_is_that_of_the_beginning() {
    let mut rig = moving(Mode::PROFILE_VELOCITY);
    rig.configuration.halt_option = 1;
    rig.word(HALT);
    rig.configuration.halt_option = 3;
    rig.run_ms(25);
    assert!((rig.sample().velocity - 5000.0).abs() < 1.0);
}

#[test]
fn stronger_commands_end_a_halt() {
    for mode in HALTING_MODES {
        for (word, state) in [
            (0x02, State::QuickStopActive),
            (0x00, State::SwitchOnDisabled),
            (0x06, State::ReadyToSwitchOn),
            (0x07, State::SwitchedOn),
        ] {
            let mut rig = moving(mode);
            rig.configuration.disable_option = 0;
            rig.word(HALT);
            rig.run_ms(5);
            rig.trace.clear();
            assert_eq!(rig.word(word | 0x100).after, state, "{mode}");
            if state != State::QuickStopActive {
                assert_eq!(rig.demand, Demand::Off, "{mode}");
                continue;
            }
            if mode != Mode::PROFILE_TORQUE {
                continuous(&rig, 400_000.0, 0.0);
                rig.run_ms(10);
                assert!(rig.sample().velocity < 10_000.0 - 5.0 * 200.0 - 9.0 * 400.0);
            }
            rig.run_ms(40);
            assert_eq!(rig.axis.state(), State::SwitchOnDisabled, "{mode}");
        }
        let mut rig = moving(mode);
        rig.word(HALT);
        rig.run_ms(5);
        rig.axis.fault();
        rig.tick();
        assert_eq!(rig.axis.state(), State::Fault);
        assert_eq!(rig.demand, Demand::Off);
        assert_eq!(rig.status() & REACHED, 0);
    }
}

#[test]
fn another_name_for_the_position_moves_nothing() {
    let mut rig = moving(Mode::PROFILE_POSITION);
    rig.word(HALT);
    rig.run_ms(100);
    let here = rig.actual.position;
    rig.axis.preset_position(50_000);
    rig.place(here + 50_000);
    rig.actual.demand_position += 50_000;
    rig.demand = *rig.axis.demand();
    rig.run_ms(20);
    assert_eq!(rig.actual.position, here + 50_000);
    rig.word(RUN);
    rig.run_ms(3000);
    assert_eq!(rig.actual.position, 70_000);
}

#[test]
fn halted_at_random_a_move_ends_exactly_and_never_jumps() {
    let mut random = Random(402);
    for case in 0..200 {
        let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
        rig.configuration.acceleration = random.scaled(1e4, 1e6) as f32;
        rig.configuration.deceleration = random.scaled(1e4, 1e6) as f32;
        rig.configuration.quick_stop_deceleration = random.scaled(1e4, 1e6) as f32;
        rig.configuration.profile_velocity = random.scaled(1e3, 1e5) as f32;
        rig.configuration.halt_option = 1 + random.below(2) as i8;
        let rate = [
            rig.configuration.acceleration,
            rig.configuration.deceleration,
            rig.configuration.quick_stop_deceleration,
        ]
        .into_iter()
        .max_by(f32::total_cmp)
        .expect("three rates");
        rig.targets.position = (random.sign() * random.scaled(10.0, 1e5)) as i32;
        rig.word(0x1F);
        for _ in 0..random.below(20) {
            rig.run_ms(random.below(30) as u32);
            // Somewhere between two ticks.
            rig.tick();
            let periods = random.below(21);
            for period in 0..20 {
                if period == periods {
                    rig.word(if random.below(2) == 0 { HALT } else { RUN });
                }
                rig.period();
            }
        }
        rig.word(RUN);
        let mut ms = 0;
        while rig.status() & REACHED == 0 {
            rig.run_ms(1);
            ms += 1;
            assert!(ms < 300_000, "case {case}");
        }
        assert_eq!(rig.actual.position, rig.targets.position, "case {case}");
        // Where a profile bends within a millisecond, the velocity may give way by what the rate
        // makes of one: 20 periods.
        continuous(&rig, 21.0 * f64::from(rate), 0.0);
    }
}
