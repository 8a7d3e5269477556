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
/// each of the `flips` may let a frame come once more.
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
                (sent..=sent + flips).contains(&times),
                "{frame}: {times} times"
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
