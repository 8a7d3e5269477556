//! How many may come, and for how long they may stand in the doorway.

use crate::peer::Peer;
use crate::{PATIENCE, frame_from, joined, next, open};
use bus::Protocol::{self, Slcan, Socketcand};
use bus::{Doors, Event, LeaveReason, Options};
use std::io::Write;
use std::time::{Duration, Instant};

const CROWDED: &str = "< error 2 clients are connected already, which is all there may be >";

/// The next event is this refusal.
fn refused(doors: &mut Doors, door: usize, reason: LeaveReason) {
    match next(doors) {
        Event::Refused {
            door: at,
            reason: why,
            ..
        } => assert_eq!((at, why), (door, reason)),
        other => panic!("{other:?} instead of a refusal"),
    }
}

/// Connects as soon as a seat is free.
fn seated(doors: &Doors) -> Peer {
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        let mut peer = Peer::connect(doors, Socketcand);
        if peer.until(b'>') == "< hi >" {
            return peer;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("no seat ever became free")
}

/// A client that has been let in, but has not joined.
fn idle(doors: &Doors, protocol: Protocol) -> Peer {
    let mut peer = Peer::connect(doors, protocol);
    match protocol {
        Socketcand => peer.expect("< hi >"),
        _ => {
            peer.say("V\r");
            peer.expect("V1013\r");
        }
    }
    peer
}

#[test]
fn doors_share_the_seats() {
    let mut doors = open(&Options {
        clients: 2,
        ..Options::default()
    });
    let _first = idle(&doors, Socketcand);
    let second = idle(&doors, Slcan);
    assert_eq!(Peer::connect(&doors, Socketcand).rest(), CROWDED);
    refused(&mut doors, 0, LeaveReason::Crowded(2));
    assert_eq!(Peer::connect(&doors, Slcan).rest(), "\x07");
    refused(&mut doors, 1, LeaveReason::Crowded(2));
    // A seat left at one door is free for the other.
    drop(second);
    let _third = seated(&doors);
}

/// Who has gone keeps the seat until the simulation knows, and does not take two meanwhile.
#[test]
fn the_seat_is_kept_until_leave_is_taken() {
    let mut doors = open(&Options {
        clients: 2,
        ..Options::default()
    });
    let gone = Peer::join(&doors, Slcan);
    let client = joined(&mut doors);
    drop(gone);
    // Its leaving is there, but not taken; and its socket is closed.
    doors.wait(PATIENCE);
    std::thread::sleep(Duration::from_millis(50));
    let _second = idle(&doors, Socketcand);
    assert_eq!(Peer::connect(&doors, Socketcand).rest(), CROWDED);
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client,
            reason: LeaveReason::Disconnected
        }
    );
    refused(&mut doors, 0, LeaveReason::Crowded(2));
    let _third = seated(&doors);
}

/// Half a handshake is none.
#[test]
fn who_does_not_join_is_dropped_and_told() {
    let time = Duration::from_millis(400);
    let mut doors = open(&Options {
        handshake: time,
        ..Options::default()
    });
    let start = Instant::now();
    let mut peer = idle(&doors, Socketcand);
    peer.say("< open can0 >");
    peer.expect("< ok >");
    assert_eq!(
        peer.rest(),
        "< error you did not join the bus within 400ms >"
    );
    assert!(start.elapsed() >= time);
    refused(&mut doors, 0, LeaveReason::Late(time));

    let start = Instant::now();
    let mut peer = idle(&doors, Slcan);
    assert_eq!(peer.rest(), "\x07");
    assert!(start.elapsed() >= time);
    let Event::Refused {
        door: 1,
        peer: from,
        reason,
    } = next(&mut doors)
    else {
        panic!()
    };
    assert_eq!(from, bus::Peer::Tcp(peer.stream.local_addr().unwrap()));
    assert_eq!(reason.to_string(), "it did not join the bus within 400ms");
}

/// Idle connections, never closed from outside, do not shut the doors.
#[test]
fn late_ones_make_room() {
    let time = Duration::from_millis(400);
    let mut doors = open(&Options {
        clients: 2,
        handshake: time,
        linger: Duration::from_millis(50),
        ..Options::default()
    });
    let _idle = [idle(&doors, Socketcand), idle(&doors, Slcan)];
    let mut doors_told = [next(&mut doors), next(&mut doors)].map(|event| match event {
        Event::Refused { door, reason, .. } if reason == LeaveReason::Late(time) => door,
        other => panic!("{other:?}"),
    });
    doors_told.sort_unstable();
    assert_eq!(doors_told, [0, 1]);
    let mut peer = seated(&doors);
    peer.say("< open can0 >< rawmode >< send 080 0 >");
    loop {
        match next(&mut doors) {
            // Those of `seated`, until there was room.
            Event::Refused { reason, .. } => assert_eq!(reason, LeaveReason::Crowded(2)),
            Event::Joined { client, .. } => {
                assert_eq!(frame_from(&mut doors, client).to_string(), "080#");
                break;
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Talking does not win time, not even so much of it that the client is no longer read.
#[test]
fn talking_is_not_joining() {
    let time = Duration::from_millis(400);
    let mut doors = open(&Options {
        handshake: time,
        outbox_frames: 8,
        ..Options::default()
    });
    let mut peer = idle(&doors, Slcan);
    peer.stream
        .set_write_timeout(Some(Duration::from_millis(50)))
        .unwrap();
    let questions = b"V\r".repeat(32_768);
    let end = Instant::now() + PATIENCE;
    // Nothing is read, so it fills up, or is closed by the other end.
    while peer.stream.write_all(&questions).is_ok() {
        assert!(Instant::now() < end, "everything is taken for ever");
    }
    refused(&mut doors, 1, LeaveReason::Late(time));
}

/// Nobody who has joined is late, nor who closes the channel to open it again.
#[test]
fn who_has_joined_may_be_silent() {
    let time = Duration::from_secs(1);
    let mut doors = open(&Options {
        handshake: time,
        ..Options::default()
    });
    let mut silent = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    let mut out = Peer::join(&doors, Slcan);
    let before = joined(&mut doors);
    out.say("C\r");
    out.expect("\r");
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client: before,
            reason: LeaveReason::ChannelClosed
        }
    );
    std::thread::sleep(time + Duration::from_millis(300));
    assert_eq!(doors.take(), None);
    silent.say("< send 080 0 >");
    assert_eq!(frame_from(&mut doors, client).to_string(), "080#");
    out.say("O\r");
    out.expect("\r");
    assert_ne!(joined(&mut doors), before);
}
