//! Traffic that is disturbed at random.

use can::{ExtendedId, Frame, StandardId};
use proptest::prelude::*;

use super::rules::Bench;

const ALL: Option<usize> = None;
/// The sender, and a receiver.
const A: Option<usize> = Some(0);
const B: Option<usize> = Some(1);

fn any_frame() -> impl Strategy<Value = Frame> {
    let byte = prop_oneof![Just(0_u8), Just(0xFF_u8), any::<u8>(), any::<u8>()];
    let data = prop::collection::vec(byte, 0..=8);
    (any::<u32>(), any::<bool>(), any::<bool>(), data).prop_map(|(id, wide, remote, data)| {
        let id: can::Id = if wide {
            ExtendedId::new(id & 0x1FFF_FFFF).unwrap().into()
        } else {
            StandardId::new((id & 0x7FF) as u16).unwrap().into()
        };
        if remote {
            Frame::remote_frame(id, data.len() as u8).unwrap()
        } else {
            Frame::data_frame(id, &data).unwrap()
        }
    })
}

/// What each has received is what the others have sent, some of it more than once: a sender that sees an
/// error in the last bit of a frame sends it again, and its receivers have it already (ISO 11898-1). So
/// each of the `flips` may let a frame come once more. And each start of frame that a receiver has read
/// where there was none may cost it a frame: see [`a_phantom_start_and_one_more_flip_cost_a_frame`].
fn check_deliveries(
    bench: &Bench,
    frames: &[(usize, Frame)],
    flips: usize,
) -> Result<(), TestCaseError> {
    for (n, node) in bench.nodes.iter().enumerate() {
        prop_assert!(node.queue.is_empty());
        for (sender, frame) in frames.iter().filter(|(sender, _)| *sender != n) {
            let times = node.received.iter().filter(|got| *got == frame).count();
            let sent = frames
                .iter()
                .filter(|other| **other == (*sender, *frame))
                .count();
            prop_assert!(
                (sent.saturating_sub(bench.phantoms)..=sent + flips).contains(&times),
                "{frame}: {times} times, {} phantoms",
                bench.phantoms
            );
        }
        for got in &node.received {
            let was_sent = frames
                .iter()
                .any(|(sender, frame)| *sender != n && frame == got);
            prop_assert!(was_sent, "{got} was never sent");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Each bit of a frame, flipped for all and for each alone: nobody takes a wrong frame, and all
    /// get the right one.
    #[test]
    fn no_flip_gets_through(frame in any_frame()) {
        for bit in 0..frame.wire_bits() {
            for who in [ALL, A, B] {
                let mut bench = Bench::new(3);
                bench.flips.push_back((bit, who));
                bench.nodes[0].queue.push_back(frame);
                prop_assert!(bench.settle(2_000));
                check_deliveries(&bench, &[(0, frame)], 1)?;
            }
        }
    }

    /// Traffic of three nodes with different identifiers, and a few flips anywhere.
    #[test]
    fn disturbed_traffic_comes_through(
        mut frames in prop::collection::vec((0_usize..3, any_frame()), 1..12),
        flips in prop::collection::vec((0_u16..160, 0_usize..4), 0..10),
        gaps in prop::collection::vec(0_u64..200, 12),
    ) {
        frames.sort_by_key(|(_, frame)| frame.arbitration_key());
        frames.dedup_by_key(|(_, frame)| frame.arbitration_key());
        let mut bench = Bench::new(3);
        bench.flips = flips.iter().map(|(bit, who)| (*bit, who.checked_sub(1))).collect();
        for ((sender, frame), gap) in frames.iter().zip(&gaps) {
            bench.nodes[*sender].queue.push_back(*frame);
            bench.run(*gap);
        }
        prop_assert!(bench.settle(100_000));
        check_deliveries(&bench, &frames, flips.len())?;
    }
}

/// A receiver alone reads a start of frame on the free wire, so many bits before the true one, and reads
/// the frame that follows out of step. Its error is seen by the sender in time, wherever the flip was:
/// six recessive bits in a row are an error, and behind the acknowledge there are eight.
#[test]
fn a_phantom_start_alone_costs_no_frame() {
    let frames = [
        Frame::remote_frame(StandardId::new(0x1D8).unwrap(), 0).unwrap(),
        Frame::data_frame(StandardId::new(0).unwrap(), &[0; 8]).unwrap(),
        Frame::data_frame(ExtendedId::new(0x1555_5555).unwrap(), &[0x55; 8]).unwrap(),
        Frame::data_frame(StandardId::new(0x7FF).unwrap(), &[0xFF; 3]).unwrap(),
    ];
    let first = Frame::data_frame(StandardId::new(1).unwrap(), &[]).unwrap();
    for frame in frames {
        for before in 1..20 {
            let mut bench = bench_with_phantom(first, before, &[]);
            bench.nodes[1].queue.push_back(frame);
            assert!(bench.settle(2_000));
            assert_eq!(bench.phantoms, 1);
            for n in [0, 2] {
                assert!(
                    bench.nodes[n].received.contains(&frame),
                    "{frame}, {before} bits before, node {n}"
                );
            }
        }
    }
}

/// The last `before` bits of a free wire are over, and node 0 has read a start of frame in the first of them.
fn bench_with_phantom(first: Frame, before: u64, more: &[(u16, Option<usize>)]) -> Bench {
    let mut bench = Bench::new(3);
    bench.flips.push_back((158, A));
    bench.flips.extend(more);
    bench.nodes[0].queue.push_back(first);
    bench.run(158 + before);
    bench
}

/// Six recessive bits behind the acknowledge are an error to who is out of step, unless one of them is
/// flipped, too: then it finds the error with the last bit of the frame, which no one repeats any more.
#[test]
fn a_phantom_start_and_one_more_flip_cost_a_frame() {
    let first = Frame::data_frame(StandardId::new(0).unwrap(), &[]).unwrap();
    let frame = Frame::remote_frame(StandardId::new(0x1D8).unwrap(), 0).unwrap();
    let mut bench = bench_with_phantom(first, 1, &[(38, A)]);
    bench.nodes[1].queue.push_back(frame);
    assert!(bench.settle(2_000));
    assert_eq!(bench.nodes[0].received, []);
    assert_eq!(bench.nodes[2].received, [first, frame]);
    assert_eq!(bench.nodes[1].sent.len(), 1);
}
