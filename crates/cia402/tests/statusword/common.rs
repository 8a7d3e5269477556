//! The bits that every mode has.

use cia402::Mode;

use crate::rig::{P3, Rig, STANDARD};
use crate::{clear, has, set};

/// In every state that an axis can be brought into, with `mode`.
pub(crate) fn in_every_state(mode: Mode, mut look: impl FnMut(&mut Rig)) {
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

pub(crate) fn voltage(mode: Mode) {
    in_every_state(mode, |rig| {
        for there in [true, false, true] {
            rig.actual.voltage = there;
            rig.tick();
            assert_eq!(has(rig, 4), there);
        }
    });
}

pub(crate) fn warning(mode: Mode) {
    in_every_state(mode, |rig| {
        for there in [false, true, false] {
            rig.actual.warning = there;
            rig.tick();
            assert_eq!(has(rig, 7), there);
        }
    });
}

pub(crate) fn remote(mode: Mode) {
    in_every_state(mode, |rig| set(rig, 9));
    let mut rig = Rig::enabled(&P3, mode);
    rig.run_ms(3);
    clear(&rig, 9);
}

pub(crate) fn controllers(mode: Mode) {
    in_every_state(mode, |rig| {
        for limited in [false, true, false] {
            rig.actual.limited = limited;
            rig.tick();
            assert_eq!(has(rig, 11), limited && rig.axis.is_powered());
        }
    });
}
