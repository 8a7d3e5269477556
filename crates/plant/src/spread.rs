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
    /// Cogging torque, relative.
    pub cogging: f64,
    /// Cogging torque, Nm more than nominal, with the nominal periods; its rests are then anywhere.
    pub cogging_nm: f64,
    /// Inertia of the load, relative.
    pub load_inertia: f64,
    /// Friction of the load, relative; Coulomb and viscous each on its own.
    pub load_friction: f64,
    /// Stiffness, damping and backlash of the coupling, and the weight of the load, relative, each on
    /// its own.
    pub coupling: f64,
    /// Position of the switches, turns to either side, each on its own.
    pub switch_turns: f64,
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
    /// Gain of the current sensors of phases A and B, relative, each on its own.
    pub current_gain: f64,
    /// Noise of the current sensors, counts more than nominal.
    pub current_noise_counts: f64,
    /// Eccentricity of the encoder's magnet, counts more than nominal; its phase is then anywhere.
    pub encoder_eccentricity_counts: f64,
    /// Lag of the encoder, s more than nominal.
    pub encoder_lag_s: f64,
    /// Noise of the encoder, counts more than nominal.
    pub encoder_noise_counts: f64,
    /// Dead time of the bridge, s more than nominal.
    pub dead_time_s: f64,
    /// Resistance of the bridge's switches, Ω more than nominal.
    pub switch_ohm: f64,
    /// Capacitance and resistances of the link between supply and bridge, relative, each on its own.
    pub link: f64,
    /// Temperature of the surroundings, K to either side.
    pub ambient_k: f64,
    /// Thermal resistances and time constants, relative, each on its own.
    pub thermal: f64,
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
    CurrentGainA = 18,
    CurrentGainB = 19,
    CurrentNoise = 20,
    NoiseSeed = 21,
    EncoderEccentricity = 22,
    EncoderEccentricityPhase = 23,
    EncoderLag = 24,
    EncoderNoise = 25,
    DeadTime = 26,
    SwitchResistance = 27,
    LinkCapacitance = 28,
    LinkSource = 29,
    LinkBleeder = 30,
    Ambient = 31,
    WindingHousing = 32,
    HousingAmbient = 33,
    WindingTime = 34,
    HousingTime = 35,
    AmplifierResistance = 36,
    AmplifierTime = 37,
    Cogging = 38,
    CoggingMore = 39,
    CoggingRest = 40,
    Stiffness = 41,
    Damping = 42,
    Backlash = 43,
    Pendulum = 44,
    NegativeLimit = 45,
    PositiveLimit = 46,
    Home = 47,
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
        cogging: 0.0,
        cogging_nm: 0.0,
        load_inertia: 0.0,
        load_friction: 0.0,
        coupling: 0.0,
        switch_turns: 0.0,
        start_turns: 0.0,
        supply: 0.0,
        diode_drop: 0.0,
        encoder_zero_turns: 0.0,
        encoder_reversed: 0.0,
        current_zero_counts: 0.0,
        current_gain: 0.0,
        current_noise_counts: 0.0,
        encoder_eccentricity_counts: 0.0,
        encoder_lag_s: 0.0,
        encoder_noise_counts: 0.0,
        dead_time_s: 0.0,
        switch_ohm: 0.0,
        link: 0.0,
        ambient_k: 0.0,
        thermal: 0.0,
    };

    /// Motors and boards as they come: windings and magnets within the tolerances that makers
    /// state, wires connected and magnets glued on as it happened, converters up to 0.1 A off, and everything
    /// a little eccentric, late and noisy.
    pub const TYPICAL: Spread = Spread {
        resistance: 0.1,
        inductance: 0.2,
        flux: 0.05,
        rotor_inertia: 0.1,
        friction: 0.5,
        wires_swapped: 0.5,
        cogging: 0.3,
        cogging_nm: 0.0,
        load_inertia: 0.2,
        load_friction: 0.5,
        coupling: 0.2,
        switch_turns: 0.01,
        start_turns: 0.5,
        supply: 0.05,
        diode_drop: 0.1,
        encoder_zero_turns: 0.5,
        encoder_reversed: 0.5,
        current_zero_counts: 40.0,
        current_gain: 0.02,
        current_noise_counts: 1.0,
        encoder_eccentricity_counts: 4.0,
        encoder_lag_s: 100e-6,
        encoder_noise_counts: 0.5,
        dead_time_s: 200e-9,
        switch_ohm: 0.1,
        link: 0.2,
        ambient_k: 10.0,
        thermal: 0.2,
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
            self.cogging,
            self.coupling,
            self.supply,
            self.diode_drop,
            self.current_gain,
            self.link,
            self.thermal,
        ];
        let shares = [self.wires_swapped, self.encoder_reversed];
        let absolute = [
            self.start_turns,
            self.cogging_nm,
            self.switch_turns,
            self.encoder_zero_turns,
            self.current_zero_counts,
            self.current_noise_counts,
            self.encoder_eccentricity_counts,
            self.encoder_lag_s,
            self.encoder_noise_counts,
            self.dead_time_s,
            self.switch_ohm,
            self.ambient_k,
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

        let cogging = &mut motor.cogging;
        relative(&mut cogging.torque_nm, self.cogging, Figure::Cogging);
        cogging.torque_nm += self.cogging_nm * fraction(seed, Figure::CoggingMore);
        if self.cogging_nm > 0.0 {
            cogging.rest_turns += 0.5 * even(seed, Figure::CoggingRest);
        }

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
        if let Some(coupling) = &mut load.coupling {
            for (value, figure) in [
                (&mut coupling.stiffness_nm_per_rad, Figure::Stiffness),
                (&mut coupling.damping_nms, Figure::Damping),
                (&mut coupling.backlash_rad, Figure::Backlash),
            ] {
                relative(value, self.coupling, figure);
            }
        }
        if let Some(pendulum) = &mut load.pendulum {
            relative(&mut pendulum.torque_nm, self.coupling, Figure::Pendulum);
        }
        let switches = &mut drawn.switches;
        for (switch, figure) in [
            (&mut switches.negative_limit, Figure::NegativeLimit),
            (&mut switches.positive_limit, Figure::PositiveLimit),
            (&mut switches.home, Figure::Home),
        ] {
            if let Some(switch) = switch {
                let moved = self.switch_turns * even(seed, figure);
                switch.from_turns += moved;
                switch.to_turns += moved;
            }
        }
        let stops = load.stops;
        drawn.start_turns += self.start_turns * even(seed, Figure::StartTurns);
        if let Some(stops) = stops {
            // Between the stops, where else.
            let above = drawn.start_turns > stops.lowest_turns;
            let low = if above {
                drawn.start_turns
            } else {
                stops.lowest_turns
            };
            let below = low < stops.highest_turns;
            drawn.start_turns = if below { low } else { stops.highest_turns };
        }

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
        let more = |value: &mut f32, most: f64, figure: Figure| {
            *value += (most * fraction(seed, figure)) as f32;
        };
        let sensors = &mut drawn.current_sensors;
        let [gain_a, gain_b] = &mut sensors.gain;
        relative_f32(gain_a, self.current_gain, Figure::CurrentGainA);
        relative_f32(gain_b, self.current_gain, Figure::CurrentGainB);
        let noise = self.current_noise_counts;
        more(&mut sensors.noise_counts, noise, Figure::CurrentNoise);
        let encoder = &mut drawn.encoder;
        let eccentricity = self.encoder_eccentricity_counts;
        more(
            &mut encoder.eccentricity_counts,
            eccentricity,
            Figure::EncoderEccentricity,
        );
        if eccentricity > 0.0 {
            let phase = core::f64::consts::PI * even(seed, Figure::EncoderEccentricityPhase);
            encoder.eccentricity_phase_rad += phase as f32;
        }
        encoder.lag_s += self.encoder_lag_s * fraction(seed, Figure::EncoderLag);
        more(
            &mut encoder.noise_counts,
            self.encoder_noise_counts,
            Figure::EncoderNoise,
        );
        if noise > 0.0 || self.encoder_noise_counts > 0.0 {
            drawn.noise_seed = stream(seed, Figure::NoiseSeed) as u32;
        }

        let bridge = &mut drawn.bridge;
        bridge.dead_time_s += self.dead_time_s * fraction(seed, Figure::DeadTime);
        bridge.switch_ohm += self.switch_ohm * fraction(seed, Figure::SwitchResistance);
        let link = &mut drawn.link;
        relative(&mut link.capacitance_f, self.link, Figure::LinkCapacitance);
        relative(&mut link.source_ohm, self.link, Figure::LinkSource);
        relative(&mut link.bleeder_ohm, self.link, Figure::LinkBleeder);

        drawn.ambient_c += (self.ambient_k * even(seed, Figure::Ambient)) as f32;
        if let Some(thermal) = &mut drawn.thermal {
            let (motor, amplifier) = (&mut thermal.motor, &mut thermal.amplifier);
            for (value, figure) in [
                (&mut motor.winding_k_per_w, Figure::WindingHousing),
                (&mut motor.housing_k_per_w, Figure::HousingAmbient),
                (&mut motor.winding_time_constant_s, Figure::WindingTime),
                (&mut motor.housing_time_constant_s, Figure::HousingTime),
                (&mut amplifier.k_per_w, Figure::AmplifierResistance),
                (&mut amplifier.time_constant_s, Figure::AmplifierTime),
            ] {
                relative(value, self.thermal, figure);
            }
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
    (stream(seed, figure) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// 64 bits of a figure's stream.
fn stream(seed: u64, figure: Figure) -> u64 {
    // SplitMix64, twice: once for the seed, once for the stream.
    mixed(mixed(seed).wrapping_add(figure as u64))
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
