//! Traffic that is looked at bit by bit, because something happens to it.

use can::Frame;
use canopen::Instant;

use super::Bus;
use crate::controller::Port;
use crate::error_frame::ErrorSeen;
use crate::medium::{ErrorState, Event, INTERFRAME_BITS, Sender, Spoilt, Traffic, Wire};
use crate::notice::{Notice, NoticeKind};
use crate::wire_act::{Participant, WireFault};

impl Bus {
    /// What is on the wire of that number is looked at bit by bit from now on, until it is free.
    pub(super) fn go_into_bits(&mut self, n: usize) {
        let now = self.now;
        let medium = self.media.nth(n);
        let (wire, bit_ns, idle_at) = (medium.wire, medium.bit_ns(), medium.idle_at);
        if medium.is_in_bits() {
            return;
        }
        if let Some(ended) = medium.take_frame() {
            let bits = now.since_ns(ended.began) / bit_ns;
            let next_ends = ended.began.plus_ns((bits + 1) * bit_ns);
            let spoilt = Spoilt {
                flips: Vec::new(),
                lost_at: ended.lost_at,
            };
            medium.begin_bits(bits as u16, next_ends, spoilt);
            self.take_back_busy(wire, ended.began.plus_ns(bits * bit_ns), idle_at);
            self.play(wire, ended.began, &ended.frame, &ended.senders, bits as u16);
        } else {
            // In intermission, or idle.
            let left = idle_at.since_ns(now).div_ceil(bit_ns).min(INTERFRAME_BITS);
            let next_ends = match left {
                0 => now.plus_ns(bit_ns),
                _ => Instant(idle_at.0 - (left - 1) * bit_ns),
            };
            medium.begin_bits(u16::MAX, next_ends, Spoilt::default());
            self.take_back_busy(wire, Instant(next_ends.0 - bit_ns), idle_at);
            let bits = (INTERFRAME_BITS - left) as u8;
            for (_, port) in self.ports().filter(|(_, port)| port.wire() == wire) {
                if left > 0 {
                    port.protocol.in_intermission(bits);
                } else {
                    port.protocol.rest(now, bit_ns);
                    port.protocol.observe();
                }
            }
        }
    }

    /// Bits are counted one by one from now on: those to come have been counted before.
    fn take_back_busy(&mut self, wire: Wire, now: Instant, counted_to: Instant) {
        if wire == self.gateway.port.wire() {
            self.busy_ns -= counted_to.since_ns(now);
        }
    }

    /// The first bits of a frame were good for all who have been there from the start.
    fn play(&mut self, wire: Wire, began: Instant, frame: &Frame, senders: &[Sender], bits: u16) {
        let stream = frame.bit_stream();
        for (who, port) in self.ports().filter(|(_, port)| port.wire() == wire) {
            let protocol = &mut port.protocol;
            if protocol.follows(began) {
                if senders.iter().any(|sender| sender.participant() == who) {
                    protocol.begin(*frame);
                }
                for number in 0..bits {
                    let level = stream.bit(number).unwrap_or(true);
                    protocol.read(level && number != stream.ack_slot(), None);
                }
            }
            protocol.observe();
        }
    }

    /// A bit has ended on the wire of that number.
    pub(super) fn bit(&mut self, n: usize) {
        let now = self.now;
        let medium = self.media.nth(n);
        let (wire, bit_ns) = (medium.wire, medium.bit_ns());
        let Some((number, spoilt)) = medium.bit() else {
            return;
        };
        let spoilt = spoilt.clone();
        let flipped = |who: Option<Participant>| {
            let flips = spoilt.flips.iter();
            flips.filter(|flip| **flip == (number, who)).count() % 2 == 1
        };
        let fault = self.acts.fault(now).filter(|_| wire.cut_off.is_none());
        let level = match fault {
            Some(WireFault::Recessive) => true,
            Some(WireFault::Dominant) => false,
            None => {
                let mut ports = self.ports().filter(|(_, port)| port.wire() == wire);
                ports.all(|(_, port)| port.protocol.level())
            }
        };
        let level = level != flipped(None);
        let is_spoilt = spoilt.flips.iter().any(|(at, _)| *at == number);
        let mut events = std::mem::take(&mut self.events);
        events.clear();
        let mut changed = Vec::new();
        let mut at_rest = true;
        self.each_joining(wire, |who, port, waiting| {
            let before = port.protocol.counters.state();
            let own = is_spoilt && flipped(Some(who));
            if let Some(event) = port.protocol.read(level != own, waiting) {
                events.push((who, event));
            }
            at_rest &= port.protocol.is_at_rest();
            let after = port.protocol.counters.state();
            if after != before {
                changed.push((who, after));
            }
        });
        self.happen(wire, &events, &spoilt.lost_at);
        self.events = events;
        for (who, state) in changed {
            self.change_state(who, state);
        }
        if wire == self.gateway.port.wire() {
            self.busy_ns += bit_ns;
        }
        let stays = self.acts.is_held_dominant(now);
        if at_rest && !stays {
            self.media.nth(n).end_bits(now);
            for (_, port) in self.ports().filter(|(_, port)| port.wire() == wire) {
                port.protocol.release(now);
            }
            self.due_is_stale = true;
            self.refresh();
        } else {
            self.media.nth(n).next_bit();
        }
    }

