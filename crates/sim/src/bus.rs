//! One simulated bus: a medium, its drives, the gateway, and the order of events.

use can::Frame;
use canopen::{Instant, NodeId};

use crate::drive::{DriveSettings, VirtualDrive};
use crate::gateway::Gateway;
use crate::medium::{InFlight, Medium, Sender, Traffic};
use crate::notice::{Notice, NoticeKind};
use crate::probe::ProbeSample;

/// What a bus is.
#[derive(Debug)]
pub struct BusSettings {
    /// Everything random follows from it.
    pub seed: u64,
    /// The drives, of different node IDs.
    pub drives: Vec<DriveSettings>,
}

/// A simulated bus.
#[derive(Debug)]
pub struct Bus {
    now: Instant,
    medium: Medium,
    drives: Vec<VirtualDrive>,
    /// When each drive must be polled next, side by side: it is looked at with every event.
    due: Vec<Instant>,
    /// A drive may have changed from outside, so `due` is to be made anew.
    due_is_stale: bool,
    /// A drive may wait for the wire.
    contended: bool,
    gateway: Gateway,
    traffic: Vec<Traffic>,
    notices: Vec<Notice>,
    probe: Option<(u64, Instant)>,
    samples: Vec<ProbeSample>,
    contenders: Vec<(Sender, Frame)>,
}

impl Bus {
    /// A bus at time 0, its drives about to boot.
    pub fn new(settings: BusSettings) -> Bus {
        let seed = settings.seed;
        let mut drives: Vec<VirtualDrive> = settings
            .drives
            .into_iter()
            .map(|drive| VirtualDrive::new(drive, seed))
            .collect();
        drives.sort_by_key(VirtualDrive::node);
        Bus {
            now: Instant::ZERO,
            medium: Medium::new(),
            due: Vec::with_capacity(drives.len()),
            due_is_stale: true,
            contended: false,
            drives,
            gateway: Gateway::default(),
            traffic: Vec::new(),
            notices: Vec::new(),
            probe: None,
            samples: Vec::new(),
            contenders: Vec::new(),
        }
    }

    /// The present time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// The drives, in the order of their node IDs.
    pub fn drives(&self) -> &[VirtualDrive] {
        &self.drives
    }

    /// The drive of that node ID.
    pub fn drive(&mut self, node: NodeId) -> Option<&mut VirtualDrive> {
        self.due_is_stale = true;
        self.drives.iter_mut().find(|drive| drive.node() == node)
    }

