//! What a drive does of CiA 402's state machine.

use super::{Drives, Part, has, row, yes};

/// Where there is no state machine, no setting of it counts.
pub(super) fn state_machine(drives: Drives<'_>) -> Part {
    let has_it = |drive: &personalities::Personality| {
        let axes = drive.axes.iter();
        axes.clone().any(|axis| axis.objects.statusword.is_some())
    };
    let flag = |name: &str, is: fn(&cia402::Dialect) -> bool| {
        row(
            name,
            drives,
            |drive| yes(has_it(drive) && is(&drive.cia402)),
        )
    };
    let option = |name: &str, index: u16| row(name, drives, |drive| yes(has(drive, index, 0)));
    Part {
        title: "state machine",
        rows: vec![
            row("state machine 0x6040, 0x6041", drives, |drive| {
                yes(has_it(drive))
            }),
            flag("reset and command in one write", |dialect| {
                dialect.reset_and_command_in_one_write
            }),
            flag("modes only when enabled", |dialect| {
                dialect.modes_only_when_enabled
            }),
            flag("enabling clears the mode", |dialect| {
                dialect.mode_display_cleared_on_enable
            }),
            flag("ramps on stops", |dialect| dialect.ramps_on_stop),
            flag("halt bit", |dialect| dialect.halt_bit),
            flag("remote bit", |dialect| dialect.remote_bit),
            flag("set-points without a handshake", |dialect| {
                dialect.set_points_at_once
            }),
            option("quick stop option 0x605A", 0x605A),
            option("shutdown option 0x605B", 0x605B),
            option("disable option 0x605C", 0x605C),
            option("halt option 0x605D", 0x605D),
            option("fault reaction option 0x605E", 0x605E),
            option("lost connection option 0x6007", 0x6007),
        ],
    }
}
