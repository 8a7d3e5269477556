//! Every bit of the statusword in every mode: when it is set and when it falls. The rows are the
//! tables of `docs/statusword.md`; a run with `WRITE_STATUSWORD=1` writes them there.

mod rig;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use cia402::{Axis, HomingMethod, Mode, State, Target, Window};
use rig::{P3, Random, Rig, STANDARD};

/// A bit that does something.
struct Row {
    bit: u32,
    /// What the standard calls it.
    name: &'static str,
    set: &'static str,
    cleared: &'static str,
    /// Panics if the bit does otherwise.
    check: fn(Mode),
}

/// The bits that do the same in every mode and state.
const COMMON: [Row; 4] = [
    Row {
        bit: 4,
        name: "voltage enabled",
        set: "the motor supply is there",
        cleared: "it is not",
        check: voltage,
    },
    Row {
        bit: 7,
        name: "warning",
        set: "a warning is there",
        cleared: "there is none",
        check: warning,
    },
    Row {
        bit: 9,
        name: "remote",
        set: "always",
        cleared: "never; the P3 has no such bit, 0",
        check: remote,
    },
    Row {
        bit: 11,
        name: "internal limit",
        set: "under power, the controllers are at a limit of torque, current, voltage or speed; in \
              some modes something else, too, see there",
        cleared: "they are not",
        check: controllers,
    },
];

/// A mode, and the bits that it uses in operation enabled. All others are 0.
struct Uses {
    mode: Mode,
    rows: &'static [Row],
}

const HALTED: &str = "; halted: the axis stands";

const TABLE: [Uses; 12] = [
    Uses {
        mode: Mode::IDLE,
        rows: &[],
    },
    Uses {
        mode: Mode::PROFILE_POSITION,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the profile has ended and the position has been within 0x6067 for 0x6068; halted: the axis stands",
                cleared: "a set-point comes into process; the position leaves the window; a halt begins or ends",
                check: position_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target lies beyond 0x607D; on the way, the speed or a rate was cut to a limit",
                cleared: "the next set-point comes into process, or the way has ended",
                check: position_limited,
            },
            Row {
                bit: 12,
                name: "set-point acknowledge",
                set: "controlword bit 4 rises and the set-point is taken",
                cleared: "bit 4 is 0 and the buffer has room for one more",
                check: acknowledge,
            },
            Row {
                bit: 13,
                name: "following error",
                set: "the following error has exceeded 0x6065 for longer than 0x6066, or the fault window for its time",
                cleared: "it is back within",
                check: following,
            },
        ],
    },
    Uses {
        mode: Mode::VELOCITY,
        rows: &[
            Row {
                bit: 10,
                name: "target reached (reserved in the standard)",
                set: "the ramp has come to the target, or to zero if bits 4 or 6 say so, and the velocity is within 10 rpm of it; halted: the axis stands",
                cleared: "the target or one of the bits 4, 5, 6 changes; the velocity leaves the window; a halt begins or ends",
                check: vl_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x607F or 0x6080; on the ramp, a rate was cut to 0x60C5 or 0x60C6",
                cleared: "it does not; the ramp has ended",
                check: vl_limited,
            },
        ],
    },
    Uses {
        mode: Mode::PROFILE_VELOCITY,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the ramp has come to the target and the velocity is within 10 rpm of it; halted: the axis stands",
                cleared: "the target changes; the velocity leaves the window; a halt begins or ends",
                check: velocity_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x607F or 0x6080; on the ramp, a rate was cut to 0x60C5 or 0x60C6",
                cleared: "it does not; the ramp has ended",
                check: velocity_limited,
            },
            Row {
                bit: 12,
                name: "speed is zero",
                set: "the speed is at most 10 rpm",
                cleared: "it is greater",
                check: speed_is_zero,
            },
        ],
    },
    Uses {
        mode: Mode::PROFILE_TORQUE,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the torque demand has come to the target on its slope; halted: the axis stands",
                cleared: "the target changes; a halt begins or ends",
                check: torque_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the target exceeds 0x6072",
                cleared: "it does not",
                check: torque_limited,
            },
        ],
    },
    Uses {
        mode: Mode::HOMING,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "homing was not started or was interrupted; it has ended and the axis holds; halted: the axis stands",
                cleared: "homing starts",
                check: homing_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the speed was cut to 0x607F or 0x6080",
                cleared: "it was not",
                check: homing_limited,
            },
            Row {
                bit: 12,
                name: "homing attained",
                set: "home is found",
                cleared: "homing starts",
                check: homing_attained,
            },
            Row {
                bit: 13,
                name: "homing error",
                set: "homing has failed",
                cleared: "homing starts",
                check: homing_error,
            },
        ],
    },
    Uses {
        mode: Mode::INTERPOLATED_POSITION,
        rows: &[
            Row {
                bit: 10,
                name: "target reached",
                set: "the buffer has run empty and the position has been within 0x6067 of the last set-point for 0x6068; halted: the axis stands",
                cleared: "the next set-point comes into process; a halt begins or ends",
                check: interpolated_reached,
            },
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point in process lies beyond 0x607D, or is too far for 0x607F or 0x6080",
                cleared: "the next one does not; it is reached",
                check: interpolated_limited,
            },
            Row {
                bit: 12,
                name: "interpolation active",
                set: "controlword bit 4 is 1 and a set-point is in process",
                cleared: "bit 4 is 0; the buffer has run empty",
                check: interpolation_active,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_POSITION,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point lies beyond 0x607D, or is too far for 0x607F or 0x6080",
                cleared: "the next one does not; it is reached",
                check: cyclic_position_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: follows,
            },
            Row {
                bit: 13,
                name: "following error",
                set: "the following error has exceeded 0x6065 for longer than 0x6066, or the fault window for its time",
                cleared: "it is back within",
                check: following,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_VELOCITY,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x607F or 0x6080, or is too far for 0x60C5 or 0x60C6",
                cleared: "the next one does not; it is reached",
                check: cyclic_velocity_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: follows,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_TORQUE,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x6072",
                cleared: "the next one does not",
                check: cyclic_torque_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: follows,
            },
        ],
    },
    Uses {
        mode: Mode::CYCLIC_TORQUE_WITH_ANGLE,
        rows: &[
            Row {
                bit: 11,
                name: "internal limit",
                set: "the set-point exceeds 0x6072",
                cleared: "the next one does not",
                check: cyclic_torque_limited,
            },
            Row {
                bit: 12,
                name: "drive follows the command",
                set: "the first set-point has come",
                cleared: "the mode or the state is left",
                check: follows,
            },
        ],
    },
    Uses {
        mode: Mode::PHASE_VOLTAGE_WITH_ANGLE,
        rows: &[],
    },
];

