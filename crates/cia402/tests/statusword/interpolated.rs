//! Mode 7.

use cia402::{Axis, Mode, Window};

use crate::rig::{Rig, STANDARD};
use crate::{GO, RUN, clear, halts, has, set};

pub(crate) fn push(rig: &mut Rig, position: i32) {
    let taken = rig
        .axis
        .push_set_point(position, &rig.configuration, &rig.targets, &rig.actual);
    assert!(taken);
}

/// Set-points each 2 ms, 20 counts apart, `buffered` of them.
pub(crate) fn interpolating(mode: Mode, buffered: i32) -> Rig {
    assert!(buffered <= Axis::BUFFER_SIZE.into());
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.interpolation_period_ns = 2_000_000;
    rig.word(RUN);
    for n in 1..=buffered {
        push(&mut rig, n * 20);
    }
    rig
}

pub(crate) fn interpolated_reached(mode: Mode) {
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

pub(crate) fn interpolated_limited(mode: Mode) {
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

pub(crate) fn interpolation_active(mode: Mode) {
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
