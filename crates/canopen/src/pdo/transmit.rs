//! A transmit PDO.

use crate::Dialect;
use crate::pdo::Mapping;

/// One transmit PDO: its parameters and its last sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tpdo {
    /// Sent with every nth SYNC; 0: with none.
    every: u8,
    /// SYNCs still to come until then.
    left: u8,
    pub(crate) data: u64,
    pub(crate) mapping: Mapping,
}

impl Tpdo {
    pub(crate) const OFF: Tpdo = Tpdo {
        every: 0,
        left: 0,
        data: 0,
        mapping: Mapping::EMPTY,
    };

    /// A PDO that counts SYNCs from now on. `exists`: its COB-ID is valid.
    pub(crate) fn new(
        exists: bool,
        transmission_type: u8,
        mapping: Mapping,
        dialect: &Dialect,
    ) -> Tpdo {
        let every = match transmission_type {
            _ if !exists || mapping.bytes() == 0 => 0,
            0 if dialect.tpdo_type_0_is_cyclic => 1,
            // Acyclic synchronous (0) and event-driven PDOs need an event, which nothing gives yet.
            241..=255 => 0,
            n => n,
        };
        Tpdo {
            every,
            left: every,
            mapping,
            ..Tpdo::OFF
        }
    }

    /// Counts a SYNC; whether this PDO is to be sent with it.
    #[inline]
    pub(crate) fn sync(&mut self) -> bool {
        if self.left > 1 {
            self.left -= 1;
            return false;
        }
        self.left = self.every;
        self.every != 0
    }

    /// Starts counting SYNCs anew.
    pub(crate) fn restart(&mut self) {
        self.left = self.every;
    }

    /// Latches the mapped values of an image.
    #[inline]
    pub(crate) fn sample(&mut self, bytes: &[u8]) {
        self.data = self.mapping.sample(bytes);
    }
}
