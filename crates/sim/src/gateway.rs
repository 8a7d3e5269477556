//! The controller that outside programs share: each has a queue of its own.

use std::collections::{BTreeMap, VecDeque};

use can::Frame;

/// Queues of outside clients. They share one controller, as the programs on one computer share one
/// interface: two of them never collide on the wire.
#[derive(Debug, Default)]
pub(crate) struct Gateway {
    queues: BTreeMap<u32, VecDeque<Frame>>,
}

impl Gateway {
    /// `client` wants to send `frame`.
    pub(crate) fn push(&mut self, client: u32, frame: Frame) {
        self.queues.entry(client).or_default().push_back(frame);
    }

    /// The waiting frame that would win arbitration, and whose it is. Each client's frames keep
    /// their order; of equal identifiers the lower client comes first.
    pub(crate) fn contender(&self) -> Option<(u32, Frame)> {
        self.queues
            .iter()
            .filter_map(|(client, queue)| Some((*client, *queue.front()?)))
            .min_by_key(|(client, frame)| (frame.arbitration_key(), *client))
    }

    /// The first frame of `client` was sent.
    pub(crate) fn sent(&mut self, client: u32) {
        if let Some(queue) = self.queues.get_mut(&client) {
            queue.pop_front();
            if queue.is_empty() {
                self.queues.remove(&client);
            }
        }
    }

    /// Frames that wait.
    pub(crate) fn waiting(&self) -> usize {
        self.queues.values().map(VecDeque::len).sum()
    }
}
