//! The motor's numbers.

use crate::{Cogging, MotorThermal};

/// A permanent-magnet synchronous motor with sinusoidal EMF and no saliency (Ld = Lq).
///
/// **Convention for the torque constant.** Everything here is amplitude-invariant: currents are
/// peak phase currents, and torque = 1.5 · pole pairs · flux · current. Data sheets of brushless
/// motors state the torque per ampere of direct current under *block* commutation, where two of
/// three phases carry the current and the torque is the mean over 60°. Averaging
/// √3 · pole pairs · flux · cos over ±30° gives
///
/// block torque constant = (3 √3 / π) · pole pairs · flux,
///
/// which [`Motor::flux_of_block_torque_constant_wb`] inverts. Others equate the sheet's figure with
/// the line-to-line *peak* (8.27 / KV and 8.3 / KV rules) and come out 4.5 % lower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Magnetic pole pairs.
    pub pole_pairs: u8,
    /// Resistance of one phase, Ω: half of what is measured between two terminals of a star.
    pub phase_resistance_ohm: f64,
    /// Synchronous inductance of one phase, H: half of what is measured between two terminals.
    pub phase_inductance_h: f64,
    /// Peak flux linkage of one phase with the magnet, Wb (V s/rad of the electrical speed).
    pub flux_wb: f64,
    /// Inertia of the rotor, kg m².
    pub rotor_inertia_kgm2: f64,
    /// Friction torque that does not depend on speed, Nm.
    pub coulomb_friction_nm: f64,
    /// Torque needed to break away from standstill, Nm; at least the Coulomb friction.
    pub static_friction_nm: f64,
    /// Friction torque per speed, Nm s/rad.
    pub viscous_friction_nms: f64,
    /// Torque that depends on the angle alone.
    pub cogging: Cogging,
    /// Wires B and C are exchanged: the motor's phase B hangs on the bridge's C, and the other way
    /// round. The magnet then turns against the bridge's order of phases.
    pub wires_swapped: bool,
}

impl Motor {
    /// Flux linkage, Wb, of a motor whose sheet states `torque_constant` Nm per ampere of block
    /// current.
    pub const fn flux_of_block_torque_constant_wb(torque_constant: f64, pole_pairs: u8) -> f64 {
        torque_constant * core::f64::consts::PI / (3.0 * SQRT_3 * pole_pairs as f64)
    }

    /// Electrical turns per turn of the shaft in the bridge's order of phases: the pole pairs,
    /// negative with [`Motor::wires_swapped`].
    ///
    /// In the bridge's frame exchanging two wires is nothing else than a magnet that turns the
    /// other way; EMF and torque follow with the same sign.
    pub const fn electrical_turns(&self) -> i16 {
        let pole_pairs = self.pole_pairs as i16;
        if self.wires_swapped {
            -pole_pairs
        } else {
            pole_pairs
        }
    }

    /// Torque per ampere of peak phase current in quadrature to the magnet, Nm/A.
    pub const fn torque_constant_nm_per_a(&self) -> f64 {
        1.5 * self.pole_pairs as f64 * self.flux_wb
    }

