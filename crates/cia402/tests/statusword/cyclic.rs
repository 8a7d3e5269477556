//! Modes 8 to 11.

use cia402::{Mode, Target};

use crate::rig::{Rig, STANDARD};
use crate::{clear, has, set};

/// A set-point for a cyclic mode.
pub(crate) fn cyclic(rig: &mut Rig, value: i16) {
    rig.targets.position = value.into();
    rig.targets.velocity = value.into();
    rig.targets.torque_pm = value;
    for target in [Target::Position, Target::Velocity, Target::Torque] {
        rig.receive(target);
    }
    rig.run_ms(1);
}

pub(crate) fn follows(mode: Mode) {
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

pub(crate) fn cyclic_position_limited(mode: Mode) {
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

pub(crate) fn cyclic_velocity_limited(mode: Mode) {
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

pub(crate) fn cyclic_torque_limited(mode: Mode) {
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