    /// An outside program sends a frame now. It goes onto the wire when it wins arbitration. Call
    /// [`Bus::run_until`] with the present time before each call, as [`crate::replay()`] does: of
    /// frames sent at one instant the first then takes a free wire, also in a replay.
    pub fn send(&mut self, client: u32, frame: Frame) {
        self.gateway.push(client, frame);
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

    /// Samples every drive's plant each `every_ns` from now on.
    pub fn probe_every(&mut self, every_ns: u64) {
        self.probe = Some((every_ns.max(1), self.now));
    }

    /// Samples since the last call.
    pub fn take_samples(&mut self) -> Vec<ProbeSample> {
        std::mem::take(&mut self.samples)
    }

    /// Time for which the wire was busy since the start, ns.
    pub fn busy_ns(&self) -> u64 {
        self.medium.busy_ns()
    }

    /// When something happens next beside plants and loops, which meet others only there.
    fn next_event(&self) -> Instant {
        let mut next = self.medium.ends;
        for due in &self.due {
            next = next.min(*due);
        }
        if let Some((_, at)) = self.probe {
            next = next.min(at);
        }
        let contended = self.contended || self.gateway.waiting() > 0;
        if contended && self.medium.ends == Instant::NEVER {
            next = next.min(self.medium.idle_at.max(self.now));
        }
        next
    }

    /// Looks at every drive, if anyone outside may have changed one.
    fn refresh(&mut self) {
        if self.due_is_stale {
            self.due_is_stale = false;
            self.contended = true;
            self.due.clear();
            self.due
                .extend(self.drives.iter().map(VirtualDrive::next_poll));
        }
    }

    /// Plants and loops up to `until` and at it. Between two events each drive is on its own, so
    /// its periods run one after the other, with all that they need at hand.
    fn control_to(&mut self, until: Instant) {
        for drive in &mut self.drives {
            while drive.next_control() <= until {
                drive.control();
            }
        }
    }

    /// Everything else that happens at this instant, in the stated order; plants and loops have
    /// come to it already.
    fn step(&mut self) {
        let now = self.now;
        self.sample();
        // Frames.
        if let Some(ended) = self.medium.take_ended(now) {
            self.deliver(ended);
        }
        // Polls.
        let notices = &mut self.notices;
        for (drive, due) in self.drives.iter_mut().zip(&mut self.due) {
            if now >= *due {
                let node = drive.node();
                drive.poll(now, &mut |kind| {
                    notices.push(Notice {
                        at: now,
                        node,
                        kind,
                    });
                });
                *due = drive.next_poll();
                self.contended |= drive.controller.contender().is_some();
            }
        }
        // Arbitration.
        if self.medium.is_idle(now) {
            self.arbitrate();
        }
    }

    fn arbitrate(&mut self) {
        self.contenders.clear();
        for drive in &self.drives {
            if let Some(frame) = drive.controller.contender() {
                self.contenders.push((Sender::Drive(drive.node()), frame));
            }
        }
        self.contended = !self.contenders.is_empty();
        if let Some((client, frame)) = self.gateway.contender() {
            self.contenders.push((Sender::Outside(client), frame));
        }
        self.medium.arbitrate(self.now, &self.contenders);
    }

    fn deliver(&mut self, ended: InFlight) {
        let now = self.now;
        match ended {
            InFlight::Frame { frame, senders } => {
                for (drive, due) in self.drives.iter_mut().zip(&mut self.due) {
                    if senders.contains(&Sender::Drive(drive.node())) {
                        drive.errors.transmitted();
                        drive.controller.sent(frame);
                        drive.fill_mailboxes();
                        self.contended |= drive.controller.contender().is_some();
                    } else {
                        drive.errors.received();
                        drive.hear(frame, now);
                    }
                    *due = drive.next_poll();
                }
                for sender in &senders {
                    if let Sender::Outside(client) = sender {
                        self.gateway.sent(*client);
                    }
                }
                if let Some(sender) = senders.first() {
                    self.traffic.push(Traffic {
                        at: now,
                        frame,
                        sender: *sender,
                    });
                }
            }
            InFlight::Collision { senders } => {
                for (drive, due) in self.drives.iter_mut().zip(&mut self.due) {
                    if !senders.contains(&Sender::Drive(drive.node())) {
                        drive.errors.receive_error();
                    } else if drive.errors.transmit_error(now) {
                        drive.controller.clear();
                        self.notices.push(Notice {
                            at: now,
                            node: drive.node(),
                            kind: NoticeKind::BusOff,
                        });
                    }
                    *due = drive.next_poll();
                }
                self.contended = true;
            }
        }
    }

    fn sample(&mut self) {
        let Some((every_ns, at)) = &mut self.probe else {
            return;
        };
        if self.now < *at {
            return;
        }
        *at = at.plus_ns(*every_ns);
        for drive in &mut self.drives {
            let node = drive.node();
            let feedback = drive.core().map(drive::Drive::feedback);
            let truth = drive.plant().truth();
            self.samples.push(ProbeSample {
                at: self.now,
                node,
                position_turns: truth.position_turns(),
                speed_rad_s: truth.speed_rad_s,
                current_a: feedback.map_or(0.0, |feedback| feedback.current_q_a),
                demand_counts: feedback.map_or(0, |feedback| feedback.demand_position),
                position_counts: feedback.map_or(0, |feedback| feedback.position),
            });
        }
    }
}
