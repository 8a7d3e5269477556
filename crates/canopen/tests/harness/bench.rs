//! A node on a bench: frames in, frames out, an owner that writes down what it is asked.

use can::{Frame, StandardId};
use canopen::{Address, Device, Events, Handle, Image, Instant, Node, NodeId, Owner, Verdict};

use super::devices;

/// Node ID of every node on a bench.
pub const ID: u8 = 5;

/// An owner that accepts what it was not told to judge otherwise.
#[derive(Debug, Default)]
pub struct Recorder {
    /// What to answer, per object.
    pub verdicts: Vec<(u16, Verdict)>,
    /// What it was asked: index, bytes, and the target 0x2007 at that time.
    pub asked: Vec<(u16, Vec<u8>, u32)>,
    /// How often it published.
    pub publications: u32,
    /// What it publishes in 0x2008; 0x2009 is its negative.
    pub position: i32,
}

const TARGET: Handle<u32> = devices::OBJECTS_CONST.handle(0x2007, 0);
const POSITION: Handle<i32> = devices::OBJECTS_CONST.handle(0x2008, 0);
const VELOCITY: Handle<i32> = devices::OBJECTS_CONST.handle(0x2009, 0);

impl Owner for Recorder {
    fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        self.asked
            .push((object.index, new.to_vec(), image.get(TARGET)));
        self.verdicts
            .iter()
            .find(|(index, _)| *index == object.index)
            .map_or(Verdict::Accept, |(_, verdict)| *verdict)
    }

    fn publish(&mut self, image: &mut Image<'_>) {
        self.publications += 1;
        image.set(POSITION, self.position);
        image.set(VELOCITY, -self.position);
    }
}

/// A frame that was sent: identifier and data.
pub type Sent = (u16, Vec<u8>);

/// One node, its owner and its clock.
#[derive(Debug)]
pub struct Bench<O = Recorder> {
    pub node: Node<Vec<u8>>,
    pub owner: O,
    pub now: Instant,
    /// The events of the last call.
    pub events: Events,
}

impl Bench {
    /// A node of a device of `devices.rs` that has booted, its boot-up frame taken.
    pub fn new(device: &'static Device) -> Bench {
        Bench::with(device, Recorder::default())
    }

    /// A node before its start.
    pub fn unstarted(device: &'static Device) -> Bench {
        Bench::unstarted_with(device, Recorder::default())
    }

    /// A node in operational of a device without a boot-up frame.
    pub fn operational_without_boot_up(device: &'static Device) -> Bench {
        let mut bench = Bench::unstarted(device);
        bench.node.start(bench.now);
        bench.send(0, &[0x01, ID]);
        bench
    }

    /// A node in operational.
    pub fn operational(device: &'static Device) -> Bench {
        let mut bench = Bench::new(device);
        bench.nmt(0x01);
        bench
    }
}

impl<O: Owner> Bench<O> {
    /// A node of any device and owner that has booted, its boot-up frame taken.
    pub fn with(device: &'static Device, owner: O) -> Bench<O> {
        let mut bench = Bench::unstarted_with(device, owner);
        bench.events = bench.node.start(bench.now);
        assert_eq!(bench.drain(), [(0x700 + u16::from(ID), vec![0])]);
        bench
    }

    /// The same before its start.
    pub fn unstarted_with(device: &'static Device, owner: O) -> Bench<O> {
        let id = NodeId::new(ID).expect("a node ID");
        Bench {
            node: Node::new(device, vec![0; device.table.image_bytes()], id),
            owner,
            now: Instant(1_000_000_000),
            events: Events::NOTHING,
        }
    }

    /// Hands over any frame; gives what the node sends.
    pub fn frame(&mut self, frame: Frame) -> Vec<Sent> {
        self.events = self.node.receive(&frame, self.now, &mut self.owner);
        self.drain()
    }

    /// Hands over a data frame.
    pub fn send(&mut self, id: u16, data: &[u8]) -> Vec<Sent> {
        let id = StandardId::new(id).expect("11 bits");
        self.frame(Frame::data_frame(id, data).expect("at most 8 bytes"))
    }

    /// An NMT command to this node.
    pub fn nmt(&mut self, command: u8) {
        assert_eq!(self.send(0, &[command, ID]), []);
    }

    /// A SYNC on 0x80.
    pub fn sync(&mut self) -> Vec<Sent> {
        self.send(0x80, &[])
    }

    /// All that waits, of 11 bits.
    pub fn drain(&mut self) -> Vec<Sent> {
        let plain = |frame: Frame| {
            assert!(!frame.is_extended() && !frame.is_remote());
            (frame.raw_id() as u16, frame.data().to_vec())
        };
        self.frames().into_iter().map(plain).collect()
    }

    /// All that waits.
    pub fn frames(&mut self) -> Vec<Frame> {
        let mut sent = Vec::new();
        while let Some(frame) = self.node.transmit(&mut self.owner) {
            assert!(sent.len() < 200, "transmit has no end");
            sent.push(frame);
        }
        assert!(self.node.is_silent());
        sent
    }

    /// Moves the clock on by `ms` and polls.
    pub fn after_ms(&mut self, ms: u64) -> Vec<Sent> {
        self.now = self.now.plus_ms(ms);
        self.events = self.node.poll(self.now, &mut self.owner);
        self.drain()
    }

    /// An SDO request as it stands; the eight bytes of the answer, if there is one.
    pub fn sdo(&mut self, request: &[u8]) -> Option<[u8; 8]> {
        let mut sent = self.send(0x600 + u16::from(ID), request);
        let (id, data) = sent.pop()?;
        assert!(sent.is_empty(), "more than one answer");
        assert_eq!(id, 0x580 + u16::from(ID));
        Some(data.try_into().expect("an SDO answer has eight bytes"))
    }

    /// Writes an object with its size said.
    pub fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let command = 0x23 | (4 - value.len() as u8) << 2;
        let mut request = [command, low, high, sub, 0, 0, 0, 0];
        request[4..4 + value.len()].copy_from_slice(value);
        let answer = self.sdo(&request).expect("an answer");
        assert_eq!(answer[1..4], [low, high, sub]);
        let data = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
        match answer[0] {
            0x60 => Ok(()),
            0x80 => Err(data),
            other => panic!("answer {other:02X}"),
        }
    }

    /// Reads an object; the four data bytes of the answer.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        let answer = self
            .sdo(&[0x40, low, high, sub, 0, 0, 0, 0])
            .expect("an answer");
        assert_eq!(answer[1..4], [low, high, sub]);
        let data = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
        match answer[0] {
            0x42 | 0x43 | 0x47 | 0x4B | 0x4F => Ok(data),
            0x80 => Err(data),
            other => panic!("answer {other:02X}"),
        }
    }

    /// Maps `entries` into the PDO whose parameters are at `index` (0x1400.. or 0x1800..), gives it
    /// a transmission type, and switches it on under `cob_id`; by the standard's procedure.
    pub fn map(&mut self, index: u16, cob_id: u32, transmission_type: u8, entries: &[u32]) {
        let mapping = index + 0x200;
        self.write(index, 1, &(cob_id | 1 << 31).to_le_bytes())
            .expect("off");
        self.write(index, 2, &[transmission_type]).expect("type");
        self.write(mapping, 0, &[0]).expect("count 0");
        for (entry, sub) in entries.iter().zip(1..) {
            self.write(mapping, sub, &entry.to_le_bytes())
                .expect("entry");
        }
        self.write(mapping, 0, &[entries.len() as u8])
            .expect("count");
        self.write(index, 1, &cob_id.to_le_bytes()).expect("on");
    }
}
