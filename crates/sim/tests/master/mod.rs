//! A master that knows nothing of the drives but what goes over the bus.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file is a crate of its own and uses a part"
)]

use can::Frame;
use canopen::{Device, Instant, NodeId};
use sim::{Bus, BusSettings, DriveSettings, Traffic, VirtualDrive};

/// Statusword patterns of CiA 402 under the mask 0x6F.
pub const SWITCH_ON_DISABLED: u16 = 0x40;
pub const READY_TO_SWITCH_ON: u16 = 0x21;
pub const OPERATION_ENABLED: u16 = 0x27;
pub const QUICK_STOP_ACTIVE: u16 = 0x07;
pub const FAULT_REACTION_ACTIVE: u16 = 0x0F;
pub const FAULT: u16 = 0x08;

/// "save".
pub const SAVE: [u8; 4] = [0x73, 0x61, 0x76, 0x65];

pub struct Master {
    pub bus: Bus,
    /// Everything that the bus has carried.
    pub log: Vec<Traffic>,
}

pub fn id(node: u8) -> NodeId {
    NodeId::new(node).unwrap()
}

pub fn p3(node: u8) -> DriveSettings {
    DriveSettings::new(id(node), &personalities::p3::P3)
}

pub fn frame(id: u16, data: &[u8]) -> Frame {
    let mut bytes = [0; 8];
    bytes[..data.len()].copy_from_slice(data);
    Frame::classic(id, bytes, data.len() as u8)
}

impl Master {
    /// A bus of P3s that have booted; the log is empty.
    pub fn new(nodes: &[u8]) -> Master {
        Master::with(nodes.iter().map(|node| p3(*node)).collect())
    }

    pub fn with(drives: Vec<DriveSettings>) -> Master {
        let mut master = Master {
            bus: Bus::new(BusSettings::new(7, drives)),
            log: Vec::new(),
        };
        master.run_ms(50);
        master.log.clear();
        master
    }

    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    pub fn drive(&mut self, node: u8) -> &mut VirtualDrive {
        self.bus.drive(id(node)).unwrap()
    }

    pub fn run_us(&mut self, us: u64) {
        self.bus.run_until(self.bus.now().plus_ns(us * 1000));
        self.log.extend(self.bus.take_traffic());
    }

    pub fn run_ms(&mut self, ms: u64) {
        self.run_us(ms * 1000);
    }

    pub fn send(&mut self, id: u16, data: &[u8]) {
        self.bus.send(0, frame(id, data));
    }

    /// A request and its answer, or `None` after 20 ms.
    fn ask(&mut self, node: u8, data: &[u8]) -> Option<[u8; 8]> {
        self.ask_within(node, data, 20)
    }

    /// An upload's answer, if there is one in so many ms.
    pub fn try_read_within(&mut self, node: u8, index: u16, sub: u8, ms: u64) -> Option<[u8; 8]> {
        let [low, high] = index.to_le_bytes();
        self.ask_within(node, &[0x40, low, high, sub], ms)
    }

    fn ask_within(&mut self, node: u8, data: &[u8], ms: u64) -> Option<[u8; 8]> {
        self.send(0x600 + u16::from(node), data);
        let end = self.bus.now().plus_ms(ms);
        loop {
            let came = self.bus.run_to_frame(end);
            let new = self.bus.take_traffic();
            let answer = new
                .iter()
                .find(|t| t.frame.raw_id() == 0x580 + u32::from(node))
                .map(|t| t.frame.bytes());
            self.log.extend(new);
            if answer.is_some() || !came {
                return answer;
            }
        }
    }

