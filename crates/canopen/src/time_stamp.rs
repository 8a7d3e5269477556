//! TIME, consumed and produced (CiA 301 7.2.6).

use crate::outbox::Slot;
use crate::{CobId, Instant, NmtState, Node, NodeMemory};

/// TIME_OF_DAY (CiA 301 7.1.6.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeOfDay {
    /// Milliseconds after midnight, 28 bits.
    pub ms: u32,
    /// Days since 1 January 1984.
    pub days: u16,
}

impl TimeOfDay {
    /// From the six bytes of a TIME; the four bits beyond the milliseconds are reserved.
    pub const fn from_bytes(data: [u8; 6]) -> TimeOfDay {
        let [m0, m1, m2, m3, d0, d1] = data;
        TimeOfDay {
            ms: u32::from_le_bytes([m0, m1, m2, m3]) & 0x0FFF_FFFF,
            days: u16::from_le_bytes([d0, d1]),
        }
    }

    /// The six bytes of a TIME.
    pub const fn to_bytes(self) -> [u8; 6] {
        let [m0, m1, m2, m3] = (self.ms & 0x0FFF_FFFF).to_le_bytes();
        let [d0, d1] = self.days.to_le_bytes();
        [m0, m1, m2, m3, d0, d1]
    }
}

/// Which frames are TIMEs, and what the last one said.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeStamp {
    /// [`can::Frame::key`] of what is consumed, or a key that no frame has.
    pub(crate) key: u32,
    produces: bool,
    last: TimeOfDay,
    /// When that came; never so far.
    last_at: Instant,
    pub(crate) sent: TimeOfDay,
}

impl TimeStamp {
    pub(crate) const OFF: TimeStamp = TimeStamp {
        key: CobId::NO_KEY,
        produces: false,
        last: TimeOfDay { ms: 0, days: 0 },
        last_at: Instant::NEVER,
        sent: TimeOfDay { ms: 0, days: 0 },
    };
}

impl<M: NodeMemory> Node<M> {
    /// Reads 0x1012: bit 31 consumes, bit 30 produces.
    pub(crate) fn read_time_parameters(&mut self) {
        let Some(handle) = self.device.objects.time_cob_id else {
            return;
        };
        let raw = self.raw(handle.field());
        let cob_id = CobId(raw & !(1 << 31));
        let usable = cob_id.is_usable(self.device.dialect.extended_identifiers);
        let consumes = raw & 1 << 31 != 0 && usable;
        self.time.key = if consumes {
            cob_id.key()
        } else {
            CobId::NO_KEY
        };
        self.time.produces = raw & 1 << 30 != 0 && usable;
        self.outbox.set_key(Slot::Time, cob_id.key());
    }

    /// A TIME was received; whether it counts: all but six bytes do not.
    pub(crate) fn receive_time(&mut self, data: &[u8], now: Instant) -> bool {
        let is_heard = matches!(self.state, NmtState::Operational | NmtState::PreOperational);
        match <[u8; 6]>::try_from(data) {
            Ok(bytes) if is_heard => {
                self.time.last = TimeOfDay::from_bytes(bytes);
                self.time.last_at = now;
                true
            }
            _ => false,
        }
    }

    /// What the last TIME said, and when it came; `None` before the first.
    pub fn time_of_day(&self) -> Option<(TimeOfDay, Instant)> {
        let time = &self.time;
        (time.last_at != Instant::NEVER).then_some((time.last, time.last_at))
    }

    /// Sends a TIME, if 0x1012 makes this node its producer and the state allows. Whether it does;
    /// then call [`Node::transmit`].
    pub fn send_time(&mut self, time: TimeOfDay) -> bool {
        let may = self.time.produces
            && matches!(self.state, NmtState::Operational | NmtState::PreOperational);
        if may {
            self.time.sent = time;
            self.outbox.post(Slot::Time);
        }
        may
    }
}
