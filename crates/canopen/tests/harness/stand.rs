//! A node with every service among others on a bus: frames of every kind, and a host that calls
//! the node at each of its deadlines and nowhere else.

use can::{ExtendedId, Frame, StandardId};
use canopen::{Address, Device, Events, Field, Image, Instant, News, Node, NodeId, Owner, Verdict};

use super::full::{FULL, OBJECTS_CONST};

/// Node ID of every node on a stand.
pub const ID: u32 = 5;
/// Marks an identifier of 29 bits.
pub const WIDE: u32 = 1 << 31;
/// Bit 31 of a COB-ID: off.
pub const OFF: u32 = 1 << 31;
/// Bit 30 of a COB-ID: no remote requests, or a producer.
pub const BIT_30: u32 = 1 << 30;
/// Bit 29 of a COB-ID: 29 bits.
pub const BIT_29: u32 = 1 << 29;

/// A frame that was sent: identifier (of 29 bits with [`WIDE`]) and data.
pub type Sent = (u32, Vec<u8>);
/// The same with the microseconds since the host began to wait.
pub type Timed = (u64, u32, Vec<u8>);

/// What a node's values mean: nothing, but it writes down what it is asked.
#[derive(Debug, Default)]
pub struct Host {
    /// What to answer, per index; others are accepted.
    pub verdicts: Vec<(u16, Verdict)>,
    /// What it was asked.
    pub asked: Vec<(Address, Vec<u8>)>,
    /// How often it published.
    pub publications: u32,
    /// What it publishes in 0x2008; 0x2009 is its negative.
    pub position: i32,
}

impl Owner for Host {
    fn write(&mut self, _: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        self.asked.push((object, new.to_vec()));
        self.verdicts
            .iter()
            .find(|(index, _)| *index == object.index)
            .map_or(Verdict::Accept, |(_, verdict)| *verdict)
    }

    fn publish(&mut self, image: &mut Image<'_>) {
        self.publications += 1;
        image.set(OBJECTS_CONST.handle::<i32>(0x2008, 0), self.position);
        image.set(OBJECTS_CONST.handle::<i32>(0x2009, 0), -self.position);
    }
}

/// A node, its host and their clock.
#[derive(Debug)]
pub struct Stand {
    pub node: Node<Vec<u8>>,
    pub host: Host,
    pub now: Instant,
    /// What the calls since [`Stand::fresh`] have brought about.
    pub log: Vec<Events>,
}

/// A data frame with the identifier of `key`.
pub fn frame(key: u32, data: &[u8]) -> Frame {
    let frame = if key & WIDE != 0 {
        Frame::data_frame(ExtendedId::new(key & !WIDE).expect("29 bits"), data)
    } else {
        Frame::data_frame(StandardId::new(key as u16).expect("11 bits"), data)
    };
    frame.expect("at most 8 bytes")
}

/// A remote request with the identifier of `key`.
pub fn remote(key: u32, length: u8) -> Frame {
    let frame = if key & WIDE != 0 {
        Frame::remote_frame(ExtendedId::new(key & !WIDE).expect("29 bits"), length)
    } else {
        Frame::remote_frame(StandardId::new(key as u16).expect("11 bits"), length)
    };
    frame.expect("at most 8 bytes")
}

impl Stand {
    /// A node with every service that has booted, its boot-up frame taken.
    pub fn new() -> Stand {
        let mut stand = Stand::unstarted(&FULL);
        assert_eq!(stand.start(), [(0x700 + ID, vec![0])]);
        stand
    }

    /// The same in operational.
    pub fn operational() -> Stand {
        let mut stand = Stand::new();
        stand.nmt(0x01);
        stand
    }

    /// A node of any device before its start.
    pub fn unstarted(device: &'static Device) -> Stand {
        let id = NodeId::new(ID as u8).expect("a node ID");
        Stand {
            node: Node::new(device, vec![0; device.table.image_bytes()], id),
            host: Host::default(),
            now: Instant(1_000_000_000),
            log: Vec::new(),
        }
    }

    /// Starts the node.
    pub fn start(&mut self) -> Vec<Sent> {
        let events = self.node.start(self.now);
        self.log.push(events);
        self.drain()
    }

    /// Forgets what has been brought about.
    pub fn fresh(&mut self) -> &mut Stand {
        self.log.clear();
        self
    }

    /// Whether one of the calls since [`Stand::fresh`] told of `news`.
    pub fn told(&self, news: News) -> bool {
        self.log.iter().any(|events| events.news.has(news))
    }

    /// Hands over a frame without taking what is sent.
    pub fn give(&mut self, frame: &Frame) {
        let events = self.node.receive(frame, self.now, &mut self.host);
        self.log.push(events);
    }

    /// Hands over a data frame; gives what the node sends.
    pub fn send(&mut self, key: u32, data: &[u8]) -> Vec<Sent> {
        self.give(&frame(key, data));
        self.drain()
    }

    /// Hands over a remote request that asks for `length` bytes.
    pub fn request(&mut self, key: u32, length: u8) -> Vec<Sent> {
        self.give(&remote(key, length));
        self.drain()
    }

    /// A SYNC without counter on 0x80.
    pub fn sync(&mut self) -> Vec<Sent> {
        self.send(0x80, &[])
    }

    /// An NMT command to this node that nothing answers.
    pub fn nmt(&mut self, command: u8) {
        assert_eq!(self.send(0, &[command, ID as u8]), []);
    }

