//! Transmit PDOs that events send: a mapped value that changed, a timer, a request (CiA 301 7.2.2.2).

use super::transmit::Kind;
use crate::outbox::Slot;
use crate::{Image, Instant, NmtState, Node, NodeMemory, Owner, PDOS};

impl<M: NodeMemory> Node<M> {
    /// Looks for mapped values that have changed since they were last sent: an event for their
    /// PDO. Call as often as events shall be seen, once a millisecond say; afterwards
    /// [`Node::transmit`]. A PDO whose values were never sent in this state has an event, too.
    #[inline]
    pub fn detect_events<O: Owner>(&mut self, now: Instant, owner: &mut O) {
        if self.state != NmtState::Operational || !self.has_event_pdos {
            return;
        }
        self.look_for_events(now, owner);
    }

    fn look_for_events<O: Owner>(&mut self, now: Instant, owner: &mut O) {
        let mut published = false;
        for n in 0..PDOS {
            let Some(tpdo) = self.tpdo.get(n) else { return };
            if !matches!(tpdo.kind, Kind::Event | Kind::Acyclic) || tpdo.has_event {
                continue;
            }
            if tpdo.mapping.is_live() && !published {
                owner.publish(&mut Image::new(self.memory.as_mut()));
                published = true;
            }
            let sample = self.sample_of(n);
            let Some(tpdo) = self.tpdo.get(n) else { return };
            if !tpdo.is_known || tpdo.data != sample {
                self.event(n, now);
            }
        }
    }

    /// An event for transmit PDO `n` (from 0): it is sent as soon as its inhibit time allows, or
    /// with the next SYNC if its type is 0. Does nothing for PDOs that events do not send, or
    /// outside operational. Afterwards call [`Node::transmit`].
    pub fn trigger<O: Owner>(&mut self, n: usize, now: Instant, owner: &mut O) {
        let Some(tpdo) = self.tpdo.get(n) else { return };
        let by_event = matches!(tpdo.kind, Kind::Event | Kind::Acyclic);
        if by_event && self.state == NmtState::Operational {
            if tpdo.mapping.is_live() {
                owner.publish(&mut Image::new(self.memory.as_mut()));
            }
            self.event(n, now);
        }
    }

    /// Sends PDO `n` now, or notes that it is to be sent. Live values were published.
    fn event(&mut self, n: usize, now: Instant) {
        let Some(tpdo) = self.tpdo.get_mut(n) else {
            return;
        };
        if tpdo.kind == Kind::Acyclic {
            tpdo.has_event = true;
        } else if now < tpdo.free_at {
            tpdo.has_event = true;
            self.due = self.due.min(tpdo.free_at);
        } else {
            self.send_event(n, now);
        }
    }

    fn send_event(&mut self, n: usize, now: Instant) {
        let data = self.sample_of(n);
        let Some(tpdo) = self.tpdo.get_mut(n) else {
            return;
        };
        tpdo.data = data;
        tpdo.is_known = true;
        tpdo.has_event = false;
        // From one invocation to the next, not from frame to frame (CiA 301 7.5.2.37).
        tpdo.free_at = now.plus_us(100 * u64::from(tpdo.parameters.inhibit));
        tpdo.timer_due = match tpdo.parameters.event_timer_ms {
            0 => Instant::NEVER,
            ms => now.plus_ms(u64::from(ms)),
        };
        self.due = self.due.min(tpdo.timer_due);
        self.outbox.post(Slot::Tpdo(n as u8));
    }

    /// The mapped values of transmit PDO `n` now.
    pub(crate) fn sample_of(&mut self, n: usize) -> u64 {
        match self.tpdo.get(n) {
            Some(tpdo) if tpdo.mapping.is_walked() => self.sample_walked(n),
            Some(tpdo) => tpdo.mapping.sample(self.memory.as_ref()),
            None => 0,
        }
    }

    /// Sends the PDOs whose inhibit time has ended or whose event timer has elapsed.
    pub(crate) fn send_due_events<O: Owner>(&mut self, now: Instant, owner: &mut O) {
        let mut published = false;
        for n in 0..PDOS {
            let Some(tpdo) = self.tpdo.get(n) else { return };
            let elapsed = now >= tpdo.timer_due && tpdo.timer_due != Instant::NEVER;
            let is_due = tpdo.has_event || elapsed;
            if !matches!(tpdo.kind, Kind::Event | Kind::Timer) || !is_due {
                continue;
            }
            if now < tpdo.free_at {
                if elapsed && let Some(tpdo) = self.tpdo.get_mut(n) {
                    tpdo.timer_due = Instant::NEVER;
                    tpdo.has_event = true;
                }
                continue;
            }
            if tpdo.mapping.is_live() && !published {
                owner.publish(&mut Image::new(self.memory.as_mut()));
                published = true;
            }
            self.send_event(n, now);
        }
    }

    /// A remote request with the identifier `key` (without its remote bit): the PDO of that
    /// identifier is sent, if it may be requested.
    #[cold]
    pub(crate) fn request_pdo<O: Owner>(&mut self, key: u32, now: Instant, owner: &mut O) {
        for n in 0..PDOS {
            let Some(tpdo) = self.tpdo.get(n) else { return };
            if !tpdo.parameters.on_request || self.outbox.key(Slot::Tpdo(n as u8)) != key {
                continue;
            }
            match tpdo.kind {
                Kind::Request | Kind::Event | Kind::Timer => {
                    if tpdo.mapping.is_live() {
                        owner.publish(&mut Image::new(self.memory.as_mut()));
                    }
                    if tpdo.kind != Kind::Request {
                        self.event(n, now);
                    } else {
                        self.send_event(n, now);
                    }
                }
                // What was sampled with the last SYNC, if there was one.
                Kind::SyncRequest if tpdo.is_known => self.outbox.post(Slot::Tpdo(n as u8)),
                _ => {}
            }
        }
    }

    /// Starts the event timers: with the state operational, or with new parameters in it.
    pub(crate) fn start_event_timers(&mut self, now: Instant) {
        for tpdo in &mut self.tpdo {
            if matches!(tpdo.kind, Kind::Event | Kind::Timer)
                && tpdo.parameters.event_timer_ms != 0
                && tpdo.timer_due == Instant::NEVER
            {
                tpdo.timer_due = now.plus_ms(u64::from(tpdo.parameters.event_timer_ms));
                self.due = self.due.min(tpdo.timer_due);
            }
        }
    }

    /// When the next PDO is due by its inhibit time or event timer.
    pub(crate) fn next_event_due(&self) -> Instant {
        let mut next = Instant::NEVER;
        for tpdo in &self.tpdo {
            if matches!(tpdo.kind, Kind::Event | Kind::Timer) {
                next = next.min(tpdo.timer_due);
                if tpdo.has_event {
                    next = next.min(tpdo.free_at);
                }
            }
        }
        next
    }
}
