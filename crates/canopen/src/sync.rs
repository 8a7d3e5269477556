//! SYNC, consumed and produced (CiA 301 7.2.5).

use can::Frame;

use crate::outbox::Slot;
use crate::{CobId, CommunicationErrors, Events, Instant, NmtState, Node, NodeMemory, Owner, PDOS};

/// Which frames are SYNCs, and when this node sends one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sync {
    /// [`can::Frame::key`] of the SYNC frame, or a key that no frame has.
    pub(crate) key: u32,
    /// SYNCs of any length are obeyed, and there is no counter and no window.
    is_plain: bool,
    /// Bytes of a SYNC, if they matter: 1 with a counter, 0 without (0x1019).
    length: Option<u8>,
    /// The greatest value of the counter; 0: there is none.
    pub(crate) overflow: u8,
    /// The counter of the next SYNC that this node sends.
    counter: u8,
    /// The window of the last SYNC has not closed yet.
    window_is_open: bool,
    /// This node sends SYNC: how often, µs. 0: it does not.
    period_us: u32,
    /// The synchronous window (0x1007), µs; 0: none.
    window_us: u32,
    pub(crate) due: Instant,
    /// Data of synchronous PDOs count until then.
    pub(crate) window_until: Instant,
}

/// What 0x1005, 0x1006, 0x1007 and 0x1019 say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SyncParameters {
    pub(crate) cob_id: CobId,
    pub(crate) period_us: u32,
    pub(crate) window_us: u32,
    /// `None` if there is no 0x1019: SYNCs of any length are obeyed.
    pub(crate) overflow: Option<u8>,
    pub(crate) extended: bool,
}

impl Sync {
    pub(crate) const DEFAULT: Sync = Sync {
        key: 0x80,
        is_plain: true,
        length: None,
        overflow: 0,
        counter: 1,
        window_is_open: false,
        period_us: 0,
        window_us: 0,
        due: Instant::NEVER,
        window_until: Instant::NEVER,
    };

    /// SYNC by its parameters. A producer that was sending goes on in its rhythm if the period is
    /// the same, and goes on counting. The window of the last SYNC goes on, or stays closed, as it
    /// began; another length begins with the next SYNC, and none at all (0) ends it.
    pub(crate) fn new(parameters: &SyncParameters, before: &Sync, now: Instant) -> Sync {
        // Bit 31 of 0x1005 says nothing (CiA 301 7.5.2.5); bit 30 makes this node a producer.
        let cob_id = CobId(parameters.cob_id.0 & !(1 << 31));
        let key = if cob_id.is_usable(parameters.extended) {
            cob_id.key()
        } else {
            CobId::NO_KEY
        };
        let produces = cob_id.0 & 1 << 30 != 0 && key != CobId::NO_KEY;
        let period_us = match produces {
            true => parameters.period_us,
            false => 0,
        };
        let due = match period_us {
            0 => Instant::NEVER,
            same if same == before.period_us && before.due != Instant::NEVER => before.due,
            us => now.plus_us(u64::from(us)),
        };
        let (window_is_open, window_until) = match parameters.window_us {
            0 => (false, Instant::NEVER),
            _ => (before.window_is_open, before.window_until),
        };
        Sync {
            key,
            is_plain: parameters.overflow.is_none() && parameters.window_us == 0,
            length: parameters.overflow.map(|overflow| u8::from(overflow > 1)),
            overflow: parameters.overflow.unwrap_or(0),
            counter: match (before.period_us, period_us) {
                (0, _) | (_, 0) => 1,
                _ => before.counter,
            },
            window_is_open,
            period_us,
            window_us: parameters.window_us,
            due,
            window_until,
        }
    }

    /// When the window is to be looked at: just after it has closed.
    pub(crate) fn window_due(&self) -> Instant {
        match self.window_is_open {
            true => self.window_until.plus_ns(1),
            false => Instant::NEVER,
        }
    }

    /// Whether a received SYNC is as long as it must be.
    #[inline]
    fn accepts(&self, length: u8) -> bool {
        match self.length {
            None => true,
            Some(expected) => expected == length,
        }
    }

    /// The counter starts again at 1 (CiA 301 7.2.5.1).
    pub(crate) fn restart(&mut self) {
        self.counter = 1;
    }

