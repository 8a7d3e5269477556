//! Rules that hold for a device with everything whatever is done to it, against models that were
//! written from CiA 301 alone; see `harness/config`.

mod harness;

use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 6_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Any bytes as doings.
    #[test]
    fn doings(input in prop::collection::vec(any::<u8>(), 0..400)) {
        harness::config::run(&input);
    }

    /// The same by a host that takes each frame at once, in operational, with fewer words to choose
    /// from, so that PDOs live longer.
    #[test]
    fn eager(input in prop::collection::vec(prop_oneof![0u8..32, any::<u8>()], 0..400)) {
        let script = [&[0x03][..], &input].concat();
        harness::config::run(&script);
    }
}
