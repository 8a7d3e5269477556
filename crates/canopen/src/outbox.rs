//! What waits to be sent: one slot per producer, not a queue of frames.

/// Producers that may have a frame waiting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    BootUp,
    Emergency,
    /// Heartbeat, or the answer to node guarding.
    ErrorControl,
    Sync,
    Time,
    Sdo(u8),
    Tpdo(u8),
}

const EMERGENCY: usize = 1;
const ERROR_CONTROL: usize = 2;
const SYNC: usize = 3;
const TIME: usize = 4;
const SDO: usize = 5;
const TPDO: usize = SDO + crate::SDO_SERVERS;
const SLOTS: usize = TPDO + crate::PDOS;
const _: () = assert!(SLOTS <= 16, "one bit each");

impl Slot {
    #[inline]
    const fn number(self) -> usize {
        match self {
            Slot::BootUp => 0,
            Slot::Emergency => EMERGENCY,
            Slot::ErrorControl => ERROR_CONTROL,
            Slot::Sync => SYNC,
            Slot::Time => TIME,
            Slot::Sdo(n) => SDO + n as usize,
            Slot::Tpdo(n) => TPDO + n as usize,
        }
    }

    const fn from_number(number: usize) -> Slot {
        match number {
            0 => Slot::BootUp,
            EMERGENCY => Slot::Emergency,
            ERROR_CONTROL => Slot::ErrorControl,
            SYNC => Slot::Sync,
            TIME => Slot::Time,
            SDO..TPDO => Slot::Sdo(number.wrapping_sub(SDO) as u8),
            n => Slot::Tpdo(n.wrapping_sub(TPDO) as u8),
        }
    }
}

/// A producer's place in the order of sending.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// [`can::Frame::key`] of the frames.
    key: u32,
    slot: Slot,
}

/// The order in which keys win arbitration (ISO 11898-1): by the first eleven bits, an identifier
/// that has only these before one of 29, then by the rest.
const fn order(key: u32) -> u32 {
    let id = key & 0x1FFF_FFFF;
    if key >> 31 != 0 {
        (id >> 18) << 19 | 1 << 18 | id & 0x3_FFFF
    } else {
        id << 19
    }
}

/// The set of waiting producers, in the order in which they will send.
///
/// Identifiers change rarely, frames are sent often: so the producers are kept sorted by identifier
/// and the next to send is the lowest bit that is set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outbox {
    /// Bit n: the producer at place n has a frame waiting.
    waiting: u16,
    /// The bits of those that may send in the present state; all others wait.
    allowed: u16,
    /// The bit of each producer, by its number.
    bits: [u16; SLOTS],
    /// The producers by identifier; of equal ones by number, so that boot-up goes before heartbeat.
    places: [Place; SLOTS],
    /// Frames that were replaced before they were sent.
    overwritten: u32,
}

impl Outbox {
    pub(crate) const EMPTY: Outbox = Outbox::new();

    #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
    const fn new() -> Outbox {
        let first = Place {
            key: 0,
            slot: Slot::BootUp,
        };
        let (mut bits, mut places) = ([0; SLOTS], [first; SLOTS]);
        let mut n = 0;
        while n < SLOTS {
            bits[n] = 1 << n;
            places[n].slot = Slot::from_number(n);
            n += 1;
        }
        Outbox {
            waiting: 0,
            allowed: u16::MAX,
            bits,
            places,
            overwritten: 0,
        }
    }

    /// The identifier that a producer will send with, as [`can::Frame::key`].
    pub(crate) fn set_key(&mut self, slot: Slot, key: u32) {
        let (waiting, old_bits) = (self.waiting, self.bits);
        let holds = self.holds_emergencies();
        for place in &mut self.places {
            if place.slot == slot {
                place.key = key;
            }
        }
        self.places
            .sort_unstable_by_key(|place| (order(place.key), place.slot.number()));
        self.waiting = 0;
        for (n, place) in self.places.iter().enumerate() {
            let number = place.slot.number();
            let bit = 1u16 << (n & 15);
            if old_bits.get(number).is_some_and(|old| waiting & old != 0) {
                self.waiting |= bit;
            }
            if let Some(new) = self.bits.get_mut(number) {
                *new = bit;
            }
        }
        self.hold_emergencies(holds);
    }

