//! The SDO servers of a device with everything, and an owner that may refuse or take its time.
//! Bytes make a script; the fuzz target and the replay of its corpus run the same code.

mod model;
mod script;

use std::ops::Range;
use std::sync::LazyLock;

use can::{ExtendedId, Frame, StandardId};
use canopen::{Abort, Address, Device, Events, Image, Instant, Node, NodeId, Verdict};

use super::full::{OBJECTS, with_blocks_of};
use super::streams::{Call, Streams};
use model::{Client, Outcome, Phase};
pub use script::run;

const ID: u8 = 5;
/// Bit 29 of a COB-ID.
const EXTENDED: u32 = 1 << 29;
/// COB-IDs of the servers, request and reply.
const IDS: [(u32, u32); 3] = [
    (0x605, 0x585),
    (0x6C0, 0x4C0),
    (EXTENDED | 0x1234_5678, EXTENDED | 0x1234_5679),
];

/// Devices whose servers want blocks of 1, 2, 5 and 127 segments.
static DEVICES: LazyLock<[Device; 4]> = LazyLock::new(|| [1, 2, 5, 127].map(with_blocks_of));

/// Bytes of the values; behind them is the room for strings, as long as the longest.
static VALUES: LazyLock<usize> = LazyLock::new(|| OBJECTS.image_bytes() - 255);

/// Where the values are that the owner publishes.
static LIVE: LazyLock<[Range<usize>; 4]> = LazyLock::new(|| {
    [(0x2008, 0), (0x2009, 0), (0x2010, 4), (0x2016, 0)]
        .map(|(index, sub)| place(Address::new(index, sub)))
});

/// A node, its owner, and the clients of its three servers.
struct World {
    node: Node<Vec<u8>>,
    owner: Streams,
    now: Instant,
    clients: [Client; 3],
    /// What waits for the owner, as its client sees it.
    waiting: Option<(usize, Client)>,
    is_on: [bool; 3],
    /// Segments of a block that are fetched after a request; the rest waits.
    patience: usize,
    /// The server whose segments wait.
    left: Option<usize>,
    /// The values as they are, by all that has been acknowledged.
    values: Vec<u8>,
}

impl World {
    fn new(device: usize) -> World {
        let id = NodeId::new(ID).expect("a node ID");
        let device = &DEVICES[device];
        let mut world = World {
            node: Node::new(device, vec![0; device.table.image_bytes()], id),
            owner: Streams::default(),
            now: Instant(1_000_000),
            clients: Default::default(),
            waiting: None,
            is_on: [true, false, false],
            patience: usize::MAX,
            left: None,
            values: Vec::new(),
        };
        world.node.start(world.now);
        let boot_up = world.node.transmit(&mut world.owner).expect("a boot-up");
        assert_eq!((boot_up.raw_id(), boot_up.data()), (0x705, &[0][..]));
        world.values = world.node.bytes()[..*VALUES].to_vec();
        world
    }

    /// A request of eight bytes to server `n`.
    fn request(&mut self, n: usize, data: [u8; 8]) {
        if self.left.take_if(|left| *left != n).is_some() {
            self.fetch();
        }
        self.left = None;
        self.owner.ended.clear();
        self.owner.calls.clear();
        self.clients[n].sends(data);
        if data[0] >> 5 == 4 && self.clients[n].phase == Phase::Idle {
            self.nobody_waits(n);
        }
        let events = self.receive(frame(IDS[n].0, &data));
        if self.is_on[n] && self.has_postponed(&events) {
            let client = std::mem::take(&mut self.clients[n]);
            assert!(self.waiting.is_none(), "two writes wait");
            self.waiting = Some((n, client));
        }
        if !self.is_on[n] {
            self.clients[n].forget();
        }
        let written = self.answers(n);
        self.check_values(written);
    }

    /// A frame that is no request: silence, and nothing happens.
    fn is_deaf_to(&mut self, frame: Frame) {
        self.fetch();
        self.receive(frame);
        assert_eq!(self.node.transmit(&mut self.owner), None, "{frame}");
        self.check_values(None);
    }

