//! Clients that talk nonsense or vanish. A well-behaved one, the witness, must not notice.

use crate::peer::Peer;
use crate::{frame_from, joined, next, numbered, open};
use bus::Protocol::{Slcan, Socketcand};
use bus::{ClientId, Doors, Event, LeaveReason, Options};
use std::io::{Read, Write};
use std::net::Shutdown;
use std::time::Duration;

struct Witness {
    peer: Peer,
    client: ClientId,
}

impl Witness {
    fn new(doors: &mut Doors) -> Witness {
        let peer = Peer::join(doors, Socketcand);
        Witness {
            peer,
            client: joined(doors),
        }
    }

    /// Still there, in both directions, with nothing in between.
    fn testifies(&mut self, doors: &mut Doors) {
        self.peer.say("< send 7FF 1 55 >");
        assert_eq!(frame_from(doors, self.client).to_string(), "7FF#55");
        doors.deliver(&numbered(9), 0, None);
        self.peer.expect("< frame 300 0.000000 09000000 >");
    }
}

/// Told what was wrong, and the conversation goes on.
#[test]
fn mistakes_are_answered() {
    let mut doors = open(&Options::default());
    let mut witness = Witness::new(&mut doors);
    let mut peer = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    let table = [
        ("< fly >", "'fly': unknown command"),
        ("< send >", "send: the identifier is missing"),
        (
            "< send 12345 0 >",
            "send: identifier '12345' has neither 3 nor 8",
        ),
        ("< send 8FF 0 >", "send: identifier '8FF' is out of range"),
        ("< send 123 x >", "send: length 'x' is not"),
        (
            "< send 123 2 1 >",
            "send: length 2 announced, but 1 bytes follow",
        ),
        (
            "< send 123 8 1 2 3 4 5 6 7 8 9 >",
            "send: length 8 announced, but 9 bytes follow",
        ),
        ("< send 123 1 fff >", "send: data 'fff' are not"),
    ];
    for (text, answer) in table {
        peer.say(text);
        let said = peer.until(b'>');
        assert!(
            said.starts_with(&format!("< error {answer}")),
            "{text}: {said}"
        );
    }
    peer.say("< send 123 0 >");
    assert_eq!(frame_from(&mut doors, client).to_string(), "123#");
    witness.testifies(&mut doors);

    let mut peer = Peer::join(&doors, Slcan);
    let client = joined(&mut doors);
    peer.say("fly\rt9990\rt1239\rt123\rT123456781122334455667788112233445566\rt1230\r");
    peer.expect("\x07\x07\x07\x07\x07z\r");
    assert_eq!(frame_from(&mut doors, client).to_string(), "123#");
}

/// Told what was wrong, and dropped.
#[test]
fn lost_streams_are_dropped() {
    let mut doors = open(&Options::default());
    let mut witness = Witness::new(&mut doors);
    let long = format!("< {}", "a".repeat(5_000));
    let table = [
        ("GET / HTTP/1.1\r\n\r\n", "'G' between two messages"),
        (&long, "a message of more than 256 characters"),
        ("< send 12\u{0}", "a byte 0x00 inside a message"),
    ];
    for (text, why) in table {
        // Before and after joining.
        let mut peer = Peer::connect(&doors, Socketcand);
        peer.expect("< hi >");
        peer.say(text);
        let said = peer.rest();
        assert!(said.starts_with(&format!("< error {why}")), "{said}");
        let Event::Refused {
            reason: LeaveReason::Protocol(reason),
            ..
        } = next(&mut doors)
        else {
            panic!()
        };
        assert!(reason.starts_with(why));

        let mut peer = Peer::join(&doors, Socketcand);
        let client = joined(&mut doors);
        peer.say(text);
        assert!(peer.rest().starts_with(&format!("< error {why}")));
        let Event::Left {
            client: left,
            reason: LeaveReason::Protocol(reason),
        } = next(&mut doors)
        else {
            panic!()
        };
        assert_eq!((left, reason.starts_with(why)), (client, true));
        witness.testifies(&mut doors);
    }
    let mut peer = Peer::join(&doors, Slcan);
    joined(&mut doors);
    peer.say(&long);
    assert_eq!(peer.rest(), "\x07");
    assert!(matches!(
        next(&mut doors),
        Event::Left {
            reason: LeaveReason::Protocol(_),
            ..
        }
    ));
    let mut peer = Peer::connect(&doors, Socketcand);
    peer.say("< open can3 >");
    assert_eq!(
        peer.rest(),
        "< hi >< error there is no bus 'can3' here, open can0 instead >"
    );
    assert!(matches!(next(&mut doors), Event::Refused { door: 0, .. }));
    witness.testifies(&mut doors);
}

