//! Whatever a control loop commands, the world stays finite, and it is the same world every time.

use control::io::Duty;
use plant::{Parameters, Plant, Stops, Switch, SwitchName};

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

/// A P3 with all that may hang on it.
fn everything() -> Parameters {
    let mut parameters = Parameters::default();
    parameters.load.inertia_kgm2 = 1e-6;
    parameters.load.stops = Some(Stops::between(-3.0, 2.0));
    let mut home = Switch::between(0.0, 0.25);
    home.bounce_s = 1e-3;
    home.hysteresis_turns = 0.01;
    parameters.switches.home = Some(home);
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
        .chain([truth.speed_rad_s, truth.torque_nm, truth.bus_voltage_v]);
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
