//! A client and the model on a wire that loses and doubles frames.

use std::collections::VecDeque;

use can::Frame;
use canopen::sdo_client::{Done, Failure, Method, SdoClient};
use canopen::{Address, Instant};

use super::model::Server;

/// The model's object.
pub const OBJECT: Address = Address::new(0x2345, 6);

/// What happens to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrives.
    Arrives,
    /// Nobody gets it.
    Lost,
    /// It arrives twice, one right behind the other.
    Doubled,
}

/// A wire whose fates come from an iterator; when that has ended, everything arrives.
#[derive(Debug)]
pub struct Wire<F> {
    fates: F,
    now: Instant,
    to_client: VecDeque<Frame>,
}

impl<F: Iterator<Item = Fate>> Wire<F> {
    /// A wire with nothing on it.
    pub fn new(fates: F) -> Wire<F> {
        Wire {
            fates,
            now: Instant(1),
            to_client: VecDeque::new(),
        }
    }

    fn copies(&mut self) -> usize {
        match self.fates.next() {
            None | Some(Fate::Arrives) => 1,
            Some(Fate::Lost) => 0,
            Some(Fate::Doubled) => 2,
        }
    }

    /// Reads the model's object.
    pub fn upload(
        &mut self,
        client: &mut SdoClient,
        server: &mut Server,
        method: Method,
    ) -> (Result<Done, Failure>, Vec<u8>) {
        client.upload(OBJECT, method).expect("an idle client");
        self.run(client, server, &[])
    }

    /// Writes the model's object.
    pub fn download(
        &mut self,
        client: &mut SdoClient,
        server: &mut Server,
        method: Method,
        bytes: &[u8],
    ) -> Result<Done, Failure> {
        let count = u32::try_from(bytes.len()).expect("an object's length");
        client
            .download(OBJECT, count, method)
            .expect("an idle client");
        self.run(client, server, bytes).0
    }

    /// Runs the transfer to its end.
    fn run(
        &mut self,
        client: &mut SdoClient,
        server: &mut Server,
        mut source: &[u8],
    ) -> (Result<Done, Failure>, Vec<u8>) {
        let mut taken: Vec<u8> = Vec::new();
        let mut sink = |offset: u32, bytes: &[u8]| {
            taken.truncate(offset as usize);
            assert_eq!(taken.len(), offset as usize, "a gap before {offset}");
            taken.extend_from_slice(bytes);
            Ok(())
        };
        let mut idle = 0;
        // Bounds how long a transfer may take: it must not go on for ever.
        for _ in 0..2_000_000 {
            self.now = self.now.plus_us(100);
            let sent = client.transmit(self.now, &mut source);
            if let Some(frame) = sent {
                for _ in 0..self.copies() {
                    server.receive(&frame);
                }
            } else if let Some(outcome) = client.outcome() {
                return (outcome, taken);
            }
            if let Some(frame) = server.out.pop_front() {
                for _ in 0..self.copies() {
                    self.to_client.push_back(frame);
                }
            }
            let answer = self.to_client.pop_front();
            if let Some(frame) = answer {
                client.receive(&frame, self.now, &mut sink);
            }
            // One frame a turn, and the second copy of one comes with the next turn.
            if sent.is_none() && answer.is_none() && server.out.is_empty() {
                idle += 1;
                assert!(client.next_deadline() > self.now, "a deadline passed by");
                assert_ne!(
                    client.next_deadline(),
                    Instant::NEVER,
                    "nothing will happen"
                );
                self.now = client.next_deadline();
                client.poll(self.now);
            } else {
                client.poll(self.now);
            }
        }
        panic!("no end after {idle} silences");
    }

    /// Lets everything that is on its way arrive at a client that is idle.
    pub fn settle(&mut self, client: &mut SdoClient, server: &mut Server) {
        for frame in self.to_client.drain(..).chain(server.out.drain(..)) {
            let mut none = |_: u32, _: &[u8]| panic!("bytes without transfer");
            assert!(!client.receive(&frame, self.now, &mut none));
        }
    }
}
