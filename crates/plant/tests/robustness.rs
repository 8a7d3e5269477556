//! Whatever a control loop commands, the world stays finite, and it is the same world every time.

use control::io::Duty;
use plant::{
    COMPLETE_P3, Coupling, EncoderFault, FULL_P3, Link, Parameters, Pendulum, Phase, Plant, Short,
    Stops, Switch, SwitchName,
};

/// A small generator of our own (xorshift), for repeatable nonsense.
struct Nonsense(u64);

impl Nonsense {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    /// A plausible duty, or one outside 0 to 1, or any bit pattern that an f32 can have.
    fn fraction(&mut self) -> f32 {
        match self.next() % 8 {
            0 => f32::from_bits(self.next()),
            1 => f32::NAN,
            2 => (self.next() as f32 - 2e9) * 1e-8,
            3 => [
                0.0,
                -0.0,
                1.0,
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::MAX,
                f32::MIN_POSITIVE,
            ][self.next() as usize % 7],
            _ => self.next() as f32 / 4_294_967_296.0,
        }
    }

    fn duty(&mut self) -> Duty<f32> {
        let phase = std::array::from_fn(|_| self.fraction());
        Duty {
            phase,
            enabled: self.next() > u32::MAX / 8,
        }
    }
}

/// A P3 with all that may hang on it, between narrow stops.
fn everything() -> Parameters {
    let mut parameters = COMPLETE_P3;
    parameters.load.stops = Some(Stops::between(-3.0, 2.0));
    parameters.switches.negative_limit = Some(Switch::below(-2.0));
    assert_eq!(parameters.check(), Ok(()));
    parameters
}

fn assert_sane(plant: &mut Plant<f32>) {
    let signals = plant.signals();
    for adc in [
        signals.motor_temperature_adc,
        signals.auxiliary_adc[0],
        signals.auxiliary_adc[1],
    ] {
        assert!((0.0..=4095.0).contains(&adc) && adc.fract() == 0.0);
    }
    let truth = plant.truth();
    let numbers = [truth.phase_current_a, truth.phase_emf_v]
        .concat()
        .into_iter()
        .chain([truth.speed_rad_s, truth.torque_nm, truth.bus_voltage_v])
        .chain([truth.load_speed_rad_s])
        .chain([truth.winding_c, truth.housing_c, truth.amplifier_c]);
    for number in numbers {
        assert!(number.is_finite(), "{truth:?}");
    }
    let sample = plant.sample();
    assert!((0..4096).contains(&sample.encoder), "{sample:?}");
    for adc in [
        sample.phase_adc[0],
        sample.phase_adc[1],
        sample.bus_adc,
        sample.temperature_adc,
    ] {
        assert!(
            (0.0..=4095.0).contains(&adc) && adc.fract() == 0.0,
            "{sample:?}"
        );
    }
}

#[test]
fn no_duty_makes_a_nan() {
    for seed in 1..=20 {
        let mut nonsense = Nonsense(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed));
        let mut plant = Plant::<f32>::new(&Parameters::default());
        for _ in 0..5_000 {
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
            assert_sane(&mut plant);
        }
    }
}

#[test]
fn no_setting_makes_a_nan_either() {
    for seed in 1..=20 {
        let mut nonsense = Nonsense(0x2545_F491_4F6C_DD1D_u64.wrapping_mul(seed));
        let mut plant = Plant::<f32>::new(&everything());
        for _ in 0..5_000 {
            let any = f32::from_bits(nonsense.next());
            match nonsense.next() % 11 {
                0 => plant.set_supply_v(any),
                1 => plant.set_load_torque_nm(any),
                2 => plant.set_motion(nonsense.next() as i32, any),
                3 => plant.set_amplifier_temperature_c(any),
                4 => plant.set_auxiliary_v([any, 1.0]),
                5 => plant.hold_switch(
                    SwitchName::Home,
                    [None, Some(true), Some(false)][nonsense.next() as usize % 3],
                ),
                6 => plant.set_motor_temperature_c(any),
                7 => plant.set_ambient_c(any),
                8 => plant.set_inputs(nonsense.next()),
                9 => plant.set_blocked(nonsense.next() > u32::MAX / 2),
                _ => plant.set_pwm_period_s(f64::from_bits(
                    u64::from(nonsense.next()) << 32 | u64::from(nonsense.next()),
                )),
            }
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
            assert_sane(&mut plant);
        }
    }
}

