//! One simulated bus: a medium, its drives, the gateway, and the order of events.

mod acts;
mod arbitrate;
mod bits;

use can::{BitRate, Frame};
use canopen::{Instant, NodeId};

use crate::disturbance::{Disturbance, Disturbed};
use crate::drive::{DriveSettings, VirtualDrive};
use crate::error_frame::ErrorSeen;
use crate::gateway::Gateway;
use crate::medium::{ErrorCounters, Event, Media, Sender, Traffic};
use crate::notice::{Happening, Notice, NoticeKind};
use crate::place::Place;
use crate::probe::ProbeSample;
use crate::scenario::{Runner, Scenario};
use crate::stranger::Stranger;
use crate::wire_act::Participant;

use acts::Acts;

/// What a bus is.
#[derive(Debug)]
pub struct BusSettings {
    /// Everything random follows from it.
    pub seed: u64,
    /// The bit rate of outside programs, and of each drive in which LSS has stored no other.
    pub bit_rate: BitRate,
    /// What is done to frames between outside programs and the bus.
    pub disturbance: Disturbance,
    /// Whether error messages of the controller of outside programs are kept
    /// ([`Happening::Error`]).
    pub error_frames: bool,
    /// The drives, at different places.
    pub drives: Vec<DriveSettings>,
    /// What happens to them, if anything: [`Scenario::set_up`] puts it here.
    pub scenario: Option<Scenario>,
}

impl BusSettings {
    /// A bus of 1 Mbit/s, undisturbed.
    pub fn new(seed: u64, drives: Vec<DriveSettings>) -> BusSettings {
        BusSettings {
            seed,
            bit_rate: BitRate::Mbit1,
            disturbance: Disturbance::default(),
            error_frames: false,
            drives,
            scenario: None,
        }
    }
}

/// A simulated bus.
#[derive(Debug)]
pub struct Bus {
    now: Instant,
    media: Media,
    drives: Vec<VirtualDrive>,
    /// When each drive must be polled next, side by side: it is looked at with every event.
    due: Vec<Instant>,
    /// A drive may have changed from outside, so `due` is to be made anew.
    due_is_stale: bool,
    /// When the first of the drives has its next control period.
    control_due: Instant,
    busy_ns: u64,
    gateway: Gateway,
    stranger: Stranger,
    traffic: Vec<Traffic>,
    notices: Vec<Notice>,
    probe: Option<(u64, Instant)>,
    samples: Vec<ProbeSample>,
    contenders: Vec<(Sender, Frame)>,
    events: Vec<(Participant, Event)>,
    /// Error messages, if they are kept.
    errors: Option<Vec<ErrorSeen>>,
    runner: Option<Runner>,
    /// Acts that are not over.
    acts: Acts,
    /// Every frame is looked at bit by bit.
    every_bit: bool,
}

impl Bus {
    /// A bus at time 0, its drives about to boot.
    pub fn new(settings: BusSettings) -> Bus {
        let (seed, bit_rate) = (settings.seed, settings.bit_rate);
        let mut drives: Vec<VirtualDrive> = settings
            .drives
            .into_iter()
            .map(|drive| VirtualDrive::new(drive, seed, bit_rate))
            .collect();
        drives.sort_by_key(VirtualDrive::place);
        Bus {
            now: Instant::ZERO,
            media: Media::default(),
            due: Vec::with_capacity(drives.len()),
            due_is_stale: true,
            control_due: Instant::ZERO,
            busy_ns: 0,
            drives,
            gateway: Gateway::new(bit_rate, settings.disturbance, seed),
            stranger: Stranger::new(bit_rate),
            traffic: Vec::new(),
            notices: Vec::new(),
            probe: None,
            samples: Vec::new(),
            contenders: Vec::new(),
            events: Vec::new(),
            errors: settings.error_frames.then(Vec::new),
            acts: Acts::default(),
            every_bit: false,
            runner: settings.scenario.as_ref().map(Runner::new),
        }
    }

    /// The present time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// The bit rate of outside programs. When one of them, as LSS master, has the drives activate
    /// another, theirs is changed with the first drive, as its user would set the interface anew.
    pub fn bit_rate(&self) -> BitRate {
        self.gateway.bit_rate()
    }

    /// The drives, in the order of their places.
    pub fn drives(&self) -> &[VirtualDrive] {
        &self.drives
    }

    pub(crate) fn drives_mut(&mut self) -> &mut [VirtualDrive] {
        &mut self.drives
    }

    /// The first drive that has that node ID now.
    pub fn drive(&mut self, node: NodeId) -> Option<&mut VirtualDrive> {
        self.due_is_stale = true;
        let mut drives = self.drives.iter_mut();
        drives.find(|drive| drive.node() == Some(node))
    }

