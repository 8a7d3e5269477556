//! A receive PDO.

use crate::pdo::Mapping;
use crate::{CobId, Dialect, RpdoSync};

/// One receive PDO: its parameters and what it received for a later SYNC.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rpdo {
    /// [`can::Frame::key`] that it listens to.
    pub(crate) key: u32,
    transmission_type: u8,
    /// SYNCs still to come before the buffer is applied; 0: the buffer is empty.
    due_in: u8,
    buffer: u64,
    pub(crate) mapping: Mapping,
}

impl Rpdo {
    pub(crate) const OFF: Rpdo = Rpdo {
        key: CobId::NO_KEY,
        transmission_type: 255,
        due_in: 0,
        buffer: 0,
        mapping: Mapping::EMPTY,
    };

    /// A PDO that has received nothing yet. `key` is the [`can::Frame::key`] it listens to, `None`
    /// if it is off.
    pub(crate) fn new(key: Option<u16>, transmission_type: u8, mapping: Mapping) -> Rpdo {
        let key = key.map_or(CobId::NO_KEY, u32::from);
        Rpdo {
            key,
            transmission_type,
            mapping,
            ..Rpdo::OFF
        }
    }

    /// Takes received data. Returns them if they are to be applied at once; otherwise they wait
    /// for their SYNC, a later reception replacing them.
    pub(crate) fn accept(&mut self, data: u64, dialect: &Dialect) -> Option<u64> {
        if self.transmission_type > 240 {
            return Some(data);
        }
        self.buffer = data;
        if self.due_in == 0 {
            self.due_in = match dialect.rpdo_sync {
                RpdoSync::Next => 1,
                // The count starts with the first reception, so that data that are sent more often
                // than they are applied still are (P50).
                RpdoSync::Nth => self.transmission_type.max(1),
            };
        }
        None
    }

    /// Counts a SYNC; returns the data that are to be applied with it.
    #[inline]
    pub(crate) fn sync(&mut self) -> Option<u64> {
        if self.due_in == 0 {
            return None;
        }
        self.due_in -= 1;
        (self.due_in == 0).then_some(self.buffer)
    }

    /// Forgets what waits for a SYNC.
    pub(crate) fn discard(&mut self) {
        self.due_in = 0;
    }
}