/// Half a message is no frame, whether the client closes or just falls silent.
#[test]
fn vanishing_in_the_middle() {
    let mut doors = open(&Options::default());
    let mut witness = Witness::new(&mut doors);
    for (protocol, half) in [(Socketcand, "< send 123 2 1"), (Slcan, "t1232010")] {
        let mut silent = Peer::join(&doors, protocol);
        let silent_client = joined(&mut doors);
        silent.say(half);
        let mut gone = Peer::join(&doors, protocol);
        let client = joined(&mut doors);
        gone.say(half);
        drop(gone);
        assert_eq!(
            next(&mut doors),
            Event::Left {
                client,
                reason: LeaveReason::Disconnected
            }
        );
        witness.testifies(&mut doors);
        drop(silent);
        let left = Event::Left {
            client: silent_client,
            reason: LeaveReason::Disconnected,
        };
        assert_eq!(next(&mut doors), left);
    }
    // Connected and gone without a word: not worth an event.
    drop(Peer::connect(&doors, Socketcand));
    std::thread::sleep(Duration::from_millis(30));
    witness.testifies(&mut doors);
}

/// A xorshift generator: the same bytes in every run.
struct Noise(u64);

impl Noise {
    fn word(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn pick(&mut self, from: &[&'static [u8]]) -> &'static [u8] {
        from[(self.word() >> 16) as usize % from.len()]
    }

    /// Words of the protocols, whole and cut, and bytes of any kind.
    fn bytes(&mut self) -> Vec<u8> {
        const WORDS: &[&[u8]] = &[
            b"< ",
            b" >",
            b"<",
            b">",
            b"open can0",
            b"< open can0 >",
            b"< rawmode >",
            b"send ",
            b"< send 123 2 1 2 >",
            b"123 ",
            b"8 ",
            b"1FFFFFFF ",
            b"ff ",
            b"echo",
            b"sendrtr",
            b"O\r",
            b"C\r",
            b"L\r",
            b"S6\r",
            b"t1231ff\r",
            b"r1230\r",
            b"T00000001",
            b"\r",
            b"t123",
            b"0",
            b"Z1\r",
        ];
        let mut bytes = Vec::new();
        for _ in 0..self.word() % 200 {
            match self.word() % 20 {
                0 => bytes.push(self.word() as u8),
                _ => bytes.extend_from_slice(self.pick(WORDS)),
            }
        }
        bytes
    }
}

#[test]
fn random_bytes_harm_nobody() {
    let mut doors = open(&Options {
        linger: Duration::from_millis(50),
        ..Options::default()
    });
    let mut witness = Witness::new(&mut doors);
    let mut noise = Noise(0x9E37_79B9_7F4A_7C15);
    let (mut joins, mut frames) = (0, 0);
    for round in 0..300 {
        let protocol = if round % 2 == 0 { Socketcand } else { Slcan };
        let mut peer = if round % 4 < 2 {
            Peer::connect(&doors, protocol)
        } else {
            Peer::join(&doors, protocol)
        };
        // The door may close in the middle of it.
        let _ = peer.stream.write_all(&noise.bytes());
        let _ = peer.stream.shutdown(Shutdown::Write);
        // Everything that is said to it is text and comes to an end.
        let mut said = Vec::new();
        let reading = std::thread::spawn(move || {
            let _ = peer.stream.read_to_end(&mut said);
            said
        });
        loop {
            // Looked at first: all events are there before the connection is closed.
            let over = reading.is_finished() && doors.clients().count() == 1;
            match doors.take() {
                Some(Event::Frame { client, .. }) => {
                    frames += 1;
                    doors.grant(client, 1);
                }
                Some(Event::Joined { .. }) => joins += 1,
                Some(Event::Left { client, .. }) => assert_ne!(client, witness.client),
                Some(Event::Refused { .. } | Event::Trouble { .. }) => {}
                None if over => break,
                None => doors.wait(Duration::from_millis(1)),
            }
        }
        assert!(reading.join().unwrap().is_ascii());
        if round % 10 == 0 {
            witness.testifies(&mut doors);
        }
    }
    // The noise is not so wild that nothing of it gets through.
    assert!(
        joins > 200 && frames > 100,
        "{joins} joins, {frames} frames"
    );
}