    /// The drive at that place.
    pub fn drive_at(&mut self, place: Place) -> Option<&mut VirtualDrive> {
        self.due_is_stale = true;
        let mut drives = self.drives.iter_mut();
        drives.find(|drive| drive.place() == place)
    }

    /// An outside program sends a frame now. It goes onto the wire when it wins arbitration. Call
    /// [`Bus::run_until`] with the present time before each call, as [`crate::replay()`] does: of
    /// frames sent at one instant the first then takes a free wire, also in a replay.
    ///
    /// How often it goes onto the wire: once, unless the bus is disturbed.
    pub fn send(&mut self, client: u32, frame: Frame) -> u8 {
        self.media.contend(self.gateway.port.wire());
        self.gateway.push(client, frame)
    }

    /// Plays every frame bit by bit from now on, also those that nothing can happen to. That is
    /// much slower and makes no difference; tests compare the two.
    pub fn look_at_every_bit(&mut self) {
        self.every_bit = true;
    }

    /// The error counters of the controller that outside programs share.
    pub fn outside_error_counters(&self) -> ErrorCounters {
        self.gateway.port.protocol.counters
    }

    /// Whose frames were lost because the controller of outside programs went bus-off, since the
    /// last call: a program's number for each frame.
    pub fn take_dropped(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.gateway.dropped)
    }

    /// What [`BusSettings::disturbance`] has done to frames on the way to the bus, and from it.
    pub fn disturbed(&self) -> [Disturbed; 2] {
        self.gateway.disturbed()
    }

    /// Outside frames that wait for the wire.
    pub fn outside_waiting(&self) -> usize {
        self.gateway.waiting()
    }

    /// Moves time to `until`. How often it is called, and with which steps, makes no difference.
    pub fn run_until(&mut self, until: Instant) {
        self.refresh();
        loop {
            let next = self.next_event();
            self.control_to(next.min(until));
            if next > until {
                break;
            }
            self.now = self.now.max(next);
            self.step();
        }
        self.now = self.now.max(until);
    }

    /// Moves time to the end of the next frame, or to `until`; whether there was a frame. Call
    /// after [`Bus::take_traffic`].
    pub fn run_to_frame(&mut self, until: Instant) -> bool {
        self.refresh();
        loop {
            let next = self.next_event();
            // What happens at the instant of a frame is brought to its end.
            if !self.traffic.is_empty() && next > self.now {
                return true;
            }
            self.control_to(next.min(until));
            if next > until {
                self.now = self.now.max(until);
                return false;
            }
            self.now = self.now.max(next);
            self.step();
        }
    }

    /// Frames that went over the wire since the last call, in order.
    pub fn take_traffic(&mut self) -> Vec<Traffic> {
        std::mem::take(&mut self.traffic)
    }

    /// What people should know of, since the last call.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }

    /// Both, in the order in which they happened.
    pub fn take_happenings(&mut self) -> Vec<Happening> {
        let errors = self.errors.as_mut().map(std::mem::take).unwrap_or_default();
        Happening::merge(self.take_traffic(), self.take_notices(), errors)
    }

    /// Samples every drive's plant each `every_ns` from now on.
    pub fn probe_every(&mut self, every_ns: u64) {
        self.probe = Some((every_ns.max(1), self.now));
    }

    /// Samples since the last call.
    pub fn take_samples(&mut self) -> Vec<ProbeSample> {
        std::mem::take(&mut self.samples)
    }

    /// Time for which the wire was busy since the start, as outside programs see it, ns: interframe
    /// spaces included, and what has another bit rate left out.
    pub fn busy_ns(&self) -> u64 {
        self.busy_ns
    }

    /// When something happens next beside plants and loops, which meet others only there.
    fn next_event(&self) -> Instant {
        let mut next = Instant::NEVER;
        for medium in self.media.iter() {
            next = next.min(medium.ends);
            if medium.ends == Instant::NEVER {
                let at = if medium.contended {
                    Instant::ZERO
                } else {
                    medium.retry_at
                };
                if at != Instant::NEVER {
                    next = next.min(at.max(medium.idle_at).max(self.now));
                }
            }
        }
        for due in &self.due {
            next = next.min(*due);
        }
        if let Some((_, at)) = self.probe {
            next = next.min(at);
        }
        if let Some(runner) = &self.runner {
            next = next
                .min(runner.next_due())
                .min(runner.next_look(&self.drives));
        }
        next.min(self.next_of_others())
    }

    /// Looks at every drive, if anyone outside may have changed one.
    fn refresh(&mut self) {
        if self.due_is_stale {
            self.due_is_stale = false;
            self.media.contend(self.gateway.port.wire());
            for drive in &self.drives {
                self.media.contend(drive.controller.port.wire());
            }
            self.due.clear();
            self.due
                .extend(self.drives.iter().map(VirtualDrive::next_poll));
        }
    }

    /// Plants and loops up to `until` and at it. Between two events each drive is on its own, so
    /// its periods run one after the other, with all that they need at hand.
    fn control_to(&mut self, until: Instant) {
        if until < self.control_due {
            return;
        }
        self.control_due = Instant::NEVER;
        for pair in self.drives.chunks_mut(2) {
            if let [one, other] = pair {
                while one.next_control() == other.next_control() && one.next_control() <= until {
                    one.control_both(other);
                }
            }
            for drive in pair {
                while drive.next_control() <= until {
                    drive.control();
                }
                self.control_due = self.control_due.min(drive.next_control());
            }
        }
    }

    /// Everything else that happens at this instant, in the stated order; plants and loops have
    /// come to it already.
    fn step(&mut self) {
        let now = self.now;
        self.sample();
        // Frames.
        for n in 0..self.media.count() {
            let medium = self.media.nth(n);
            if now < medium.ends {
                continue;
            }
            match medium.take_ended(now) {
                Some(ended) => self.deliver(&ended),
                None => self.bit(n),
            }
        }
        self.play_scenario();
        // Polls.
        self.poll_others();
        let mut left = Vec::new();
        let notices = &mut self.notices;
        for (drive, due) in self.drives.iter_mut().zip(&mut self.due) {
            if now >= *due {
                let port = &drive.controller.port;
                let (wire, was_on) = (port.wire(), port.protocol.is_on());
                let (place, node, booted) = (drive.place(), drive.node(), drive.is_booting());
                drive.poll(now, &mut |kind| {
                    notices.push(Notice {
                        at: now,
                        who: Some(Participant::Drive(place)),
                        node,
                        kind,
                    });
                });
                let port = &drive.controller.port;
                if was_on && (wire != port.wire() || !port.protocol.is_on()) {
                    left.push(wire);
                }
                *due = drive.next_poll();
                let (own, common) = (drive.bit_rate(), self.gateway.bit_rate());
                if booted && !drive.is_booting() && own != common {
                    notices.push(Notice {
                        at: now,
                        who: Some(Participant::Drive(place)),
                        node: drive.node(),
                        kind: NoticeKind::OtherBitRate {
                            drive: own,
                            bus: common,
                        },
                    });
                }
                if let Some(bit_rate) = drive.take_changed_rate() {
                    let wire = self.gateway.port.wire();
                    self.gateway.drive_changed(bit_rate, now);
                    if wire != self.gateway.port.wire() {
                        left.push(wire);
                    }
                    self.media.contend(self.gateway.port.wire());
                }
                if drive.controller.contender().is_some() {
                    self.media.contend(drive.controller.port.wire());
                }
            }
        }
        for wire in left {
            // It may have been sending.
            let n = self.media.number(wire);
            if self.media.nth(n).carries_frame() {
                self.go_into_bits(n);
            }
        }
        self.play_scenario();
        // Arbitration.
        for n in 0..self.media.count() {
            if self.media.nth(n).is_idle(now) {
                self.arbitrate(n);
            }
        }
    }

    /// Does what the scenario has for this instant.
    #[inline]
    fn play_scenario(&mut self) {
        let Some(mut runner) = self.runner.take() else {
            return;
        };
        let at = self.now;
        runner.look(&self.drives, at);
        while let Some(doing) = runner.take_due(at) {
            let words = doing.perform(self);
            let notices = words.into_iter().map(|words| Notice {
                at,
                who: None,
                node: None,
                kind: NoticeKind::Scenario(words),
            });
            self.notices.extend(notices);
            for (drive, due) in self.drives.iter().zip(&mut self.due) {
                *due = drive.next_poll();
            }
        }
        self.runner = Some(runner);
    }

    /// Keeps SYNC messages of outside programs from the bus, or lets them pass.
    pub(crate) fn hold_sync(&mut self, held: bool) {
        self.gateway.hold_sync(held);
    }

    fn sample(&mut self) {
        let Some((every_ns, at)) = &mut self.probe else {
            return;
        };
        if self.now < *at {
            return;
        }
        *at = at.plus_ns(*every_ns);
        for drive in &self.drives {
            let core = drive.core();
            let mut feedbacks = core.into_iter().flat_map(drive::Drive::feedbacks);
            for (axis, world) in drive.worlds().iter().enumerate() {
                let feedback = feedbacks.next();
                let truth = world.truth();
                self.samples.push(ProbeSample {
                    at: self.now,
                    place: drive.place(),
                    axis,
                    position_turns: truth.position_turns(),
                    speed_rad_s: truth.speed_rad_s,
                    current_a: feedback.map_or(0.0, |feedback| feedback.current_q_a),
                    demand_counts: feedback.map_or(0, |feedback| feedback.demand_position),
                    position_counts: feedback.map_or(0, |feedback| feedback.position),
                });
            }
        }
    }
}
