//! Everything that makes one world differ from another.

use control::io::Scales;

use crate::load::MAX_TURNS;
use crate::output_encoder::OutputEncoder;
use crate::{
    AmplifierThermal, Bridge, Cogging, Coupling, CurrentSensors, EC_MAX_22_283860,
    EC_MAX_22_283860_THERMAL, Encoder, Link, Load, LogicSupply, Motor, Pendulum, Stops, Switch,
    Switches, Thermal,
};

/// The parameters of a [`crate::Plant`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// The motor.
    pub motor: Motor,
    /// What the motor drives.
    pub load: Load,
    /// Position of the shaft at the start, turns; 0: the rotor is aligned with phase A.
    pub start_turns: f64,
    /// Switches along the load's way.
    pub switches: Switches,
    /// PWM period, s.
    pub pwm_period_s: f64,
    /// PWM periods between the command of a duty and its effect.
    pub load_delay_periods: u8,
    /// The bridge's switches and their drivers.
    pub bridge: Bridge,
    /// Motor supply, V; 0 is off.
    pub supply_v: f32,
    /// What is between the motor supply and the bridge.
    pub link: Link,
    /// The supply of processor and sensors.
    pub logic: LogicSupply,
    /// Forward voltage of one free-wheeling diode of the bridge, V.
    pub diode_drop_v: f32,
    /// The encoder and how it sits on the rotor.
    pub encoder: Encoder,
    /// An encoder on the output of a gear behind the load, if there is one.
    pub output_encoder: Option<OutputEncoder>,
    /// What one converter count means. `current_zero` is the design's value; this board's own is
    /// in `current_zero_counts`.
    pub scales: Scales,
    /// Reading of phases A and B at no current, counts.
    pub current_zero_counts: [f32; 2],
    /// The current sensors' errors beside their zeros.
    pub current_sensors: CurrentSensors,
    /// Where the sensors' noise starts; the same seed gives the same noise.
    pub noise_seed: u32,
    /// Temperature of the surroundings, and of everything at the start, °C.
    pub ambient_c: f32,
    /// How motor and amplifier warm up; `None`: they keep the temperature that they have.
    pub thermal: Option<Thermal>,
}

/// A Barrett P3 with the motor of its manual, running free.
///
/// From the manual: 48 V, encoder reading 0x0DF8 under phase A, current zero 0x0729 of phase A. The
/// zero of phase B, the steps of the converters and the diodes are ours: 2.5 mA a count spans
/// -4.58 to +5.65 A about phase A's zero, so the 3.66 A of a stalled motor fit; 17.6 mV a count spans
/// 72 V; 0.05 K a count spans -50 to +154.8 °C, 0.075 K for the motor -50 to +257 °C. So are
/// the amplifier's heat, a board of 6 J/K on a metal frame, and its 20 ns for a switching.
pub const VIRTUAL_P3: Parameters = Parameters {
    motor: EC_MAX_22_283860,
    load: Load::NONE,
    start_turns: 0.0,
    switches: Switches::NONE,
    pwm_period_s: 10e-6,
    load_delay_periods: 1,
    bridge: Bridge::IDEAL,
    supply_v: 48.0,
    link: Link::IDEAL,
    logic: LogicSupply::NOMINAL,
    diode_drop_v: 0.8,
    encoder: Encoder::ideal(4096, 0x0DF8),
    output_encoder: None,
    scales: Scales {
        current_a: 2.5e-3,
        current_zero: 2048.0,
        voltage_v: 17.6e-3,
        temperature_k: 0.05,
        temperature_zero_c: -50.0,
        motor_temperature_k: 0.075,
        motor_temperature_zero_c: -50.0,
    },
    current_zero_counts: [0x0729 as f32, 2071.0],
    current_sensors: CurrentSensors::IDEAL,
    noise_seed: 1,
    ambient_c: 25.0,
    thermal: Some(Thermal {
        motor: EC_MAX_22_283860_THERMAL,
        amplifier: AmplifierThermal {
            k_per_w: 10.0,
            time_constant_s: 60.0,
            idle_w: 0.6,
            switching_s: 20e-9,
        },
    }),
};

