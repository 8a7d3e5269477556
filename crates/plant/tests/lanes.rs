//! Four worlds side by side have the bits of each alone, with every effect and without.

#[path = "../../control/tests/group/mod.rs"]
mod group;

use std::array::from_fn;

use control::io::Duty;
use group::{Lanes, Masks, N};
use plant::{COMPLETE_P3, FULL_P3, Parameters, Phase, Plant, Short, Stops, VIRTUAL_P3};

/// Duties that come near the rails, stand still, drive hard and switch off, differently in each lane.
fn duty(lane: usize, period: usize) -> Duty<f32> {
    let turn = (period as f32 * 0.003 * (lane as f32 + 1.0)).sin();
    let depth = [0.5, 0.4, 0.06, 0.499][lane];
    Duty {
        phase: [0.5 + depth * turn, 0.5 - depth * turn, 0.5 + 0.1 * depth],
        enabled: !(period / (300 + 70 * lane)).is_multiple_of(3),
    }
}

fn compare(parameters: &Parameters, act: impl Fn(&mut dyn Acts, usize)) {
    let mut alone: [Plant<f32>; N] = from_fn(|_| Plant::new(parameters));
    let mut together = Plant::<Lanes>::new(parameters);
    for (lane, plant) in alone.iter_mut().enumerate() {
        plant.set_noise_seed(lane as i32 + 7);
        plant.set_motion(lane as i32 * 12_345, 300.0 * lane as f32);
        plant.set_load_torque_nm(1e-3 * lane as f32);
    }
    together.set_noise_seed(from_fn(|lane| lane as i32 + 7));
    let speeds = Lanes(from_fn(|lane| 300.0 * lane as f32));
    together.set_motion(from_fn(|lane| lane as i32 * 12_345), speeds);
    together.set_load_torque_nm(Lanes(from_fn(|lane| 1e-3 * lane as f32)));
    for period in 0..4_000 {
        let duties: [Duty<f32>; N] = from_fn(|lane| duty(lane, period));
        act(&mut together, period);
        together.load(&Duty {
            phase: from_fn(|phase| Lanes(duties.map(|duty| duty.phase[phase]))),
            enabled: Masks(duties.map(|duty| duty.enabled)),
        });
        for (plant, duty) in alone.iter_mut().zip(&duties) {
            act(plant, period);
            plant.load(duty);
            for _ in 0..5 {
                plant.step();
            }
        }
        for _ in 0..5 {
            together.step();
        }
        let (sample, truth) = (together.sample(), together.truth());
        for (lane, plant) in alone.iter().enumerate() {
            let (one, real) = (plant.sample(), plant.truth());
            let at = format!("lane {lane}, period {period}");
            for phase in 0..2 {
                assert_eq!(
                    sample.phase_adc[phase].0[lane], one.phase_adc[phase],
                    "{at}"
                );
            }
            assert_eq!(sample.encoder[lane], one.encoder, "{at}");
            assert_eq!(sample.encoder_valid.0[lane], one.encoder_valid, "{at}");
            assert_eq!(sample.overcurrent.0[lane], one.overcurrent, "{at}");
            assert_eq!(sample.bus_adc.0[lane], one.bus_adc, "{at}");
            for phase in 0..3 {
                let bits = truth.phase_current_a[phase].0[lane].to_bits();
                assert_eq!(bits, real.phase_current_a[phase].to_bits(), "{at}");
            }
            for (group, one) in [
                (truth.bus_voltage_v, real.bus_voltage_v),
                (truth.bridge_current_a, real.bridge_current_a),
                (truth.speed_rad_s, real.speed_rad_s),
                (truth.load_speed_rad_s, real.load_speed_rad_s),
                (truth.winding_c, real.winding_c),
                (truth.housing_c, real.housing_c),
                (truth.amplifier_c, real.amplifier_c),
            ] {
                assert_eq!(group.0[lane].to_bits(), one.to_bits(), "{at}");
            }
            assert_eq!(truth.angle[lane], real.angle, "{at}");
            assert_eq!(truth.load_angle[lane], real.load_angle, "{at}");
        }
    }
    // The runs were not idle.
    for plant in &alone {
        assert!(plant.truth().turns != 0 || plant.truth().angle.abs() > 1 << 24);
    }
}

/// What a test does to any plant.
trait Acts {
    fn wires(&mut self, open: Option<Phase>, short: Option<Short>);
    fn encoder(&mut self, magnet_mm: f32);
}

impl<R: control::Real> Acts for Plant<R> {
    fn wires(&mut self, open: Option<Phase>, short: Option<Short>) {
        for phase in [Phase::A, Phase::B, Phase::C] {
            self.set_open_phase(phase, open == Some(phase));
        }
        self.set_short(short);
    }

    fn encoder(&mut self, magnet_mm: f32) {
        self.set_magnet_mm(magnet_mm);
    }
}

#[test]
fn without_effects() {
    compare(&VIRTUAL_P3, |_, _| {});
}

#[test]
fn with_every_effect() {
    compare(&FULL_P3, |_, _| {});
    compare(&COMPLETE_P3, |_, _| {});
    // Narrow stops, which the shafts strike again and again.
    let mut narrow = COMPLETE_P3;
    narrow.load.stops = Some(Stops::between(-0.6, 0.4));
    compare(&narrow, |_, _| {});
    narrow.load.coupling = None;
    compare(&narrow, |_, _| {});
}

#[test]
fn with_broken_wires_and_a_loose_magnet() {
    let cases = [
        (None, None),
        (Some(Phase::A), None),
        (None, Some(Short::BesidePhase(Phase::C))),
        (None, Some(Short::ToNegative(Phase::B))),
        (Some(Phase::C), Some(Short::ToPositive(Phase::A))),
    ];
    for parameters in [VIRTUAL_P3, FULL_P3] {
        compare(&parameters, |plant, period| {
            if period % 400 == 0 {
                let (open, short) = cases[period / 400 % cases.len()];
                plant.wires(open, short);
                plant.encoder([1.0, 2.5, 5.0][period / 400 % 3]);
            }
        });
    }
}