/// Operation enabled, with and without bit 4, and halted.
const RUN: u16 = 0x0F;
const GO: u16 = 0x1F;
const HALT: u16 = 0x100;

fn has(rig: &Rig, bit: u32) -> bool {
    rig.status() & (1 << bit) != 0
}

#[track_caller]
fn set(rig: &Rig, bit: u32) {
    assert!(
        has(rig, bit),
        "bit {bit} is not set in {}",
        rig.axis.statusword()
    );
}

#[track_caller]
fn clear(rig: &Rig, bit: u32) {
    assert!(
        !has(rig, bit),
        "bit {bit} is set in {}",
        rig.axis.statusword()
    );
}

/// In every state that an axis can be brought into, with `mode`.
fn in_every_state(mode: Mode, mut look: impl FnMut(&mut Rig)) {
    let fault = |rig: &mut Rig| {
        rig.axis.fault();
        rig.tick();
    };
    let ways: [&[u16]; 5] = [
        &[],
        &[0x06],
        &[0x06, 0x07],
        &[0x06, 0x0F],
        &[0x06, 0x0F, 0x02],
    ];
    for faults in [false, true] {
        for way in ways {
            let mut rig = Rig::new(&STANDARD);
            rig.configuration.quick_stop_option = 6;
            rig.mode(mode).expect("the mode exists");
            for word in way {
                rig.word(*word);
            }
            if faults {
                fault(&mut rig);
            }
            look(&mut rig);
        }
    }
}

