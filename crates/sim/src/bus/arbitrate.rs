//! Who gets a free wire, and what becomes of a frame that is good as a whole.

use can::Frame;
use canopen::Instant;

use super::Bus;
use crate::controller::Port;
use crate::drive::VirtualDrive;
use crate::medium::{Ended, Sender, Spoilt, Traffic};
use crate::wire_act::Participant;

impl Bus {
    /// Everybody's port, drives first.
    pub(super) fn ports(&mut self) -> impl Iterator<Item = (Participant, &mut Port)> {
        let drives = self.drives.iter_mut().map(|drive| {
            let place = drive.place();
            (Participant::Drive(place), &mut drive.controller.port)
        });
        drives
            .chain([(Participant::Outside, &mut self.gateway.port)])
            .chain([(Participant::Stranger, &mut self.stranger.port)])
    }

    /// The port of one.
    pub(super) fn port(&mut self, who: Participant) -> Option<&mut Port> {
        match who {
            Participant::Drive(place) => {
                let mut drives = self.drives.iter_mut();
                let drive = drives.find(|drive| drive.place() == place)?;
                Some(&mut drive.controller.port)
            }
            Participant::Outside => Some(&mut self.gateway.port),
            Participant::Stranger => Some(&mut self.stranger.port),
        }
    }

    /// The wire of that number is free: who gets it?
    pub(super) fn arbitrate(&mut self, n: usize) {
        let now = self.now;
        let medium = self.media.nth(n);
        let (wire, bit_ns) = (medium.wire, medium.bit_ns());
        self.contenders.clear();
        let mut contest = Contest {
            now,
            bit_ns,
            listeners: 0,
            all_idle: true,
            retry_at: Instant::NEVER,
            contenders: &mut self.contenders,
        };
        for drive in &mut self.drives {
            if drive.controller.port.wire() == wire {
                let frame = drive.controller.contender();
                let sender = Sender::Drive(drive.place());
                contest.enter(&mut drive.controller.port, sender, frame);
            }
        }
        if self.gateway.port.wire() == wire {
            match self.gateway.contender() {
                Some((client, frame)) => {
                    let sender = Sender::Outside(client);
                    contest.enter(&mut self.gateway.port, sender, Some(frame));
                }
                None => contest.enter(&mut self.gateway.port, Sender::Outside(0), None),
            }
        }
        if self.stranger.port.protocol.is_on() && self.stranger.port.wire() == wire {
            let frame = self.stranger.contender(now);
            contest.enter(&mut self.stranger.port, Sender::Stranger, frame);
        }
        let (listeners, all_idle) = (contest.listeners, contest.all_idle);
        let retry_at = contest.retry_at;
        let medium = self.media.nth(n);
        medium.retry_at = retry_at;
        medium.contended = !self.contenders.is_empty();
        let Some((_, winner)) = self
            .contenders
            .iter()
            .min_by_key(|(_, frame)| frame.arbitration_key())
        else {
            return;
        };
        let winner = *winner;
        self.begin(n, winner, listeners, all_idle);
    }

    /// The frame wins arbitration, and others of its identifier begin with it.
    fn begin(&mut self, n: usize, winner: Frame, listeners: usize, all_idle: bool) {
        let now = self.now;
        let wire = self.media.nth(n).wire;
        let key = winner.arbitration_key();
        let same = || {
            let contenders = self.contenders.iter();
            contenders.filter(move |(_, frame)| frame.arbitration_key() == key)
        };
        let is_good = same().all(|(_, frame)| *frame == winner);
        let senders: Vec<Sender> = same().map(|(sender, _)| *sender).collect();
        let spoilt = self.acts.meet(&winner, &senders);
        for (sender, _) in &self.contenders {
            if let Sender::Outside(client) = sender {
                self.gateway.begin(*client);
            }
        }
        // Somebody must acknowledge it.
        let is_heard = listeners > senders.len();
        let is_cable_good = wire.cut_off.is_some() || !self.acts.is_cable_broken(now);
        if is_good && is_heard && spoilt.flips.is_empty() && is_cable_good && !self.every_bit {
            if !all_idle {
                for (_, port) in self.ports().filter(|(_, port)| port.wire() == wire) {
                    port.protocol.hold(now);
                }
            }
            let medium = self.media.nth(n);
            let busy_ns = medium.begin_frame(now, winner, senders, spoilt.lost_at);
            if wire == self.gateway.port.wire() {
                self.busy_ns += busy_ns;
            }
        } else {
            self.begin_in_bits(n, spoilt);
        }
    }

