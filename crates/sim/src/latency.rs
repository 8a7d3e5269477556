//! How long a drive's processor takes, with seeded jitter.

use crate::place::Place;
use rand_core::{RngCore, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// From a frame's end to its handling, at least, ns.
const SERVICE_NS: u64 = 20_000;
/// Uniform jitter of that, ns.
const SERVICE_JITTER_NS: u64 = 20_000;
/// From one waiting frame to the next, at least, ns.
const NEXT_NS: u64 = 8_000;
/// Uniform jitter of that, ns.
const NEXT_JITTER_NS: u64 = 4_000;
/// From reset to the boot-up frame, at least, ns.
const BOOT_NS: u64 = 20_000_000;
/// Uniform jitter of that, ns.
const BOOT_JITTER_NS: u64 = 2_000_000;
/// From a save command to its acknowledge: writing flash, ns.
const STORE_NS: u64 = 5_000_000;

/// One drive's delays. The generator is PCG (XSL 128/64), whose output is defined and the same
/// everywhere.
#[derive(Debug)]
pub(crate) struct Latency {
    random: Pcg64Mcg,
}

impl Latency {
    /// Delays of the drive at `place` on a bus of this seed.
    pub(crate) fn new(seed: u64, place: Place) -> Latency {
        // Mixed, so that neighbouring seeds and places have nothing in common.
        let number = u64::from(place.number());
        let without_node_id = (number >> 7) << 63;
        let mixed = seed.wrapping_mul(128).wrapping_add(number & 127) ^ without_node_id;
        Latency {
            random: Pcg64Mcg::seed_from_u64(mixed),
        }
    }

    pub(crate) fn service_ns(&mut self) -> u64 {
        SERVICE_NS + self.below(SERVICE_JITTER_NS)
    }

    pub(crate) fn next_ns(&mut self) -> u64 {
        NEXT_NS + self.below(NEXT_JITTER_NS)
    }

    pub(crate) fn boot_ns(&mut self) -> u64 {
        BOOT_NS + self.below(BOOT_JITTER_NS)
    }

    pub(crate) fn store_ns(&self) -> u64 {
        STORE_NS
    }

    /// Uniform from 0 to `bound` − 1; the bias of the remainder is below 10⁻¹³.
    fn below(&mut self, bound: u64) -> u64 {
        self.random.next_u64() % bound
    }
}
