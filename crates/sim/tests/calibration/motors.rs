//! Motors that nobody knows: data sheets of many kinds, and motors as they come.

use canopen::{Address, DataType, NodeId};
use client::{Client, Link, Value};
use plant::{EC_MAX_22_283860, Parameters, Spread, VIRTUAL_P3};

/// Reproducible numbers from 0 to below 1 (SplitMix64).
#[derive(Clone, Debug)]
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Dice {
        Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D)
    }

    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / 2f64.powi(64)
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.roll()
    }

    pub(crate) fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.roll() * all.len() as f64) as usize]
    }
}

/// A motor as its data sheet describes it, and one of its kind as it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Individual {
    pub(crate) sheet: Sheet,
    pub(crate) truth: Parameters,
}

/// What somebody who commissions a drive knows of its motor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheet {
    pub(crate) poles: i64,
    pub(crate) torque_constant_mnm_a: i64,
    pub(crate) terminal_resistance_10mohm: i64,
    pub(crate) terminal_inductance_10uh: i64,
    pub(crate) rotor_inertia: i64,
    pub(crate) continuous_ma: i64,
    pub(crate) peak_ma: i64,
    pub(crate) rated_torque_mnm: i64,
    pub(crate) no_load_counts_s: i64,
}

pub(crate) const COUNTS: f64 = 4096.0;

/// One motor out of a kind, both from the seed. Every tenth is the manual's EC-max 22.
pub(crate) fn individual(seed: u64) -> Individual {
    let mut dice = Dice::new(seed);
    let mut nominal = VIRTUAL_P3;
    if !seed.is_multiple_of(10) {
        let pole_pairs = dice.one_of(&[1u8, 1, 2, 2, 3, 4, 5, 7]);
        let torque_constant = dice.between(0.018, 0.045);
        let resistance = dice.between(1.5, 9.0);
        let electrical_s = dice.between(50e-6, 250e-6);
        let mechanical_s = dice.between(3e-3, 12e-3);
        let motor = &mut nominal.motor;
        *motor = EC_MAX_22_283860;
        motor.pole_pairs = pole_pairs;
        motor.flux_wb = torque_constant / (1.5 * f64::from(pole_pairs));
        motor.phase_resistance_ohm = resistance;
        motor.phase_inductance_h = resistance * electrical_s;
        motor.rotor_inertia_kgm2 = mechanical_s * torque_constant.powi(2) / (1.5 * resistance);
        nominal.supply_v = dice.one_of(&[24.0, 36.0, 48.0]);
    }
    let motor = &mut nominal.motor;
    let torque_constant = motor.torque_constant_nm_per_a();
    // About 5 W may become heat for ever.
    let continuous_a = (5.0 / (1.5 * motor.phase_resistance_ohm)).sqrt().min(1.4);
    let rated = torque_constant * continuous_a;
    motor.coulomb_friction_nm = rated * dice.between(0.01, 0.06);
    motor.static_friction_nm = motor.coulomb_friction_nm * 1.2;
    let no_load = f64::from(nominal.supply_v) / 3f64.sqrt() / motor.emf_constant_vs();
    motor.viscous_friction_nms = rated * dice.between(0.01, 0.05) / no_load;
    let sheet = Sheet {
        poles: 2 * i64::from(motor.pole_pairs),
        torque_constant_mnm_a: (torque_constant * 1e3).round() as i64,
        terminal_resistance_10mohm: (motor.phase_resistance_ohm * 2.0 * 100.0).round() as i64,
        terminal_inductance_10uh: (motor.phase_inductance_h * 2.0 * 1e5).round() as i64,
        rotor_inertia: (motor.rotor_inertia_kgm2 * 1e7 * 32768.0).round() as i64,
        continuous_ma: (continuous_a * 1e3) as i64,
        peak_ma: (continuous_a * 2.5e3) as i64,
        rated_torque_mnm: (rated * 1e3).round() as i64,
        no_load_counts_s: (no_load / std::f64::consts::TAU * COUNTS) as i64,
    };
    let mut truth = Spread::TYPICAL.draw(&nominal, seed);
    truth.encoder.lag_s = dice.between(0.0, 150e-6);
    truth.encoder.noise_counts = dice.between(0.0, 0.5) as f32;
    truth.current_sensors.gain = [0, 1].map(|_| dice.between(0.98, 1.02) as f32);
    truth.current_sensors.noise_counts = 1.0;
    truth.bridge.dead_time_s = dice.between(0.0, 300e-9);
    truth.bridge.switch_ohm = dice.between(0.0, 0.1);
    truth.noise_seed = seed as u32;
    truth.encoder.eccentricity_counts = 0.0;
    if !is_even(seed) {
        truth.encoder.eccentricity_counts = dice.between(2.0, 12.0) as f32;
        truth.encoder.eccentricity_phase_rad = dice.between(0.0, std::f64::consts::TAU) as f32;
        // The least common multiple of poles and slots.
        let poles = 2 * u32::from(truth.motor.pole_pairs);
        truth.motor.cogging.periods_per_turn = dice.one_of(&[3 * poles, 6 * poles]) as u16;
        truth.motor.cogging.torque_nm = rated * dice.between(0.0, 0.06);
        truth.motor.cogging.rest_turns = dice.roll();
    }
    Individual { sheet, truth }
}

