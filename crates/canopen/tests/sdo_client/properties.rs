//! The client and the model on wires that lose and double frames: right data or a failure.

use canopen::sdo_client::{Method, Settings};
use proptest::prelude::*;

use crate::harness::model::Traits;
use crate::harness::script::{self, Case};
use crate::harness::wire::Fate;

const METHODS: [Method; 3] = [Method::Expedited, Method::Segmented, Method::Block];

/// Lengths at which something changes: one exchange, one segment, a block of 127 segments.
const LENGTHS: [usize; 14] = [0, 1, 4, 5, 6, 7, 8, 13, 14, 15, 888, 889, 890, 65_536];

#[test]
fn every_length_by_every_method_both_ways() {
    let mut transfers = 0;
    for count in LENGTHS {
        for method in METHODS {
            for is_upload in [true, false] {
                for flags in 0..8u8 {
                    let case = Case {
                        settings: Settings {
                            crc: flags & 4 == 0,
                            ..Settings::DEFAULT
                        },
                        traits: Traits {
                            sizes: flags & 1 != 0,
                            crc: flags & 2 != 0,
                            blocks: true,
                            block_sizes: [127, 5],
                            switches: flags & 4 != 0,
                        },
                        method,
                        is_upload,
                        value: script::bytes(count, flags),
                    };
                    let succeeded = case.run(std::iter::empty());
                    let is_possible = match (method, is_upload) {
                        (Method::Expedited, true) => match count {
                            1..=3 => flags & 1 != 0,
                            _ => count == 4,
                        },
                        (Method::Expedited, false) => (1..=4).contains(&count),
                        _ => true,
                    };
                    assert_eq!(succeeded, is_possible, "{count} bytes, {method:?}");
                    transfers += u32::from(succeeded);
                }
            }
        }
    }
    assert!(transfers > 450, "{transfers}");
}

/// Each frame of a transfer lost or doubled once: two attempts are enough for that.
#[test]
fn any_one_frame_may_be_lost_or_doubled() {
    for is_upload in [true, false] {
        for method in METHODS {
            for fate in [Fate::Lost, Fate::Doubled] {
                let case = Case {
                    settings: Settings {
                        attempts: 2,
                        block_size: 5,
                        ..Settings::DEFAULT
                    },
                    traits: Traits {
                        sizes: true,
                        crc: true,
                        blocks: true,
                        block_sizes: [5, 4],
                        switches: false,
                    },
                    method,
                    is_upload,
                    value: script::bytes(if method == Method::Expedited { 3 } else { 100 }, 1),
                };
                let mut failed = Vec::new();
                let frames = 60;
                for place in 0..frames {
                    let fates = std::iter::repeat_n(Fate::Arrives, place).chain([fate]);
                    if !case.run(fates) {
                        failed.push(place);
                    }
                }
                assert!(
                    failed.len() <= 1,
                    "{method:?} {fate:?} upload {is_upload}: {failed:?}"
                );
            }
        }
    }
}

fn settings() -> impl Strategy<Value = Settings> {
    (
        0..4u32,
        prop_oneof![1..8u8, any::<u8>()],
        any::<bool>(),
        any::<u8>(),
    )
        .prop_map(|(attempts, block_size, crc, switch_threshold)| Settings {
            attempts,
            block_size,
            crc,
            switch_threshold,
            ..Settings::DEFAULT
        })
}

fn traits() -> impl Strategy<Value = Traits> {
    let block_size = || prop_oneof![1..8u8, 1..=127u8];
    let flags = (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>());
    (flags, block_size(), block_size()).prop_map(|((sizes, crc, few, switches), a, b)| Traits {
        sizes,
        crc,
        blocks: !few || sizes,
        block_sizes: [a, b],
        switches,
    })
}

fn fates() -> impl Strategy<Value = Vec<Fate>> {
    let bad = |weight| {
        prop_oneof![
            weight => Just(Fate::Arrives),
            1 => Just(Fate::Lost),
            1 => Just(Fate::Doubled),
        ]
    };
    prop_oneof![
        proptest::collection::vec(bad(3), 0..400),
        proptest::collection::vec(bad(40), 0..1500),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn right_data_or_a_failure(
        settings in settings(),
        traits in traits(),
        method in proptest::sample::select(&METHODS[..]),
        is_upload in any::<bool>(),
        count in prop_oneof![0..20usize, 0..3000usize],
        salt in any::<u8>(),
        fates in fates(),
    ) {
        let value = script::bytes(count, salt);
        let case = Case { settings, traits, method, is_upload, value };
        case.run(fates.into_iter());
    }

    #[test]
    fn nothing_that_a_server_says_breaks_a_rule(input in proptest::collection::vec(any::<u8>(), 0..300)) {
        script::run(&input);
    }
}
