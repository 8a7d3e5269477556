//! The outside programs that are on the bus, and what is said about their coming and going.

use std::collections::BTreeMap;

use bus::{ClientId, Doors, LeaveReason, Peer, Trouble};
use can::BitRate;

use crate::output::tell;

/// Who is on the bus. The simulation knows outside programs by numbers, counted in the order in
/// which they joined, so that a recording does not depend on anything else.
#[derive(Debug, Default)]
pub(super) struct Guests {
    joined: u32,
    present: BTreeMap<u32, Guest>,
}

#[derive(Clone, Copy, Debug)]
struct Guest {
    client: ClientId,
    /// Its frames that wait for the wire.
    waiting: u32,
}

impl Guests {
    /// Somebody joined.
    pub(super) fn join(
        &mut self,
        client: ClientId,
        doors: &Doors,
        door: usize,
        peer: &Peer,
        listen_only: bool,
    ) {
        self.joined += 1;
        let number = self.joined;
        self.present.insert(number, Guest { client, waiting: 0 });
        let only = if listen_only { ", to listen only" } else { "" };
        let door = address(doors, door);
        tell(format_args!(
            "client {number} joined from {peer} at {door}{only}"
        ));
    }

    /// Somebody who has just joined asked for a bit rate, in bits per second. `common` is the bus's.
    pub(super) fn check_rate(&self, client: ClientId, asked: Option<u32>, common: BitRate) {
        let common = common.bit_s();
        if let Some(rate) = asked.filter(|rate| *rate != common)
            && let Some(number) = self.number(client)
        {
            tell(format_args!(
                "warning: client {number} asked for {rate} bit/s; this bus has {common}, and on a \
                 real one it would now disturb everybody"
            ));
        }
    }

    /// Somebody left.
    pub(super) fn leave(&mut self, client: ClientId, reason: &LeaveReason) {
        if let Some(number) = self.number(client) {
            self.present.remove(&number);
            tell(format_args!("client {number} left: {reason}"));
        }
    }

    /// Somebody never got onto the bus.
    pub(super) fn refuse(&self, doors: &Doors, door: usize, peer: &Peer, why: &LeaveReason) {
        // To look whether a port is open, and to go again, is what scripts do.
        if *why != LeaveReason::Disconnected {
            tell(format_args!(
                "{peer} did not join at {}: {why}",
                address(doors, door)
            ));
        }
    }

    /// An interface has something to report.
    pub(super) fn trouble(&self, doors: &Doors, door: usize, trouble: &Trouble) {
        tell(format_args!("{}: {trouble}", address(doors, door)));
    }

    fn number(&self, client: ClientId) -> Option<u32> {
        let mut present = self.present.iter();
        present.find_map(|(number, guest)| (guest.client == client).then_some(*number))
    }

    /// The number of one who is on the bus and hands it a frame.
    pub(super) fn sends(&mut self, client: ClientId) -> Option<u32> {
        let number = self.number(client)?;
        self.present.get_mut(&number)?.waiting += 1;
        Some(number)
    }

    /// A frame of this one got onto the wire, so another may come. Who that is, if still here.
    pub(super) fn sent(&mut self, number: u32, doors: &mut Doors) -> Option<ClientId> {
        let guest = self.present.get_mut(&number)?;
        // A disturbance may have put a frame on the wire twice, which the client has sent once.
        if guest.waiting > 0 {
            guest.waiting -= 1;
            doors.grant(guest.client, 1);
        }
        Some(guest.client)
    }

    /// Nothing waits any more. A frame that a drive sent at the same time and with the same bits
    /// has been counted as the drive's only; it must not cost its other sender a place for ever.
    pub(super) fn all_sent(&mut self, doors: &mut Doors) {
        for guest in self.present.values_mut().filter(|guest| guest.waiting > 0) {
            doors.grant(guest.client, guest.waiting);
            guest.waiting = 0;
        }
    }
}

fn address(doors: &Doors, door: usize) -> String {
    let address = doors.addresses().get(door);
    address.map_or_else(|| "a door".to_owned(), ToString::to_string)
}
