//! The controller that outside programs share: each has a queue of its own.

use std::collections::{BTreeMap, VecDeque};

use can::{BitRate, Frame};
use canopen::Instant;
use canopen::lss::Request;

use crate::controller::Port;
use crate::disturbance::{Disturbance, Disturbed, Disturber};
use crate::medium::Sender;

/// The identifier of SYNC in the predefined connection set (CiA 301 7.3.5).
const SYNC: u32 = 0x080;

/// Queues of outside clients. They share one controller, as the programs on one computer share one
/// interface: two of them never collide on the wire.
#[derive(Debug)]
pub(crate) struct Gateway {
    queues: BTreeMap<u32, VecDeque<Frame>>,
    pub(crate) port: Port,
    /// An outside LSS master has told the drives to change their bit rate.
    changes: bool,
    /// Whose frame is on the wire.
    sends: Option<u32>,
    /// Whose frames were lost by bus-off, and have not been told of.
    pub(crate) dropped: Vec<u32>,
    /// SYNC messages get lost on the way to the bus.
    holds_sync: bool,
    /// On the way to the bus, and from it.
    inward: Disturber,
    outward: Disturber,
}

impl Gateway {
    /// One without clients.
    pub(crate) fn new(bit_rate: BitRate, disturbance: Disturbance, seed: u64) -> Gateway {
        let mut port = Port::new(bit_rate);
        port.protocol.start(Instant::ZERO);
        Gateway {
            queues: BTreeMap::new(),
            port,
            changes: false,
            sends: None,
            dropped: Vec::new(),
            holds_sync: false,
            inward: Disturber::new(disturbance, seed, 0),
            outward: Disturber::new(disturbance, seed, 1),
        }
    }

    /// Its bit rate.
    pub(crate) fn bit_rate(&self) -> BitRate {
        self.port.bit_rate()
    }

    /// A drive has changed its bit rate because an LSS master said so. If that was one outside, its
    /// user would now set the interface anew; the first drive that changes tells how.
    pub(crate) fn drive_changed(&mut self, bit_rate: BitRate, now: Instant) {
        if std::mem::take(&mut self.changes) && bit_rate != self.bit_rate() {
            self.port.tune(bit_rate, now);
        }
    }

    /// `client` wants to send `frame`. How often it waits now.
    pub(crate) fn push(&mut self, client: u32, frame: Frame) -> u8 {
        if self.holds_sync && frame.raw_id() == SYNC && !frame.is_extended() {
            return 0;
        }
        let copies = self.inward.copies();
        for _ in 0..copies {
            self.queues.entry(client).or_default().push_back(frame);
        }
        copies
    }

    /// Loses SYNC messages on the way to the bus, or does so no longer.
    pub(crate) fn hold_sync(&mut self, held: bool) {
        self.holds_sync = held;
    }

    /// How often clients get a frame of this sender. They share one controller, so what one of them
    /// sends reaches the others undisturbed.
    pub(crate) fn copies(&mut self, sender: Sender) -> u8 {
        match sender {
            Sender::Drive(_) | Sender::Stranger => self.outward.copies(),
            Sender::Outside(_) => 1,
        }
    }

    /// What was disturbed on the way to the bus, and from it.
    pub(crate) fn disturbed(&self) -> [Disturbed; 2] {
        [self.inward.done, self.outward.done]
    }

    /// The waiting frame that would win arbitration, and whose it is. Each client's frames keep
    /// their order; of equal identifiers the lower client comes first.
    pub(crate) fn contender(&self) -> Option<(u32, Frame)> {
        self.queues
            .iter()
            .filter_map(|(client, queue)| Some((*client, *queue.front()?)))
            .min_by_key(|(client, frame)| (frame.arbitration_key(), *client))
    }

    /// A frame of `client` is on the wire.
    pub(crate) fn begin(&mut self, client: u32) {
        self.sends = Some(client);
    }

    /// Whose frame is on the wire, or was last.
    pub(crate) fn sends(&self) -> Option<u32> {
        self.sends
    }

    /// It is bus-off: as the system of a real interface does, the frame in the controller is
    /// dropped. The others wait until the controller has recovered.
    pub(crate) fn drop_frame(&mut self) {
        if let Some(client) = self.sends.take()
            && let Some(queue) = self.queues.get_mut(&client)
        {
            if queue.pop_front().is_some() {
                self.dropped.push(client);
            }
            if queue.is_empty() {
                self.queues.remove(&client);
            }
        }
    }

    /// The first frame of `client` was sent.
    pub(crate) fn sent(&mut self, client: u32) {
        if let Some(queue) = self.queues.get_mut(&client) {
            let frame = queue.pop_front();
            let request = frame.and_then(|frame| Request::from_frame(&frame));
            if let Some(Request::ActivateBitTiming { .. }) = request {
                self.changes = true;
            }
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
