//! The master's way to a simulated bus: time advances while it waits.

use std::collections::VecDeque;
use std::fmt;

use can::Frame;
use canopen::Instant;
use client::{Link, LinkError};

use crate::medium::Sender;
use crate::{Bus, Happening, Injection, Notice, Recording};

/// A [`Link`] to a bus in virtual time. Waiting for a frame runs the simulation.
#[derive(Debug)]
pub struct VirtualLink<'a> {
    bus: &'a mut Bus,
    client: u32,
    received: VecDeque<Happening>,
    recording: Option<&'a mut Recording>,
    teller: Option<Teller<'a>>,
}

/// Who is told of notices while a link waits.
pub trait Listener {
    /// There is something that people should know of.
    fn hear(&self, notice: &Notice);
}

struct Teller<'a>(&'a dyn Listener);

impl fmt::Debug for Teller<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Teller")
    }
}

impl<'a> VirtualLink<'a> {
    /// Outside client number `client` of `bus`.
    pub fn new(bus: &'a mut Bus, client: u32) -> VirtualLink<'a> {
        VirtualLink {
            bus,
            client,
            received: VecDeque::new(),
            recording: None,
            teller: None,
        }
    }

    /// Writes all traffic and every injection down.
    pub fn record(mut self, recording: &'a mut Recording) -> VirtualLink<'a> {
        self.recording = Some(recording);
        self
    }

    /// Writes notices down, too, and tells them in their place between the frames. Without it they
    /// stay with the bus.
    pub fn tell(mut self, listener: &'a dyn Listener) -> VirtualLink<'a> {
        self.teller = Some(Teller(listener));
        self
    }

    /// The bus, to look at and to act upon.
    pub fn bus(&mut self) -> &mut Bus {
        self.bus
    }

    fn collect(&mut self) -> Result<(), LinkError> {
        let happenings = match &self.teller {
            Some(_) => self.bus.take_happenings(),
            None => {
                let traffic = self.bus.take_traffic().into_iter();
                traffic.map(Happening::Frame).collect()
            }
        };
        for happening in happenings {
            if let Some(recording) = &mut self.recording {
                recording.happening(&happening).map_err(failed)?;
            }
            let copies = match &happening {
                Happening::Notice(_) => 1,
                Happening::Error(_) => 0,
                Happening::Frame(traffic) if traffic.sender == Sender::Outside(self.client) => 0,
                Happening::Frame(traffic) => traffic.copies,
            };
            if let Happening::Frame(traffic) = happening {
                let again = (1..copies).map(|_| Happening::Frame(traffic));
                self.received.extend(again);
            }
            if copies > 0 {
                self.received.push_back(happening);
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
            while let Some(happening) = self.received.pop_front() {
                match (happening, &self.teller) {
                    (Happening::Frame(traffic), _) => {
                        return Ok(Some((traffic.at, traffic.frame)));
                    }
                    (Happening::Notice(notice), Some(Teller(listener))) => {
                        listener.hear(&notice);
                    }
                    (Happening::Notice(_), None) | (Happening::Error(_), _) => {}
                }
            }
            if !self.bus.run_to_frame(until) {
                return Ok(None);
            }
        }
    }
}
