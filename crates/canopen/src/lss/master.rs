//! The master: one job at a time, each of one or several requests.

use can::Frame;

use super::request::node_id_byte;
use super::{
    Answer, BitTiming, Bound, Identity, Known, Part, Refusal, Request, Scan, ScanEnd, State,
    UNCONFIGURED,
};
use crate::{Instant, NodeId};

/// How long a master waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// For an answer, in milliseconds.
    pub answer_ms: u16,
    /// For the answer to "store configuration", in milliseconds: flash takes its time.
    pub store_ms: u16,
    /// For an answer that may stay away because nobody is meant (fastscan, identify), in
    /// milliseconds. A device that is slower is taken for one that does not agree.
    pub scan_ms: u16,
    /// After such an answer, for others that agree, too, in milliseconds. An answer that comes
    /// later still would be taken for one to the next question.
    pub settle_ms: u16,
    /// Behind a request that is not answered, before the next, in milliseconds.
    pub gap_ms: u16,
    /// How often an unanswered request is made in all, at least once.
    pub attempts: u8,
}

impl Default for Settings {
    /// 500 ms, 5 s to store, 20 ms in scans, 3 ms to settle, 1 ms between requests, two attempts.
    /// A scan takes at most 0.5 s for the zeros and 40 ms for each bit that is 1.
    fn default() -> Settings {
        Settings {
            answer_ms: 500,
            store_ms: 5_000,
            scan_ms: 20,
            settle_ms: 3,
            gap_ms: 1,
            attempts: 2,
        }
    }
}

/// What a master can be asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Bring all slaves into a state. Ends with [`Outcome::Done`], for there is no answer. A slave
    /// that has got a node ID while unconfigured boots when it is sent to waiting.
    Switch(State),
    /// Bring all slaves to waiting, then this one to configuration.
    Select(Identity),
    /// Give the slave in configuration a pending node ID; `None` is 0xFF.
    ConfigureNodeId(Option<NodeId>),
    /// Give the slave in configuration a pending bit timing.
    ConfigureBitTiming(BitTiming),
    /// Let all slaves in configuration change their bit timing. Ends with [`Outcome::Done`] when
    /// it is sent: the owner has to change its own after `delay_ms` and be silent for that time
    /// twice.
    ActivateBitTiming {
        /// Length of each of the two delays, in milliseconds.
        delay_ms: u16,
    },
    /// Let the slave in configuration store both.
    Store,
    /// Ask the slave in configuration for its identity.
    InquireIdentity,
    /// Ask the slave in configuration for its active node ID.
    InquireNodeId,
    /// Is there a slave with the vendor ID and product code of `low`, and revision and serial
    /// number from those of `low` to those of `high`?
    Identify {
        /// The least numbers.
        low: Identity,
        /// The greatest numbers; vendor ID and product code do not count.
        high: Identity,
    },
    /// Is there an unconfigured slave?
    IdentifyNonConfigured,
    /// Find an unconfigured slave in waiting, and bring it to configuration.
    Fastscan(Known),
}

/// How a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is done.
    Done,
    /// The slave refused.
    Refused(Refusal),
    /// The identity that was inquired.
    Identity(Identity),
    /// The node ID that was inquired; `None` is 0xFF.
    NodeId(Option<NodeId>),
    /// The slave says that its node ID is this, and there is no such node ID.
    NoNodeId(u8),
    /// Whether there is one, for both "identify" services.
    Present(bool),
    /// How fastscan ended.
    Scanned(ScanEnd),
    /// No answer to any attempt.
    TimedOut,
}

/// The master has a job already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Busy;

impl core::fmt::Display for Busy {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the LSS master has a job already")
    }
}

impl core::error::Error for Busy {}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Nothing to do.
    Idle,
    /// A request that is not answered is out.
    Gap,
    /// A request that is answered is out.
    Asked,
    /// Somebody answered; others may.
    Settling,
}

/// An LSS master (CiA 305). There must be one only on a bus.
///
/// After every call that may give it something to say, take the frames from
/// [`Master::transmit`].
#[derive(Clone, Copy, Debug)]
pub struct Master {
    settings: Settings,
    job: Job,
    phase: Phase,
    deadline: Instant,
    /// Which request of the job is out.
    step: u8,
    attempt: u8,
    inquired: Identity,
    scan: Scan,
    out: Option<Request>,
    outcome: Option<Outcome>,
}

