//! Finding the devices without a node ID, and giving them one.

use canopen::NodeId;
use canopen::lss::{Identity, Job, Known, Outcome, Part, Request, ScanEnd, State};

use super::{Cause, Lss, LssError, Step};
use crate::{Link, LinkError, nmt};

/// Scans in a row that may fail before it is given up.
const LOST_SCANS: u32 = 10;

/// How long a device may take to boot with its new node ID, in milliseconds.
const BOOT_MS: u64 = 2_000;

/// How far a procedure has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// A scan goes on; it ends after 133 questions, or earlier if nobody is there.
    Scanning {
        /// Questions answered, by word or by silence.
        asked: u16,
    },
    /// A scan has found a device.
    Found(Identity),
    /// A scan has failed and is repeated.
    Lost,
    /// A device has got its node ID.
    Assigned(Assigned),
}

/// What was found of the unconfigured devices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Devices that were found and answered to their identity, the lowest first.
    pub devices: Vec<Identity>,
    /// Identities that a scan ended with and that no device answered to: while frames were lost,
    /// numbers of several devices came together.
    pub doubtful: Vec<Identity>,
}

/// A device that has got a node ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assigned {
    /// Which device.
    pub identity: Identity,
    /// Its node ID.
    pub node: NodeId,
    /// Whether its boot-up with this node ID was heard.
    pub booted: bool,
}

/// What [`Lss::assign`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Assignment {
    /// Devices that have got a node ID, in this order.
    pub assigned: Vec<Assigned>,
    /// Whether devices are left for which there was no node ID. Devices that do not offer
    /// "identify non-configured remote slave" are not counted.
    pub more: bool,
}

/// How a search for one device ended.
enum Scanned {
    Nobody,
    Found(Identity),
    /// The last question was not answered; the answer may be what was lost.
    Perhaps(Identity),
}