    /// The device, if it speaks plain CiA 301. The faithful P3 takes frames as short as the manual's
    /// and answers without a size, the extended one whole frames and with it. One that is just
    /// getting a node ID over the bus is a P3.
    fn standard(&mut self, node: u8) -> Option<&'static Device> {
        let device = &self.bus.drive(id(node))?.personality().device;
        (!device.dialect.short_requests).then_some(device)
    }

    /// Writes as the manual does, without a size; the abort code if there is one.
    pub fn try_write(&mut self, node: u8, index: u16, sub: u8, value: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut data = vec![0x22, low, high, sub];
        data.extend(value);
        if self.standard(node).is_some() {
            data[0] |= 1 | (4 - value.len() as u8) << 2;
            data.resize(8, 0);
        }
        let answer = self.ask(node, &data).expect("an answer");
        assert_eq!(answer[1..4], [low, high, sub]);
        match answer[0] {
            0x60 => Ok(()),
            0x80 => Err(u32::from_le_bytes(answer[4..].try_into().unwrap())),
            other => panic!("{other:02X}"),
        }
    }

    #[track_caller]
    pub fn write(&mut self, node: u8, index: u16, sub: u8, value: &[u8]) {
        let result = self.try_write(node, index, sub, value);
        assert_eq!(result, Ok(()), "{index:04X},{sub} := {value:02X?}");
    }

    #[track_caller]
    pub fn write_i32(&mut self, node: u8, index: u16, sub: u8, value: i32) {
        self.write(node, index, sub, &value.to_le_bytes());
    }

    #[track_caller]
    pub fn write_i16(&mut self, node: u8, index: u16, sub: u8, value: i16) {
        self.write(node, index, sub, &value.to_le_bytes());
    }

    #[track_caller]
    pub fn write_u16(&mut self, node: u8, index: u16, sub: u8, value: u16) {
        self.write(node, index, sub, &value.to_le_bytes());
    }

    /// The raw 4 data bytes of an upload, or the abort code.
    pub fn try_read(&mut self, node: u8, index: u16, sub: u8) -> Result<[u8; 4], u32> {
        let [low, high] = index.to_le_bytes();
        let standard = self.standard(node);
        let request = [0x40, low, high, sub, 0, 0, 0, 0];
        let length = if standard.is_some() { 8 } else { 4 };
        let answer = self.ask(node, &request[..length]).expect("an answer");
        assert_eq!(answer[1..4], [low, high, sub]);
        let data: [u8; 4] = answer[4..].try_into().unwrap();
        if answer[0] == 0x80 {
            return Err(u32::from_le_bytes(data));
        }
        let expected = standard.map_or(0x42, |device| {
            let entry = device.table.find(index, sub).expect("the object");
            let row = device.table.row(&entry).expect("its row");
            0x43 | (4 - row.data_type.size()) << 2
        });
        assert_eq!(answer[0], expected, "{index:04X},{sub}: {answer:02X?}");
        Ok(data)
    }

    #[track_caller]
    pub fn read(&mut self, node: u8, index: u16, sub: u8) -> i32 {
        i32::from_le_bytes(self.try_read(node, index, sub).expect("a value"))
    }

    #[track_caller]
    pub fn read_i16(&mut self, node: u8, index: u16, sub: u8) -> i16 {
        self.read(node, index, sub) as i16
    }

    pub fn status(&mut self, node: u8) -> u16 {
        self.read(node, 0x6041, 0) as u16
    }

    pub fn state(&mut self, node: u8) -> u16 {
        self.status(node) & 0x6F
    }

    pub fn position(&mut self, node: u8) -> i32 {
        self.read(node, 0x6064, 0)
    }

    /// Into operation enabled as the manual shows (l.244), then the mode.
    #[track_caller]
    pub fn enable(&mut self, node: u8, mode: u8) {
        self.write_u16(node, 0x6040, 0, 0x86);
        self.write_u16(node, 0x6040, 0, 0x0F);
        assert_eq!(self.state(node), OPERATION_ENABLED);
        self.write(node, 0x6060, 0, &[mode]);
        assert_eq!(self.read(node, 0x6061, 0), i32::from(mode));
    }

    /// Emergency frames since the log was cleared.
    pub fn emergencies(&self, node: u8) -> Vec<[u8; 8]> {
        let id = 0x80 + u32::from(node);
        let frames = self.log.iter().filter(|t| t.frame.raw_id() == id);
        frames.map(|t| t.frame.bytes()).collect()
    }

    /// Codes of the emergency frames since the log was cleared.
    pub fn emergency_codes(&self, node: u8) -> Vec<u16> {
        let codes = self.emergencies(node);
        codes
            .iter()
            .map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
            .collect()
    }
}