    /// All that contend begin at once, and what becomes of it is seen bit by bit.
    fn begin_in_bits(&mut self, n: usize, spoilt: Spoilt) {
        let medium = self.media.nth(n);
        let wire = medium.wire;
        let first_ends = self.now.plus_ns(medium.bit_ns());
        medium.begin_bits(0, first_ends, spoilt);
        for (_, port) in self.ports().filter(|(_, port)| port.wire() == wire) {
            port.protocol.observe();
        }
        let contenders = std::mem::take(&mut self.contenders);
        for (sender, frame) in &contenders {
            if let Some(port) = self.port(sender.participant()) {
                port.protocol.begin(*frame);
            }
        }
        self.contenders = contenders;
    }

    /// A good frame has ended.
    pub(super) fn deliver(&mut self, ended: &Ended) {
        let now = self.now;
        let Ended {
            frame,
            senders,
            lost_at,
            began,
            wire,
        } = ended;
        let bit_ns = wire.bit_rate.bit_ns();
        if let Some(runner) = &mut self.runner {
            runner.see(frame, senders, now);
        }
        // Who has another bit rate, or was not there when this began, notices nothing.
        let on_wire = |drive: &VirtualDrive| drive.controller.port.wire() == *wire;
        let all = self.drives.iter_mut().zip(&mut self.due);
        for (drive, due) in all.filter(|(drive, _)| on_wire(drive)) {
            let who = Sender::Drive(drive.place());
            let protocol = &mut drive.controller.port.protocol;
            let (sent, follows) = (senders.contains(&who), protocol.follows(*began));
            protocol.finish(sent, now, bit_ns);
            if sent && follows {
                drive.controller.sent(*frame);
                drive.fill_mailboxes();
                if drive.controller.contender().is_some() {
                    self.media.contend(*wire);
                }
            } else if follows && !lost_at.contains(&who.participant()) {
                drive.hear(*frame, now);
            }
            *due = drive.next_poll();
        }
        if self.stranger.port.wire() == *wire {
            let sent = senders.contains(&Sender::Stranger);
            self.stranger.port.protocol.finish(sent, now, bit_ns);
            if sent {
                self.stranger.sent(*frame, now);
                self.media.contend(*wire);
            }
        }
        if self.gateway.port.wire() != *wire {
            return;
        }
        let is_outside = |sender: &&Sender| matches!(sender, Sender::Outside(_));
        let outside = senders.iter().find(is_outside);
        let follows = self.gateway.port.protocol.follows(*began);
        let protocol = &mut self.gateway.port.protocol;
        protocol.finish(outside.is_some(), now, bit_ns);
        if let Some(Sender::Outside(client)) = outside {
            self.gateway.sent(*client);
            self.media.contend(*wire);
        }
        let is_lost = outside.is_none() && (!follows || lost_at.contains(&Participant::Outside));
        if let Some(sender) = senders.first() {
            self.traffic.push(Traffic {
                at: now,
                frame: *frame,
                sender: *sender,
                copies: if is_lost {
                    0
                } else {
                    self.gateway.copies(*sender)
                },
            });
        }
    }
}

/// Collects who wants a wire.
struct Contest<'c> {
    now: Instant,
    bit_ns: u64,
    /// Those that take part, contenders included.
    listeners: usize,
    /// Whether nobody waits for anything but a frame.
    all_idle: bool,
    retry_at: Instant,
    contenders: &'c mut Vec<(Sender, Frame)>,
}

impl Contest<'_> {
    #[inline]
    fn enter(&mut self, port: &mut Port, sender: Sender, frame: Option<Frame>) {
        let protocol = &mut port.protocol;
        protocol.rest(self.now, self.bit_ns);
        let is_idle = protocol.is_idle();
        self.listeners += usize::from(is_idle);
        self.all_idle &= is_idle || !protocol.is_on();
        if let Some(frame) = frame {
            match port.may_send_at(self.now) {
                at if at <= self.now => self.contenders.push((sender, frame)),
                at => self.retry_at = self.retry_at.min(at),
            }
        }
    }
}
