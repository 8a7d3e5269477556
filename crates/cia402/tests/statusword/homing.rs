//! Mode 6.

use cia402::{HomingMethod, Mode};

use crate::rig::{Rig, STANDARD};
use crate::{GO, RUN, clear, halts, set};

/// On the way to an index pulse.
pub(crate) fn homing(mode: Mode) -> Rig {
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
pub(crate) fn index(rig: &mut Rig) {
    let trigger = rig.axis.take_trigger().expect("a trigger");
    assert!(trigger.index);
    rig.actual.homing.captured = cia402::Captured {
        serial: trigger.serial,
        edge: None,
        index: Some(rig.actual.position),
    };
    rig.run_ms(50);
}

pub(crate) fn homing_reached(mode: Mode) {
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

pub(crate) fn homing_limited(mode: Mode) {
    let mut rig = homing(mode);
    rig.configuration.max_velocity = Some(500.0);
    clear(&rig, 11);
    rig.word(GO);
    rig.run_ms(50);
    set(&rig, 11);
    index(&mut rig);
    clear(&rig, 11);
}

pub(crate) fn homing_attained(mode: Mode) {
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

pub(crate) fn homing_error(mode: Mode) {
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
