//! How a master moves it: a mode is in force once it is written (J14).

use crate::operation::{Machine, Operation, Way, WayKind};

pub(super) const OPERATION: Operation = Operation {
    prepare: &[],
    machine: Machine::None,
    ways: &[
        // Barrett's trapezoid (J15).
        Way {
            mode: 7,
            target: 0x607A,
            actual: 0x6064,
            kind: WayKind::Position {
                per_turn: 4096.0,
                handshake: false,
                window: 20.0,
                turns: 10.0,
            },
        },
        // Q16.16 rad/s (J13).
        Way {
            mode: 3,
            target: 0x60FF,
            actual: 0x606C,
            kind: WayKind::Velocity {
                per_rpm: core::f64::consts::TAU / 60.0 * 65_536.0,
                rpm: 3000.0,
            },
        },
        Way {
            mode: 1,
            target: 0x607A,
            actual: 0x6064,
            kind: WayKind::Stream {
                per_turn: 4096.0,
                window: 20.0,
                turns: 4.0,
            },
        },
    ],
};