    /// Everybody on a wire, and the frame that it would join with if somebody's start of frame came
    /// now.
    fn each_joining(
        &mut self,
        wire: Wire,
        mut each: impl FnMut(Participant, &mut Port, Option<Frame>),
    ) {
        let now = self.now;
        for drive in &mut self.drives {
            if drive.controller.port.wire() == wire {
                let waiting = drive.controller.contender();
                let place = drive.place();
                let port = &mut drive.controller.port;
                let waiting = waiting.filter(|_| port.may_send_at(now) <= now);
                each(Participant::Drive(place), port, waiting);
            }
        }
        if self.gateway.port.wire() == wire {
            let waiting = self.gateway.contender();
            let port = &mut self.gateway.port;
            let waiting = waiting.filter(|_| port.may_send_at(now) <= now);
            each(Participant::Outside, port, waiting.map(|(_, frame)| frame));
        }
        if self.stranger.port.wire() == wire && self.stranger.port.protocol.is_on() {
            let waiting = self.stranger.contender(now);
            each(Participant::Stranger, &mut self.stranger.port, waiting);
        }
    }

    /// Passes on what a bit has brought.
    fn happen(&mut self, wire: Wire, events: &[(Participant, Event)], lost_at: &[Participant]) {
        let now = self.now;
        // Whoever sent it: the controllers know before they hear that it is sent.
        let mut good = None;
        for (_, event) in events {
            if let Event::Received(frame) | Event::Sent(frame) = event {
                let mut ports = self.ports();
                let sender = ports
                    .find(|(_, port)| port.wire() == wire && port.protocol.sends() == Some(*frame));
                good = good.or(sender.map(|(who, _)| (*frame, who)));
            }
        }
        let sender = good.map(|(frame, who)| {
            let sender = match who {
                Participant::Drive(place) => Sender::Drive(place),
                Participant::Outside => Sender::Outside(self.gateway.sends().unwrap_or(0)),
                Participant::Stranger => Sender::Stranger,
            };
            (frame, sender)
        });
        if let Some(runner) = &mut self.runner
            && let Some((frame, sender)) = sender
        {
            runner.see(&frame, &[sender], now);
        }
        let mut reaches_outside = false;
        for (who, event) in events {
            match (who, event) {
                (Participant::Outside, Event::Received(_)) => {
                    reaches_outside = !lost_at.contains(who);
                }
                (Participant::Outside, Event::Sent(_)) => {
                    reaches_outside = true;
                    if let Some(client) = self.gateway.sends() {
                        self.gateway.sent(client);
                    }
                }
                (
                    Participant::Outside,
                    Event::Error {
                        kind,
                        field,
                        transmitter,
                    },
                ) => {
                    let counters = self.outside_error_counters();
                    self.see_error(ErrorSeen::in_frame(
                        now,
                        *kind,
                        *field,
                        *transmitter,
                        counters,
                    ));
                }
                (Participant::Outside, Event::Recovered) => {
                    self.see_error(ErrorSeen::restarted(now));
                    self.tell(Participant::Outside, NoticeKind::BusOn);
                }
                (Participant::Stranger, Event::Sent(frame)) => self.stranger.sent(*frame, now),
                (Participant::Drive(_), event) => {
                    self.happen_to_drive(wire, *who, event, lost_at.contains(who));
                }
                (Participant::Stranger, Event::Error { .. })
                | (Participant::Stranger, Event::Received(_) | Event::Recovered) => {}
            }
        }
        if wire == self.gateway.port.wire()
            && let Some((frame, sender)) = sender
        {
            self.traffic.push(Traffic {
                at: now,
                frame,
                sender,
                copies: if reaches_outside {
                    self.gateway.copies(sender)
                } else {
                    0
                },
            });
        }
    }