/// Sets something electrical to nonsense, or breaks or mends it.
fn meddle(plant: &mut Plant<f32>, nonsense: &mut Nonsense) {
    let any = f32::from_bits(nonsense.next());
    let phase = [Phase::A, Phase::B, Phase::C][nonsense.next() as usize % 3];
    let yes = nonsense.next().is_multiple_of(2);
    match nonsense.next() % 12 {
        0 => plant.set_short(yes.then_some(Short::BesidePhase(phase))),
        1 => plant.set_short(yes.then_some(Short::ToNegative(phase))),
        2 => plant.set_short(yes.then_some(Short::ToPositive(phase))),
        3 => plant.set_open_phase(phase, yes),
        4 => plant.set_encoder_fault(
            [
                EncoderFault::None,
                EncoderFault::Stuck,
                EncoderFault::NoAnswer,
                EncoderFault::BadParity,
            ][nonsense.next() as usize % 4],
        ),
        5 => plant.set_magnet_mm(any),
        6 => plant.set_bad_answers(any),
        7 => plant.slip_magnet(nonsense.next() as i32),
        8 => plant.set_logic_supply_v(if yes { 24.0 } else { any }),
        9 => plant.set_link(&if yes {
            Link::SMALL
        } else {
            Link {
                capacitance_f: f64::from(nonsense.fraction()),
                source_ohm: any.into(),
                bleeder_ohm: f64::from(nonsense.fraction()),
                brake_ohm: f64::from(nonsense.fraction()),
                brake_on_v: any,
                brake_off_v: nonsense.fraction(),
            }
        }),
        10 => plant.set_noise_seed(nonsense.next() as i32),
        _ => plant.set_supply_v(if yes { 48.0 } else { any }),
    }
}

#[test]
fn neither_does_meddling_with_the_electrical_side() {
    for seed in 1..=20 {
        let mut nonsense = Nonsense(0xD1B5_4A32_D192_ED03_u64.wrapping_mul(seed));
        let mut plant = Plant::<f32>::new(&FULL_P3);
        plant.set_motion(0, 1_000.0);
        for _ in 0..5_000 {
            meddle(&mut plant, &mut nonsense);
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
            assert_sane(&mut plant);
        }
    }
}

#[test]
fn a_world_of_impossible_parameters_is_refused_and_does_not_panic() {
    let mut refused = 0;
    for seed in 1..=2_000 {
        let mut nonsense = Nonsense(0x94D0_49BB_1331_11EB_u64.wrapping_mul(seed));
        let mut parameters = FULL_P3;
        for _ in 0..3 {
            let any = nonsense.fraction();
            let wide = f64::from(any);
            match nonsense.next() % 14 {
                0 => parameters.bridge.dead_time_s = wide * 1e-5,
                1 => parameters.bridge.switch_ohm = wide,
                2 => parameters.bridge.overcurrent_a = any,
                3 => parameters.bridge.blanking_s = wide * 1e-5,
                4 => parameters.link.capacitance_f = wide * 1e-3,
                5 => parameters.link.source_ohm = wide,
                6 => parameters.link.brake_on_v = any,
                7 => parameters.current_sensors.gain[0] = any,
                8 => parameters.current_sensors.noise_counts = any,
                9 => parameters.current_sensors.time_constant_s = wide * 1e-3,
                10 => parameters.encoder.eccentricity_counts = any,
                11 => parameters.encoder.lag_s = wide * 1e-3,
                12 => parameters.encoder.magnet_mm = any,
                _ => parameters.encoder.bad_answers = any,
            }
        }
        let possible = parameters.check().is_ok();
        refused += u32::from(!possible);
        let mut plant = Plant::<f32>::new(&parameters);
        for _ in 0..20 {
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
            if possible {
                assert_sane(&mut plant);
            } else {
                let _ = (plant.sample(), plant.truth());
                let _ = plant.signals();
            }
        }
    }
    assert!((200..1_900).contains(&refused), "{refused}");
}