fn voltage(mode: Mode) {
    in_every_state(mode, |rig| {
        for there in [true, false, true] {
            rig.actual.voltage = there;
            rig.tick();
            assert_eq!(has(rig, 4), there);
        }
    });
}

fn warning(mode: Mode) {
    in_every_state(mode, |rig| {
        for there in [false, true, false] {
            rig.actual.warning = there;
            rig.tick();
            assert_eq!(has(rig, 7), there);
        }
    });
}

fn remote(mode: Mode) {
    in_every_state(mode, |rig| set(rig, 9));
    let mut rig = Rig::enabled(&P3, mode);
    rig.run_ms(3);
    clear(&rig, 9);
}

fn controllers(mode: Mode) {
    in_every_state(mode, |rig| {
        for limited in [false, true, false] {
            rig.actual.limited = limited;
            rig.tick();
            assert_eq!(has(rig, 11), limited && rig.axis.is_powered());
        }
    });
}

/// Halted, bit 10 falls, and comes back when the axis stands; without halt it falls again.
fn halts(rig: &mut Rig, word: u16) {
    rig.word(word | HALT);
    clear(rig, 10);
    rig.actual.velocity = 0.0;
    rig.run_ms(300);
    set(rig, 10);
    rig.word(word);
    clear(rig, 10);
}

fn hand_over(rig: &mut Rig, target: i32) {
    rig.targets.position = target;
    rig.word(RUN);
    rig.word(GO);
}

fn position_reached(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.position_window = Some(Window {
        size: 10,
        time_ms: 5,
    });
    rig.run_ms(3);
    clear(&rig, 10);
    hand_over(&mut rig, 100);
    rig.lag = 11;
    rig.run_ms(200);
    clear(&rig, 10);
    rig.lag = 10;
    rig.run_ms(1); // it is seen at the next tick
    rig.run_ms(5);
    clear(&rig, 10);
    rig.run_ms(1);
    set(&rig, 10);
    rig.lag = 11;
    rig.run_ms(2);
    clear(&rig, 10);
    rig.lag = 0;
    rig.run_ms(10);
    set(&rig, 10);
    hand_over(&mut rig, 5000);
    clear(&rig, 10);
    rig.run_ms(100);
    halts(&mut rig, RUN);
}

fn position_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.position_limits = Some((-1000, 1000));
    for (target, limited) in [(1001, true), (500, false), (-1001, true), (1000, false)] {
        hand_over(&mut rig, target);
        rig.run_ms(1000);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
    rig.configuration.max_velocity = Some(100.0);
    hand_over(&mut rig, 990);
    rig.run_ms(10);
    set(&rig, 11);
    rig.run_ms(1000);
    clear(&rig, 11);
    rig.configuration.max_velocity = None;
    rig.configuration.max_acceleration = Some(100.0);
    hand_over(&mut rig, 980);
    rig.run_ms(10);
    set(&rig, 11);
    rig.run_ms(2000);
    clear(&rig, 11);
}

fn acknowledge(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    clear(&rig, 12);
    hand_over(&mut rig, 1000);
    set(&rig, 12);
    rig.word(RUN);
    clear(&rig, 12);
    hand_over(&mut rig, 2000); // into the buffer
    rig.word(RUN);
    set(&rig, 12);
    rig.run_ms(1000);
    clear(&rig, 12);
}

fn following(mode: Mode) {
    for fault in [false, true] {
        let mut rig = Rig::enabled(&STANDARD, mode);
        let window = Some(Window {
            size: 50,
            time_ms: 3,
        });
        if fault {
            rig.configuration.following_fault = window;
        } else {
            rig.configuration.following_warning = window;
        }
        rig.run_ms(2);
        clear(&rig, 13);
        rig.lag = 51;
        rig.run_ms(4);
        clear(&rig, 13);
        rig.run_ms(3);
        set(&rig, 13);
        rig.lag = 50;
        rig.run_ms(2);
        clear(&rig, 13);
    }
}

/// A window of 683 counts/s around the target, as the P3 has it.
fn windowed(mode: Mode) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.velocity_window = Some(Window {
        size: 683,
        time_ms: 0,
    });
    rig.configuration.velocity_threshold = 683.0;
    rig.configuration.vl = cia402::VlConfiguration {
        counts_per_s: 1.0,
        acceleration: 100_000.0,
        deceleration: 100_000.0,
        quick_stop_deceleration: 100_000.0,
    };
    rig
}

