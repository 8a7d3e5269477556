//! LSS on random buses: slaves against their model, fastscan against any devices, lost frames.

mod harness;

use canopen::lss::{
    BitTiming, Event, Identity, Job, Known, Outcome, Part, Reply, ScanEnd, Settings, State,
};
use canopen::{Instant, NodeId};
use harness::lss::{Pair, Wire, identity};
use proptest::prelude::*;

const IDENTITY: Identity = Identity {
    vendor: 0x0102_0304,
    product: 0x0506_0708,
    revision: 0x090A_0B0C,
    serial: 0x0D0E_0F10,
};

/// No node ID.
const NONE: u8 = 0xFF;

/// Settings whose times are easy to add up.
const QUICK: Settings = Settings {
    answer_ms: 10,
    store_ms: 100,
    scan_ms: 5,
    settle_ms: 1,
    gap_ms: 1,
    attempts: 1,
};

/// Numbers that differ in few bits or in many.
fn address() -> impl Strategy<Value = [u32; 4]> {
    let number = || {
        prop_oneof![
            0u32..4,
            any::<u32>(),
            (0u32..32).prop_map(|bit| 1 << bit),
            Just(u32::MAX),
        ]
    };
    [number(), number(), number(), number()]
}

fn addresses() -> impl Strategy<Value = Vec<[u32; 4]>> {
    prop::collection::btree_set(address(), 1..=20).prop_map(|set| set.into_iter().collect())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// The scripts of the fuzzer, without its feedback.
    #[test]
    fn scripts(input in prop::collection::vec(any::<u8>(), 0..300)) {
        harness::lss::run(&input);
    }

    /// Any requests, most of them of services: slave and model agree after each.
    #[test]
    fn slave_and_model(
        address in address(),
        active in prop_oneof![Just(NONE), 1u8..=127],
        requests in prop::collection::vec(
            (prop_oneof![3 => 64u8..95, 1 => 0u8..30, 1 => any::<u8>()], any::<[u8; 7]>(), 0u8..8),
            0..60,
        ),
    ) {
        let mut pair = Pair::new(address, active, &BitTiming::ALL[..4]);
        let mut now = Instant::ZERO;
        for (command, mut rest, kind) in requests {
            // Mostly numbers that are right, and fields in their ranges.
            if kind > 1 {
                let own = match command {
                    72..=75 => address[usize::from(command / 2 - 34)],
                    70 | 71 => address[usize::from(command - 70)],
                    64..=67 => address[usize::from(command - 64)],
                    _ => address[usize::from(rest[5] & 3)],
                };
                if matches!(command, 64..=81) {
                    rest[..4].copy_from_slice(&own.to_le_bytes());
                }
                rest[4] &= 0x9F;
                rest[5] &= 3;
                rest[6] &= 3;
            }
            let mut data = [command; 8];
            data[1..].copy_from_slice(&rest);
            match kind {
                0 => now = now.plus_ms(u64::from(rest[0]) << 8),
                1 if rest[0] > 200 => pair.reset_communication(),
                _ => {}
            }
            pair.poll(now);
            if let Some(Reply::Event(Event::StoreConfiguration { .. })) = pair.receive(data, now) {
                pair.complete(Ok(()));
            }
        }
    }

    /// Of 1 to 20 devices with different identities every one is found, the lowest first, and the
    /// configured ones are not.
    #[test]
    fn fastscan_finds_every_device(mut all in addresses(), configured in 0usize..3) {
        let mut slaves: Vec<([u32; 4], u8)> = all.iter().map(|address| (*address, NONE)).collect();
        for slave in slaves.iter_mut().take(configured) {
            slave.1 = 9;
        }
        all.drain(..configured.min(all.len()));
        let mut wire = Wire::of(&slaves, QUICK);
        let found = wire.find_all(Known::NOTHING, &mut || false);
        let expected: Vec<Identity> = all.into_iter().map(identity).collect();
        prop_assert_eq!(found, expected);
    }

    /// With a number known, those that have it are found and no others.
    #[test]
    fn fastscan_finds_those_with_a_known_number(all in addresses(), which in any::<prop::sample::Index>()) {
        let [vendor, _, _, _] = all[which.index(all.len())];
        let slaves: Vec<_> = all.iter().map(|address| (*address, NONE)).collect();
        let mut wire = Wire::of(&slaves, QUICK);
        let known = Known { vendor: Some(vendor), ..Known::NOTHING };
        let mut found = Vec::new();
        loop {
            match wire.run(Job::Fastscan(known)).0 {
                Outcome::Scanned(ScanEnd::Found(identity)) => found.push(identity),
                Outcome::Scanned(ScanEnd::Nobody | ScanEnd::Lost { part: Part::Vendor, .. }) => break,
                other => panic!("{other:?}"),
            }
        }
        let expected: Vec<_> = all.into_iter().filter(|address| address[0] == vendor).map(identity).collect();
        prop_assert_eq!(found, expected);
    }

    /// One frame in 16 is lost, on its way to a device or back. Devices that missed the beginning
    /// of a scan can add their numbers to another's; so what was found is selected, and a device
    /// that answers that is one that is there, with no bit wrong. Nothing waits for ever.
    #[test]
    fn fastscan_with_lost_frames(all in addresses(), seed in any::<u64>()) {
        let slaves: Vec<_> = all.iter().map(|address| (*address, NONE)).collect();
        let mut wire = Wire::of(&slaves, Settings { attempts: 4, ..QUICK });
        let mut state = seed | 1;
        let mut lost = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state & 0xF0 == 0
        };
        for found in wire.find_all(Known::NOTHING, &mut lost) {
            let there = all.contains(&Part::ALL.map(|part| found.get(part)));
            match wire.run_losing(Job::Select(found), &mut lost).0 {
                Outcome::Done => prop_assert!(there, "{}", found),
                Outcome::TimedOut => {}
                other => panic!("{other:?}"),
            }
            let outcome = wire.run(Job::Select(found)).0;
            prop_assert_eq!(outcome == Outcome::Done, there, "{}", found);
        }
        // Back to waiting without losses, and whoever was missed is found.
        wire.run(Job::Switch(State::Waiting));
        let found = wire.find_all(Known::NOTHING, &mut || false);
        prop_assert_eq!(found.len(), all.len());
    }

    /// Every job of the master with lost frames ends, and never with an answer that nobody gave.
    #[test]
    fn jobs_with_lost_frames(losses in any::<u64>(), attempts in 1u8..5) {
        let address = Part::ALL.map(|part| IDENTITY.get(part));
        let mut left = losses;
        let mut lost = || {
            let lost = left & 3 == 0;
            left = left.rotate_right(2);
            lost
        };
        for job in [Job::Select(IDENTITY), Job::InquireIdentity, Job::InquireNodeId, Job::Store] {
            let mut wire = Wire::of(&[(address, 5)], Settings { attempts, ..QUICK });
            wire.run(Job::Select(IDENTITY));
            let outcome = wire.run_losing(job, &mut lost).0;
            let right = match job {
                Job::InquireIdentity => Outcome::Identity(IDENTITY),
                Job::InquireNodeId => Outcome::NodeId(NodeId::new(5)),
                _ => Outcome::Done,
            };
            prop_assert!(outcome == right || outcome == Outcome::TimedOut, "{:?}: {:?}", job, outcome);
        }
    }
}
