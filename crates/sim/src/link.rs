//! The master's way to a simulated bus: time advances while it waits.

use can::Frame;
use canopen::Instant;
use client::{Link, LinkError};

use crate::medium::{Sender, Traffic};
use crate::{Bus, Injection, Recording};

/// A [`Link`] to a bus in virtual time. Waiting for a frame runs the simulation.
#[derive(Debug)]
pub struct VirtualLink<'a> {
    bus: &'a mut Bus,
    client: u32,
    received: std::collections::VecDeque<Traffic>,
    recording: Option<&'a mut Recording>,
}

impl<'a> VirtualLink<'a> {
    /// Outside client number `client` of `bus`.
    pub fn new(bus: &'a mut Bus, client: u32) -> VirtualLink<'a> {
        VirtualLink {
            bus,
            client,
            received: std::collections::VecDeque::new(),
            recording: None,
        }
    }

    /// Writes all traffic and every injection down.
    pub fn record(mut self, recording: &'a mut Recording) -> VirtualLink<'a> {
        self.recording = Some(recording);
        self
    }

    /// The bus, to look at and to act upon.
    pub fn bus(&mut self) -> &mut Bus {
        self.bus
    }

    fn collect(&mut self) -> Result<(), LinkError> {
        for traffic in self.bus.take_traffic() {
            if let Some(recording) = &mut self.recording {
                recording.frame(&traffic).map_err(failed)?;
            }
            if traffic.sender != Sender::Outside(self.client) {
                let copies = usize::from(traffic.copies);
                self.received.extend(std::iter::repeat_n(traffic, copies));
            }
        }
        Ok(())
    }
}

fn failed(error: std::io::Error) -> LinkError {
    LinkError::Failed {
        door: "recording".to_owned(),
        cause: error.to_string(),
    }
}

impl Link for VirtualLink<'_> {
    fn now(&self) -> Instant {
        self.bus.now()
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        if let Some(recording) = &mut self.recording {
            recording
                .injection(&Injection {
                    at: self.bus.now(),
                    client: self.client,
                    frame,
                })
                .map_err(failed)?;
        }
        // As a replay does it: what is due now comes first.
        self.bus.run_until(self.bus.now());
        self.bus.send(self.client, frame);
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        loop {
            self.collect()?;
            if let Some(traffic) = self.received.pop_front() {
                return Ok(Some((traffic.at, traffic.frame)));
            }
            if !self.bus.run_to_frame(until) {
                return Ok(None);
            }
        }
    }
}
