//! Hidden truth: parameters that are random within stated spreads.

use rand_core::{RngCore as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use super::parameters::Parameter;
use super::quantity::Quantity;
use crate::place::Place;

/// How far a parameter may be from its value, evenly to both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spread {
    /// This part of it.
    Share(f64),
    /// This much, in the quantity's first unit.
    Absolute(f64),
}

/// The seed of the drive at `place`.
pub(super) fn seed_of(place: Place, seed: u64) -> u64 {
    seed.rotate_left(17) ^ (u64::from(place.number()) << 56)
}

/// The parameter of the drive at `place`, drawn around `centre` and held within its limits. Each
/// parameter has a generator of its own, so that a spread more or less leaves the others.
pub(super) fn draw(
    parameter: &Parameter,
    centre: f64,
    spread: Spread,
    place: Place,
    seed: u64,
) -> f64 {
    // FNV-1a of the path.
    let path = parameter
        .path
        .bytes()
        .fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        });
    let mut random = Pcg64Mcg::seed_from_u64(path ^ seed_of(place, seed));
    // 53 bits: every step of it is a number of its own.
    let part = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let reach = match spread {
        Spread::Share(share) => centre.abs() * share,
        Spread::Absolute(reach) => reach,
    };
    let drawn = centre + reach * (2.0 * part - 1.0);
    let drawn = match parameter.quantity {
        Quantity::Whole => drawn.round(),
        _ => drawn,
    };
    drawn.clamp(parameter.least, parameter.most)
}