#[test]
fn a_world_repeats_itself_bit_for_bit() {
    let run = |split: usize| {
        let mut nonsense = Nonsense(42);
        let mut plant = Plant::<f32>::new(&Parameters::default());
        plant.set_load_torque_nm(-5e-3);
        for n in 0..10_000 {
            if n == split {
                // A copy taken at any moment goes on like the original.
                let copy = plant;
                plant.load(&Duty {
                    phase: [0.9, 0.1, 0.1],
                    enabled: true,
                });
                plant.step();
                plant = copy;
            }
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
        }
        plant
    };
    let first = run(usize::MAX);
    for split in [1, 777, 9_999] {
        assert_eq!(first, run(split));
    }
    assert_ne!(first.truth().turns, 0);
}

#[test]
fn neither_does_an_impossible_load_or_heat_panic() {
    let mut refused = 0;
    for seed in 1..=3_000 {
        let mut nonsense = Nonsense(0xA24B_AED4_963E_E407_u64.wrapping_mul(seed));
        let mut parameters = everything();
        for _ in 0..2 {
            let any = f64::from(nonsense.fraction());
            let load = &mut parameters.load;
            let coupling = load.coupling.get_or_insert(Coupling {
                stiffness_nm_per_rad: 1.0,
                damping_nms: 0.0,
                backlash_rad: 0.0,
            });
            let stops = load.stops.get_or_insert(Stops::between(-1.0, 1.0));
            let thermal = parameters.thermal.as_mut().expect("a P3 warms up");
            let home = parameters.switches.home.get_or_insert(Switch::above(0.0));
            match nonsense.next() % 24 {
                0 => coupling.stiffness_nm_per_rad = any,
                1 => coupling.damping_nms = any,
                2 => coupling.backlash_rad = any,
                3 => stops.lowest_turns = any,
                4 => stops.highest_turns = any,
                5 => stops.stiffness_nm_per_rad = any,
                6 => stops.damping_ratio = any,
                7 => load.inertia_kgm2 = any,
                8 => load.coulomb_friction_nm = any,
                9 => {
                    load.pendulum = Some(Pendulum {
                        torque_nm: any,
                        hanging_turns: f64::from(nonsense.fraction()),
                    });
                }
                10 => parameters.motor.cogging.torque_nm = any,
                11 => parameters.motor.cogging.rest_turns = any,
                12 => parameters.motor.cogging.periods_per_turn = nonsense.next() as u16 & 3,
                13 => parameters.start_turns = any,
                14 => home.from_turns = any,
                15 => home.hysteresis_turns = any,
                16 => home.bounce_s = any,
                17 => thermal.motor.winding_k_per_w = any,
                18 => thermal.motor.housing_time_constant_s = any,
                19 => thermal.motor.resistance_per_k = any,
                20 => thermal.motor.reference_c = any,
                21 => thermal.amplifier.time_constant_s = any,
                22 => thermal.amplifier.switching_s = any,
                _ => parameters.ambient_c = any as f32,
            }
        }
        let possible = parameters.check().is_ok();
        refused += u32::from(!possible);
        let mut plant = Plant::<f32>::new(&parameters);
        for _ in 0..30 {
            plant.load(&nonsense.duty());
            for _ in 0..5 {
                plant.step();
            }
            if possible {
                assert_sane(&mut plant);
            } else {
                let _ = (plant.sample(), plant.truth());
                let _ = plant.signals();
            }
        }
    }
    println!("{refused} of 3000 refused");
    assert!((300..2_900).contains(&refused), "{refused}");
}
