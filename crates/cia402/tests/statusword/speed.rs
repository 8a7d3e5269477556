//! Modes 2 and 3.

use cia402::{Mode, Target, Window};

use crate::rig::{Rig, STANDARD};
use crate::{HALT, RUN, clear, halts, has, set};

/// A window of 683 counts/s around the target, as the P3 has it.
pub(crate) fn windowed(mode: Mode) -> Rig {
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
pub(crate) fn velocity_bit_10(mut rig: Rig, word: u16, target: fn(&mut Rig, i16)) {
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

pub(crate) fn vl_reached(mode: Mode) {
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

pub(crate) fn vl_target(rig: &mut Rig, counts_per_s: i16) {
    rig.targets.vl_velocity = counts_per_s;
    rig.receive(Target::VlVelocity);
}

pub(crate) fn velocity_target(rig: &mut Rig, counts_per_s: i16) {
    rig.targets.velocity = counts_per_s.into();
    rig.receive(Target::Velocity);
}

pub(crate) fn velocity_reached(mode: Mode) {
    let mut rig = windowed(mode);
    rig.configuration.deceleration = 100_000.0;
    velocity_bit_10(rig, RUN, velocity_target);
}

pub(crate) fn velocity_bit_11(mut rig: Rig, word: u16, target: fn(&mut Rig, i16)) {
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

pub(crate) fn vl_limited(mode: Mode) {
    velocity_bit_11(windowed(mode), 0x7F, vl_target);
}

pub(crate) fn velocity_limited(mode: Mode) {
    velocity_bit_11(windowed(mode), RUN, velocity_target);
}

pub(crate) fn speed_is_zero(mode: Mode) {
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
