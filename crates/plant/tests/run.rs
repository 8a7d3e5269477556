//! Many periods at once are the periods one by one: bit for bit, whatever happens in between.

use control::io::Duty;
use plant::{
    COMPLETE_P3, Coupling, FULL_P3, Load, Parameters, Phase, Plant, Short, VIRTUAL_MD80, VIRTUAL_P3,
};

/// Numbers that repeat (xorshift).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % end
    }

    /// From -1 to 1.
    fn even(&mut self) -> f32 {
        self.below(1 << 21) as f32 / (1 << 20) as f32 - 1.0
    }
}

/// Something that happens to a world between two control boundaries.
fn act(plant: &mut Plant<f32>, choice: u64, value: f32) {
    match choice {
        0 => plant.set_load_torque_nm(0.004 * value),
        1 => plant.set_load_torque_nm(0.0),
        2 => plant.set_blocked(value > 0.3),
        3 => plant.set_supply_v(if value < -0.3 {
            0.0
        } else {
            30.0 + 18.0 * value
        }),
        4 => plant.set_motion(1 << 30, 900.0 * value),
        5 => plant.set_motion(0, 0.0),
        6 => plant.set_open_phase(Phase::B, value > 0.8),
        7 => plant.set_short((value > 0.8).then_some(Short::BesidePhase(Phase::A))),
        8 => plant.set_timer_dead_time_s(if value < 0.0 { 0.0 } else { 500e-9 }),
        9 => plant.set_late_periods(if value < 0.0 { 0 } else { 2 }),
        10 => plant.set_motor_temperature_c(60.0 + 40.0 * value),
        _ => {}
    }
}

/// What the bridge is told: open, resting, a weak or a strong voltage, or the ends of the range.
fn duty(numbers: &mut Numbers, kind: u64) -> Duty<f32> {
    let reach = [0.0, 0.0, 0.01, 0.4, 0.6][kind as usize];
    let not_below = |share: f32| if share < 0.0 { 0.0 } else { share };
    let not_above = |share: f32| if share > 1.0 { 1.0 } else { share };
    Duty {
        phase: [(); 3].map(|()| not_above(not_below(0.5 + reach * numbers.even()))),
        enabled: kind > 0,
    }
}

#[test]
fn a_run_has_the_bits_of_its_steps() {
    let coupled = Parameters {
        load: Load {
            inertia_kgm2: 2e-6,
            coupling: Some(Coupling {
                stiffness_nm_per_rad: 5.0,
                damping_nms: 1e-4,
                backlash_rad: 0.01,
            }),
            ..Load::NONE
        },
        ..VIRTUAL_P3
    };
    let worlds = [VIRTUAL_P3, VIRTUAL_MD80, FULL_P3, COMPLETE_P3, coupled];
    let (mut rested, mut flowed) = (0, 0);
    for (number, world) in worlds.iter().enumerate() {
        let mut numbers = Numbers(0x9E37_79B9_7F4A_7C15 + number as u64);
        let mut stepped = Plant::<f32>::new(world);
        let mut run = stepped;
        let mut kind = 0;
        for period in 0..20_000 {
            if numbers.below(40) == 0 {
                let (choice, value) = (numbers.below(12), numbers.even());
                act(&mut stepped, choice, value);
                act(&mut run, choice, value);
            }
            if numbers.below(60) == 0 {
                kind = numbers.below(5);
            }
            let duty = duty(&mut numbers, kind);
            stepped.load(&duty);
            run.load(&duty);
            let periods = numbers.below(12) as u32;
            for _ in 0..periods {
                stepped.step();
            }
            run.run(periods);
            // As text, which tells a zero from a negative one.
            let seen = |plant: &Plant<f32>| format!("{:?} {:?}", plant.truth(), plant.sample());
            assert_eq!(
                seen(&run),
                seen(&stepped),
                "world {number}, period {period}"
            );
            let truth = run.truth();
            let flows = truth.phase_current_a[0] != 0.0;
            rested += u32::from(!flows && truth.speed_rad_s == 0.0);
            flowed += u32::from(flows);
        }
    }
    assert!(rested > 5_000 && flowed > 20_000, "{rested} {flowed}");
}
