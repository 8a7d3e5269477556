//! Mode 4.

use cia402::{Mode, Target};

use crate::rig::{Rig, STANDARD};
use crate::{HALT, RUN, clear, halts, has, set};

pub(crate) fn torque_target(rig: &mut Rig, torque_pm: i16) {
    rig.targets.torque_pm = torque_pm;
    rig.receive(Target::Torque);
}

pub(crate) fn torque_reached(mode: Mode) {
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

pub(crate) fn torque_limited(mode: Mode) {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.max_torque_pm = 500.0;
    for (target, limited) in [(501, true), (500, false), (-501, true), (0, false)] {
        torque_target(&mut rig, target);
        rig.run_ms(3);
        assert_eq!(has(&rig, 11), limited, "{target}");
    }
}