/// Whether a motor turns evenly and its encoder is centred: every second pair of them.
pub(crate) fn is_even(seed: u64) -> bool {
    (seed / 2).is_multiple_of(2)
}

/// Writes what the data sheet says into a drive that was used with another motor before.
pub(crate) async fn enter<L: Link>(client: &mut Client<L>, node: NodeId, sheet: &Sheet) {
    use DataType::{I8, I16, I32, U16, U32};
    for (index, sub, data_type, value) in [
        (0x3011, 3, I8, sheet.poles),
        (0x3011, 4, U16, sheet.torque_constant_mnm_a),
        (0x3011, 5, U16, sheet.terminal_resistance_10mohm),
        (0x3011, 6, U16, sheet.terminal_inductance_10uh),
        (0x3011, 7, U32, sheet.rotor_inertia),
        (0x3011, 8, I16, sheet.continuous_ma),
        (0x3011, 9, I16, sheet.peak_ma),
        (0x3011, 11, I16, sheet.continuous_ma / 2),
        (0x6076, 0, I32, sheet.rated_torque_mnm),
        (0x6080, 0, I32, sheet.no_load_counts_s),
        (0x607F, 0, I32, sheet.no_load_counts_s),
        (0x60C5, 0, U32, 0),
        (0x60C6, 0, U32, 0),
    ] {
        let data = Value::Integer(value).encode(data_type).unwrap();
        let object = Address::new(index, sub);
        client
            .download(node, object, data)
            .await
            .unwrap_or_else(|error| panic!("{error}: {sheet:?}"));
    }
}

/// Writes what a calibration finds, from the truth.
pub(crate) async fn calibrated<L: Link>(client: &mut Client<L>, node: NodeId, truth: &Parameters) {
    use DataType::{I8, I16, U16, U32};
    let mirrored = truth.encoder.reversed != truth.motor.wires_swapped;
    let [bias_a, bias_b] = truth.current_zero_counts;
    for (index, sub, data_type, value) in [
        (0x3009, 1, U16, bias_a.round() as i64),
        (0x3009, 2, U16, bias_b.round() as i64),
        (0x3011, 1, I16, i64::from(truth.encoder.zero_counts)),
        (0x3011, 2, I8, if mirrored { -1 } else { 1 }),
        (0x3013, 5, U32, (truth.encoder.lag_s * 1e6).round() as i64),
    ] {
        let data = Value::Integer(value).encode(data_type).unwrap();
        let object = Address::new(index, sub);
        client.download(node, object, data).await.unwrap();
    }
}
