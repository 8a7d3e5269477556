//! Acts upon the wire that are going on.

use can::Frame;
use canopen::Instant;

use super::Bus;
use crate::drive::VirtualDrive;
use crate::medium::{Sender, Spoilt};
use crate::place::Place;
use crate::wire_act::{ImpossibleAct, Participant, WhichFrames, WireAct, WireFault};

/// What is going on.
#[derive(Debug, Default)]
pub(super) struct Acts {
    /// Those that are about frames.
    pending: Vec<WireAct>,
    /// What is broken of the cable, and until when.
    faults: Vec<(WireFault, Instant)>,
}

impl Acts {
    /// A frame begins: what is done to it?
    #[inline]
    pub(super) fn meet(&mut self, frame: &Frame, senders: &[Sender]) -> Spoilt {
        if self.pending.is_empty() {
            return Spoilt::default();
        }
        self.meet_pending(frame, senders)
    }

    fn meet_pending(&mut self, frame: &Frame, senders: &[Sender]) -> Spoilt {
        let mut spoilt = Spoilt::default();
        let is_met = |frames: &mut WhichFrames| {
            let senders = senders.iter().map(|sender| sender.participant());
            if !frames.fits(frame, senders) {
                return false;
            }
            if frames.skip > 0 {
                frames.skip -= 1;
                return false;
            }
            frames.times -= 1;
            true
        };
        for act in &mut self.pending {
            let (WireAct::Flip { frames, .. } | WireAct::Lose { frames, .. }) = act else {
                continue;
            };
            let is_met = is_met(frames);
            match act {
                WireAct::Flip { bit, seen_by, .. } if is_met => {
                    spoilt.flips.push((bit.number_in(frame), *seen_by));
                }
                WireAct::Lose { receiver, .. } if is_met => spoilt.lost_at.push(*receiver),
                _ => {}
            }
        }
        self.pending.retain(|act| match act {
            WireAct::Flip { frames, .. } | WireAct::Lose { frames, .. } => frames.times > 0,
            _ => false,
        });
        spoilt
    }

    /// What the cable did to the bit that ends now: of two levels the dominant one prevails.
    #[inline]
    pub(super) fn fault(&self, now: Instant) -> Option<WireFault> {
        let mut prevails = None;
        for (fault, _) in self.faults.iter().filter(|(_, until)| now <= *until) {
            if prevails != Some(WireFault::Dominant) {
                prevails = Some(*fault);
            }
        }
        prevails
    }

    /// Whether the cable is broken from now on.
    #[inline]
    pub(super) fn is_cable_broken(&self, now: Instant) -> bool {
        self.faults.iter().any(|(_, until)| now < *until)
    }

    /// Whether the cable is dominant from now on.
    #[inline]
    pub(super) fn is_held_dominant(&self, now: Instant) -> bool {
        let mut faults = self.faults.iter();
        faults.any(|(fault, until)| *fault == WireFault::Dominant && now < *until)
    }
}

impl Bus {
    /// Something is done to the wire on purpose, from now on. It goes on until its time is over or
    /// its frames have been met; several acts may go on at once.
    ///
    /// What comes of it follows from the protocol alone: see `docs/can-medium.md`.
    ///
    /// # Errors
    /// [`ImpossibleAct`]; nothing was done then.
    pub fn act(&mut self, act: WireAct) -> Result<(), ImpossibleAct> {
        let places: Vec<Place> = self.drives.iter().map(VirtualDrive::place).collect();
        act.check_drives(&places)?;
        // What is due now comes first, as in a replay.
        self.run_until(self.now);
        self.act_now(act);
        Ok(())
    }

    /// An act that is known to be possible, in the midst of what happens at this instant.
    pub(crate) fn act_now(&mut self, act: WireAct) {
        let now = self.now;
        match act {
            WireAct::Flip { .. } | WireAct::Lose { .. } => self.acts.pending.push(act),
            WireAct::Hold { who, for_ns } => {
                if let Some(port) = self.port(who) {
                    port.hold(now.plus_ns(for_ns));
                }
            }
            WireAct::Flood {
                frame,
                every_ns,
                for_ns,
            } => {
                let wire = self.gateway.port.wire().bit_rate;
                self.stranger.port.tune(wire, now);
                let until = now.plus_ns(for_ns);
                self.stranger.flood(frame, every_ns, now, until);
                self.media.contend(self.stranger.port.wire());
            }
            WireAct::Disconnect(who) => self.move_to_wire(who, Some(who)),
            WireAct::Connect(who) => self.move_to_wire(who, None),
            WireAct::Break { fault, for_ns } => self.break_cable(fault, now.plus_ns(for_ns)),
        }
    }

    fn break_cable(&mut self, fault: WireFault, until: Instant) {
        let now = self.now;
        let faults = &mut self.acts.faults;
        faults.retain(|(_, until)| now <= *until);
        faults.push((fault, until));
        for n in 0..self.media.count() {
            let medium = self.media.nth(n);
            let is_common = medium.wire.cut_off.is_none();
            if is_common && (fault == WireFault::Dominant || !medium.is_idle(self.now)) {
                self.go_into_bits(n);
            }
        }
    }

    /// Somebody is cut off, or connected again, whatever is on the wires at that moment.
    fn move_to_wire(&mut self, who: Participant, cut_off: Option<Participant>) {
        let now = self.now;
        let Some(port) = self.port(who) else { return };
        let old = port.wire();
        port.cut_off(cut_off);
        let new = port.wire();
        if new == old {
            return;
        }
        if let Some(port) = self.port(who) {
            port.cut_off(old.cut_off);
        }
        let numbers = [old, new].map(|wire| self.media.number(wire));
        for n in numbers {
            if !self.media.nth(n).is_idle(now) {
                self.go_into_bits(n);
            }
        }
        let [was_on, comes_to] = numbers;
        let phase = self.media.nth(was_on).ends;
        let Some(port) = self.port(who) else { return };
        port.cut_off(cut_off);
        let protocol = &mut port.protocol;
        if protocol.is_at_rest() {
            protocol.leave(now);
        }
        let takes_part = !protocol.is_at_rest();
        let medium = self.media.nth(comes_to);
        if takes_part && !medium.is_in_bits() {
            // It is in the middle of something, alone with itself or with others who are idle.
            self.go_into_bits(comes_to);
            let medium = self.media.nth(comes_to);
            if phase > now && phase < medium.ends {
                medium.ends = phase;
            }
        }
        if self.media.nth(comes_to).is_in_bits()
            && let Some(port) = self.port(who)
        {
            port.protocol.observe();
        }
        self.media.nth(comes_to).contended = true;
        self.due_is_stale = true;
    }
}