    fn happen_to_drive(&mut self, wire: Wire, who: Participant, event: &Event, is_lost: bool) {
        let now = self.now;
        let mut all = self.drives.iter_mut().zip(&mut self.due);
        let found = all.find(|(drive, _)| Participant::Drive(drive.place()) == who);
        let Some((drive, due)) = found else {
            return;
        };
        match event {
            Event::Sent(frame) => {
                drive.controller.sent(*frame);
                drive.fill_mailboxes();
                if drive.controller.contender().is_some() {
                    self.media.contend(wire);
                }
            }
            Event::Received(frame) if !is_lost => drive.hear(*frame, now),
            Event::Recovered => drive.recovered(),
            Event::Received(_) | Event::Error { .. } => {}
        }
        *due = drive.next_poll();
        if *event == Event::Recovered {
            self.tell(who, NoticeKind::BusOn);
        }
    }

    /// Somebody's error state has changed.
    fn change_state(&mut self, who: Participant, state: ErrorState) {
        let Some(port) = self.port(who) else { return };
        let counters = port.protocol.counters;
        if who == Participant::Outside {
            let error = ErrorSeen::state(self.now, counters);
            self.see_error(error);
        }
        let Some(port) = self.port(who) else { return };
        if !counters.is_warning() {
            port.told_passive = false;
        }
        match state {
            ErrorState::Active => {}
            ErrorState::Passive => {
                // Who goes back and forth at the limit is told of once.
                if !std::mem::replace(&mut port.told_passive, true) {
                    self.tell(who, NoticeKind::ErrorPassive(counters));
                }
                if let Some(drive) = self.drive_of(who) {
                    drive.became_passive();
                }
            }
            ErrorState::BusOff => {
                port.told_passive = false;
                match who {
                    Participant::Drive(_) => {
                        if let Some(drive) = self.drive_of(who) {
                            drive.controller.empty_mailboxes();
                        }
                    }
                    Participant::Outside => self.gateway.drop_frame(),
                    Participant::Stranger => {}
                }
                self.tell(who, NoticeKind::BusOff);
            }
        }
    }

    fn drive_of(&mut self, who: Participant) -> Option<&mut crate::VirtualDrive> {
        let mut drives = self.drives.iter_mut();
        drives.find(|drive| Participant::Drive(drive.place()) == who)
    }

    fn see_error(&mut self, error: ErrorSeen) {
        if let Some(errors) = &mut self.errors {
            errors.push(error);
        }
    }

    pub(super) fn tell(&mut self, who: Participant, kind: NoticeKind) {
        let node = self.drive_of(who).and_then(|drive| drive.node());
        self.notices.push(Notice {
            at: self.now,
            who: Some(who),
            node,
            kind,
        });
    }

    /// When gateway and babbling node have something to do.
    pub(super) fn next_of_others(&self) -> Instant {
        let gateway = &self.gateway.port;
        let recovers = if gateway.protocol.counters.is_bus_off() {
            gateway.protocol.rests_until(gateway.bit_rate().bit_ns())
        } else {
            Instant::NEVER
        };
        if self.stranger.port.protocol.is_on() {
            recovers.min(self.stranger.next_event(self.now).max(self.now))
        } else {
            recovers
        }
    }

    /// Does what is due of gateway and babbling node.
    pub(super) fn poll_others(&mut self) {
        let now = self.now;
        let gateway = &mut self.gateway.port;
        let bit_ns = gateway.bit_rate().bit_ns();
        if gateway.protocol.counters.is_bus_off() && gateway.protocol.rest(now, bit_ns) {
            self.see_error(ErrorSeen::restarted(now));
            self.tell(Participant::Outside, NoticeKind::BusOn);
        }
        if self.stranger.port.protocol.is_on() {
            if self.stranger.end_floods(now) {
                self.stranger.port.stop();
            } else if self.stranger.contender(now).is_some() {
                self.media.contend(self.stranger.port.wire());
            }
        }
    }
}
