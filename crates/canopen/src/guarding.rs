//! Node guarding and life guarding, the slave's side (CiA 301 7.2.8.3.2.1).

use crate::outbox::Slot;
use crate::{CommunicationErrors, Events, Instant, Node, NodeMemory, Owner};

/// The slave's side of guarding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guarding {
    /// The device has 0x100C and 0x100D.
    pub(crate) exists: bool,
    /// 0x100C times 0x100D; 0: the master's life is not guarded.
    life_time_ms: u32,
    /// Bit 7 of the next answer.
    toggle: bool,
    /// The frame that waits is an answer to the master, not a heartbeat.
    pub(crate) is_answer: bool,
    /// When the master must have asked again.
    pub(crate) due: Instant,
}

impl Guarding {
    pub(crate) const OFF: Guarding = Guarding {
        exists: false,
        life_time_ms: 0,
        toggle: false,
        is_answer: false,
        due: Instant::NEVER,
    };

    /// The byte of the answer; the next one has the other toggle bit.
    pub(crate) fn answer(&mut self, state: u8) -> u8 {
        let toggle = u8::from(self.toggle) << 7;
        self.toggle = !self.toggle;
        self.is_answer = false;
        toggle | state
    }
}

impl<M: NodeMemory> Node<M> {
    /// Reads 0x100C and 0x100D. Guarding begins with the master's next request.
    pub(crate) fn read_guarding_parameters(&mut self, events: &mut Events) {
        let objects = &self.device.objects;
        let (Some(time), Some(factor)) = (objects.guard_time_ms, objects.life_time_factor) else {
            return;
        };
        let (time_ms, factor) = (self.raw(time.field()), self.raw(factor.field()));
        self.guarding.exists = true;
        self.guarding.life_time_ms = time_ms.saturating_mul(factor);
        self.guarding.due = Instant::NEVER;
        if self.guarding.life_time_ms == 0 {
            self.end_life_guarding(events);
        }
    }

    /// The master's life is not guarded any more, and so is not lost.
    pub(crate) fn end_life_guarding(&mut self, events: &mut Events) {
        self.guarding.due = Instant::NEVER;
        self.note(CommunicationErrors::LIFE_GUARD, false, events);
    }

    /// The master asks for the state. Answered unless this node has a heartbeat, which excludes
    /// guarding (CiA 301 7.2.8.2.2).
    pub(crate) fn guarded(&mut self, now: Instant, events: &mut Events) {
        if !self.guarding.exists || self.heartbeat.is_on() || !self.device.dialect.remote_requests {
            return;
        }
        if self.guarding.life_time_ms != 0 {
            self.guarding.due = now.plus_ms(u64::from(self.guarding.life_time_ms));
            self.due = self.due.min(self.guarding.due);
        }
        self.note(CommunicationErrors::LIFE_GUARD, false, events);
        self.guarding.is_answer = true;
        self.outbox.post(Slot::ErrorControl);
    }

    /// The master has not asked within the life time.
    pub(crate) fn guard_lost<O: Owner>(
        &mut self,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        self.guarding.due = Instant::NEVER;
        self.note(CommunicationErrors::LIFE_GUARD, true, events);
        self.communication_error(now, owner, events);
    }
}