    /// The data of the next SYNC that this node sends, and its length.
    pub(crate) fn frame(&self, key: u32) -> Frame {
        // The counter has gone on when the frame was posted.
        let sent = match self.counter {
            1 => self.overflow,
            next => next - 1,
        };
        let length = u8::from(self.overflow > 1);
        Frame::keyed(key, [sent, 0, 0, 0, 0, 0, 0, 0], length)
    }
}

impl<M: NodeMemory> Node<M> {
    /// A SYNC frame was received.
    #[inline]
    pub(crate) fn receive_sync<O: Owner>(
        &mut self,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        if matches!(self.state, NmtState::Initialising | NmtState::Stopped) {
            return;
        }
        if !self.sync.is_plain && !self.judge_sync_frame(frame, now, events) {
            return;
        }
        self.synchronise(now, owner, events);
    }

    /// Applies the receive PDOs whose SYNC this is. Outside operational none waits.
    fn apply_buffered<O: Owner>(&mut self, now: Instant, owner: &mut O, events: &mut Events) {
        self.rpdo_waits = false;
        for n in 0..PDOS {
            let Some(rpdo) = self.rpdo.get_mut(n) else {
                return;
            };
            let due = rpdo.sync();
            self.rpdo_waits |= rpdo.waits();
            if let Some(data) = due {
                self.apply(n, data, now, owner, events);
            }
        }
    }

    /// Whether a SYNC is as long as 0x1019 says. Then begins with it what depends on its counter.
    fn judge_sync_frame(&mut self, frame: &Frame, now: Instant, events: &mut Events) -> bool {
        let is_good = self.sync.accepts(frame.len());
        self.note(CommunicationErrors::SYNC_LENGTH, !is_good, events);
        if is_good {
            let [counter, ..] = frame.bytes();
            self.open_window(counter, now);
        }
        is_good
    }

    /// Does what a SYNC asks for: applies receive PDOs, samples transmit PDOs.
    #[inline]
    fn synchronise<O: Owner>(&mut self, now: Instant, owner: &mut O, events: &mut Events) {
        events.sync = true;
        if self.rpdo_waits {
            self.apply_buffered(now, owner, events);
        }
        if self.sends_pdos(self.state) {
            self.sample_with_sync(owner);
        }
    }

    /// What only some SYNCs have: a counter, and a window for the PDOs that belong to it.
    fn open_window(&mut self, counter: u8, now: Instant) {
        if self.sync.overflow > 1 {
            for tpdo in &mut self.tpdo {
                tpdo.sync_counter(counter);
            }
        }
        if self.sync.window_us != 0 {
            self.sync.window_until = now.plus_us(u64::from(self.sync.window_us));
            self.sync.window_is_open = true;
            self.due = self.due.min(self.sync.window_due());
        }
    }

    /// The window has closed: synchronous PDOs that were not sent are not sent any more (CiA 301
    /// 7.5.2.7).
    pub(crate) fn close_window(&mut self, events: &mut Events) {
        self.sync.window_is_open = false;
        let mut late = false;
        for (n, tpdo) in self.tpdo.iter().enumerate() {
            let slot = Slot::Tpdo(n as u8);
            if tpdo.parameters.transmission_type <= 240 && self.outbox.is_waiting(slot) {
                self.outbox.withdraw(slot);
                late = true;
            }
        }
        self.note(CommunicationErrors::SYNC_WINDOW, late, events);
    }

    /// Sends a SYNC and obeys it.
    pub(crate) fn produce_sync<O: Owner>(
        &mut self,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let sync = &mut self.sync;
        // A late call does not produce a burst.
        let period_us = u64::from(sync.period_us);
        let next = sync.due.plus_us(period_us);
        sync.due = if next > now {
            next
        } else {
            now.plus_us(period_us)
        };
        if matches!(self.state, NmtState::Initialising | NmtState::Stopped) {
            return;
        }
        let counter = sync.counter;
        sync.counter = match counter >= sync.overflow {
            true => 1,
            false => counter + 1,
        };
        self.outbox.post(Slot::Sync);
        self.open_window(counter, now);
        self.synchronise(now, owner, events);
    }
}
