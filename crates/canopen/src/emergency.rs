//! Emergency producer and consumer, error register and error history (CiA 301 7.2.7, 7.5.2.2,
//! 7.5.2.4).

use crate::outbox::Slot;
use crate::{CobId, Events, Image, Instant, News, NmtState, Node, NodeId, NodeMemory};

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
    /// Shortest time from one to the next (0x1015), 100 µs.
    pub(crate) inhibit: u16,
    /// No emergency is sent before.
    free_at: Instant,
    /// When the next waiting one may be sent; [`EmergencyQueue::AT_ONCE`]: one has left.
    pub(crate) due: Instant,
}

impl EmergencyQueue {
    const LENGTH: usize = 8;
    /// One has left: the inhibit time starts with the next time that the node is given.
    const AT_ONCE: Instant = Instant::ZERO;

    pub(crate) const EMPTY: EmergencyQueue = EmergencyQueue {
        ring: [Emergency {
            code: 0,
            register: 0,
            vendor: [0; 5],
        }; EmergencyQueue::LENGTH],
        first: 0,
        waiting: 0,
        lost: 0,
        inhibit: 0,
        free_at: Instant::ZERO,
        due: Instant::NEVER,
    };

    /// Forgets what waits; the inhibit time stays, and goes on.
    pub(crate) fn clear(&mut self) {
        *self = EmergencyQueue {
            inhibit: self.inhibit,
            free_at: self.free_at,
            due: self.due,
            ..EmergencyQueue::EMPTY
        };
    }

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

impl<M: NodeMemory> Node<M> {
    /// Announces an error, or the end of one (`code` 0x0000): sends an emergency frame with the
    /// error register `register`, which becomes 0x1001, and puts a code other than 0 in front of
    /// the error history 0x1003. The frame waits for the end of the inhibit time 0x1015.
    pub fn announce(&mut self, code: u16, register: u8, vendor: [u8; 5], now: Instant) {
        let objects = &self.device.objects;
        let mut image = Image::new(self.memory.as_mut());
        if let Some(handle) = objects.error_register {
            image.set(handle, register);
        }
        if code != 0 {
            let mut newest = u32::from(code);
            let mut count = 0;
            for handle in objects.history.iter().flatten() {
                let older = image.get(*handle);
                image.set(*handle, newest);
                count += 1;
                newest = older;
                if older == 0 {
                    break;
                }
            }
            if let Some(handle) = objects.history_count {
                image.set(handle, count);
            }
        }
        if self.emcy_exists && self.state != NmtState::Initialising {
            self.emergencies.push(Emergency {
                code,
                register,
                vendor,
            });
            self.release_emergency(now);
        }
    }

    /// Lets the next emergency go, or notes when it may. The inhibit time of one that has left
    /// (CiA 301 7.5.2.18) starts here: it is given no time when it leaves.
    pub(crate) fn release_emergency(&mut self, now: Instant) {
        let waits = self.outbox.is_waiting(Slot::Emergency);
        let queue = &mut self.emergencies;
        if queue.due == EmergencyQueue::AT_ONCE {
            queue.free_at = now.plus_us(100 * u64::from(queue.inhibit));
        }
        queue.due = Instant::NEVER;
        // While one waits for the bus, the next waits for it.
        if waits || queue.is_empty() {
            return;
        }
        if now < queue.free_at {
            queue.due = queue.free_at;
            self.due = self.due.min(queue.due);
        } else {
            self.outbox.post(Slot::Emergency);
        }
    }

    /// Takes the emergency that is sent now. With an inhibit time the node asks for the time at
    /// once, from which it counts.
    pub(crate) fn take_emergency(&mut self) -> Option<Emergency> {
        let queue = &mut self.emergencies;
        let emergency = queue.pop()?;
        if queue.inhibit != 0 {
            queue.due = EmergencyQueue::AT_ONCE;
            self.due = EmergencyQueue::AT_ONCE;
        } else if !queue.is_empty() {
            self.outbox.post(Slot::Emergency);
        }
        Some(emergency)
    }

    /// Reads 0x1028: whether any node's emergencies are listened for.
    pub(crate) fn read_emcy_consumers(&mut self) {
        let Some(run) = self.device.objects.emcy_consumers else {
            return;
        };
        self.hears_emergencies = (0..run.count)
            .map(|n| CobId(self.raw(run.nth(n))))
            .any(|cob_id| cob_id.0 != 0 && !cob_id.is_off());
    }

    /// A frame that may be the emergency of a node in 0x1028; whether it is.
    pub(crate) fn receive_emergency(&mut self, key: u32, data: &[u8], events: &mut Events) -> bool {
        if !self.hears_emergencies {
            return false;
        }
        let Some(run) = self.device.objects.emcy_consumers else {
            return false;
        };
        let Ok(bytes) = <[u8; 8]>::try_from(data) else {
            return false;
        };
        for n in 0..run.count {
            let cob_id = CobId(self.raw(run.nth(n)));
            let usable = cob_id.is_usable(self.device.dialect.extended_identifiers);
            if usable && cob_id.0 != 0 && cob_id.key() == key {
                // Sub-index n is for node n (CiA 301 7.5.2.31).
                self.received = NodeId::new(n.saturating_add(1))
                    .map(|node| (node, Emergency::from_bytes(bytes)));
                events.news.insert(News::EMERGENCY);
                return true;
            }
        }
        false
    }

    /// The last emergency of a node in 0x1028.
    pub fn received_emergency(&self) -> Option<(NodeId, Emergency)> {
        self.received
    }
}
