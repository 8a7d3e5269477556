//! Devices that speak nothing but LSS, and say when they boot. The tests of the command put them
//! behind a door.

#![allow(dead_code, reason = "each test file uses its part")]

use std::collections::VecDeque;

use can::Frame;
use canopen::lss::{
    BitTiming, BitTimings, Event, Identity, Reply, Request, Slave, State, StoreError,
};
use canopen::nmt::Command;
use canopen::{Instant, NodeId};
use client::{Link, LinkError};

/// One device with its flash.
#[derive(Debug)]
pub(crate) struct Device {
    pub(crate) slave: Slave,
    pub(crate) stored: (Option<NodeId>, BitTiming),
    /// What storing comes to.
    pub(crate) store: Result<(), StoreError>,
}

impl Device {
    /// A device that does not change to 800 kbit/s.
    pub(crate) fn new(identity: Identity, node: Option<NodeId>) -> Device {
        let supported = BitTimings::NONE
            .with(BitTiming::Kbit1000)
            .with(BitTiming::Kbit250);
        let stored = (node, BitTiming::Kbit1000);
        Device {
            slave: Slave::new(identity, stored.0, stored.1, supported),
            stored,
            store: Ok(()),
        }
    }

    /// Takes a frame; gives what the device sends upon it.
    pub(crate) fn receive(&mut self, frame: &Frame, now: Instant) -> Option<Frame> {
        if let (0, &[command, id]) = (frame.key(), frame.data())
            && Command::from_byte(command) == Some(Command::ResetCommunication)
            && self.slave.node_id().map(NodeId::get) == Some(id)
        {
            return self.slave.reset_communication().map(boot_up);
        }
        match self.slave.receive(Request::from_frame(frame)?, now)? {
            Reply::Answer(answer) => Some(answer.frame()),
            Reply::Event(Event::StoreConfiguration {
                node_id,
                bit_timing,
            }) => {
                if self.store.is_ok() {
                    self.stored = (node_id, bit_timing);
                }
                Some(self.slave.complete(self.store)?.frame())
            }
            Reply::Event(Event::NodeIdConfigured(id)) => Some(boot_up(id)),
            Reply::Event(_) => None,
        }
    }
}

fn boot_up(id: NodeId) -> Frame {
    Frame::classic(0x700 + u16::from(id.get()), [0; 8], 1)
}

/// The n-th of devices that differ in their serial numbers, which are high ones.
pub(crate) fn nth(n: u32) -> Identity {
    Identity {
        vendor: 0x408,
        product: 3,
        revision: 0x0001_0002,
        serial: 3_000 + n,
    }
}

/// Devices on a bus that loses frames.
#[derive(Debug)]
pub(crate) struct Devices {
    pub(crate) now: Instant,
    pub(crate) all: Vec<Device>,
    /// One frame in so many is lost; 0 is none.
    pub(crate) one_lost_in: u64,
    random: u64,
    coming: VecDeque<(Instant, Frame)>,
}

impl Devices {
    pub(crate) fn new(all: Vec<Device>) -> Devices {
        Devices {
            now: Instant::ZERO,
            all,
            one_lost_in: 0,
            random: 0x9E37_79B9_7F4A_7C15,
            coming: VecDeque::new(),
        }
    }

    /// Unconfigured devices, numbered from 0.
    pub(crate) fn unconfigured(count: u32) -> Devices {
        Devices::new((0..count).map(|n| Device::new(nth(n), None)).collect())
    }

    /// Whether all are in this state.
    pub(crate) fn all_in(&self, state: State) -> bool {
        self.all.iter().all(|device| device.slave.state() == state)
    }

    pub(crate) fn ids(&self) -> Vec<Option<u8>> {
        let ids = self.all.iter().map(|device| device.slave.node_id());
        ids.map(|id| id.map(NodeId::get)).collect()
    }

    fn loses(&mut self) -> bool {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.one_lost_in != 0 && self.random.is_multiple_of(self.one_lost_in)
    }
}

impl Link for Devices {
    fn now(&self) -> Instant {
        self.now
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.now = self.now.plus_us(130);
        for n in 0..self.all.len() {
            if self.loses() {
                continue;
            }
            if let Some(answer) = self.all[n].receive(&frame, self.now)
                && !self.loses()
            {
                let last = self.coming.back().map_or(self.now, |(at, _)| *at);
                self.coming
                    .push_back((last.max(self.now).plus_us(130), answer));
            }
        }
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        match self.coming.front().copied() {
            Some((at, frame)) if at <= until => {
                self.coming.pop_front();
                self.now = self.now.max(at);
                Ok(Some((at, frame)))
            }
            _ => {
                self.now = self.now.max(until);
                for device in &mut self.all {
                    while device.slave.poll(self.now).is_some() {}
                }
                Ok(None)
            }
        }
    }
}
