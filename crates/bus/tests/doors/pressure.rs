//! Clients that send faster than the bus carries, and clients that read slower.

use crate::peer::Peer;
use crate::{event_within, frame_from, joined, next, number, numbered, open};
use bus::Protocol::{Slcan, Socketcand};
use bus::{Doors, Event, LeaveReason, Options, Protocol};
use std::io::{ErrorKind, Write};
use std::time::Duration;

fn send_text(protocol: Protocol, number: u32) -> String {
    let bytes = number.to_le_bytes();
    match protocol {
        Socketcand => {
            let [a, b, c, d] = bytes;
            format!("< send 300 4 {a:x} {b:x} {c:x} {d:x} >")
        }
        _ => format!("t3004{:08X}\r", u32::from_be_bytes(bytes)),
    }
}

/// 20,000 frames as fast as they go, against a consumer that holds three and rests now and then.
#[test]
fn a_fast_sender_loses_nothing() {
    for protocol in [Socketcand, Slcan] {
        let mut doors = open(&Options {
            mailbox_frames: 3,
            ..Options::default()
        });
        let mut peer = Peer::join(&doors, protocol);
        let client = joined(&mut doors);
        let sender = std::thread::spawn(move || {
            (0..20_000).for_each(|number| peer.say(&send_text(protocol, number)));
            peer
        });
        let mut mailbox = 0;
        for expected in 0..20_000 {
            let Event::Frame {
                client: from,
                frame,
            } = next(&mut doors)
            else {
                panic!()
            };
            assert_eq!((from, number(&frame)), (client, expected));
            mailbox += 1;
            assert!(mailbox <= 3, "more than the mailbox holds");
            if mailbox == 3 {
                if expected % 1_000 < 3 {
                    assert_eq!(event_within(&mut doors, Duration::from_millis(5)), None);
                }
                doors.grant(client, 3);
                mailbox = 0;
            }
        }
        sender.join().unwrap();
        assert_eq!(
            next(&mut doors),
            Event::Left {
                client,
                reason: LeaveReason::Disconnected
            }
        );
    }
}

/// Without credit the socket is not read, so that the sender is stopped by TCP itself, and goes on
/// from there without a gap.
#[test]
fn a_sender_without_credit_is_stopped() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    peer.stream
        .set_write_timeout(Some(Duration::from_millis(300)))
        .unwrap();
    let mut sent = 0;
    let rest = loop {
        let text = send_text(Socketcand, sent).into_bytes();
        let mut rest = &text[..];
        while !rest.is_empty() {
            match peer.stream.write(rest) {
                Ok(count) => rest = &rest[count..],
                Err(error) => {
                    assert!(matches!(
                        error.kind(),
                        ErrorKind::WouldBlock | ErrorKind::TimedOut
                    ));
                    break;
                }
            }
        }
        sent += 1;
        if !rest.is_empty() {
            break rest.to_vec();
        }
        assert!(sent < 3_000_000, "nothing stops the sender");
    };
    // What the system's buffers hold, but here only the four of the mailbox.
    for expected in 0..4 {
        let Event::Frame { frame, .. } = next(&mut doors) else {
            panic!()
        };
        assert_eq!(number(&frame), expected);
    }
    assert_eq!(event_within(&mut doors, Duration::from_millis(100)), None);
    doors.grant(client, 4);
    peer.stream.set_write_timeout(None).unwrap();
    let end = std::thread::spawn(move || {
        peer.stream.write_all(&rest).unwrap();
        peer
    });
    for expected in 4..sent {
        assert_eq!(number(&frame_from(&mut doors, client)), expected);
    }
    drop(end.join().unwrap());
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client,
            reason: LeaveReason::Disconnected
        }
    );
}

/// Who sends and hangs up at once (like cansend) is heard out.
#[test]
fn frames_outlive_their_sender() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    (0..50).for_each(|number| peer.say(&send_text(Socketcand, number)));
    drop(peer);
    std::thread::sleep(Duration::from_millis(50));
    for expected in 0..50 {
        assert_eq!(number(&frame_from(&mut doors, client)), expected);
    }
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client,
            reason: LeaveReason::Disconnected
        }
    );
}

