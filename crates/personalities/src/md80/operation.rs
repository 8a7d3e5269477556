//! How a master moves it.

use canopen::Address;

use crate::Setting;
use crate::operation::{Machine, Operation, Way, WayKind, setting};

pub(super) const OPERATION: Operation = Operation {
    prepare: &[
        // No watchdog of the bus: a target is written once.
        Setting {
            object: Address::new(0x2000, 12),
            bytes: &[0, 0],
        },
        // RPM/s; 0 after every start (M24).
        setting(0x6083, &600_u32.to_le_bytes()),
        setting(0x6084, &600_u32.to_le_bytes()),
        setting(0x6067, &100_u32.to_le_bytes()),
    ],
    machine: Machine::Standard,
    ways: &[
        // A target counts as soon as it is written (M25). Turns of the output.
        Way {
            mode: 1,
            target: 0x607A,
            actual: 0x6064,
            kind: WayKind::Position {
                per_turn: 16_384.0,
                handshake: false,
                window: 100.0,
                turns: 2.0,
            },
        },
        Way {
            mode: 3,
            target: 0x60FF,
            actual: 0x606C,
            kind: WayKind::Velocity {
                per_rpm: 1.0,
                rpm: 120.0,
            },
        },
        Way {
            mode: 8,
            target: 0x607A,
            actual: 0x6064,
            kind: WayKind::Stream {
                per_turn: 16_384.0,
                window: 100.0,
                turns: 0.5,
            },
        },
    ],
};
