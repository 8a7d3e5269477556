//! Hidden truth: individual motors and boards, drawn from a seed.

use crate::Parameters;

/// How far individual motors and boards deviate from their data sheets.
///
/// [`Spread::draw`] makes one of them: every figure is drawn evenly within its spread, each from a
/// stream of its own, so that a figure stays the same when another is spread more, less or not at
/// all. The same nominal figures, spread and seed always make the same world.
///
/// Relative spreads: 0.1 is from 90 % to 110 % of the nominal figure; below 1. Shares: 0.5 is every
/// second one. What is nominally zero is spread by its own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Resistance of the winding, relative.
    pub resistance: f64,
    /// Inductance of the winding, relative.
    pub inductance: f64,
    /// Flux of the magnet, and with it the torque constant, relative.
    pub flux: f64,
    /// Inertia of the rotor, relative.
    pub rotor_inertia: f64,
    /// Friction of the motor, relative; Coulomb and static friction together, viscous on its own.
    pub friction: f64,
    /// Share of the motors whose wires B and C are exchanged.
    pub wires_swapped: f64,
    /// Inertia of the load, relative.
    pub load_inertia: f64,
    /// Friction of the load, relative; Coulomb and viscous each on its own.
    pub load_friction: f64,
    /// Position of the shaft at the start, turns to either side.
    pub start_turns: f64,
    /// Voltage of the supply, relative.
    pub supply: f64,
    /// Forward voltage of the diodes, relative.
    pub diode_drop: f64,
    /// Angle at which the encoder's magnet is glued on, turns to either side: 0.5 is anywhere.
    pub encoder_zero_turns: f64,
    /// Share of the encoders that count the other way.
    pub encoder_reversed: f64,
    /// Reading of phases A and B at no current, counts to either side.
    pub current_zero_counts: f64,
}

/// The streams. A number once given stays with its figure, or old seeds would make other worlds.
#[derive(Clone, Copy)]
#[repr(u64)]
enum Figure {
    Resistance = 1,
    Inductance = 2,
    Flux = 3,
    RotorInertia = 4,
    CoulombFriction = 5,
    ViscousFriction = 6,
    WiresSwapped = 7,
    LoadInertia = 8,
    LoadCoulombFriction = 9,
    LoadViscousFriction = 10,
    StartTurns = 11,
    Supply = 12,
    DiodeDrop = 13,
    EncoderZero = 14,
    EncoderReversed = 15,
    CurrentZeroA = 16,
    CurrentZeroB = 17,
}

impl Spread {
    /// Nothing deviates.
    pub const NONE: Spread = Spread {
        resistance: 0.0,
        inductance: 0.0,
        flux: 0.0,
        rotor_inertia: 0.0,
        friction: 0.0,
        wires_swapped: 0.0,
        load_inertia: 0.0,
        load_friction: 0.0,
        start_turns: 0.0,
        supply: 0.0,
        diode_drop: 0.0,
        encoder_zero_turns: 0.0,
        encoder_reversed: 0.0,
        current_zero_counts: 0.0,
    };

    /// Motors and boards as they come: windings and magnets within the tolerances that makers
    /// state, wires connected and magnets glued on as it happened, and converters up to 0.1 A off.
    pub const TYPICAL: Spread = Spread {
        resistance: 0.1,
        inductance: 0.2,
        flux: 0.05,
        rotor_inertia: 0.1,
        friction: 0.5,
        wires_swapped: 0.5,
        load_inertia: 0.2,
        load_friction: 0.5,
        start_turns: 0.5,
        supply: 0.05,
        diode_drop: 0.1,
        encoder_zero_turns: 0.5,
        encoder_reversed: 0.5,
        current_zero_counts: 40.0,
    };

    /// Whether these are spreads: relative ones from 0 to less than 1, shares from 0 to 1, others
    /// finite and not negative. Else the first that is not.
    pub fn check(&self) -> Result<(), f64> {
        let relative = [
            self.resistance,
            self.inductance,
            self.flux,
            self.rotor_inertia,
            self.friction,
            self.load_inertia,
            self.load_friction,
            self.supply,
            self.diode_drop,
        ];
        let shares = [self.wires_swapped, self.encoder_reversed];
        let absolute = [
            self.start_turns,
            self.encoder_zero_turns,
            self.current_zero_counts,
        ];
        let bad = |ok: fn(f64) -> bool, values: &[f64]| {
            let mut bad = values.iter().copied().filter(|&value| !ok(value));
            bad.next().map_or(Ok(()), Err)
        };
        bad(|value| (0.0..1.0).contains(&value), &relative)?;
        bad(|value| (0.0..=1.0).contains(&value), &shares)?;
        bad(|value| (0.0..=1e6).contains(&value), &absolute)
    }

