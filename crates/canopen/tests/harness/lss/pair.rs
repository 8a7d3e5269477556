//! A slave and its model side by side.

use canopen::lss::{Answer, BitTiming, BitTimings, Event, Reply, Request, Slave, StoreError};
use canopen::{Instant, NodeId};

use super::model::{Expected, Model};
use super::wire::identity;

/// A slave and its model, which have to agree.
#[derive(Clone, Debug)]
pub struct Pair {
    pub slave: Slave,
    pub model: Model,
}

pub(super) fn node_id(byte: u8) -> Option<NodeId> {
    NodeId::new(byte)
}

fn id_byte(id: Option<NodeId>) -> u8 {
    id.map_or(0xFF, NodeId::get)
}

impl Pair {
    /// `rates` are indices of table 0.
    pub fn new(address: [u32; 4], active: u8, rates: &[BitTiming]) -> Pair {
        let set = rates
            .iter()
            .fold(BitTimings::NONE, |set, rate| set.with(*rate));
        let start = BitTiming::Kbit1000;
        let indices = rates.iter().map(|rate| rate.index()).collect();
        Pair {
            slave: Slave::new(identity(address), node_id(active), start, set),
            model: Model::new(address, id_byte(node_id(active)), start.index(), indices),
        }
    }

    /// Hands eight bytes to both; gives the answer, and what is to be done.
    pub fn receive(&mut self, data: [u8; 8], now: Instant) -> Option<Reply> {
        let expected = self.model.receive(data);
        let reply = Request::from_bytes(data).and_then(|request| self.slave.receive(request, now));
        let got = match reply {
            None => Expected::Silence,
            Some(Reply::Answer(answer)) => Expected::Answer(answer.to_bytes()),
            Some(Reply::Event(Event::StoreConfiguration {
                node_id,
                bit_timing,
            })) => Expected::Store(id_byte(node_id), bit_timing.index()),
            Some(Reply::Event(Event::NodeIdConfigured(id))) => Expected::Boot(id.get()),
            Some(Reply::Event(Event::Silence { delay_ms })) => Expected::Delays(delay_ms),
            Some(Reply::Event(other)) => panic!("{other:?} on a request"),
        };
        assert_eq!(got, expected, "{data:02X?}");
        self.agree();
        reply
    }

    pub fn poll(&mut self, now: Instant) -> Vec<Event> {
        let mut events = Vec::new();
        while let Some(event) = self.slave.poll(now) {
            assert!(self.model.silent, "{event:?}");
            match event {
                Event::SwitchBitTiming(timing) => assert_eq!(timing.index(), self.model.rate),
                Event::SpeakAgain => self.model.silent = false,
                other => panic!("{other:?} by time alone"),
            }
            events.push(event);
        }
        assert!(self.slave.next_deadline() > now, "poll left something");
        self.agree();
        events
    }

    pub fn complete(&mut self, stored: Result<(), StoreError>) -> Option<[u8; 8]> {
        let asked = std::mem::take(&mut self.model.storing) && !self.model.silent;
        let answer = self.slave.complete(stored).map(Answer::to_bytes);
        let (error, specific) = match stored {
            Ok(()) => (0, 0),
            Err(StoreError::NotSupported) => (1, 0),
            Err(StoreError::Access) => (2, 0),
            Err(StoreError::Specific(code)) => (255, code),
        };
        assert_eq!(
            answer,
            asked.then_some([23, error, specific, 0, 0, 0, 0, 0])
        );
        self.agree();
        answer
    }

    pub fn reset_communication(&mut self) {
        self.model.reset_communication();
        let active = self.slave.reset_communication();
        assert_eq!(id_byte(active), self.model.active);
        self.agree();
    }

    fn agree(&self) {
        let Pair { slave, model } = self;
        assert_eq!(slave.state() as u8, model.mode);
        assert_eq!(id_byte(slave.node_id()), model.active);
        assert_eq!(id_byte(slave.pending_node_id()), model.pending);
        assert_eq!(slave.pending_bit_timing().index(), model.rate);
        assert_eq!(slave.is_unconfigured(), model.unconfigured());
        assert_eq!(slave.is_silent(), model.silent);
        assert_eq!(slave.next_deadline() == Instant::NEVER, !model.silent);
    }
}
