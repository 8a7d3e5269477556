//! Every input is answered: odd numbers in every field, every call in every order.

mod rig;

use cia402::{
    Actual, Axis, Captured, Configuration, Demand, HomingInputs, State, Target, Targets, Window,
};
use rig::{P3, Random, STANDARD};

#[test]
fn anything_may_be_written_at_any_time() {
    // No panic with overflow checks, and never a demand that is not a number.
    let mut random = Random(99);
    let odd = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-30,
        1e30,
        f32::MAX,
        f32::MIN_POSITIVE,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        20_000.0,
        3e5,
    ];
    let integers = [0, 1, -1, i32::MIN, i32::MAX, 5000, -5000];
    for dialect in [&STANDARD, &P3] {
        let mut axis = Axis::new(dialect);
        let mut configuration = Configuration::default();
        let mut targets = Targets::default();
        let mut actual = Actual::default();
        let (mut enabled, mut homed) = (0, 0);
        for step in 0..1_000_000 {
            let number = odd[random.below(odd.len() as u64) as usize];
            let integer = integers[random.below(integers.len() as u64) as usize];
            let window = (random.below(2) == 0).then_some(Window {
                size: integer as u32,
                time_ms: random.below(3) as u16,
            });
            match random.below(44) {
                0 => configuration.profile_velocity = number,
                1 => configuration.acceleration = number,
                2 => configuration.deceleration = number,
                3 => configuration.quick_stop_deceleration = number,
                4 => configuration.max_velocity = window.map(|_| number),
                5 => configuration.max_acceleration = window.map(|_| number),
                6 => configuration.max_deceleration = window.map(|_| number),
                7 => configuration.position_limits = window.map(|_| (integer, integer / 2)),
                8 => configuration.max_torque_pm = number,
                9 => configuration.torque_slope_pm_per_s = window.map(|_| number),
                10 => configuration.interpolation_period_ns = integer as u32,
                11 if random.below(2) == 0 => {
                    configuration.halt_option = random.below(7) as i8 - 1;
                }
                11 => {
                    let code = random.below(12) as i8 - 2;
                    match random.below(5) {
                        0 => configuration.shutdown_option = code,
                        1 => configuration.disable_option = code,
                        2 => configuration.fault_reaction_option = code,
                        3 => configuration.abort_connection_option = code,
                        _ => configuration.quick_stop_option = code,
                    }
                }
                12 => configuration.position_window = window,
                13 => configuration.following_fault = window,
                14 => configuration.velocity_window = window,
                15 => configuration.velocity_threshold = number,
                16 => targets.position = integer,
                17 => targets.velocity = integer,
                18 => targets.torque_pm = integer as i16,
                19 => targets.position_offset = integer,
                20 => targets.velocity_offset = integer,
                21 => actual.position = integer,
                22 => actual.velocity = number,
                23 => actual.demand_position = integer,
                24 => actual.demand_velocity = number,
                25 => actual.demand_fraction = number,
                26 => actual.demand_torque_pm = number,
                27 => actual.torque_pm = number,
                28 => axis.initialised(),
                40 => configuration.homing.method = random.below(48) as i8 - 6,
                41 => {
                    configuration.homing.switch_velocity = number;
                    configuration.homing.zero_velocity = number.abs();
                    configuration.homing.acceleration = number;
                    configuration.homing.offset = integer;
                    configuration.homing.range = integer as u32;
                    configuration.homing.timeout_ms = random.below(100) as u32;
                }
                42 | 43 => {
                    actual.limited = window.is_some();
                    actual.homing = HomingInputs {
                        negative_limit: random.below(4) == 0,
                        positive_limit: random.below(4) == 0,
                        home: random.below(2) == 0,
                        captured: Captured {
                            serial: random.below(3) as u8,
                            edge: window.map(|_| integer),
                            index: window.map(|_| integer),
                        },
                    };
                }
                29 if random.below(20) == 0 => axis.fault(),
                29 if random.below(20) == 0 => {
                    axis.fault_reaction(&configuration, &targets, &actual)
                }
                30 => {
                    let mode = match random.below(4) {
                        0 => 6,
                        _ => random.below(14) as i8 - 2,
                    };
                    let _ = axis.write_mode(mode, &configuration, &targets, &actual);
                }
                31..=33 => {
                    let words = [
                        0x80, 0x86, 0x06, 0x0F, 0x1F, 0x3F, 0x5F, 0x7F, 0x21F, 0x02, 0x0F, 0x10F,
                        0x11F, 0x15F,
                    ];
                    let word = match random.below(20) {
                        0 => random.next() as u16,
                        _ => words[random.below(words.len() as u64) as usize],
                    };
                    axis.write_controlword(word, &configuration, &targets, &actual);
                }
                34 => axis.set_point(Target::Position, &configuration, &targets, &actual),
                35 => axis.set_point(Target::Velocity, &configuration, &targets, &actual),
                36 => {
                    let target = [Target::Torque, Target::VlVelocity][random.below(2) as usize];
                    axis.set_point(target, &configuration, &targets, &actual);
                }
                38 => {
                    axis.push_set_point(integer, &configuration, &targets, &actual);
                    axis.sync(&configuration, &targets, &actual);
                }
                39 if random.below(4) == 0 => match random.below(8) {
                    0 => configuration.jerk = number,
                    1 => configuration.vl.counts_per_s = number,
                    2 => configuration.vl.acceleration = number,
                    3 => configuration.vl.deceleration = number,
                    4 => configuration.vl.quick_stop_deceleration = number,
                    5 => configuration.interpolation_buffer = integer as u8,
                    6 => targets.vl_velocity = integer as i16,
                    _ => axis.clear_buffer(integer != 0),
                },
                37 if random.below(20) == 0 => {
                    axis.connection_lost(&configuration, &targets, &actual);
                }
                _ => axis.tick(&configuration, &targets, &actual),
            }
            enabled += u32::from(axis.state() == State::OperationEnabled);
            if let Some(demand) = axis.take_demand() {
                let end = demand.at(u32::MAX);
                let start = demand.at(0);
                let sound = [start, end].iter().all(|point| {
                    (0.0..1.0).contains(&point.fraction)
                        && point.velocity.is_finite()
                        && point.torque_pm.is_finite()
                });
                assert!(sound, "step {step}: {demand:?}");
                let driven = demand != Demand::Off;
                let right = match axis.state() {
                    State::OperationEnabled | State::QuickStopActive => driven,
                    State::FaultReactionActive => true,
                    _ => !driven,
                };
                assert!(right, "step {step}: {demand:?} in {}", axis.state());
                assert_eq!(driven, axis.is_powered());
            }
            homed += u32::from(axis.take_position_shift().is_some());
            let _ = axis.take_trigger();
            let status = axis.statusword();
            assert_eq!(status.state(), Some(axis.state()));
        }
        assert!(enabled > 100_000, "{enabled}");
        assert!(homed > 5, "{homed}");
    }
}