/// Both modes through their targets; `word` lets them move.
fn velocity_bit_10(mut rig: Rig, word: u16, target: fn(&mut Rig, i16)) {
    rig.word(word);
    rig.run_ms(1);
    set(&rig, 10);
    target(&mut rig, 10_000);
    clear(&rig, 10);
    rig.run_ms(99);
    clear(&rig, 10);
    rig.run_ms(2);
    set(&rig, 10);
    rig.stuck = true;
    rig.actual.velocity = 9_316.0;
    rig.run_ms(1);
    clear(&rig, 10);
    rig.actual.velocity = 9_317.0;
    rig.run_ms(1);
    set(&rig, 10);
    rig.stuck = false;
    rig.run_ms(2);
    halts(&mut rig, word);
    rig.run_ms(110);
    set(&rig, 10);
    target(&mut rig, -10_000);
    clear(&rig, 10);
}

fn vl_reached(mode: Mode) {
    velocity_bit_10(windowed(mode), 0x7F, vl_target);
    // Bits 4, 5 and 6.
    for word in [0x6F, 0x5F, 0x3F] {
        let mut rig = windowed(mode);
        rig.word(0x7F);
        vl_target(&mut rig, 10_000);
        rig.run_ms(110);
        set(&rig, 10);
        rig.word(word);
        clear(&rig, 10);
        rig.run_ms(110);
        set(&rig, 10);
    }
}

fn vl_target(rig: &mut Rig, counts_per_s: i16) {
    rig.targets.vl_velocity = counts_per_s;
    rig.receive(Target::VlVelocity);
}

fn velocity_target(rig: &mut Rig, counts_per_s: i16) {
    rig.targets.velocity = counts_per_s.into();
    rig.receive(Target::Velocity);
}

fn velocity_reached(mode: Mode) {
    let mut rig = windowed(mode);
    rig.configuration.deceleration = 100_000.0;
    velocity_bit_10(rig, RUN, velocity_target);
}

fn velocity_bit_11(mut rig: Rig, word: u16, target: fn(&mut Rig, i16)) {
    rig.word(word);
    rig.configuration.max_velocity = Some(5000.0);
    for (wanted, limited) in [(5001, true), (5000, false), (-6000, true), (0, false)] {
        target(&mut rig, wanted);
        rig.run_ms(200);
        assert_eq!(has(&rig, 11), limited, "{wanted}");
    }
    rig.configuration.max_velocity = None;
    rig.configuration.max_acceleration = Some(10_000.0);
    target(&mut rig, 1000);
    rig.run_ms(50);
    set(&rig, 11);
    rig.run_ms(60);
    clear(&rig, 11);
    rig.configuration.max_deceleration = Some(10_000.0);
    target(&mut rig, 0);
    rig.run_ms(50);
    set(&rig, 11);
    rig.run_ms(60);
    clear(&rig, 11);
}

fn vl_limited(mode: Mode) {
    velocity_bit_11(windowed(mode), 0x7F, vl_target);
}

fn velocity_limited(mode: Mode) {
    velocity_bit_11(windowed(mode), RUN, velocity_target);
}

fn speed_is_zero(mode: Mode) {
    let mut rig = windowed(mode);
    rig.stuck = true;
    for (speed, zero) in [(0.0, true), (684.0, false), (683.0, true), (-684.0, false)] {
        rig.actual.velocity = speed;
        rig.run_ms(1);
        assert_eq!(has(&rig, 12), zero, "{speed}");
    }
    // Also in a halt.
    rig.word(RUN | HALT);
    rig.run_ms(1);
    clear(&rig, 12);
    rig.actual.velocity = 0.0;
    rig.run_ms(1);
    set(&rig, 12);
}

fn torque_target(rig: &mut Rig, torque_pm: i16) {
    rig.targets.torque_pm = torque_pm;
    rig.receive(Target::Torque);
}

