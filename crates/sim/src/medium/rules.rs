//! The rules of fault confinement, each with the counters that it leads to.

use std::collections::VecDeque;

use can::{Frame, StandardId};
use canopen::Instant;

use super::protocol::State;
use super::{ErrorKind, ErrorState, Event, Protocol};
use crate::wire_act::BitPlace;

/// Controllers on a wire, moved bit by bit.
pub(super) struct Bench {
    pub(super) nodes: Vec<Node>,
    pub(super) bits: u64,
    /// Bits since the last start of frame on an idle wire.
    number: u16,
    /// What is flipped in the frames to come, and in the present one.
    pub(super) flips: VecDeque<(u16, Option<usize>)>,
    flip: Option<(u16, Option<usize>)>,
    /// Starts of frame that a node has read by a flip where the wire was free.
    pub(super) phantoms: usize,
    /// What the cable does to every bit.
    pub(super) stuck: Option<bool>,
}

pub(super) struct Node {
    pub(super) protocol: Protocol,
    pub(super) queue: VecDeque<Frame>,
    pub(super) received: Vec<Frame>,
    pub(super) sent: Vec<(u64, Frame)>,
    errors: Vec<ErrorKind>,
}

impl Bench {
    /// Controllers that know that the wire is free.
    pub(super) fn new(count: usize) -> Bench {
        let nodes = (0..count).map(|_| {
            let mut protocol = Protocol::new();
            protocol.start(Instant::ZERO);
            Node {
                protocol,
                queue: VecDeque::new(),
                received: Vec::new(),
                sent: Vec::new(),
                errors: Vec::new(),
            }
        });
        let mut bench = Bench {
            nodes: nodes.collect(),
            bits: 0,
            number: u16::MAX,
            flips: VecDeque::new(),
            flip: None,
            phantoms: 0,
            stuck: None,
        };
        bench.run(11);
        assert!(bench.nodes.iter().all(|node| node.protocol.is_idle()));
        bench
    }

    pub(super) fn bit(&mut self) {
        self.bits += 1;
        self.number = self.number.saturating_add(1);
        for node in &mut self.nodes {
            if node.protocol.is_idle()
                && let Some(frame) = node.queue.front()
            {
                node.protocol.begin(*frame);
                self.number = 0;
            }
        }
        let level = self.nodes.iter().all(|node| node.protocol.level());
        let level = self.stuck.unwrap_or(level);
        if self.number == 0 {
            self.flip = self.flips.pop_front();
        }
        let flip = self.flip.filter(|(number, _)| *number == self.number);
        for (n, node) in self.nodes.iter_mut().enumerate() {
            let flipped = flip.is_some_and(|(_, who)| who.is_none_or(|who| who == n));
            let waiting = node.queue.front().copied();
            let free = matches!(
                node.protocol.state,
                State::Idle | State::Suspended(_) | State::Intermission(2)
            );
            self.phantoms += usize::from(flipped && level && free);
            match node.protocol.read(level != flipped, waiting) {
                Some(Event::Received(frame)) => node.received.push(frame),
                Some(Event::Sent(frame)) => {
                    assert_eq!(node.queue.pop_front(), Some(frame));
                    node.sent.push((self.bits, frame));
                }
                Some(Event::Error { kind, .. }) => node.errors.push(kind),
                Some(Event::Recovered) | None => {}
            }
            let counters = node.protocol.counters;
            assert!(
                counters.transmit <= 263 && counters.receive <= 255,
                "{counters:?}"
            );
        }
    }

    pub(super) fn run(&mut self, bits: u64) {
        (0..bits).for_each(|_| self.bit());
    }

    /// Until nothing is left to send and all is quiet; false if that takes too long.
    pub(super) fn settle(&mut self, most: u64) -> bool {
        let quiet = |node: &Node| node.queue.is_empty() && node.protocol.is_at_rest();
        for _ in 0..most {
            if self.nodes.iter().all(quiet) {
                return true;
            }
            self.bit();
        }
        false
    }

