//! The watchdog of commands (^RWD). The document does not have it; the maker's user manual does: who
//! commands the controller, by serial line or by CAN, must go on commanding it.

use canopen::{Field, Image, Table};

use super::fields::field;

/// How long no command has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watchdog {
    limit: Option<Field>,
    silent_ms: u32,
    /// The motors rest: none has come in time, or none at all yet.
    is_out: bool,
}

impl Watchdog {
    pub(super) fn of(table: &Table) -> Watchdog {
        Watchdog {
            limit: field(table, 0x3008, 0),
            silent_ms: 0,
            is_out: true,
        }
    }

    /// A command has come: what ran before runs again.
    pub(super) fn feed(&mut self) {
        self.silent_ms = 0;
        self.is_out = false;
    }

    /// A millisecond has passed.
    pub(super) fn tick(&mut self, image: &Image<'_>) {
        self.silent_ms = self.silent_ms.saturating_add(1);
        let limit_ms = self.limit.map_or(0, |limit| image.raw(limit));
        self.is_out |= limit_ms != 0 && self.silent_ms >= limit_ms;
    }

    /// Whether the motors must rest. Only a command ends that.
    pub(super) fn is_out(&self) -> bool {
        self.is_out
    }
}