impl<L: Link> Lss<'_, L> {
    /// Finds all unconfigured devices, or those with the numbers that are `known`. Each is selected
    /// once in the end, to be sure of it. All are in waiting afterwards.
    ///
    /// Takes, for each device, 133 questions of [`canopen::lss::Settings::settle_ms`] where it
    /// answers, and of `scan_ms` times `attempts` where nobody does.
    ///
    /// # Errors
    /// [`LssError`]: the link broke, or too many scans in a row failed.
    pub async fn find_unconfigured(
        &mut self,
        known: Known,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Found, LssError> {
        self.leave().await?;
        let mut candidates = Vec::new();
        let mut lost = 0;
        // A device that was found is in configuration, where fastscan does not find it again.
        loop {
            let identity = match self.scan(known, progress).await? {
                Scanned::Nobody => break,
                Scanned::Found(identity) => {
                    lost = 0;
                    identity
                }
                Scanned::Perhaps(identity) => {
                    lost += 1;
                    self.give_up(lost)?;
                    identity
                }
            };
            if !candidates.contains(&identity) {
                candidates.push(identity);
            }
        }
        let mut found = Found::default();
        for identity in candidates {
            match self.select(identity).await {
                Ok(()) => found.devices.push(identity),
                Err(error) if error.is_time_out() => found.doubtful.push(identity),
                Err(error) => return Err(error),
            }
        }
        self.leave().await?;
        found.devices.sort();
        Ok(found)
    }

    /// Gives the unconfigured devices the node IDs `ids`, the first found the first: found first
    /// is the lowest identity. Stores them, if `store`. Ends when there is no more device or no
    /// more node ID. The caller sees to it that no configured device has one of them.
    ///
    /// # Errors
    /// [`LssError`]: the link broke, a device refused or does not answer, or too many scans in a
    /// row failed. A device that does not store its node ID does not get it; devices that got
    /// theirs before keep them.
    pub async fn assign(
        &mut self,
        ids: &[NodeId],
        known: Known,
        store: bool,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Assignment, LssError> {
        self.leave().await?;
        let mut assignment = Assignment::default();
        let mut lost = 0;
        for node in ids {
            let identity = loop {
                let identity = match self.scan(known, progress).await? {
                    Scanned::Nobody => return Ok(assignment),
                    Scanned::Found(identity) | Scanned::Perhaps(identity) => identity,
                };
                // Now it alone is in configuration, and it has all four numbers.
                match self.select(identity).await {
                    Ok(()) => break identity,
                    Err(error) if error.is_time_out() => {
                        lost += 1;
                        self.give_up(lost)?;
                        progress(Progress::Lost);
                    }
                    Err(error) => return Err(error),
                }
            };
            lost = 0;
            if let Err(error) = self.configure(*node, store).await {
                // It shall be as it was. If it does not even answer that, nothing can be done.
                let _ = self.set_node_id(None).await;
                let _ = self.leave().await;
                return Err(error);
            }
            let assigned = Assigned {
                identity,
                node: *node,
                booted: self.boot(*node).await?,
            };
            progress(Progress::Assigned(assigned));
            assignment.assigned.push(assigned);
        }
        let more = self.identify_unconfigured().await;
        assignment.more = more.map_err(|error| self.error(Step::Scan, Cause::Link(error)))?;
        Ok(assignment)
    }

    async fn configure(&mut self, node: NodeId, store: bool) -> Result<(), LssError> {
        self.set_node_id(Some(node)).await?;
        match store {
            true => self.store().await,
            false => Ok(()),
        }
    }

    /// Sends all devices to waiting.
    async fn leave(&mut self) -> Result<(), LssError> {
        let switched = self.switch(State::Waiting).await;
        switched.map_err(|error| self.error(Step::Scan, Cause::Link(error)))
    }

    /// The next device.
    async fn scan(
        &mut self,
        known: Known,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Scanned, LssError> {
        self.selected = None;
        let mut lost = 0;
        loop {
            let mut told = |asked| progress(Progress::Scanning { asked });
            let outcome = self.run_watched(Job::Fastscan(known), &mut told).await;
            let outcome = outcome.map_err(|error| self.error(Step::Scan, Cause::Link(error)))?;
            match outcome {
                Outcome::Scanned(ScanEnd::Found(identity)) => {
                    progress(Progress::Found(identity));
                    return Ok(Scanned::Found(identity));
                }
                // Others may be there, but nobody with what is known.
                Outcome::Scanned(ScanEnd::Lost { part, .. }) if all_known(known, part) => {
                    return Ok(Scanned::Nobody);
                }
                Outcome::Scanned(ScanEnd::Lost {
                    part: Part::Serial,
                    tried,
                }) => {
                    progress(Progress::Lost);
                    return Ok(Scanned::Perhaps(tried));
                }
                Outcome::Scanned(ScanEnd::Lost { .. }) => {
                    lost += 1;
                    self.give_up(lost)?;
                    progress(Progress::Lost);
                }
                _ => return Ok(Scanned::Nobody),
            }
        }
    }

    fn give_up(&self, lost: u32) -> Result<(), LssError> {
        match lost {
            LOST_SCANS.. => Err(LssError {
                identity: None,
                step: Step::Scan,
                cause: Cause::Lost { scans: lost },
            }),
            _ => Ok(()),
        }
    }

    /// Sends all devices to waiting and waits until the one with its new node ID has booted.
    async fn boot(&mut self, node: NodeId) -> Result<bool, LssError> {
        let heard = self.leave_and_hear(node).await;
        heard.map_err(|error| self.error(Step::Scan, Cause::Link(error)))
    }

    async fn leave_and_hear(&mut self, node: NodeId) -> Result<bool, LinkError> {
        self.client.set_aside().await?;
        let request = Request::SwitchGlobal(State::Waiting);
        self.client.send(request.frame()).await?;
        let until = self.client.now().plus_ms(BOOT_MS);
        let boot_up =
            |_, frame: &can::Frame| (nmt::error_control(frame) == Some((node, 0))).then_some(());
        Ok(self.client.wait_for(until, boot_up).await?.is_some())
    }
}

/// Whether the numbers up to this one are known, so that silence says: nobody has them.
fn all_known(known: Known, last: Part) -> bool {
    let mut parts = Part::ALL.into_iter().filter(|part| *part <= last);
    parts.all(|part| known.get(part).is_some())
}