    pub(super) fn counters(&self) -> Vec<(u16, u16)> {
        let counters = self.nodes.iter().map(|node| node.protocol.counters);
        counters.map(|c| (c.transmit, c.receive)).collect()
    }

    pub(super) fn set(&mut self, n: usize, transmit: u16, receive: u16) {
        let counters = &mut self.nodes[n].protocol.counters;
        (counters.transmit, counters.receive) = (transmit, receive);
    }
}

pub(super) fn standard(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

pub(super) const ALL: Option<usize> = None;
/// The sender, and two receivers.
const A: Option<usize> = Some(0);
const B: Option<usize> = Some(1);

/// One frame from A, one bit of its first attempt flipped: counters of A, B and C when it is
/// through, and how often B and C have got it.
#[test]
fn one_flip_counts_as_the_standard_says() {
    // 0x555 and 0x55 are never stuffed but in the CRC, so bit numbers are easy.
    let frame = standard(0x555, &[0x55; 4]);
    let place = |place: BitPlace| place.number_in(&frame);
    // Of identifier 0 the sixth bit is a recessive stuff bit.
    let stuffed = standard(0, &[]);
    let before = [(10, 10), (0, 10), (0, 10)];
    for (what, frame, (bit, who), after, times) in [
        // Transmitter −1, receivers −1.
        (
            "nothing",
            frame,
            (300, ALL),
            [(9, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        // Bit error: +8. The receivers see its flag: +1. Then the frame is through: −1 each.
        (
            "start of frame",
            frame,
            (0, ALL),
            [(17, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        (
            "a bit of the data",
            frame,
            (30, ALL),
            [(17, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        (
            "the same for A",
            frame,
            (30, A),
            [(17, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        // B finds it first, by the CRC, and sees the others' flags behind its own: +1 +8. C has
        // acknowledged the frame and counted it as good: −1 +1 −1.
        (
            "the same for B",
            frame,
            (30, B),
            [(17, 10), (0, 18), (0, 9)],
            [1, 1],
        ),
        // A recessive stuff bit that is dominant in arbitration: no transmit error (exception 2).
        (
            "a stuff bit",
            stuffed,
            (5, ALL),
            [(9, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        (
            "no acknowledge",
            frame,
            (place(BitPlace::AckSlot), ALL),
            [(17, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        // A reads none; B and C have counted the frame as good before A's flag comes.
        (
            "no acknowledge for A",
            frame,
            (place(BitPlace::AckSlot), A),
            [(17, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        (
            "CRC delimiter",
            frame,
            (place(BitPlace::CrcDelimiter), ALL),
            [(17, 10), (0, 10), (0, 10)],
            [1, 1],
        ),
        (
            "acknowledge delimiter",
            frame,
            (place(BitPlace::AckDelimiter), ALL),
            [(17, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        (
            "end of frame 1",
            frame,
            (place(BitPlace::EndOfFrame(1)), ALL),
            [(17, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        (
            "end of frame 6",
            frame,
            (place(BitPlace::EndOfFrame(6)), ALL),
            [(17, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        // Receivers have taken it, the transmitter repeats it.
        (
            "end of frame 7",
            frame,
            (place(BitPlace::EndOfFrame(7)), ALL),
            [(17, 10), (0, 8), (0, 8)],
            [2, 2],
        ),
        (
            "the same for A",
            frame,
            (place(BitPlace::EndOfFrame(7)), A),
            [(17, 10), (0, 8), (0, 8)],
            [2, 2],
        ),
        // B sends an overload flag, which A and C meet in their intermission.
        (
            "the same for B",
            frame,
            (place(BitPlace::EndOfFrame(7)), B),
            [(9, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        // B destroys for itself what C has taken already.
        (
            "end of frame 6 for B",
            frame,
            (place(BitPlace::EndOfFrame(6)), B),
            [(17, 10), (0, 17), (0, 8)],
            [1, 2],
        ),
        // An overload frame counts nothing.
        (
            "intermission 1",
            frame,
            (place(BitPlace::Intermission(1)), ALL),
            [(9, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        (
            "intermission 2",
            frame,
            (place(BitPlace::Intermission(2)), ALL),
            [(9, 10), (0, 9), (0, 9)],
            [1, 1],
        ),
        // It is taken for a start of frame: six recessive bits follow, a stuff error.
        (
            "intermission 3",
            frame,
            (place(BitPlace::Intermission(3)), ALL),
            [(9, 11), (0, 10), (0, 10)],
            [1, 1],
        ),
    ] {
        let mut bench = Bench::new(3);
        for (n, (transmit, receive)) in before.into_iter().enumerate() {
            bench.set(n, transmit, receive);
        }
        bench.flips.push_back((bit, who));
        bench.nodes[0].queue.push_back(frame);
        assert!(bench.settle(2_000), "{what}");
        assert_eq!(
            bench.counters(),
            after,
            "{what}: {:?}",
            bench.nodes[1].errors
        );
        for (n, times) in [(1, times[0]), (2, times[1])] {
            assert_eq!(
                bench.nodes[n].received,
                vec![frame; times],
                "{what}: node {n}"
            );
        }
        assert_eq!(bench.nodes[0].sent.len(), 1, "{what}");
    }
}

/// Whoever is alone gets no acknowledge: sixteen errors to error passive, no further from there.
#[test]
fn who_is_alone_is_error_passive_and_tries_for_ever() {
    let mut bench = Bench::new(1);
    let frame = standard(0x701, &[0]);
    bench.nodes[0].queue.push_back(frame);
    // Up to the acknowledge slot, flag, delimiter, intermission.
    let attempt = u64::from(frame.frame_bits()) - 8 + 6 + 8 + 3;
    for n in 1..=16 {
        bench.run(attempt);
        assert_eq!(bench.counters(), [(8 * n, 0)]);
    }
    let tries = bench.nodes[0].errors.len();
    bench.run(1_000 * (attempt + 8));
    assert_eq!(bench.counters(), [(128, 0)]);
    assert!(
        bench.nodes[0]
            .errors
            .iter()
            .all(|kind| *kind == ErrorKind::Acknowledge)
    );
    // Suspended for eight bits each time.
    assert!((999..=1001).contains(&(bench.nodes[0].errors.len() - tries)));
    // As soon as somebody is there it is through.
    let mut listener = Bench::new(1);
    bench.nodes.append(&mut listener.nodes);
    bench.run(2 * attempt);
    assert_eq!(bench.nodes[1].received, [frame]);
    assert_eq!(bench.counters(), [(127, 0), (0, 0)]);
}

/// An error passive receiver's flag is recessive: the others notice nothing, and it misses the frame.
#[test]
fn an_error_passive_receiver_destroys_nothing() {
    let frame = standard(0x555, &[0x55; 4]);
    let mut bench = Bench::new(3);
    bench.set(1, 0, 130);
    bench.flips.push_back((30, B));
    bench.nodes[0].queue.push_back(frame);
    assert!(bench.settle(500));
    assert_eq!(bench.nodes[1].received, []);
    assert_eq!(bench.nodes[2].received, [frame]);
    assert_eq!(bench.counters(), [(0, 0), (0, 131), (0, 0)]);
    // A good one takes it back to 119 and error active.
    bench.nodes[0].queue.push_back(frame);
    assert!(bench.settle(500));
    assert_eq!(bench.counters(), [(0, 0), (0, 119), (0, 0)]);
    assert_eq!(bench.nodes[1].protocol.counters.state(), ErrorState::Active);
}

/// An error passive transmitter waits eight bits more, in which another may come first.
#[test]
fn an_error_passive_transmitter_suspends() {
    for (transmit, order) in [(100, [0, 0, 1]), (200, [0, 1, 0])] {
        let mut bench = Bench::new(3);
        bench.set(0, transmit, 0);
        let low = standard(0x100, &[]);
        bench.nodes[0].queue.extend([low, low]);
        bench.run(1);
        bench.nodes[1].queue.push_back(standard(0x200, &[]));
        assert!(bench.settle(1_000));
        let mut sent: Vec<(u64, usize)> = (0..2)
            .flat_map(|n| bench.nodes[n].sent.iter().map(move |(at, _)| (*at, n)))
            .collect();
        sent.sort_unstable();
        let senders: Vec<usize> = sent.iter().map(|(_, n)| *n).collect();
        assert_eq!(senders, order, "{transmit}");
        assert_eq!(bench.counters()[0].0, transmit - 2);
    }
    // Alone it takes eight bits longer.
    let gap = |transmit| {
        let mut bench = Bench::new(2);
        bench.set(0, transmit, 0);
        bench.nodes[0].queue.extend([standard(0x100, &[]); 2]);
        assert!(bench.settle(1_000));
        bench.nodes[0].sent[1].0 - bench.nodes[0].sent[0].0
    };
    assert_eq!(gap(200) - gap(100), 8);
}

/// The error that makes it error passive is still marked by an active flag, the next by a passive
/// one; receivers then see a stuff error and mark that.
#[test]
fn the_flag_follows_the_state_before_the_error() {
    let frame = standard(0x555, &[0x55; 4]);
    for (transmit, after) in [(120, 127), (128, 135)] {
        let mut bench = Bench::new(3);
        bench.set(0, transmit, 0);
        bench.flips.push_back((30, A));
        bench.nodes[0].queue.push_back(frame);
        bench.run(32);
        assert_eq!(bench.nodes[0].protocol.level(), transmit == 128, "the flag");
        assert!(bench.settle(500));
        // Somebody's dominant bits behind its passive flag are no rule for a transmitter.
        assert_eq!(bench.counters(), [(after, 0), (0, 0), (0, 0)]);
        assert_eq!(bench.nodes[2].received, [frame]);
    }
}

/// Of two frames with one identifier the first bit that differs decides: who reads dominant for its
/// recessive bit has an error there. A data frame wins against a remote frame before it comes to that.
#[test]
fn one_identifier_twice() {
    let id = StandardId::new(0x123).unwrap();
    let remote = Frame::remote_frame(id, 0).unwrap();
    let mut bench = Bench::new(3);
    bench.nodes[0].queue.push_back(remote);
    bench.nodes[1].queue.push_back(standard(0x123, &[1]));
    assert!(bench.settle(1_000));
    assert_eq!(bench.counters(), [(0, 0); 3]);
    assert_eq!(bench.nodes[2].received, [standard(0x123, &[1]), remote]);

    let (low, high) = (
        standard(0x123, &[0x55, 0x10]),
        standard(0x123, &[0x55, 0x11]),
    );
    let (one, other) = (low.bit_stream(), high.bit_stream());
    let first = (0..low.frame_bits())
        .find(|n| one.bit(*n) != other.bit(*n))
        .unwrap();
    let mut bench = Bench::new(3);
    bench.nodes[0].queue.push_back(high);
    bench.nodes[1].queue.push_back(low);
    bench.run(u64::from(first));
    assert_eq!(bench.counters(), [(0, 0); 3]);
    bench.run(1);
    assert_eq!(bench.counters(), [(8, 0), (0, 0), (0, 0)]);
    bench.run(6);
    assert_eq!(bench.counters()[1].0, 8, "it reads the flag");
}

/// Dominant in the last bit of an error frame's delimiter is an overload, before that a form error.
#[test]
fn the_last_bit_of_a_delimiter_is_no_error() {
    for (recessive, after) in [(6, 16), (7, 8)] {
        let mut bench = Bench::new(3);
        bench.flips.push_back((30, ALL));
        bench.nodes[0].queue.push_back(standard(0x555, &[0x55; 4]));
        bench.run(31);
        assert_eq!(bench.counters()[0], (8, 0));
        // Behind the flags.
        bench.run(6);
        while bench.nodes.iter().any(|node| !node.protocol.level()) {
            bench.bit();
        }
        bench.run(recessive);
        bench.stuck = Some(false);
        bench.bit();
        bench.stuck = None;
        let counted = bench.counters();
        assert_eq!(counted[0].0, after, "{recessive}: {counted:?}");
        assert!(bench.settle(500));
        assert_eq!(bench.nodes[1].received.len(), 1);
    }
}
