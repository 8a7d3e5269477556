//! The MD80's sample motor, T-Motor AK80-9, and a board like the MD80's around it.

use control::io::Scales;

use crate::{
    AmplifierThermal, Bridge, Cogging, CurrentSensors, Encoder, Link, Load, LogicSupply, Motor,
    MotorThermal, Parameters, Switches, Thermal,
};

/// Turns of the AK80-9's output for one of its rotor.
pub const AK80_9_GEAR: f64 = 1.0 / 9.0;

/// T-Motor AK80-9, an actuator with a planetary gear of 9:1. All figures are the rotor's.
///
/// | figure | value | source |
/// |---|---|---|
/// | pole pairs | 21 | maker's sheet, and MAB's configuration of it |
/// | terminal resistance | 170 mΩ | maker's sheet |
/// | terminal inductance | 57 µH | maker's sheet |
/// | torque constant | 91 mNm/A | MAB's configuration; the sheet's speed constant of 100 rpm/V would make 83 mNm per ampere of peak phase current |
/// | rotor inertia | 607 g cm² | maker's sheet |
/// | back drive torque | 0.51 Nm at the output | maker's sheet |
///
/// The back drive torque is all Coulomb friction here, a ninth of it at the rotor; a tenth as much again
/// at 5000 rpm is viscous, our choice. Its cogging is not stated and left out.
pub const AK80_9: Motor = Motor {
    pole_pairs: 21,
    phase_resistance_ohm: 0.170 / 2.0,
    phase_inductance_h: 57e-6 / 2.0,
    flux_wb: 0.091 / (1.5 * 21.0),
    rotor_inertia_kgm2: 607e-7,
    coulomb_friction_nm: 0.51 / 9.0,
    static_friction_nm: 0.51 / 9.0,
    viscous_friction_nms: 0.1 * 0.51 / 9.0 / (5_000.0 * core::f64::consts::TAU / 60.0),
    cogging: Cogging::NONE,
    wires_swapped: false,
};

/// The heat of the same motor; no sheet has it, so it is inferred. At 12 A rated, 18.4 W of copper loss,
/// the winding reaches 80 °C in air of 25 °C: 3 K/W together, most of them from housing to air. Half a
/// kilogram of steel, copper and aluminium has 300 J/K.
pub const AK80_9_THERMAL: MotorThermal = MotorThermal {
    winding_k_per_w: 0.8,
    housing_k_per_w: 2.2,
    winding_time_constant_s: 30.0,
    housing_time_constant_s: 660.0,
    reference_c: 25.0,
    resistance_per_k: 0.003_93,
    flux_per_k: -0.001_1,
};

/// An MD80 with its sample motor, running free: 48 V, PWM and loops at 40 kHz, an encoder of 14 bits.
/// The steps of the converters are ours: 50 mA a count spans ±102 A, for the 80 A of the board. So are
/// the amplifier's heat and the 150 A at which its gate drivers open the bridge: more than the 101 A
/// that a shorted motor of this kind can make.
pub const VIRTUAL_MD80: Parameters = Parameters {
    motor: AK80_9,
    load: Load::NONE,
    start_turns: 0.0,
    switches: Switches::NONE,
    pwm_period_s: 25e-6,
    load_delay_periods: 1,
    bridge: Bridge {
        overcurrent_a: 150.0,
        ..Bridge::IDEAL
    },
    supply_v: 48.0,
    link: Link::IDEAL,
    logic: LogicSupply::NOMINAL,
    diode_drop_v: 0.8,
    encoder: Encoder::ideal(1 << 14, 5000),
    output_encoder: None,
    scales: Scales {
        current_a: 0.05,
        current_zero: 2048.0,
        voltage_v: 17.6e-3,
        temperature_k: 0.05,
        temperature_zero_c: -50.0,
        motor_temperature_k: 0.05,
        motor_temperature_zero_c: -50.0,
    },
    current_zero_counts: [2041.0, 2055.0],
    current_sensors: CurrentSensors::IDEAL,
    noise_seed: 1,
    ambient_c: 25.0,
    thermal: Some(Thermal {
        motor: AK80_9_THERMAL,
        amplifier: AmplifierThermal {
            k_per_w: 5.0,
            time_constant_s: 60.0,
            idle_w: 1.0,
            switching_s: 40e-9,
        },
    }),
};

#[cfg(test)]
mod tests {
    use super::{AK80_9, VIRTUAL_MD80};

    #[test]
    fn such_a_world_can_be() {
        assert_eq!(VIRTUAL_MD80.check(), Ok(()));
    }

    #[test]
    fn figures_of_the_convention() {
        assert!((AK80_9.torque_constant_nm_per_a() - 0.091).abs() < 1e-12);
    }
}
