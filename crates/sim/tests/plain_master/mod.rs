//! A master of one extended P3 that speaks plain CiA 301 and CiA 402.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file is a crate of its own and uses a part"
)]

use canopen::{Address, DataType, Instant, NodeId};
use cia402::Statusword;
use client::axis::{Axis, Walk};
use client::sdo::SdoError;
use client::{Client, RequestForm, Value, block_on};
use sim::{Bus, BusSettings, DriveSettings, VirtualLink};

pub const NODE: NodeId = NodeId::new(1).unwrap();
const AXIS: Axis = Axis {
    walk: Walk::Standard,
    ..Axis::new(NODE)
};

/// Operation enabled without and with halt.
pub const RUN: i64 = 0x0F;
pub const HALT: i64 = 0x10F;

/// See the module.
pub struct Master<'a> {
    pub client: Client<VirtualLink<'a>>,
}

/// A bus with one booted drive.
pub fn bus() -> Bus {
    let drive = DriveSettings::new(NODE, &personalities::p3_extended::P3_EXTENDED);
    let mut bus = Bus::new(BusSettings::new(402, vec![drive]));
    bus.run_until(Instant::ZERO.plus_ms(50));
    bus.take_traffic();
    bus
}

impl<'a> Master<'a> {
    pub fn new(bus: &'a mut Bus) -> Master<'a> {
        let mut client = Client::new(VirtualLink::new(bus, 0));
        client.settings.form = RequestForm::Standard;
        Master { client }
    }

    /// The type that the drive's dictionary gives an object.
    pub fn kind(index: u16, sub: u8) -> DataType {
        let table = personalities::p3_extended::OBJECTS.table();
        let entry = table.find(index, sub).expect("the object");
        table.row(&entry).expect("its row").data_type
    }

    pub fn try_write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), SdoError> {
        let bytes = Value::Integer(value)
            .encode(Master::kind(index, sub))
            .expect("a value of that type");
        block_on(self.client.download(NODE, Address::new(index, sub), bytes))
    }

    #[track_caller]
    pub fn write(&mut self, index: u16, sub: u8, value: i64) {
        self.try_write(index, sub, value).expect("a write");
    }

    #[track_caller]
    pub fn read(&mut self, index: u16, sub: u8) -> i64 {
        let object = Address::new(index, sub);
        let kind = Master::kind(index, sub);
        match block_on(self.client.read(NODE, object, kind)).expect("a value") {
            Value::Integer(value) => value,
            other => panic!("{other:?}"),
        }
    }

    pub fn status(&mut self) -> Statusword {
        Statusword(self.read(0x6041, 0) as u16)
    }

    /// Lets virtual time pass; the codes of the emergencies in it.
    pub fn wait_ms(&mut self, ms: u64) -> Vec<u16> {
        let until = self.client.now().plus_ms(ms);
        let mut codes = Vec::new();
        while let Some((_, frame)) = block_on(self.client.receive(until)).expect("a link") {
            if frame.raw_id() == 0x81 {
                codes.push(u16::from_le_bytes([frame.bytes()[0], frame.bytes()[1]]));
            }
        }
        codes
    }

    #[track_caller]
    pub fn enable(&mut self) {
        let seen = block_on(AXIS.enable(&mut self.client)).expect("operation enabled");
        assert!(seen.remote());
    }

    /// The shaft's true speed, counts/s.
    pub fn true_speed(&mut self) -> f64 {
        let drive = self.client.link().bus().drive(NODE).expect("the drive");
        let turns_per_s = f64::from(drive.plant().truth().speed_rad_s) / core::f64::consts::TAU;
        turns_per_s * 4096.0
    }
}
