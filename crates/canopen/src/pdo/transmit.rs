//! A transmit PDO.

use crate::pdo::Mapping;
use crate::{Dialect, Image};

/// One transmit PDO: its parameters and its last sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tpdo {
    /// Whether its COB-ID is valid.
    exists: bool,
    transmission_type: u8,
    syncs: u8,
    pub(crate) data: u64,
    pub(crate) mapping: Mapping,
}

impl Tpdo {
    pub(crate) const OFF: Tpdo = Tpdo {
        exists: false,
        transmission_type: 255,
        syncs: 0,
        data: 0,
        mapping: Mapping::EMPTY,
    };

    /// A PDO that counts SYNCs from now on.
    pub(crate) fn new(exists: bool, transmission_type: u8, mapping: Mapping) -> Tpdo {
        Tpdo {
            exists,
            transmission_type,
            mapping,
            ..Tpdo::OFF
        }
    }

    /// Counts a SYNC; whether this PDO is to be sent with it.
    #[inline]
    pub(crate) fn sync(&mut self, dialect: &Dialect) -> bool {
        let every = match self.transmission_type {
            0 if dialect.tpdo_type_0_is_cyclic => 1,
            // Acyclic synchronous and event-driven PDOs need an event, which nothing gives yet.
            0 | 241..=255 => return false,
            n => n,
        };
        if !self.exists || self.mapping.bytes() == 0 {
            return false;
        }
        self.syncs = self.syncs.saturating_add(1);
        if self.syncs < every {
            return false;
        }
        self.syncs = 0;
        true
    }

    /// Starts counting SYNCs anew.
    pub(crate) fn restart(&mut self) {
        self.syncs = 0;
    }

    /// Latches the mapped values.
    #[inline]
    pub(crate) fn sample(&mut self, image: &Image<'_>) {
        let mut data = 0;
        for copy in self.mapping.copies() {
            data |= u64::from(image.raw(copy.field)) << (8 * u32::from(copy.at & 7));
        }
        self.data = data;
    }
}