/// [`VIRTUAL_P3`] with every imperfection of its electrical side, in sizes that a sound drive may have.
pub const FULL_P3: Parameters = Parameters {
    bridge: Bridge {
        dead_time_s: 200e-9,
        switch_ohm: 0.03,
        ..Bridge::IDEAL
    },
    link: Link {
        brake_ohm: 22.0,
        brake_on_v: 58.0,
        brake_off_v: 56.0,
        ..Link::SMALL
    },
    encoder: Encoder {
        eccentricity_counts: 6.0,
        eccentricity_phase_rad: 0.5,
        lag_s: 30e-6,
        noise_counts: 0.3,
        bad_answers: 1e-4,
        ..Encoder::ideal(4096, 0x0DF8)
    },
    current_sensors: CurrentSensors {
        gain: [1.01, 0.99],
        noise_counts: 1.5,
        time_constant_s: 2e-6,
    },
    ..VIRTUAL_P3
};

/// [`FULL_P3`] with every effect of the mechanical side too: a motor that cogs, and behind an elastic
/// shaft with play a load with friction and a weight, between stops that are a million turns away,
/// with all three switches.
pub const COMPLETE_P3: Parameters = Parameters {
    motor: Motor {
        static_friction_nm: 1.4e-3,
        cogging: Cogging {
            torque_nm: 0.3e-3,
            periods_per_turn: 12,
            rest_turns: 0.02,
        },
        ..EC_MAX_22_283860
    },
    load: Load {
        inertia_kgm2: 1e-6,
        coulomb_friction_nm: 0.5e-3,
        viscous_friction_nms: 0.2e-6,
        coupling: Some(Coupling {
            stiffness_nm_per_rad: 2.0,
            damping_nms: 50e-6,
            backlash_rad: 2e-3,
        }),
        pendulum: Some(Pendulum {
            torque_nm: 0.5e-3,
            hanging_turns: 0.3,
        }),
        stops: Some(Stops::between(-1e6, 1e6)),
    },
    switches: Switches {
        negative_limit: Some(Switch::below(-0.9e6)),
        positive_limit: Some(Switch::above(0.9e6)),
        home: Some(Switch {
            hysteresis_turns: 0.002,
            bounce_s: 0.5e-3,
            ..Switch::between(0.1, 0.2)
        }),
    },
    ..FULL_P3
};

impl Default for Parameters {
    /// [`VIRTUAL_P3`].
    fn default() -> Self {
        VIRTUAL_P3
    }
}

/// A parameter that no world can have. Carries the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Invalid {
    /// `motor.pole_pairs` is 0.
    NoPolePairs,
    /// `motor.phase_resistance_ohm` is not positive.
    Resistance(f64),
    /// `motor.phase_inductance_h` is not positive.
    Inductance(f64),
    /// `motor.flux_wb` is not positive.
    Flux(f64),
    /// Rotor and load together have no positive inertia, or one of them a negative one.
    Inertia(f64),
    /// A friction coefficient is negative.
    Friction(f64),
    /// `start_turns` is beyond 2³⁰ turns.
    Start(f64),
    /// A figure of `motor.cogging` is negative, infinite or undefined, or it has no periods.
    Cogging(f64),
    /// A figure of `load.coupling` is negative or undefined, or its stiffness zero.
    Coupling(f64),
    /// A figure of `load.pendulum` is infinite or undefined.
    Pendulum(f64),
    /// `load.stops` are not apart, or `start_turns` is not between them. Carries the stops, turns.
    Stops(f64, f64),
    /// A switch ends before it begins, or its hysteresis or bounce is negative or beyond reason.
    Switch(f64),
    /// The stiffness of `load.stops` is not positive, or their damping negative.
    Stop(f64),
    /// `pwm_period_s` is not between 1 µs and 1 ms.
    PwmPeriod(f64),
    /// `encoder.counts_per_turn` is not between 1 and 2²⁰.
    EncoderCounts(u32),
    /// An error of the encoder is undefined, infinite or beyond what it can be: eccentricity and noise
    /// up to a quarter turn, lag from 0 to 1 ms, magnet from 0 to 1 m, bad answers from 0 to 1.
    EncoderError(f64),
    /// A figure of the output encoder is undefined or infinite, or it has no counts.
    OutputEncoder(f64),
    /// A gain of a current sensor is not from 0 to 10, its noise not from 0 to 4095 counts, or its
    /// time constant not from 0 to 1 s.
    CurrentSensor(f64),
    /// A figure of the bridge is negative or undefined, or the dead time is not below a tenth of the
    /// PWM period.
    Bridge(f64),
    /// The link has a capacitance beyond 1 F, or one without a positive resistance of the supply, a bleeder
    /// or brake of no positive resistance, or a brake that switches off above where it switches on.
    Link(f64),
    /// A figure of the logic supply is negative, infinite or undefined.
    Logic(f32),
    /// A figure of `thermal` is negative, undefined or beyond reason.
    Thermal(f64),
    /// A converter step in `scales` is not positive.
    Scale(f32),
    /// `supply_v`, `diode_drop_v`, a current zero or a temperature is undefined, infinite or (the
    /// first two) negative.
    Level(f32),
}

