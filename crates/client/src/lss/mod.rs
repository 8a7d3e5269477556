//! Layer setting services from the master's side (CiA 305): node IDs and bit rates over the bus.
//!
//! ```text
//! client.lss().select(identity) → set_node_id → store → switch(State::Waiting)
//! client.lss().find_unconfigured(…)       who has no node ID?
//! client.lss().assign(…)                  a node ID for each of them
//! ```

mod error;
mod find;

use canopen::NodeId;
use canopen::lss::{BitTiming, Identity, Job, Master, Outcome, Settings, State};

use crate::{Client, Link, LinkError};

pub use error::{Cause, LssError, Step};
pub use find::{Assigned, Assignment, Found, Progress};

/// Identifier of LSS answers.
const ANSWERS: u32 = 0x7E4;

/// A client as LSS master. There must be no other on the bus.
#[derive(Debug)]
pub struct Lss<'c, L> {
    client: &'c mut Client<L>,
    selected: Option<Identity>,
    /// Time-outs and attempts; may be changed between calls.
    pub settings: Settings,
}

impl<L: Link> Client<L> {
    /// This client as LSS master, with the default [`Settings`].
    pub fn lss(&mut self) -> Lss<'_, L> {
        Lss {
            client: self,
            selected: None,
            settings: Settings::default(),
        }
    }
}

impl<L: Link> Lss<'_, L> {
    /// Does one job.
    ///
    /// # Errors
    /// The link broke.
    pub async fn run(&mut self, job: Job) -> Result<Outcome, LinkError> {
        self.run_watched(job, &mut |_| ()).await
    }

    /// Does one job; `asked` is told how many questions of a fastscan have been answered.
    async fn run_watched(
        &mut self,
        job: Job,
        asked: &mut dyn FnMut(u16),
    ) -> Result<Outcome, LinkError> {
        self.client.set_aside().await?;
        let mut master = Master::new(self.settings);
        // A new master has no job yet, so it takes this one.
        let _ = master.start(job, self.client.now());
        loop {
            while let Some(frame) = master.transmit() {
                self.client.send(frame).await?;
            }
            if let Some(outcome) = master.take_outcome() {
                return Ok(outcome);
            }
            let heard = self
                .client
                .wait_for(master.next_deadline(), |_, frame| {
                    (frame.key() == ANSWERS).then_some(*frame)
                })
                .await?;
            let now = self.client.now();
            if let Some(frame) = heard {
                master.receive(&frame, now);
            }
            master.poll(now);
            asked(master.scanned());
        }
    }

    /// Brings all devices into a state. Those that got a node ID while they had none boot when they
    /// are sent to waiting.
    ///
    /// # Errors
    /// The link broke.
    pub async fn switch(&mut self, state: State) -> Result<(), LinkError> {
        self.selected = None;
        self.run(Job::Switch(state)).await.map(|_| ())
    }

    /// Brings one device to configuration and all others to waiting.
    ///
    /// # Errors
    /// [`LssError`]: no device with this identity answers.
    pub async fn select(&mut self, identity: Identity) -> Result<(), LssError> {
        self.selected = Some(identity);
        self.done(Job::Select(identity), Step::Select).await
    }

    /// Gives the device in configuration a node ID; `None` makes it unconfigured. A device without
    /// one takes it when it is sent to waiting, others with their next reset of communication.
    ///
    /// # Errors
    /// [`LssError`]: it refuses or does not answer.
    pub async fn set_node_id(&mut self, id: Option<NodeId>) -> Result<(), LssError> {
        self.done(Job::ConfigureNodeId(id), Step::SetNodeId).await
    }

    /// Gives the device in configuration a bit timing, which [`Lss::activate_bit_timing`] makes
    /// active, or the next power-on if it is stored.
    ///
    /// # Errors
    /// [`LssError`]: it refuses or does not answer.
    pub async fn set_bit_timing(&mut self, timing: BitTiming) -> Result<(), LssError> {
        self.done(Job::ConfigureBitTiming(timing), Step::SetBitTiming)
            .await
    }

    /// Lets all devices in configuration change their bit timing after `delay_ms`, and be silent
    /// for that time before and after. The interface of this link has to change its own in between.
    ///
    /// # Errors
    /// The link broke.
    pub async fn activate_bit_timing(&mut self, delay_ms: u16) -> Result<(), LinkError> {
        let job = Job::ActivateBitTiming { delay_ms };
        self.run(job).await.map(|_| ())
    }

    /// Lets the device in configuration store its node ID and bit timing.
    ///
    /// # Errors
    /// [`LssError`]: it refuses or does not answer.
    pub async fn store(&mut self) -> Result<(), LssError> {
        self.done(Job::Store, Step::Store).await
    }

    /// The identity of the device in configuration, of which there must be one only.
    ///
    /// # Errors
    /// [`LssError`]: it does not answer.
    pub async fn inquire_identity(&mut self) -> Result<Identity, LssError> {
        match self
            .ended(Job::InquireIdentity, Step::InquireIdentity)
            .await?
        {
            Outcome::Identity(identity) => Ok(identity),
            _ => Err(self.timed_out(Step::InquireIdentity)),
        }
    }

    /// The active node ID of the device in configuration; `None` if it has none.
    ///
    /// # Errors
    /// [`LssError`]: it does not answer, or with a number that is no node ID.
    pub async fn inquire_node_id(&mut self) -> Result<Option<NodeId>, LssError> {
        match self.ended(Job::InquireNodeId, Step::InquireNodeId).await? {
            Outcome::NodeId(id) => Ok(id),
            Outcome::NoNodeId(byte) => Err(self.error(Step::InquireNodeId, Cause::NoNodeId(byte))),
            _ => Err(self.timed_out(Step::InquireNodeId)),
        }
    }

    /// Whether a device has the vendor ID and product code of `low`, and revision and serial number
    /// between those of `low` and `high`, these included. Not all devices offer this service.
    ///
    /// # Errors
    /// The link broke.
    pub async fn identify(&mut self, low: Identity, high: Identity) -> Result<bool, LinkError> {
        let outcome = self.run(Job::Identify { low, high }).await?;
        Ok(outcome == Outcome::Present(true))
    }

    /// Whether there is an unconfigured device. Not all devices offer this service.
    ///
    /// # Errors
    /// The link broke.
    pub async fn identify_unconfigured(&mut self) -> Result<bool, LinkError> {
        let outcome = self.run(Job::IdentifyNonConfigured).await?;
        Ok(outcome == Outcome::Present(true))
    }

    async fn done(&mut self, job: Job, step: Step) -> Result<(), LssError> {
        self.ended(job, step).await.map(|_| ())
    }

    /// The outcome of a job, unless that is a failure.
    async fn ended(&mut self, job: Job, step: Step) -> Result<Outcome, LssError> {
        match self.run(job).await {
            Ok(Outcome::Refused(refusal)) => Err(self.error(step, Cause::Refused(refusal))),
            Ok(Outcome::TimedOut) => Err(self.timed_out(step)),
            Ok(outcome) => Ok(outcome),
            Err(error) => Err(self.error(step, Cause::Link(error))),
        }
    }

    fn timed_out(&self, step: Step) -> LssError {
        let answer_ms = match step {
            Step::Store => self.settings.store_ms,
            _ => self.settings.answer_ms,
        };
        let attempts = self.settings.attempts;
        self.error(
            step,
            Cause::TimedOut {
                answer_ms,
                attempts,
            },
        )
    }

    fn error(&self, step: Step, cause: Cause) -> LssError {
        LssError {
            identity: self.selected,
            step,
            cause,
        }
    }
}