fn torque_reached(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.torque_slope_pm_per_s = Some(1000.0);
    rig.configuration.velocity_threshold = 683.0;
    rig.run_ms(2);
    set(&rig, 10);
    torque_target(&mut rig, 100);
    clear(&rig, 10);
    rig.run_ms(99);
    clear(&rig, 10);
    rig.run_ms(2);
    set(&rig, 10);
    rig.actual.velocity = 5000.0;
    rig.word(RUN | HALT);
    rig.run_ms(300);
    clear(&rig, 10); // it coasts
    rig.word(RUN);
    rig.run_ms(200);
    halts(&mut rig, RUN);
}

fn torque_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.max_torque_pm = 500.0;
    for (target, limited) in [(501, true), (500, false), (-501, true), (0, false)] {
        torque_target(&mut rig, target);
        rig.run_ms(3);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
}

/// On the way to an index pulse.
fn homing(mode: Mode) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.homing.method = 34;
    rig.configuration.homing.zero_velocity = 1000.0;
    rig.configuration.homing.acceleration = 100_000.0;
    rig.configuration.homing.counts_per_turn = 4096;
    rig.configuration.velocity_threshold = 10.0;
    rig.run_ms(2);
    rig
}

/// The index pulse comes.
fn index(rig: &mut Rig) {
    let trigger = rig.axis.take_trigger().expect("a trigger");
    assert!(trigger.index);
    rig.actual.homing.captured = cia402::Captured {
        serial: trigger.serial,
        edge: None,
        index: Some(rig.actual.position),
    };
    rig.run_ms(50);
}

fn homing_reached(mode: Mode) {
    let mut rig = homing(mode);
    set(&rig, 10);
    rig.word(GO);
    clear(&rig, 10);
    rig.run_ms(50);
    clear(&rig, 10);
    rig.word(RUN); // interrupted
    set(&rig, 10);
    rig.word(GO);
    rig.run_ms(50);
    halts(&mut rig, GO);
    rig.run_ms(50);
    index(&mut rig);
    set(&rig, 10);
    // A failure stops, too.
    rig.word(RUN);
    rig.word(GO);
    rig.run_ms(50);
    rig.actual.homing.positive_limit = true;
    rig.run_ms(1);
    clear(&rig, 10); // it still moves
    rig.run_ms(50);
    set(&rig, 10);
}

fn homing_limited(mode: Mode) {
    let mut rig = homing(mode);
    rig.configuration.max_velocity = Some(500.0);
    clear(&rig, 11);
    rig.word(GO);
    rig.run_ms(50);
    set(&rig, 11);
    index(&mut rig);
    clear(&rig, 11);
}

fn homing_attained(mode: Mode) {
    let mut rig = homing(mode);
    clear(&rig, 12);
    rig.word(GO);
    rig.run_ms(50);
    clear(&rig, 12);
    index(&mut rig);
    set(&rig, 12);
    rig.word(RUN);
    set(&rig, 12);
    rig.word(GO);
    clear(&rig, 12);
}

fn homing_error(mode: Mode) {
    let mut rig = homing(mode);
    assert!(HomingMethod::new(0).is_none());
    rig.configuration.homing.method = 0;
    clear(&rig, 13);
    rig.word(GO);
    set(&rig, 13);
    rig.run_ms(50);
    set(&rig, 13);
    rig.word(RUN);
    set(&rig, 13);
    rig.configuration.homing.method = 34;
    rig.word(GO);
    clear(&rig, 13);
}

fn push(rig: &mut Rig, position: i32) {
    let taken = rig
        .axis
        .push_set_point(position, &rig.configuration, &rig.targets, &rig.actual);
    assert!(taken);
}

/// Set-points each 2 ms, 20 counts apart, `buffered` of them.
fn interpolating(mode: Mode, buffered: i32) -> Rig {
    assert!(buffered <= Axis::BUFFER_SIZE.into());
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.interpolation_period_ns = 2_000_000;
    rig.word(RUN);
    for n in 1..=buffered {
        push(&mut rig, n * 20);
    }
    rig
}

