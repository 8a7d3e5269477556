//! LSS in a virtual drive: the slave that stands beside its core (CiA 305).

use std::collections::VecDeque;

use can::{BitRate, Frame};
use canopen::lss::{
    BitTiming, BitTimings, Event, Identity, Part, Reply, Request, Slave, StoreError, UNCONFIGURED,
};
use canopen::store::{self, lss::LssConfiguration};
use canopen::{Default, Instant, NodeId};
use personalities::Personality;

use crate::drive::VirtualDrive;
use crate::notice::NoticeKind;

/// Answers that may wait for a mailbox; more are lost.
const ANSWERS: usize = 16;

/// The LSS side of a drive: none in a drive whose dialect has no LSS, nor in one that is off.
#[derive(Debug)]
pub(crate) struct Station {
    /// What the drive is without stored configuration.
    node: Option<NodeId>,
    /// What it has without LSS: stored, or changed while it runs.
    own: Option<NodeId>,
    bit_rate: BitRate,
    /// What an LSS slave of this drive is, if it is one.
    slave_of: Option<(Identity, BitTimings)>,
    /// While it is on.
    slave: Option<Slave>,
    answers: VecDeque<Frame>,
    /// A store under way, and when it is done.
    storing: Option<(LssConfiguration, Instant)>,
}

impl Station {
    /// Of a drive that is off. `node` and `bit_rate` hold where nothing is stored.
    pub(crate) fn new(
        personality: &Personality,
        serial: u32,
        node: Option<NodeId>,
        bit_rate: BitRate,
    ) -> Station {
        let is_slave = personality.device.dialect.lss;
        Station {
            node,
            own: node,
            bit_rate,
            slave_of: is_slave.then(|| (identity(personality, serial), timings(personality))),
            slave: None,
            answers: VecDeque::new(),
            storing: None,
        }
    }

    /// The processor starts: what is stored becomes active. The bit rate to start with.
    pub(crate) fn power_on(&mut self, personality: &Personality, stored: &[u8]) -> BitRate {
        self.own = drive::stored_node_id(personality, stored).or(self.node);
        let Some((identity, supported)) = self.slave_of else {
            return self.bit_rate;
        };
        // Damaged parameters are told of where the core finds them.
        let configuration = store::lss::read(stored).unwrap_or_default();
        let node = match configuration.node_id {
            Some(id) => NodeId::new(id),
            None => self.node,
        };
        let timing = configuration
            .bit_timing
            .filter(|timing| timing.selector == 0)
            .and_then(|timing| BitTiming::from_index(timing.index))
            .filter(|timing| supported.has(*timing))
            .unwrap_or_else(|| timing_of(self.bit_rate));
        self.slave = Some(Slave::new(identity, node, timing, supported));
        self.rate_of(timing)
    }

    /// The processor is reset: nothing is left but what is stored.
    pub(crate) fn power_off(&mut self) {
        self.slave = None;
        self.answers.clear();
        self.storing = None;
    }

    /// Whether it hears LSS requests.
    pub(crate) fn is_on(&self) -> bool {
        self.slave.is_some()
    }

    /// The node ID to boot with.
    pub(crate) fn node(&self) -> Option<NodeId> {
        match &self.slave {
            Some(slave) => slave.node_id(),
            None => self.own,
        }
    }

    /// NMT "reset communication": the node ID from now on.
    pub(crate) fn reset_communication(&mut self) -> Option<NodeId> {
        self.answers.clear();
        match &mut self.slave {
            Some(slave) => slave.reset_communication(),
            None => self.own,
        }
    }

    /// The drive has taken another node ID by itself.
    pub(crate) fn rename(&mut self, id: NodeId) {
        self.own = Some(id);
    }

    /// When [`VirtualDrive::poll_lss`] has something to do.
    pub(crate) fn next_deadline(&self) -> Instant {
        let slave = self.slave.as_ref();
        let next = slave.map_or(Instant::NEVER, Slave::next_deadline);
        self.storing.map_or(next, |(_, at)| next.min(at))
    }

    /// Whether the drive must send nothing.
    pub(crate) fn is_silent(&self) -> bool {
        self.slave.as_ref().is_some_and(Slave::is_silent)
    }

    /// The next answer to send.
    pub(crate) fn next_answer(&mut self) -> Option<Frame> {
        self.answers.pop_front()
    }

    fn answer(&mut self, answer: canopen::lss::Answer) {
        if self.answers.len() < ANSWERS {
            self.answers.push_back(answer.frame());
        }
    }

