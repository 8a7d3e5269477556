//! Mode 1, and the following error of mode 8.

use cia402::{Mode, Window};

use crate::rig::{Rig, STANDARD};
use crate::{GO, RUN, clear, halts, has, set};

pub(crate) fn hand_over(rig: &mut Rig, target: i32) {
    rig.targets.position = target;
    rig.word(RUN);
    rig.word(GO);
}

pub(crate) fn position_reached(mode: Mode) {
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

pub(crate) fn position_limited(mode: Mode) {
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

pub(crate) fn acknowledge(mode: Mode) {
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

pub(crate) fn following(mode: Mode) {
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
