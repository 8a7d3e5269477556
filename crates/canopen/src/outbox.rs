//! What waits to be sent: one slot per producer, not a queue of frames.

/// Producers that may have a frame waiting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    BootUp,
    Emergency,
    Tpdo(u8),
    Sdo,
    Heartbeat,
}

const BOOT_UP: u8 = 0;
const EMERGENCY: u8 = 1;
const SDO: u8 = 2;
const HEARTBEAT: u8 = 3;
const TPDO: u8 = 4;
const SLOTS: usize = 4 + crate::PDOS;

impl Slot {
    #[inline]
    const fn number(self) -> u8 {
        match self {
            Slot::BootUp => BOOT_UP,
            Slot::Emergency => EMERGENCY,
            Slot::Sdo => SDO,
            Slot::Heartbeat => HEARTBEAT,
            Slot::Tpdo(n) => TPDO + n,
        }
    }

    #[inline]
    const fn from_number(number: u8) -> Slot {
        match number {
            BOOT_UP => Slot::BootUp,
            EMERGENCY => Slot::Emergency,
            SDO => Slot::Sdo,
            HEARTBEAT => Slot::Heartbeat,
            n => Slot::Tpdo(n - TPDO),
        }
    }
}

/// The set of waiting producers and the identifier each will send with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outbox {
    waiting: u16,
    ids: [u16; SLOTS],
    /// Frames that were replaced before they were sent.
    overwritten: u32,
}

impl Outbox {
    pub(crate) const EMPTY: Outbox = Outbox {
        waiting: 0,
        ids: [0; SLOTS],
        overwritten: 0,
    };

    pub(crate) fn set_id(&mut self, slot: Slot, id: u16) {
        if let Some(place) = self.ids.get_mut(usize::from(slot.number())) {
            *place = id;
        }
    }

    /// The producer has something to send; if its last frame is still waiting, that is replaced.
    #[inline]
    pub(crate) fn post(&mut self, slot: Slot) {
        let bit = 1u16 << (slot.number() & 15);
        // Emergencies have a ring of their own: none replaces another.
        if self.waiting & bit & !(1 << EMERGENCY) != 0 {
            self.overwritten = self.overwritten.wrapping_add(1);
        }
        self.waiting |= bit;
    }

    #[inline]
    pub(crate) fn withdraw(&mut self, slot: Slot) {
        self.waiting &= !(1u16 << (slot.number() & 15));
    }

    /// Takes out the producer whose identifier is lowest, among those in `allowed`.
    #[inline]
    pub(crate) fn take(&mut self, emergency_allowed: bool) -> Option<(Slot, u16)> {
        let mut rest = self.waiting(emergency_allowed);
        let mut best: Option<(u8, u16)> = None;
        while rest != 0 {
            let number = rest.trailing_zeros() as u8;
            rest &= rest - 1;
            let id = self
                .ids
                .get(usize::from(number))
                .copied()
                .unwrap_or(u16::MAX);
            if best.is_none_or(|(_, lowest)| id < lowest) {
                best = Some((number, id));
            }
        }
        let (number, id) = best?;
        self.waiting &= !(1 << number);
        Some((Slot::from_number(number), id))
    }

    #[inline]
    pub(crate) fn is_empty(&self, emergency_allowed: bool) -> bool {
        self.waiting(emergency_allowed) == 0
    }

    #[inline]
    fn waiting(&self, emergency_allowed: bool) -> u16 {
        if emergency_allowed {
            self.waiting
        } else {
            self.waiting & !(1 << EMERGENCY)
        }
    }

    pub(crate) fn overwritten(&self) -> u32 {
        self.overwritten
    }
}