fn interpolated_reached(mode: Mode) {
    let mut rig = interpolating(mode, 4);
    rig.configuration.position_window = Some(Window {
        size: 10,
        time_ms: 0,
    });
    clear(&rig, 10);
    rig.word(GO);
    rig.lag = 11;
    rig.run_ms(20);
    clear(&rig, 10);
    rig.lag = 10;
    rig.run_ms(2);
    set(&rig, 10);
    push(&mut rig, 100);
    rig.run_ms(1);
    clear(&rig, 10);
    let mut rig = interpolating(mode, 16);
    rig.word(GO);
    rig.run_ms(10);
    halts(&mut rig, GO);
}

fn interpolated_limited(mode: Mode) {
    let mut rig = interpolating(mode, 0);
    rig.configuration.position_limits = Some((-100, 100));
    rig.word(GO);
    for (position, limited) in [(90, false), (101, true), (100, false), (-101, true)] {
        push(&mut rig, position);
        rig.run_ms(6);
        assert_eq!(has(&rig, 11), limited, "{position}");
    }
    rig.configuration.max_velocity = Some(1000.0);
    push(&mut rig, -90);
    rig.run_ms(5);
    set(&rig, 11);
    rig.run_ms(10);
    clear(&rig, 11);
}

fn interpolation_active(mode: Mode) {
    let mut rig = interpolating(mode, 6);
    rig.run_ms(3);
    clear(&rig, 12);
    rig.word(GO);
    rig.run_ms(1);
    set(&rig, 12);
    rig.word(RUN);
    clear(&rig, 12);
    rig.word(GO);
    rig.run_ms(9);
    set(&rig, 12);
    rig.run_ms(6);
    clear(&rig, 12);
}

/// A set-point for a cyclic mode.
fn cyclic(rig: &mut Rig, value: i16) {
    rig.targets.position = value.into();
    rig.targets.velocity = value.into();
    rig.targets.torque_pm = value;
    for target in [Target::Position, Target::Velocity, Target::Torque] {
        rig.receive(target);
    }
    rig.run_ms(1);
}

fn follows(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.run_ms(3);
    clear(&rig, 12);
    cyclic(&mut rig, 10);
    set(&rig, 12);
    rig.run_ms(20);
    set(&rig, 12);
    rig.mode(Mode::IDLE).expect("mode 0");
    clear(&rig, 12);
    rig.mode(mode).expect("the mode");
    rig.run_ms(3);
    clear(&rig, 12);
    cyclic(&mut rig, 10);
    rig.word(0x00);
    clear(&rig, 12);
}

fn cyclic_position_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.position_limits = Some((-100, 100));
    for (target, limited) in [
        (100, false),
        (101, true),
        (0, false),
        (-101, true),
        (-90, false),
    ] {
        cyclic(&mut rig, target);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
    rig.configuration.max_velocity = Some(1000.0);
    cyclic(&mut rig, -80);
    rig.run_ms(5);
    set(&rig, 11);
    rig.run_ms(10);
    clear(&rig, 11);
}

fn cyclic_velocity_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.max_velocity = Some(100.0);
    for (target, limited) in [
        (100, false),
        (101, true),
        (0, false),
        (-101, true),
        (-90, false),
    ] {
        cyclic(&mut rig, target);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
    rig.configuration.max_acceleration = Some(1000.0);
    cyclic(&mut rig, -100);
    rig.run_ms(5);
    set(&rig, 11);
    rig.run_ms(10);
    clear(&rig, 11);
}

fn cyclic_torque_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.max_torque_pm = 100.0;
    for (target, limited) in [
        (100, false),
        (101, true),
        (0, false),
        (-101, true),
        (-90, false),
    ] {
        cyclic(&mut rig, target);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
}

