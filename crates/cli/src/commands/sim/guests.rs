//! The outside programs that are on the bus, and what is said about their coming and going.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use bus::{ClientId, Doors, LeaveReason};

/// Bits per second of the simulated bus.
const BIT_RATE: u32 = 1_000_000;

/// Who is on the bus. The simulation knows outside programs by numbers, counted in the order in
/// which they joined, so that a recording does not depend on anything else.
#[derive(Debug, Default)]
pub(super) struct Guests {
    joined: u32,
    present: BTreeMap<u32, ClientId>,
}

impl Guests {
    /// Somebody joined.
    pub(super) fn join(
        &mut self,
        client: ClientId,
        doors: &Doors,
        door: usize,
        peer: SocketAddr,
        listen_only: bool,
        bit_rate: Option<u32>,
    ) {
        self.joined += 1;
        let number = self.joined;
        self.present.insert(number, client);
        let only = if listen_only { ", to listen only" } else { "" };
        let door = address(doors, door);
        eprintln!("client {number} joined from {peer} at {door}{only}");
        if let Some(rate) = bit_rate.filter(|rate| *rate != BIT_RATE) {
            eprintln!(
                "warning: client {number} asked for {rate} bit/s; this bus has {BIT_RATE}, and on \
                 a real one it would now disturb everybody"
            );
        }
    }

    /// Somebody left.
    pub(super) fn leave(&mut self, client: ClientId, reason: &LeaveReason) {
        if let Some(number) = self.number(client) {
            self.present.remove(&number);
            eprintln!("client {number} left: {reason}");
        }
    }

    /// Somebody never got onto the bus.
    pub(super) fn refuse(&self, doors: &Doors, door: usize, peer: SocketAddr, why: &LeaveReason) {
        // To look whether a port is open, and to go again, is what scripts do.
        if *why != LeaveReason::Disconnected {
            eprintln!("{peer} did not join at {}: {why}", address(doors, door));
        }
    }

    /// The number of one who is on the bus.
    pub(super) fn number(&self, client: ClientId) -> Option<u32> {
        let mut present = self.present.iter();
        present.find_map(|(number, other)| (*other == client).then_some(*number))
    }

    /// Who has this number, if still on the bus.
    pub(super) fn client(&self, number: u32) -> Option<ClientId> {
        self.present.get(&number).copied()
    }
}

fn address(doors: &Doors, door: usize) -> String {
    let address = doors.addresses().get(door);
    address.map_or_else(|| "a door".to_owned(), ToString::to_string)
}
