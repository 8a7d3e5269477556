//! Heartbeat consumer: other nodes that this one listens for (CiA 301 7.2.8.3.2.2, 7.5.2.19).

use crate::{
    CommunicationErrors, Events, Instant, News, NmtState, Node, NodeId, NodeMemory, Owner,
};

/// Nodes that one node can listen for.
pub const MONITORED: usize = 8;

/// What is known of a node that is listened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Monitored {
    /// Which.
    pub node: NodeId,
    /// What it said last; `None` before its first heartbeat, from which on it is listened for.
    pub state: Option<NmtState>,
    /// It has fallen silent.
    pub is_lost: bool,
}

/// One entry of 0x1016.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Consumer {
    node: Option<NodeId>,
    time_ms: u16,
    state: Option<NmtState>,
    is_lost: bool,
    pub(crate) due: Instant,
}

impl Consumer {
    pub(crate) const OFF: Consumer = Consumer {
        node: None,
        time_ms: 0,
        state: None,
        is_lost: false,
        due: Instant::NEVER,
    };

    /// Of a value of 0x1016: bits 16 to 23 the node, bits 0 to 15 the time in ms. Node 0, nodes
    /// over 127 and time 0 are entries that are not used.
    pub(crate) fn new(raw: u32) -> Consumer {
        let time_ms = raw as u16;
        let node = NodeId::new((raw >> 16) as u8).filter(|_| time_ms != 0);
        Consumer {
            node,
            time_ms,
            ..Consumer::OFF
        }
    }
}

impl<M: NodeMemory> Node<M> {
    /// Reads the entries of 0x1016. Those that have not changed go on.
    pub(crate) fn read_consumers(&mut self) {
        let Some(run) = self.device.objects.heartbeat_consumers else {
            return;
        };
        for (n, consumer) in (0..run.count).zip(0..MONITORED) {
            let new = Consumer::new(self.raw(run.nth(n)));
            if let Some(place) = self.monitor.get_mut(consumer)
                && (place.node, place.time_ms) != (new.node, new.time_ms)
            {
                *place = new;
            }
        }
    }

    /// A heartbeat of `node` was received.
    pub(crate) fn heard(&mut self, node: NodeId, byte: u8, now: Instant, events: &mut Events) {
        let Some(state) = NmtState::from_heartbeat(byte) else {
            return;
        };
        for consumer in &mut self.monitor {
            if consumer.node != Some(node) {
                continue;
            }
            // A boot-up says that it has started anew, whatever it was before.
            let is_new = consumer.state != Some(state)
                || consumer.is_lost
                || state == NmtState::Initialising;
            consumer.state = Some(state);
            consumer.is_lost = false;
            consumer.due = now.plus_ms(u64::from(consumer.time_ms));
            self.due = self.due.min(consumer.due);
            if is_new {
                events.news.insert(News::HEARTBEAT);
            }
        }
        self.sum_up_monitor(events);
    }

    /// Notes the nodes that have fallen silent.
    pub(crate) fn check_heartbeats<O: Owner>(
        &mut self,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let mut any = false;
        for consumer in &mut self.monitor {
            if now >= consumer.due && consumer.due != Instant::NEVER {
                consumer.due = Instant::NEVER;
                consumer.is_lost = true;
                any = true;
            }
        }
        if any {
            events.news.insert(News::HEARTBEAT);
            self.sum_up_monitor(events);
            self.communication_error(now, owner, events);
        }
    }

    /// The error lasts as long as one of them is silent.
    pub(crate) fn sum_up_monitor(&mut self, events: &mut Events) {
        let lost = self.monitor.iter().any(|consumer| consumer.is_lost);
        self.note(CommunicationErrors::HEARTBEAT, lost, events);
    }

    /// The nodes in 0x1016, in its order.
    pub fn monitored(&self) -> impl Iterator<Item = Monitored> {
        self.monitor.iter().filter_map(|consumer| {
            Some(Monitored {
                node: consumer.node?,
                state: consumer.state,
                is_lost: consumer.is_lost,
            })
        })
    }
}