/// Whatever is done in operation enabled, only these bits are ever 1.
fn never_others(mode: Mode, used: u16) {
    let mut random = Random(1 + u64::from(mode.0.unsigned_abs()));
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.following_warning = Some(Window {
        size: 5,
        time_ms: 1,
    });
    rig.configuration.velocity_fault = Some(Window {
        size: 5,
        time_ms: 1,
    });
    rig.configuration.velocity_threshold = 100.0;
    let allowed = used | State::OperationEnabled.mask();
    let mut seen = 0;
    for _ in 0..3000 {
        match random.below(8) {
            0 => {
                rig.word(RUN | (random.next() as u16 & 0x0370));
            }
            1 => cyclic(&mut rig, random.next() as i16),
            2 => vl_target(&mut rig, random.next() as i16),
            3 => {
                let position = random.next() as i16;
                rig.axis.push_set_point(
                    position.into(),
                    &rig.configuration,
                    &rig.targets,
                    &rig.actual,
                );
            }
            4 => rig.lag = random.below(20) as i32,
            5 => {
                rig.actual.warning = random.below(2) == 0;
                rig.actual.limited = random.below(2) == 0;
            }
            _ => rig.run_ms(random.below(30) as u32),
        }
        assert_eq!(rig.axis.state(), State::OperationEnabled);
        let others = rig.status() & !allowed;
        assert_eq!(others, 0, "{}", rig.axis.statusword());
        seen |= rig.status();
    }
    // Halted, every mode that halts says that it stands.
    assert_eq!(seen & 0x0400 != 0, used & 0x0400 != 0);
}

#[test]
fn every_bit_of_every_mode_does_what_its_row_says() {
    let mut broken = Vec::new();
    for uses in &TABLE {
        let mode = uses.mode;
        assert!(STANDARD.modes().contains(mode));
        for row in COMMON.iter().chain(uses.rows) {
            let check = AssertUnwindSafe(|| (row.check)(mode));
            if catch_unwind(check).is_err() {
                broken.push(format!("{mode}, bit {}", row.bit));
            }
        }
        let used = COMMON.iter().chain(uses.rows);
        let used = used.fold(0, |word, row| word | 1 << row.bit);
        if catch_unwind(AssertUnwindSafe(|| never_others(mode, used))).is_err() {
            broken.push(format!("{mode}, the bits it has not"));
        }
        // What halts says so, and what does not halt has no bit 10.
        let halts = uses.rows.iter().any(|row| row.set.contains(HALTED));
        assert_eq!(halts, used & 0x0400 != 0, "{mode}");
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_table_is_complete() {
    let listed: Vec<i8> = TABLE.iter().map(|uses| uses.mode.0).collect();
    let all: Vec<i8> = (i8::MIN..=i8::MAX)
        .filter(|&mode| STANDARD.modes().contains(Mode(mode)))
        .collect();
    assert_eq!(listed, all);
}

#[test]
fn a_quick_stop_shows_when_it_stands() {
    // The only bit beside the common ones in another state than operation enabled.
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.quick_stop_option = 6;
    velocity_target(&mut rig, 10_000);
    rig.run_ms(200);
    rig.word(0x02);
    assert_eq!(rig.status() & 0x3C4F, 0x0007);
    rig.run_ms(100);
    assert_eq!(rig.status() & 0x3C4F, 0x0407);
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from("| bit | name | set when | cleared when |\n|---|---|---|---|\n");
    for row in rows {
        let Row {
            bit,
            name,
            set,
            cleared,
            ..
        } = row;
        text += &format!("| {bit} | {name} | {set} | {cleared} |\n");
    }
    text
}

#[test]
fn the_documentation_has_the_same_rows() {
    let mut tables = String::from("\n### In every mode and state\n\n");
    tables += &table(&COMMON);
    for uses in &TABLE {
        let name = uses.mode.name().expect("a name");
        tables += &format!("\n### Mode {}, {name}\n\n", uses.mode.0);
        if uses.rows.is_empty() {
            tables += "None.\n";
        } else {
            tables += &table(uses.rows);
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/statusword.md");
    let text = std::fs::read_to_string(&path).expect("docs/statusword.md can be read");
    let (begin, end) = ("<!-- bits -->\n", "\n<!-- end -->\n");
    let from = text.find(begin).expect("the tables have a beginning") + begin.len();
    let to = text.find(end).expect("the tables have an end");
    if text[from..to] == *tables {
        return;
    }
    assert!(
        std::env::var_os("WRITE_STATUSWORD").is_some(),
        "docs/statusword.md has other tables; \
         write them anew with WRITE_STATUSWORD=1 cargo test -p servobus-cia402 --test statusword"
    );
    let new = format!("{}{tables}{}", &text[..from], &text[to..]);
    std::fs::write(&path, new).expect("docs/statusword.md can be written");
}