    /// Whether the owner has said "later" to what was asked just now.
    fn has_postponed(&self, events: &Events) -> bool {
        let is_later = |call: &Call| match call {
            Call::Write(..) => self.owner.verdict == Verdict::Later,
            Call::Begin(..) => self.owner.begin == Verdict::Later,
            Call::End(..) => self.owner.end == Verdict::Later,
            Call::Bytes(..) | Call::Abort(..) => false,
        };
        // An expedited download cannot wait for its begin.
        let postponed = self.owner.calls.last().is_some_and(is_later);
        assert!(!postponed || events.changed.is_empty());
        postponed
    }

    fn receive(&mut self, frame: Frame) -> Events {
        self.node.receive(&frame, self.now, &mut self.owner)
    }

    /// Fetches what the node sends; gives the object that has been written according to it.
    fn answers(&mut self, asked: usize) -> Option<(Address, usize)> {
        let mut written = None;
        for fetched in 1.. {
            assert!(fetched <= 200, "transmit has no end");
            let Some(frame) = self.node.transmit(&mut self.owner) else {
                assert!(self.node.is_silent());
                break;
            };
            let n = self.server_of(&frame);
            assert_eq!(n, asked, "of another server: {frame}");
            if self.hears(n, frame.bytes()) == Outcome::Written {
                assert_eq!(written, None, "two at once");
                written = Some((self.clients[n].object.expect("an object"), n));
            }
            let in_block = matches!(self.clients[n].phase, Phase::BlockUpload { .. });
            if in_block && fetched >= self.patience && !self.node.is_silent() {
                self.left = Some(n);
                break;
            }
        }
        written
    }

    /// Fetches all, whoever it is for; nothing is written by it.
    fn fetch(&mut self) {
        self.left = None;
        for _ in 0..200 {
            let Some(frame) = self.node.transmit(&mut self.owner) else {
                return;
            };
            let n = self.server_of(&frame);
            assert_ne!(self.hears(n, frame.bytes()), Outcome::Written);
        }
        panic!("transmit has no end");
    }

    fn server_of(&self, frame: &Frame) -> usize {
        assert!(!frame.is_remote() && frame.len() == 8, "{frame}");
        let key = |cob_id: u32| cob_id & 0x1FFF_FFFF | (cob_id >> 29 & 1) << 31;
        let n = IDS.iter().position(|ids| key(ids.1) == frame.key());
        n.expect("an SDO answer")
    }

    fn hears(&mut self, n: usize, answer: [u8; 8]) -> Outcome {
        if answer[0] == 0x80 && answer[4..] == [0x01, 0x00, 0x04, 0x05] {
            // A request out of place ends what waits, too.
            self.nobody_waits(n);
        }
        let outcome = self.clients[n].hears(answer);
        if outcome == Outcome::Read {
            let client = &self.clients[n];
            let object = client.object.expect("an object");
            if matches!(object.index, 0x1021 | 0x1F50 | 0x2020 | 0x2021) && object.sub < 2 {
                let is_count = object == Address::new(0x1F50, 0);
                assert!(is_count || client.data == self.owner.contents, "wrong data");
            }
        }
        outcome
    }

    fn nobody_waits(&mut self, n: usize) {
        self.waiting.take_if(|(server, _)| *server == n);
    }

    /// Only what was written has changed, and it is what was written.
    fn check_values(&mut self, written: Option<(Address, usize)>) {
        let now = &self.node.bytes()[..*VALUES];
        for range in LIVE.iter().cloned() {
            self.values[range.clone()].copy_from_slice(&now[range]);
        }
        if let Some((object, n)) = written {
            let client = &self.clients[n];
            let range = place(object);
            if range.is_empty() {
                assert_eq!(self.owner.ended.len(), 1);
                let taken = self.owner.ended.last();
                assert_eq!(taken, Some(&client.data), "wrong data");
            }
            let entry = OBJECTS.table().find(object.index, object.sub).expect("it");
            let asks = OBJECTS
                .table()
                .row(&entry)
                .is_some_and(|row| row.asks_owner);
            let (kept, old) = (&now[range.clone()], &self.values[range.clone()]);
            let count = kept.len().min(client.data.len());
            let is_kept = kept[..count] == client.data[..count]
                && kept[count..].iter().all(|byte| *byte == 0);
            // A command may be obeyed and leave no value.
            assert!(
                is_kept || (asks && kept == old),
                "{object} has a wrong value"
            );
            self.values[range.clone()].copy_from_slice(&now[range]);
            if object == Address::new(0x1003, 0) {
                // The history is cleared, which was clear.
                assert_eq!(client.data.first(), Some(&0));
            }
        }
        assert!(self.values == now, "another object has changed");
    }