    /// Looks for changed values.
    pub fn detect(&mut self) -> Vec<Sent> {
        self.node.detect_events(self.now, &mut self.host);
        self.drain()
    }

    /// The application has an event for TPDO `n` (from 0).
    pub fn trigger(&mut self, n: usize) -> Vec<Sent> {
        self.node.trigger(n, self.now, &mut self.host);
        self.drain()
    }

    /// Announces an error with vendor bytes of 0.
    pub fn announce(&mut self, code: u16, register: u8) -> Vec<Sent> {
        self.node.announce(code, register, [0; 5], self.now);
        self.drain()
    }

    /// All that waits.
    pub fn drain(&mut self) -> Vec<Sent> {
        let mut sent = Vec::new();
        while let Some(frame) = self.node.transmit(&mut self.host) {
            assert!(!frame.is_remote());
            sent.push((frame.key(), frame.data().to_vec()));
        }
        assert!(self.node.is_silent());
        sent
    }

    /// Lets `us` pass for a host that calls the node at its deadlines and takes what it sends.
    ///
    /// # Panics
    /// If after a call a deadline is not in the future.
    pub fn wait_us(&mut self, us: u64) -> Vec<Timed> {
        let start = self.now;
        let end = start.plus_us(us);
        let mut sent = Vec::new();
        while self.node.next_deadline() <= end {
            self.now = self.now.max(self.node.next_deadline());
            let events = self.node.poll(self.now, &mut self.host);
            self.log.push(events);
            let after = self.now.since_ns(start) / 1_000;
            sent.extend(
                self.drain()
                    .into_iter()
                    .map(|(key, data)| (after, key, data)),
            );
            if self.node.next_deadline() == Instant::ZERO {
                // An emergency that has left asks for the time, once, and nothing else.
                let events = self.node.poll(self.now, &mut self.host);
                assert_eq!((events, self.drain()), (Events::NOTHING, vec![]));
            }
            assert!(
                self.node.next_deadline() > self.now,
                "a deadline that was met"
            );
        }
        self.now = end;
        // A call too many changes nothing.
        let events = self.node.poll(end, &mut self.host);
        assert_eq!((events, self.drain()), (Events::NOTHING, vec![]));
        sent
    }

    /// The same in milliseconds.
    pub fn wait_ms(&mut self, ms: u64) -> Vec<Timed> {
        self.wait_us(1_000 * ms)
    }

    fn field(&self, index: u16, sub: u8) -> Field {
        self.node
            .device()
            .table
            .find(index, sub)
            .expect("an object")
            .field
    }

    /// Writes an object of at most four bytes by SDO.
    pub fn write(&mut self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let length = self
            .node
            .device()
            .table
            .find(index, sub)
            .map_or(4, |entry| entry.field.size());
        let mut request = [0x23 | (4 - length) << 2, low, high, sub, 0, 0, 0, 0];
        let bytes = value.to_le_bytes();
        request[4..4 + usize::from(length)].copy_from_slice(&bytes[..usize::from(length)]);
        self.sdo(&request).map(|_| ())
    }

    /// Reads an object of at most four bytes by SDO.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        self.sdo(&[0x40, low, high, sub, 0, 0, 0, 0])
    }

    /// The data of the answer to an expedited request, or the abort code. Other frames that wait
    /// are not taken.
    fn sdo(&mut self, request: &[u8; 8]) -> Result<u32, u32> {
        self.give(&frame(0x600 + ID, request));
        let sent = self.drain();
        let [(key, data)] = &sent[..] else {
            panic!("not one answer: {sent:02X?}");
        };
        assert_eq!((*key, data.len()), (0x580 + ID, 8));
        assert_eq!(data[1..4], request[1..4]);
        let value = u32::from_le_bytes(data[4..].try_into().expect("four bytes"));
        match data[0] {
            0x80 => Err(value),
            0x43 | 0x47 | 0x4B | 0x4F | 0x60 => Ok(value),
            other => panic!("answer {other:02X}"),
        }
    }

    /// Writes by SDO what must be taken.
    pub fn must(&mut self, index: u16, sub: u8, value: u32) {
        let written = self.write(index, sub, value);
        assert_eq!(written, Ok(()), "0x{index:04X},{sub} = 0x{value:X}");
    }

    /// The application sets a number.
    pub fn set(&mut self, index: u16, sub: u8, value: u64) {
        let field = self.field(index, sub);
        self.node.image().set_bytes(field, &value.to_le_bytes());
    }

    /// What a number is, zero extended.
    pub fn get(&mut self, index: u16, sub: u8) -> u64 {
        let field = self.field(index, sub);
        self.node.image().wide(field)
    }

    /// Steps 1 to 4 of the standard's procedure: the PDO whose parameters are at `index` is off,
    /// has the type and maps `entries`.
    pub fn map_off(&mut self, index: u16, transmission_type: u8, entries: &[u32]) {
        let mapping = index + 0x200;
        let cob_id = self.read(index, 1).expect("a COB-ID");
        self.must(index, 1, cob_id | OFF);
        self.must(index, 2, u32::from(transmission_type));
        self.must(mapping, 0, 0);
        for (entry, sub) in entries.iter().zip(1..) {
            self.must(mapping, sub, *entry);
        }
        self.must(mapping, 0, entries.len() as u32);
    }

    /// The whole procedure; afterwards the PDO is on.
    pub fn map(&mut self, index: u16, cob_id: u32, transmission_type: u8, entries: &[u32]) {
        self.map_off(index, transmission_type, entries);
        self.must(index, 1, cob_id);
    }
}
