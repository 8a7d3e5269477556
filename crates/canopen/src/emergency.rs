//! Emergency producer, error register and error history (CiA 301 7.2.7, 7.5.2.2, 7.5.2.4).

/// Contents of an emergency frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Error code; 0x0000 is "error reset or no error".
    pub code: u16,
    /// The error register 0x1001 at that time.
    pub register: u8,
    /// The manufacturer's bytes.
    pub vendor: [u8; 5],
}

impl Emergency {
    /// From the eight bytes of an emergency frame.
    pub const fn from_bytes(data: [u8; 8]) -> Emergency {
        let [c0, c1, register, v0, v1, v2, v3, v4] = data;
        Emergency {
            code: u16::from_le_bytes([c0, c1]),
            register,
            vendor: [v0, v1, v2, v3, v4],
        }
    }

    /// The eight bytes of the frame.
    pub const fn to_bytes(self) -> [u8; 8] {
        let [c0, c1] = self.code.to_le_bytes();
        let [v0, v1, v2, v3, v4] = self.vendor;
        [c0, c1, self.register, v0, v1, v2, v3, v4]
    }
}

/// Emergencies that wait to be sent: a small ring, because each one tells something of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmergencyQueue {
    ring: [Emergency; EmergencyQueue::LENGTH],
    first: u8,
    waiting: u8,
    lost: u32,
}

impl EmergencyQueue {
    const LENGTH: usize = 8;

    pub(crate) const EMPTY: EmergencyQueue = EmergencyQueue {
        ring: [Emergency {
            code: 0,
            register: 0,
            vendor: [0; 5],
        }; EmergencyQueue::LENGTH],
        first: 0,
        waiting: 0,
        lost: 0,
    };

    /// Appends; if the ring is full the newest is not sent, and counted.
    pub(crate) fn push(&mut self, emergency: Emergency) {
        if usize::from(self.waiting) == Self::LENGTH {
            self.lost = self.lost.wrapping_add(1);
            return;
        }
        let at = (usize::from(self.first) + usize::from(self.waiting)) % Self::LENGTH;
        if let Some(place) = self.ring.get_mut(at) {
            *place = emergency;
            self.waiting += 1;
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Emergency> {
        if self.waiting == 0 {
            return None;
        }
        let emergency = self.ring.get(usize::from(self.first)).copied();
        self.first = (self.first + 1) % Self::LENGTH as u8;
        self.waiting -= 1;
        emergency
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    pub(crate) fn lost(&self) -> u32 {
        self.lost
    }
}