    /// Time passes.
    fn wait_ms(&mut self, ms: u64) {
        self.fetch();
        self.now = self.now.plus_ms(ms);
        self.node.poll(self.now, &mut self.owner);
        assert!(self.node.next_deadline() > self.now, "a deadline passed by");
        self.fetch();
        self.check_values(None);
    }

    /// The owner says what it had postponed.
    fn complete(&mut self, result: Result<(), Abort>) {
        self.fetch();
        let waiting = self.waiting.take();
        if let (Err(_), Some((_, client))) = (result, &waiting) {
            // Of a download that it would have begun the owner itself knows.
            let begins =
                |request: &[u8; 8]| matches!(request[0] >> 5, 1 | 6) && request[0] & 0xE1 != 0xC1;
            let begun = client.request.filter(begins);
            self.owner.forget(begun.map(model::object));
        }
        self.node.complete(result, self.now);
        let Some((n, client)) = waiting else {
            assert_eq!(self.node.transmit(&mut self.owner), None, "nothing waited");
            return;
        };
        self.clients[n] = client;
        let answer = self.node.transmit(&mut self.owner).expect("an answer");
        assert_eq!(self.server_of(&answer), n);
        self.hears(n, answer.bytes());
        // A postponed write commits nothing.
        self.check_values(None);
    }

    /// Switches a further server on or off.
    fn switch(&mut self, n: usize, on: bool) {
        let off = if on { 0 } else { 1 << 31 };
        let (request, reply) = IDS[n];
        for (sub, id) in [(1, request), (2, reply)] {
            let index = 0x1200 + n as u16;
            let [low, high] = index.to_le_bytes();
            let [d0, d1, d2, d3] = (id | off).to_le_bytes();
            self.request(0, [0x23, low, high, sub, d0, d1, d2, d3]);
        }
        // It may have been refused: a write waits, or a block has swallowed it.
        let is_on = (1..=2).all(|sub| {
            let field = OBJECTS
                .table()
                .find(0x1200 + n as u16, sub)
                .expect("it")
                .field;
            self.node.image().raw(field) >> 31 == 0
        });
        if !is_on {
            self.clients[n].forget();
            self.nobody_waits(n);
        }
        self.is_on[n] = is_on;
    }

    /// No SDO in stopped.
    fn stop_and_go(&mut self) {
        let nmt = |command| Frame::classic(0, [command, ID, 0, 0, 0, 0, 0, 0], 2);
        self.receive(nmt(2));
        assert!(self.owner.is_balanced(), "a stream is still open");
        self.receive(nmt(0x80));
        assert_eq!(self.node.transmit(&mut self.owner), None);
        self.left = None;
        self.clients = Default::default();
        self.waiting = None;
    }

    /// The end: everybody gives up, and the node is as good as new.
    fn end(&mut self) {
        self.patience = usize::MAX;
        self.wait_ms(1000);
        self.wait_ms(1000);
        for n in 0..3 {
            self.request(n, [0x80, 0, 0, 0, 0, 0, 0, 0]);
        }
        self.complete(Ok(()));
        assert!(self.owner.is_balanced(), "a stream is still open");
        self.request(0, [0x2F, 0x0B, 0x20, 0, 7, 0, 0, 0]);
        self.request(0, [0x40, 0x0B, 0x20, 0, 0, 0, 0, 0]);
        assert_eq!(self.clients[0].data, [7]);
    }
}

/// Where an object's bytes are in the image.
fn place(object: Address) -> Range<usize> {
    let table = OBJECTS.table();
    let field = table
        .find(object.index, object.sub)
        .expect("an object")
        .field;
    let mut bytes = vec![0; table.image_bytes()];
    Image::new(&mut bytes).set_bytes(field, &[0xFF; 255]);
    let size = usize::from(field.size());
    let from = bytes.iter().position(|byte| *byte != 0).unwrap_or(0);
    from..from + size
}

fn frame(cob_id: u32, data: &[u8]) -> Frame {
    match cob_id & EXTENDED {
        0 => Frame::data_frame(StandardId::new(cob_id as u16).expect("11 bits"), data),
        _ => {
            let id = ExtendedId::new(cob_id & 0x1FFF_FFFF).expect("29 bits");
            Frame::data_frame(id, data)
        }
    }
    .expect("at most eight bytes")
}