    /// Peak EMF of one phase per mechanical speed, V s/rad.
    pub const fn emf_constant_vs(&self) -> f64 {
        self.pole_pairs as f64 * self.flux_wb
    }
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// maxon EC-max 22, order number 283860: 48 V, 25 W class, the example motor of the P3 manual.
///
/// | figure | value | source |
/// |---|---|---|
/// | nominal voltage, continuous current | 48 V, 0.716 A | P3 manual, motor example |
/// | terminal resistance | 13.1 Ω | P3 manual, motor example |
/// | terminal inductance | 0.729 mH | second-hand table; the 24 V winding of the same motor scales to 0.728 mH |
/// | torque constant (block) | 34.8 mNm/A | second-hand table; times the speed constant 274 rpm/V = 0.9985 |
/// | rotor inertia | 4.45 g cm² | second-hand table |
/// | pole pairs | 1 | believed, not confirmed by a sheet |
/// | no-load current | 64 mA at 12,900 rpm | inferred from the no-load speed, not from a sheet |
///
/// The block torque constant makes 21.04 mWb and 31.56 mNm per ampere of peak phase current
/// (see [`Motor`]). With a sinusoidal drive at its linear limit of 48 V/√3 per phase and no
/// friction this motor would turn at 12,578 rpm; the speed constant of the sheet, 274 rpm/V, is for
/// block commutation and promises 13,152.
///
/// Friction: 64 mA · 34.8 mNm/A = 2.227 mNm at 12,900 rpm (1350.9 rad/s). The split is our choice:
/// 1.2 mNm Coulomb (bearings and hysteresis, a little over half) and the rest viscous, 0.7604
/// µNm s/rad (eddy currents and windage). No stick-slip: static equals Coulomb friction. The winding is
/// ironless, so there is no cogging.
pub const EC_MAX_22_283860: Motor = Motor {
    pole_pairs: 1,
    phase_resistance_ohm: 13.1 / 2.0,
    phase_inductance_h: 0.729e-3 / 2.0,
    flux_wb: Motor::flux_of_block_torque_constant_wb(34.8e-3, 1),
    rotor_inertia_kgm2: 4.45e-7,
    coulomb_friction_nm: 1.2e-3,
    static_friction_nm: 1.2e-3,
    viscous_friction_nms: (0.064 * 34.8e-3 - 1.2e-3) / (12_900.0 * core::f64::consts::TAU / 60.0),
    cogging: Cogging::NONE,
    wires_swapped: false,
};

/// maxon EC 45 flat, order number 339281: 24 V, 30 W, with Hall sensors.
///
/// | figure | value | source |
/// |---|---|---|
/// | terminal resistance | 4.83 Ω | maxon catalogue, edition May 2012, p. 193, EC 45 flat 30 W, line 10 |
/// | terminal inductance | 2.24 mH | line 11 |
/// | torque constant (block) | 51.0 mNm/A | line 12; the speed constant, 187 rpm/V, says the same |
/// | rotor inertia | 92.5 g cm² | line 16 |
/// | without load at 24 V | 4,380 rpm, 73 mA | lines 2 and 3 |
/// | continuous torque and current | 55.3 mNm, 1.01 A | lines 5 and 6 |
/// | with the rotor held at 24 V | 4.97 A | line 8: 24 V / 4.83 Ω |
/// | pole pairs | 8 | line 29 |
///
/// Friction: 73 mA · 51.0 mNm/A = 3.72 mNm at 4,380 rpm, of which 2 mNm are taken for Coulomb friction
/// and the rest for viscous. The iron-cored winding cogs; no figure of it is published, and there is
/// none here.
pub const EC_45_FLAT_339281: Motor = Motor {
    pole_pairs: 8,
    phase_resistance_ohm: 4.83 / 2.0,
    phase_inductance_h: 2.24e-3 / 2.0,
    flux_wb: Motor::flux_of_block_torque_constant_wb(51.0e-3, 8),
    rotor_inertia_kgm2: 92.5e-7,
    coulomb_friction_nm: 2e-3,
    static_friction_nm: 2e-3,
    viscous_friction_nms: (0.073 * 51.0e-3 - 2e-3) / (4_380.0 * core::f64::consts::TAU / 60.0),
    cogging: Cogging::NONE,
    wires_swapped: false,
};

/// The heat of the same motor. No sheet of it was at hand, so these are inferred:
///
/// * Winding to housing 2 K/W and winding time constant 4.85 s: the sheet of maxon's EC 22 (40 W),
///   of the same diameter and with the same kind of winding.
/// * Housing to ambient 8.9 K/W: at the continuous 0.716 A (0.79 A of peak phase current for the same
///   torque make 6.1 W cold and 9.2 W warm) and with 2.1 W of friction the winding reaches 155 °C, the
///   limit of this family, in air of 25 °C. The EC 22 has 10 K/W.
/// * Housing time constant 320 s: the EC 22's heat capacity, 278 s/(10 K/W), in proportion to the
///   weight, 110 g to 85 g.
/// * Copper 0.393 %/K; magnet of neodymium, -0.11 %/K.
pub const EC_MAX_22_283860_THERMAL: MotorThermal = MotorThermal {
    winding_k_per_w: 2.0,
    housing_k_per_w: 8.9,
    winding_time_constant_s: 4.85,
    housing_time_constant_s: 320.0,
    reference_c: 25.0,
    resistance_per_k: 0.003_93,
    flux_per_k: -0.001_1,
};

#[cfg(test)]
mod tests {
    use super::EC_MAX_22_283860 as MOTOR;

    #[test]
    fn block_torque_constant_is_the_mean_of_the_cosine_over_sixty_degrees() {
        // Numerical mean of √3 p ψ cos over ±30°, and back to the sheet's 34.8 mNm/A.
        let steps = 10_000;
        let mean = (0..steps)
            .map(|i| {
                let degrees = (f64::from(i) + 0.5) * 60.0 / f64::from(steps) - 30.0;
                3.0_f64.sqrt() * MOTOR.flux_wb * degrees.to_radians().cos()
            })
            .sum::<f64>()
            / f64::from(steps);
        assert!((mean - 34.8e-3).abs() < 1e-9, "{mean}");
    }

    #[test]
    fn figures_of_the_convention() {
        assert!((MOTOR.flux_wb - 21.04e-3).abs() < 5e-6);
        assert!((MOTOR.torque_constant_nm_per_a() - 31.56e-3).abs() < 5e-6);
        assert!((MOTOR.viscous_friction_nms - 0.7604e-6).abs() < 5e-11);
        // 48 V / √3 over the EMF constant, without friction.
        let speed = 48.0 / 3.0_f64.sqrt() / MOTOR.emf_constant_vs();
        assert!((speed * 60.0 / core::f64::consts::TAU - 12_578.0).abs() < 1.0);
    }
}