    /// One motor on one board with one load, out of those that are `nominal` within this spread.
    ///
    /// If `nominal` passes [`Parameters::check`] and the spread [`Spread::check`], what is drawn
    /// passes as well.
    pub fn draw(&self, nominal: &Parameters, seed: u64) -> Parameters {
        let mut drawn = *nominal;
        let relative = |value: &mut f64, spread: f64, figure: Figure| {
            *value *= 1.0 + spread * even(seed, figure);
        };
        let relative_f32 = |value: &mut f32, spread: f64, figure: Figure| {
            *value = (f64::from(*value) * (1.0 + spread * even(seed, figure))) as f32;
        };
        let happens = |share: f64, figure: Figure| fraction(seed, figure) < share;

        let motor = &mut drawn.motor;
        relative(
            &mut motor.phase_resistance_ohm,
            self.resistance,
            Figure::Resistance,
        );
        relative(
            &mut motor.phase_inductance_h,
            self.inductance,
            Figure::Inductance,
        );
        relative(&mut motor.flux_wb, self.flux, Figure::Flux);
        relative(
            &mut motor.rotor_inertia_kgm2,
            self.rotor_inertia,
            Figure::RotorInertia,
        );
        for dry in [
            &mut motor.coulomb_friction_nm,
            &mut motor.static_friction_nm,
        ] {
            relative(dry, self.friction, Figure::CoulombFriction);
        }
        relative(
            &mut motor.viscous_friction_nms,
            self.friction,
            Figure::ViscousFriction,
        );
        motor.wires_swapped ^= happens(self.wires_swapped, Figure::WiresSwapped);

        let load = &mut drawn.load;
        relative(
            &mut load.inertia_kgm2,
            self.load_inertia,
            Figure::LoadInertia,
        );
        let friction = self.load_friction;
        relative(
            &mut load.coulomb_friction_nm,
            friction,
            Figure::LoadCoulombFriction,
        );
        relative(
            &mut load.viscous_friction_nms,
            friction,
            Figure::LoadViscousFriction,
        );
        drawn.start_turns += self.start_turns * even(seed, Figure::StartTurns);

        relative_f32(&mut drawn.supply_v, self.supply, Figure::Supply);
        relative_f32(&mut drawn.diode_drop_v, self.diode_drop, Figure::DiodeDrop);

        let encoder = &mut drawn.encoder;
        let counts = f64::from(encoder.counts_per_turn);
        let moved = counts * self.encoder_zero_turns * even(seed, Figure::EncoderZero);
        // Past the nearest count of a turn that is not negative: whole turns do not matter.
        let whole = (f64::from(encoder.zero_counts) + moved) as i64;
        encoder.zero_counts = whole.rem_euclid(i64::from(encoder.counts_per_turn).max(1)) as u32;
        encoder.reversed ^= happens(self.encoder_reversed, Figure::EncoderReversed);

        let [zero_a, zero_b] = &mut drawn.current_zero_counts;
        for (zero, figure) in [
            (zero_a, Figure::CurrentZeroA),
            (zero_b, Figure::CurrentZeroB),
        ] {
            *zero += (self.current_zero_counts * even(seed, figure)) as f32;
        }
        drawn
    }
}

/// Evenly from -1 to 1.
fn even(seed: u64, figure: Figure) -> f64 {
    2.0 * fraction(seed, figure) - 1.0
}

/// Evenly from 0 to less than 1.
fn fraction(seed: u64, figure: Figure) -> f64 {
    // SplitMix64, twice: once for the seed, once for the stream.
    let bits = mixed(mixed(seed).wrapping_add(figure as u64));
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// One output of the SplitMix64 generator at this state.
const fn mixed(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::{Spread, mixed};

    #[test]
    fn the_generator_is_splitmix64() {
        // The first outputs of the reference implementation for seed 1234567.
        let step = 0x9E37_79B9_7F4A_7C15_u64;
        let outputs = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        for (n, output) in outputs.into_iter().enumerate() {
            assert_eq!(mixed(1_234_567 + step.wrapping_mul(n as u64)), output);
        }
    }

    #[test]
    fn spreads_have_their_limits() {
        assert_eq!(Spread::NONE.check(), Ok(()));
        assert_eq!(Spread::TYPICAL.check(), Ok(()));
        let with = |change: fn(&mut Spread)| {
            let mut spread = Spread::NONE;
            change(&mut spread);
            spread.check()
        };
        assert_eq!(with(|s| s.flux = 1.0), Err(1.0));
        assert_eq!(with(|s| s.flux = -0.1), Err(-0.1));
        assert_eq!(with(|s| s.encoder_reversed = 1.0), Ok(()));
        assert_eq!(with(|s| s.wires_swapped = 1.5), Err(1.5));
        assert!(with(|s| s.start_turns = f64::NAN).is_err_and(f64::is_nan));
        assert!(with(|s| s.current_zero_counts = f64::INFINITY).is_err());
    }
}