impl Parameters {
    /// Whether a world with these parameters makes sense; else the first that does not. A
    /// [`crate::Plant`] of others does not panic, but what it computes means nothing.
    pub fn check(&self) -> Result<(), Invalid> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let (motor, load) = (&self.motor, &self.load);
        if motor.pole_pairs == 0 {
            return Err(Invalid::NoPolePairs);
        }
        if !positive(motor.phase_resistance_ohm) {
            return Err(Invalid::Resistance(motor.phase_resistance_ohm));
        }
        if !positive(motor.phase_inductance_h) {
            return Err(Invalid::Inductance(motor.phase_inductance_h));
        }
        if !positive(motor.flux_wb) {
            return Err(Invalid::Flux(motor.flux_wb));
        }
        for inertia in [motor.rotor_inertia_kgm2, load.inertia_kgm2] {
            if !not_negative(inertia) {
                return Err(Invalid::Inertia(inertia));
            }
        }
        if !positive(motor.rotor_inertia_kgm2 + load.inertia_kgm2) {
            return Err(Invalid::Inertia(0.0));
        }
        for friction in [
            motor.coulomb_friction_nm,
            motor.static_friction_nm,
            motor.viscous_friction_nms,
            load.coulomb_friction_nm,
            load.viscous_friction_nms,
        ] {
            if !not_negative(friction) {
                return Err(Invalid::Friction(friction));
            }
        }
        if !(-MAX_TURNS..=MAX_TURNS).contains(&self.start_turns) {
            return Err(Invalid::Start(self.start_turns));
        }
        motor.cogging.check()?;
        load.check(self.start_turns)?;
        self.switches.check()?;
        if let Some(thermal) = &self.thermal {
            thermal.check()?;
        }
        if !(self.pwm_period_s >= 1e-6 && self.pwm_period_s <= 1e-3) {
            return Err(Invalid::PwmPeriod(self.pwm_period_s));
        }
        self.encoder.check()?;
        if let Some(encoder) = &self.output_encoder {
            encoder.check()?;
        }
        self.current_sensors.check()?;
        self.bridge.check(self.pwm_period_s)?;
        self.link.check()?;
        self.logic.check()?;
        let scales = &self.scales;
        for scale in [
            scales.current_a,
            scales.voltage_v,
            scales.temperature_k,
            scales.motor_temperature_k,
        ] {
            if !positive(scale.into()) {
                return Err(Invalid::Scale(scale));
            }
        }
        for level in [self.supply_v, self.diode_drop_v] {
            if !not_negative(level.into()) {
                return Err(Invalid::Level(level));
            }
        }
        let [zero_a, zero_b] = self.current_zero_counts;
        for level in [
            zero_a,
            zero_b,
            scales.temperature_zero_c,
            scales.motor_temperature_zero_c,
            self.ambient_c,
        ] {
            if !level.is_finite() {
                return Err(Invalid::Level(level));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{COMPLETE_P3, FULL_P3, Invalid, VIRTUAL_P3};

    #[test]
    fn the_first_bad_parameter_is_named() {
        for possible in [VIRTUAL_P3, FULL_P3, COMPLETE_P3] {
            assert_eq!(possible.check(), Ok(()));
        }
        let mut bad = VIRTUAL_P3;
        bad.scales.voltage_v = 0.0;
        assert_eq!(bad.check(), Err(Invalid::Scale(0.0)));
        bad.motor.phase_inductance_h = -1.0;
        assert_eq!(bad.check(), Err(Invalid::Inductance(-1.0)));
        bad.motor.phase_resistance_ohm = f64::NAN;
        assert!(matches!(bad.check(), Err(Invalid::Resistance(r)) if r.is_nan()));
    }
}
