//! The doors over real sockets on loopback: what clients see, and what the simulation sees.

mod ends;
mod garbage;
mod handshake;
mod peer;
mod pressure;
mod seats;

use bus::{ClientId, Doors, Endpoint, Event, Options};
use can::{Frame, StandardId};
use std::time::{Duration, Instant};

/// Long enough for a busy machine; only a failing test waits so long.
const PATIENCE: Duration = Duration::from_secs(20);

fn open(options: &Options) -> Doors {
    let endpoints: [Endpoint; 2] =
        ["socketcand://127.0.0.1:0", "slcan://127.0.0.1:0"].map(|text| text.parse().unwrap());
    Doors::open(&endpoints, options).unwrap()
}

/// The next event; fails if none comes.
fn next(doors: &mut Doors) -> Event {
    event_within(doors, PATIENCE).expect("an event")
}

fn event_within(doors: &mut Doors, time: Duration) -> Option<Event> {
    let end = Instant::now() + time;
    loop {
        let event = doors.take();
        let left = end.saturating_duration_since(Instant::now());
        if event.is_some() || left.is_zero() {
            return event;
        }
        doors.wait(left);
    }
}

/// The client that joins next.
fn joined(doors: &mut Doors) -> ClientId {
    match next(doors) {
        Event::Joined { client, .. } => client,
        other => panic!("{other:?} instead of a client joining"),
    }
}

/// The frame that comes next from this client, whose mailbox is emptied at once.
fn frame_from(doors: &mut Doors, from: ClientId) -> Frame {
    match next(doors) {
        Event::Frame { client, frame } if client == from => {
            doors.grant(client, 1);
            frame
        }
        other => panic!("{other:?} instead of a frame from {from}"),
    }
}

/// A frame that carries its number.
fn numbered(number: u32) -> Frame {
    Frame::data_frame(StandardId::new(0x300).unwrap(), &number.to_le_bytes()).unwrap()
}

fn number(frame: &Frame) -> u32 {
    assert_eq!(frame.raw_id(), 0x300);
    u32::from_le_bytes(frame.data().try_into().unwrap())
}