    /// Whether emergencies wait, rather than being sent.
    pub(crate) fn hold_emergencies(&mut self, hold: bool) {
        self.allowed = u16::MAX;
        if hold {
            self.allowed &= !self.bit(Slot::Emergency);
        }
    }

    fn holds_emergencies(&self) -> bool {
        self.allowed != u16::MAX
    }

    #[inline]
    fn bit(&self, slot: Slot) -> u16 {
        self.bits.get(slot.number()).copied().unwrap_or(0)
    }

    /// The producer has something to send; if its last frame is still waiting, that is replaced.
    #[inline]
    pub(crate) fn post(&mut self, slot: Slot) {
        let bit = self.bit(slot);
        // Emergencies have a ring of their own: none replaces another.
        if self.waiting & bit != 0 && slot != Slot::Emergency {
            self.overwritten = self.overwritten.wrapping_add(1);
        }
        self.waiting |= bit;
    }

    /// What the producer has waiting is not sent after all.
    #[inline]
    pub(crate) fn withdraw(&mut self, slot: Slot) {
        self.waiting &= !self.bit(slot);
    }

    /// Takes out the producer whose identifier is lowest.
    #[inline]
    pub(crate) fn take(&mut self) -> Option<(Slot, u32)> {
        let waiting = self.waiting & self.allowed;
        let place = self.places.get(waiting.trailing_zeros() as usize)?;
        // The lowest bit that is set, out of all that wait.
        self.waiting &= !(waiting & waiting.wrapping_neg());
        Some((place.slot, place.key))
    }

    /// The identifier that a producer sends with, as [`can::Frame::key`].
    pub(crate) fn key(&self, slot: Slot) -> u32 {
        let place = self.bit(slot).trailing_zeros() as usize;
        self.places.get(place).map_or(0, |place| place.key)
    }

    /// Whether the producer has something waiting.
    pub(crate) fn is_waiting(&self, slot: Slot) -> bool {
        self.waiting & self.bit(slot) != 0
    }

    /// Whether nothing waits that may be sent.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting & self.allowed == 0
    }

    pub(crate) fn overwritten(&self) -> u32 {
        self.overwritten
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identifiers that change while frames wait change the order, not what waits or is held.
    #[test]
    fn identifiers_change_while_frames_wait() {
        for hold in [false, true] {
            let mut outbox = Outbox::EMPTY;
            for (slot, id) in [
                (Slot::BootUp, 0x705),
                (Slot::Emergency, 0x085),
                (Slot::Sdo(0), 0x585),
                (Slot::ErrorControl, 0x705),
                (Slot::Tpdo(0), 0x185),
                (Slot::Tpdo(3), 0x485),
            ] {
                outbox.set_key(slot, id);
            }
            for slot in [
                Slot::ErrorControl,
                Slot::Emergency,
                Slot::Sdo(0),
                Slot::Tpdo(3),
            ] {
                outbox.post(slot);
            }
            outbox.hold_emergencies(hold);
            outbox.set_key(Slot::Emergency, 0x485);
            outbox.set_key(Slot::Tpdo(3), 0x086);
            let mut order = core::iter::from_fn(|| outbox.take());
            assert_eq!(order.next(), Some((Slot::Tpdo(3), 0x086)));
            if !hold {
                assert_eq!(order.next(), Some((Slot::Emergency, 0x485)));
            }
            assert_eq!(order.next(), Some((Slot::Sdo(0), 0x585)));
            assert_eq!(order.next(), Some((Slot::ErrorControl, 0x705)));
            assert_eq!(order.next(), None);
            assert!(outbox.is_empty());
            outbox.hold_emergencies(false);
            let held = hold.then_some((Slot::Emergency, 0x485));
            assert_eq!(outbox.take(), held);
            assert_eq!(outbox.overwritten(), 0);
        }
    }
}