impl Master {
    /// A master without a job.
    pub const fn new(settings: Settings) -> Master {
        Master {
            settings,
            job: Job::InquireNodeId,
            phase: Phase::Idle,
            deadline: Instant::NEVER,
            step: 0,
            attempt: 1,
            inquired: Identity {
                vendor: 0,
                product: 0,
                revision: 0,
                serial: 0,
            },
            scan: Scan::new(Known::NOTHING),
            out: None,
            outcome: None,
        }
    }

    /// Begins a job. An outcome that nobody took is dropped.
    ///
    /// # Errors
    /// [`Busy`] until the job before has ended.
    pub fn start(&mut self, job: Job, now: Instant) -> Result<(), Busy> {
        if self.phase != Phase::Idle {
            return Err(Busy);
        }
        self.job = job;
        self.outcome = None;
        self.step = 0;
        self.attempt = 1;
        if let Job::Fastscan(known) = job {
            self.scan = Scan::new(known);
        }
        self.ask(now);
        Ok(())
    }

    /// Gives a job up; there is no outcome.
    pub fn cancel(&mut self) {
        self.phase = Phase::Idle;
        self.deadline = Instant::NEVER;
        self.out = None;
    }

    /// How the job ended; once.
    pub fn take_outcome(&mut self) -> Option<Outcome> {
        self.outcome.take()
    }

    /// How many questions of a fastscan have been answered, by word or by silence; at most 133.
    pub const fn scanned(&self) -> u16 {
        self.scan.asked()
    }

    /// The next frame to send.
    pub fn transmit(&mut self) -> Option<Frame> {
        self.out.take().map(Request::frame)
    }

    /// When [`Master::poll`] has something to do.
    pub const fn next_deadline(&self) -> Instant {
        self.deadline
    }

    /// Takes a frame; others than LSS answers are ignored.
    pub fn receive(&mut self, frame: &Frame, now: Instant) {
        if let (Phase::Asked, Some(answer)) = (self.phase, Answer::from_frame(frame)) {
            self.answered(answer, now);
        }
    }

    /// Lets time pass.
    pub fn poll(&mut self, now: Instant) {
        if now < self.deadline || self.deadline == Instant::NEVER {
            return;
        }
        match self.phase {
            Phase::Idle => self.deadline = Instant::NEVER,
            Phase::Gap => self.next_step(now),
            Phase::Asked => self.timed_out(now),
            Phase::Settling => self.heard(true, now),
        }
    }

    /// Sends the request of the present step.
    fn ask(&mut self, now: Instant) {
        let request = request(self.job, self.step, &self.scan);
        self.out = Some(request);
        let settings = &self.settings;
        let (phase, wait_ms) = match request {
            Request::SwitchGlobal(_)
            | Request::ActivateBitTiming { .. }
            | Request::SwitchSelective(Part::Vendor | Part::Product | Part::Revision, _) => {
                (Phase::Gap, settings.gap_ms)
            }
            Request::Identify(bound, _) if bound != Bound::SerialHigh => {
                (Phase::Gap, settings.gap_ms)
            }
            Request::Store => (Phase::Asked, settings.store_ms),
            Request::Fastscan { .. } | Request::Identify(..) | Request::IdentifyNonConfigured => {
                (Phase::Asked, settings.scan_ms)
            }
            _ => (Phase::Asked, settings.answer_ms),
        };
        self.phase = phase;
        self.deadline = now.plus_ms(u64::from(wait_ms));
    }

    fn end(&mut self, outcome: Outcome) {
        self.phase = Phase::Idle;
        self.deadline = Instant::NEVER;
        self.outcome = Some(outcome);
    }

    /// The step is over; the next, or the end.
    fn next_step(&mut self, now: Instant) {
        self.step = self.step.saturating_add(1);
        if self.step < steps(self.job) {
            // An attempt at a sequence that is answered as a whole goes on.
            if self.phase == Phase::Asked {
                self.attempt = 1;
            }
            self.ask(now);
        } else {
            self.end(match self.job {
                Job::InquireIdentity => Outcome::Identity(self.inquired),
                _ => Outcome::Done,
            });
        }
    }