/// Delivers until the client that does not read is dropped; a second one, which reads, gets all.
fn starve(protocol: Protocol) -> (Doors, Peer, usize) {
    let options = Options {
        linger: Duration::from_secs(10),
        ..Options::default()
    };
    let mut doors = open(&options);
    let slow = Peer::join(&doors, protocol);
    let client = joined(&mut doors);
    let mut brisk = Peer::join(&doors, Socketcand);
    joined(&mut doors);
    let mut delivered = 0_u32;
    let reason = loop {
        for _ in 0..2_000 {
            doors.deliver(&numbered(delivered), 0, None);
            delivered += 1;
        }
        for expected in delivered - 2_000..delivered {
            let [a, b, c, d] = expected.to_le_bytes();
            brisk.expect(&format!(
                "< frame 300 0.000000 {a:02X}{b:02X}{c:02X}{d:02X} >"
            ));
        }
        match doors.take() {
            None => assert!(delivered < 5_000_000, "it is never dropped"),
            Some(Event::Left {
                client: left,
                reason,
            }) if left == client => break reason,
            Some(other) => panic!("{other:?}"),
        }
    };
    assert_eq!(reason, LeaveReason::TooSlow { waiting: 65_536 });
    // The other one stays, in both directions.
    brisk.say("< send 080 0 >");
    assert!(matches!(next(&mut doors), Event::Frame { .. }));
    doors.deliver(&numbered(0), 0, None);
    brisk.expect("< frame 300 0.000000 00000000 >");
    (doors, slow, delivered as usize)
}

/// It gets the frames from the first on without a gap, and then the reason.
#[test]
fn a_slow_reader_is_dropped_and_told() {
    let (_doors, mut slow, delivered) = starve(Socketcand);
    let text = slow.rest();
    let mut messages: Vec<&str> = text.split_inclusive('>').collect();
    let last = messages.pop().unwrap();
    assert_eq!(
        last,
        "< error you read too slowly, 65536 frames were waiting >"
    );
    assert!(messages.len() + 65_536 <= delivered);
    for (expected, message) in (0_u32..).zip(&messages) {
        let [a, b, c, d] = expected.to_le_bytes();
        assert_eq!(
            *message,
            format!("< frame 300 0.000000 {a:02X}{b:02X}{c:02X}{d:02X} >")
        );
    }

    let (_doors, mut slow, _) = starve(Slcan);
    let text = slow.rest();
    let frames = text.strip_suffix('\x07').unwrap();
    assert!(frames.ends_with('\r'));
    for (expected, line) in (0_u32..).zip(frames.split_terminator('\r')) {
        assert_eq!(
            line,
            format!("t3004{:08X}", u32::from_be_bytes(expected.to_le_bytes()))
        );
    }
}

/// A client that is behind is not listened to until it has caught up; nothing of it is lost.
#[test]
fn who_is_behind_is_not_heard() {
    let mut doors = open(&Options {
        outbox_frames: 40_000,
        ..Options::default()
    });
    let mut peer = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    let mut delivered = 0;
    // 20,000 waiting frames make it fall silent, 40,000 would make it be dropped.
    loop {
        (0..1_000).for_each(|_| doors.deliver(&numbered(0), 0, None));
        delivered += 1_000;
        peer.say("< send 080 0 >");
        match event_within(&mut doors, Duration::from_millis(300)) {
            Some(Event::Frame { .. }) => doors.grant(client, 1),
            Some(other) => panic!("{other:?}"),
            None => break,
        }
        assert!(delivered < 5_000_000, "it is heard for ever");
    }
    for _ in 0..delivered {
        assert_eq!(
            peer.until(b'>').len(),
            "< frame 300 0.000000 00000000 >".len()
        );
    }
    assert_eq!(frame_from(&mut doors, client).to_string(), "080#");
}