    fn rate_of(&self, timing: BitTiming) -> BitRate {
        let rate = timing.kbit_s().and_then(BitRate::from_kbit_s);
        rate.unwrap_or(self.bit_rate)
    }
}

/// The LSS address: 0x1018 with the device's own serial number (CiA 305, LSS address).
fn identity(personality: &Personality, serial: u32) -> Identity {
    let number = |part: Part| {
        let table = &personality.device.table;
        let entry = table.find(0x1018, part.number() + 1).ok();
        match entry.and_then(|entry| table.row(&entry))?.default {
            Default::Value(value) => u32::try_from(value).ok(),
            _ => None,
        }
    };
    Identity {
        vendor: number(Part::Vendor).unwrap_or(0),
        product: number(Part::Product).unwrap_or(0),
        revision: number(Part::Revision).unwrap_or(0),
        serial,
    }
}

/// The entries of table 0 that the drive can have. 100 kbit/s is none.
fn timings(personality: &Personality) -> BitTimings {
    let rates = personality.bit_rates.iter();
    let entries = rates.filter_map(|rate| BitTiming::from_kbit_s(rate.kbit_s()));
    entries.fold(BitTimings::NONE, BitTimings::with)
}

/// The entry of a rate. A rate without one is what the drive has found out by itself.
fn timing_of(bit_rate: BitRate) -> BitTiming {
    BitTiming::from_kbit_s(bit_rate.kbit_s()).unwrap_or(BitTiming::Automatic)
}

impl VirtualDrive {
    /// Whether a received frame is an LSS request to this drive; it is obeyed then, in every NMT
    /// state and without a node ID, too.
    pub(crate) fn takes_lss(&mut self, frame: &Frame, now: Instant) -> bool {
        let Some(slave) = &mut self.station.slave else {
            return false;
        };
        let Some(request) = Request::from_frame(frame) else {
            return false;
        };
        match slave.receive(request, now) {
            Some(Reply::Answer(answer)) => self.station.answer(answer),
            Some(Reply::Event(event)) => self.obey_lss(event, now),
            None => {}
        }
        true
    }

    /// What of LSS is due.
    pub(crate) fn poll_lss(&mut self, now: Instant, notice: &mut impl FnMut(NoticeKind)) {
        if let Some((configuration, at)) = self.station.storing
            && now >= at
        {
            self.station.storing = None;
            let stored = self.store_lss(&configuration, now, notice);
            let slave = self.station.slave.as_mut();
            if let Some(answer) = slave.and_then(|slave| slave.complete(stored)) {
                self.station.answer(answer);
            }
        }
        while let Some(event) = self.station.slave.as_mut().and_then(|s| s.poll(now)) {
            self.obey_lss(event, now);
        }
    }

    fn obey_lss(&mut self, event: Event, now: Instant) {
        match event {
            Event::StoreConfiguration {
                node_id,
                bit_timing,
            } => {
                let configuration = LssConfiguration {
                    node_id: Some(node_id.map_or(UNCONFIGURED, NodeId::get)),
                    bit_timing: Some(store::lss::BitTiming {
                        selector: 0,
                        index: bit_timing.index(),
                    }),
                };
                let at = now.plus_ns(self.latency.store_ns());
                self.station.storing = Some((configuration, at));
            }
            // It has waited in NMT initialisation; now it goes on.
            Event::NodeIdConfigured(_) => {
                self.boots_at = now.plus_ns(self.latency.boot_ns());
            }
            Event::Silence { .. } => {
                self.controller.silence(true);
                self.station.answers.clear();
            }
            Event::SwitchBitTiming(timing) => {
                let bit_rate = self.station.rate_of(timing);
                self.controller.tune(bit_rate, now);
                self.service_at = Instant::NEVER;
                self.changed_rate = Some(bit_rate);
            }
            Event::SpeakAgain => self.controller.silence(false),
        }
    }

    /// If the power fails meanwhile, there is no slave any more that could answer.
    fn store_lss(
        &mut self,
        configuration: &LssConfiguration,
        now: Instant,
        notice: &mut impl FnMut(NoticeKind),
    ) -> Result<(), StoreError> {
        let mut bytes = vec![0; self.store.capacity()];
        let used = store::lss::replace(self.store.bytes(), configuration, &mut bytes);
        bytes.truncate(used.map_err(|_| StoreError::Access)?);
        match self.replace_stored(bytes, now, notice) {
            Some(Ok(())) => Ok(()),
            Some(Err(error)) => {
                notice(NoticeKind::CannotStore(error));
                Err(StoreError::Access)
            }
            None => Err(StoreError::Access),
        }
    }
}
