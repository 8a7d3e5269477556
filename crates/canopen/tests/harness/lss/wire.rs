//! Slaves, a master, and what lies between them.

use canopen::Instant;
use canopen::lss::{BitTiming, Event, Identity, Job, Known, Master, Outcome, Reply, ScanEnd};
use canopen::lss::{Part, Settings};

use super::Pair;

/// Numbers in their order as an identity.
pub fn identity([vendor, product, revision, serial]: [u32; 4]) -> Identity {
    Identity {
        vendor,
        product,
        revision,
        serial,
    }
}

/// Some slaves, a master, a wire.
#[derive(Debug)]
pub struct Wire {
    pub pairs: Vec<Pair>,
    pub master: Master,
    pub now: Instant,
    pub attempts: u8,
    /// Whether the master has a job.
    pub(super) busy: bool,
}

impl Wire {
    pub fn new(pairs: Vec<Pair>, settings: Settings) -> Wire {
        Wire {
            pairs,
            master: Master::new(settings),
            now: Instant(5_000_000),
            attempts: settings.attempts,
            busy: false,
        }
    }

    pub fn start(&mut self, job: Job) {
        assert_eq!(self.master.start(job, self.now).is_err(), self.busy);
        self.busy = true;
    }

    /// Brings what the master has to say to all slaves and their answers back. `lost` says of each
    /// delivery whether it fails.
    pub fn exchange(&mut self, lost: &mut dyn FnMut() -> bool) {
        self.deliver(lost);
        self.check_master();
    }

    fn deliver(&mut self, lost: &mut dyn FnMut() -> bool) {
        while let Some(frame) = self.master.transmit() {
            assert!(!frame.is_extended() && !frame.is_remote());
            assert_eq!((frame.raw_id(), frame.len()), (0x7E5, 8));
            for at in 0..self.pairs.len() {
                if lost() {
                    continue;
                }
                match self.pairs[at].receive(frame.bytes(), self.now) {
                    Some(Reply::Answer(answer)) if !lost() => {
                        self.master.receive(&answer.frame(), self.now);
                    }
                    Some(Reply::Event(Event::StoreConfiguration { .. })) => {
                        let answer = self.pairs[at].complete(Ok(()));
                        if let Some(bytes) = answer.filter(|_| !lost()) {
                            let frame = can::Frame::classic(0x7E4, bytes, 8);
                            self.master.receive(&frame, self.now);
                        }
                    }
                    _ => {}
                }
            }
        }
    }

    /// Lets `ns` pass, then polls everybody.
    pub fn wait(&mut self, ns: u64) {
        self.now = self.now.plus_ns(ns);
        for pair in &mut self.pairs {
            pair.poll(self.now);
        }
        self.master.poll(self.now);
        self.check_master();
    }

    pub(super) fn check_master(&mut self) {
        self.take_outcome();
    }

    fn take_outcome(&mut self) -> Option<Outcome> {
        let outcome = self.master.take_outcome();
        assert!(self.busy || outcome.is_none(), "{outcome:?} of nothing");
        self.busy &= outcome.is_none();
        assert_eq!(self.busy, self.master.next_deadline() != Instant::NEVER);
        outcome
    }

    /// Without any answer every job ends, after a known number of time-outs.
    pub(super) fn finish(&mut self) {
        let most = 140 * u32::from(self.attempts.max(1)) + 20;
        for _ in 0..most {
            if !self.busy {
                return;
            }
            while self.master.transmit().is_some() {}
            let until = self.master.next_deadline();
            self.now = self.now.max(until);
            self.master.poll(self.now);
            self.check_master();
        }
        assert!(!self.busy, "the job does not end");
    }

    /// Slaves with these identities and node IDs that can do all bit timings.
    pub fn of(slaves: &[([u32; 4], u8)], settings: Settings) -> Wire {
        let pairs = slaves
            .iter()
            .map(|(address, active)| Pair::new(*address, *active, &BitTiming::ALL))
            .collect();
        Wire::new(pairs, settings)
    }

    /// Runs a job to its end on a wire that loses nothing; gives the outcome and the milliseconds
    /// that it took.
    pub fn run(&mut self, job: Job) -> (Outcome, u64) {
        self.run_losing(job, &mut || false)
    }

    /// Runs a job to its end; `lost` says of each delivery whether it fails.
    pub fn run_losing(&mut self, job: Job, lost: &mut dyn FnMut() -> bool) -> (Outcome, u64) {
        let began = self.now;
        self.start(job);
        loop {
            self.deliver(lost);
            if let Some(outcome) = self.take_outcome() {
                return (outcome, self.now.since_ns(began) / 1_000_000);
            }
            self.now = self.now.max(self.master.next_deadline());
            self.master.poll(self.now);
        }
    }

    /// Looks for slaves until none answers any more; gives the identities that were found, in the
    /// order of finding. Without losses that is all there are.
    pub fn find_all(&mut self, known: Known, lost: &mut dyn FnMut() -> bool) -> Vec<Identity> {
        let mut found = Vec::new();
        for _ in 0..1_000 {
            match self.run_losing(Job::Fastscan(known), lost).0 {
                Outcome::Scanned(ScanEnd::Found(identity)) => found.push(identity),
                Outcome::Scanned(ScanEnd::Nobody) => return found,
                Outcome::Scanned(ScanEnd::Lost {
                    part: Part::Serial,
                    tried,
                }) => {
                    found.push(tried);
                }
                Outcome::Scanned(ScanEnd::Lost { .. }) => {}
                other => panic!("{other:?}"),
            }
        }
        panic!("no end, {} found", found.len());
    }
}
