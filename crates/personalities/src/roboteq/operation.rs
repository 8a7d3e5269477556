//! How a master moves it: with the state machine switched on.

use crate::operation::{Machine, Operation, Way, WayKind, setting};

pub(super) const OPERATION: Operation = Operation {
    prepare: &[
        // ^FSA.
        setting(0x30F1, &[1]),
        // ^RWD: no watchdog of commands, since a target is written once.
        setting(0x3008, &[0, 0]),
    ],
    machine: Machine::Standard,
    ways: &[
        // 0.1 A.
        Way {
            mode: 4,
            target: 0x6071,
            actual: 0x6077,
            kind: WayKind::Torque {
                value: 10.0,
                window: 1.0,
            },
        },
        Way {
            mode: 1,
            target: 0x607A,
            actual: 0x6064,
            kind: WayKind::Position {
                per_turn: 4096.0,
                handshake: true,
                window: 20.0,
                turns: 10.0,
            },
        },
        Way {
            mode: 3,
            target: 0x60FF,
            actual: 0x606C,
            kind: WayKind::Velocity {
                per_rpm: 1.0,
                rpm: 1000.0,
            },
        },
    ],
};
