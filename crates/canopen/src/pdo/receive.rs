//! A receive PDO.

use can::Frame;

use crate::pdo::Mapping;
use crate::{
    CobId, CommunicationErrors, Dialect, Events, Instant, News, Node, NodeMemory, Owner, PDOS,
    RpdoSync,
};

/// One receive PDO: its parameters and what it received for a later SYNC.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rpdo {
    /// [`can::Frame::key`] that it listens to.
    pub(crate) key: u32,
    parameters: RpdoParameters,
    /// SYNCs still to come before the buffer is applied; 0: the buffer is empty.
    due_in: u8,
    /// What was wrong with the last frame, or with there being none.
    flaws: CommunicationErrors,
    buffer: u64,
    /// When the next frame must have come.
    pub(crate) deadline: Instant,
    pub(crate) mapping: Mapping,
}

/// What 0x1400 says beside the identifier.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RpdoParameters {
    pub(crate) transmission_type: u8,
    /// The longest time from one frame to the next; 0: any.
    pub(crate) deadline_ms: u16,
}

impl Rpdo {
    pub(crate) const OFF: Rpdo = Rpdo {
        key: CobId::NO_KEY,
        parameters: RpdoParameters {
            transmission_type: 255,
            deadline_ms: 0,
        },
        due_in: 0,
        flaws: CommunicationErrors::NOTHING,
        buffer: 0,
        deadline: Instant::NEVER,
        mapping: Mapping::EMPTY,
    };

    /// A PDO that has received nothing yet. `key` is the [`can::Frame::key`] it listens to, `None`
    /// if it is off.
    pub(crate) fn new(key: Option<u32>, parameters: RpdoParameters, mapping: Mapping) -> Rpdo {
        Rpdo {
            key: key.unwrap_or(CobId::NO_KEY),
            parameters,
            mapping,
            ..Rpdo::OFF
        }
    }

    /// Whether its data wait for a SYNC.
    #[inline]
    fn is_synchronous(&self) -> bool {
        self.parameters.transmission_type <= 240
    }

    /// Takes received data. Returns them if they are to be applied at once; otherwise they wait
    /// for their SYNC, a later reception replacing them.
    #[inline]
    fn accept(&mut self, data: u64, dialect: &Dialect) -> Option<u64> {
        if !self.is_synchronous() {
            return Some(data);
        }
        self.buffer = data;
        if self.due_in == 0 {
            self.due_in = match dialect.rpdo_sync {
                RpdoSync::Next => 1,
                // The count starts with the first reception, so that data that are sent more often
                // than they are applied still are (P50).
                RpdoSync::Nth => self.parameters.transmission_type.max(1),
            };
        }
        None
    }

    /// Another longest time between frames, from the next one on.
    pub(crate) fn set_deadline(&mut self, deadline_ms: u16) {
        self.parameters.deadline_ms = deadline_ms;
        self.deadline = Instant::NEVER;
        self.flaws.set(CommunicationErrors::RPDO_TIMEOUT, false);
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

    /// Whether data wait for a SYNC.
    pub(crate) fn waits(&self) -> bool {
        self.due_in != 0
    }

    /// Forgets what waits for a SYNC, and that a frame is awaited.
    pub(crate) fn discard(&mut self) {
        self.due_in = 0;
        self.deadline = Instant::NEVER;
        self.flaws = CommunicationErrors::NOTHING;
    }

    /// What is wrong with it.
    pub(crate) fn flaws(&self) -> CommunicationErrors {
        self.flaws
    }
}

impl<M: NodeMemory> Node<M> {
    /// Hands a frame to the receive PDOs; whether one listens to it.
    #[inline]
    pub(crate) fn receive_pdo<O: Owner>(
        &mut self,
        key: u32,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) -> bool {
        let data = u64::from_le_bytes(frame.bytes());
        let mut is_mine = false;
        for n in 0..PDOS {
            let Some(rpdo) = self.rpdo.get_mut(n) else {
                return is_mine;
            };
            if rpdo.key != key {
                continue;
            }
            is_mine = true;
            let is_plain = frame.len() == rpdo.mapping.bytes()
                && rpdo.flaws.is_empty()
                && rpdo.parameters.deadline_ms == 0;
            if !is_plain && !self.judge_frame(n, frame.len(), now, events) {
                continue;
            }
            // Data of a SYNC whose window has closed do not count (CiA 301 7.5.2.7).
            let too_late = now > self.sync.window_until;
            let Some(rpdo) = self.rpdo.get_mut(n) else {
                return is_mine;
            };
            if too_late && rpdo.is_synchronous() {
                continue;
            }
            match rpdo.accept(data, &self.device.dialect) {
                Some(data) => self.apply(n, data, now, owner, events),
                None => self.rpdo_waits = true,
            }
        }
        is_mine
    }

    /// A frame for receive PDO `n` that is not as long as its mapping, or the first good one after
    /// such, or one that has a deadline. Whether it is applied: a frame shorter than its mapping is
    /// not (CiA 301 7.2.2.4); a longer one is, with the bytes that are mapped. A disabled mapping
    /// takes none, and no length is wrong for it.
    #[cold]
    fn judge_frame(&mut self, n: usize, length: u8, now: Instant, events: &mut Events) -> bool {
        let has_deadlines = self.device.dialect.pdo_events;
        let Some(rpdo) = self.rpdo.get_mut(n) else {
            return false;
        };
        let mapped = rpdo.mapping.bytes();
        if mapped == 0 {
            return false;
        }
        let before = rpdo.flaws;
        rpdo.flaws
            .set(CommunicationErrors::RPDO_TOO_SHORT, length < mapped);
        rpdo.flaws
            .set(CommunicationErrors::RPDO_TOO_LONG, length > mapped);
        rpdo.flaws.set(CommunicationErrors::RPDO_TIMEOUT, false);
        if has_deadlines && rpdo.parameters.deadline_ms != 0 {
            rpdo.deadline = now.plus_ms(u64::from(rpdo.parameters.deadline_ms));
            self.due = self.due.min(rpdo.deadline);
        }
        if before != rpdo.flaws {
            self.sum_up_errors(events);
        }
        length >= mapped
    }

    /// Notes the receive PDOs that have not come in time.
    pub(crate) fn check_deadlines(&mut self, now: Instant, events: &mut Events) {
        let mut any = false;
        for rpdo in &mut self.rpdo {
            if now >= rpdo.deadline && rpdo.deadline != Instant::NEVER {
                rpdo.deadline = Instant::NEVER;
                rpdo.flaws.set(CommunicationErrors::RPDO_TIMEOUT, true);
                any = true;
            }
        }
        if any {
            self.sum_up_errors(events);
        }
    }

    /// Makes the set of errors anew from those of the services.
    pub(crate) fn sum_up_errors(&mut self, events: &mut Events) {
        let mut errors = self.service_errors;
        for rpdo in &self.rpdo {
            errors.insert(rpdo.flaws());
        }
        if errors != self.errors {
            self.errors = errors;
            events.news.insert(News::ERRORS);
        }
    }
}