    fn answered(&mut self, answer: Answer, now: Instant) {
        match (self.job, answer) {
            (Job::Select(_), Answer::Selected) => self.next_step(now),
            (Job::InquireIdentity, Answer::Identity(part, number))
                if part.number() == self.step =>
            {
                self.inquired.set(part, number);
                self.next_step(now);
            }
            (Job::InquireNodeId, Answer::NodeId(byte)) => self.end(match NodeId::new(byte) {
                None if byte != UNCONFIGURED => Outcome::NoNodeId(byte),
                id => Outcome::NodeId(id),
            }),
            (Job::ConfigureNodeId(_) | Job::ConfigureBitTiming(_) | Job::Store, answer) => {
                use super::Service;
                let asked = match self.job {
                    Job::ConfigureNodeId(_) => Service::ConfigureNodeId,
                    Job::ConfigureBitTiming(_) => Service::ConfigureBitTiming,
                    _ => Service::Store,
                };
                match answer {
                    Answer::Done(service) if service == asked => self.next_step(now),
                    Answer::Refused(refusal) if refusal.service == asked => {
                        self.end(Outcome::Refused(refusal));
                    }
                    _ => {}
                }
            }
            (Job::Identify { .. } | Job::Fastscan(_), Answer::Identified)
            | (Job::IdentifyNonConfigured, Answer::NonConfigured) => {
                self.phase = Phase::Settling;
                self.deadline = now.plus_ms(u64::from(self.settings.settle_ms));
            }
            _ => {}
        }
    }

    fn timed_out(&mut self, now: Instant) {
        if self.attempt < self.settings.attempts {
            self.attempt = self.attempt.saturating_add(1);
            // These begin from their first number: the slave counts them.
            if matches!(self.job, Job::Select(_) | Job::Identify { .. }) {
                self.step = 0;
            }
            self.ask(now);
            return;
        }
        match self.job {
            Job::Identify { .. } | Job::IdentifyNonConfigured | Job::Fastscan(_) => {
                self.heard(false, now);
            }
            _ => self.end(Outcome::TimedOut),
        }
    }

    /// Somebody agreed or nobody did.
    fn heard(&mut self, somebody: bool, now: Instant) {
        if !matches!(self.job, Job::Fastscan(_)) {
            return self.end(Outcome::Present(somebody));
        }
        match self.scan.answered(somebody) {
            Some(end) => self.end(Outcome::Scanned(end)),
            None => {
                self.attempt = 1;
                self.ask(now);
            }
        }
    }
}

/// How many requests a job is made of. Fastscan has steps of its own.
const fn steps(job: Job) -> u8 {
    match job {
        Job::Select(_) => 5,
        Job::InquireIdentity => 4,
        Job::Identify { .. } => 6,
        _ => 1,
    }
}

/// A job's request of a step; past the last one, the last.
fn request(job: Job, step: u8, scan: &Scan) -> Request {
    let part = |number: u8| Part::from_number(number).unwrap_or(Part::Serial);
    match job {
        Job::Switch(state) => Request::SwitchGlobal(state),
        Job::Select(identity) => match step.checked_sub(1) {
            None => Request::SwitchGlobal(State::Waiting),
            Some(number) => {
                let part = part(number);
                Request::SwitchSelective(part, identity.get(part))
            }
        },
        Job::ConfigureNodeId(id) => Request::ConfigureNodeId(node_id_byte(id)),
        Job::ConfigureBitTiming(timing) => Request::ConfigureBitTiming {
            table: 0,
            index: timing.index(),
        },
        Job::ActivateBitTiming { delay_ms } => Request::ActivateBitTiming { delay_ms },
        Job::Store => Request::Store,
        Job::InquireIdentity => Request::InquireIdentity(part(step)),
        Job::InquireNodeId => Request::InquireNodeId,
        Job::Identify { low, high } => match step {
            0 => Request::Identify(Bound::Vendor, low.vendor),
            1 => Request::Identify(Bound::Product, low.product),
            2 => Request::Identify(Bound::RevisionLow, low.revision),
            3 => Request::Identify(Bound::RevisionHigh, high.revision),
            4 => Request::Identify(Bound::SerialLow, low.serial),
            _ => Request::Identify(Bound::SerialHigh, high.serial),
        },
        Job::IdentifyNonConfigured => Request::IdentifyNonConfigured,
        Job::Fastscan(_) => scan.request(),
    }
}
