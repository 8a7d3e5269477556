//! The same source over several lanes gives the same bits in every lane: nothing branches on a
//! value, and no operation depends on its neighbours.

mod group;
mod rig;

use control::current::CurrentGains;
use control::i2t::I2t;
use control::io::Sample;
use control::tuning::Pi;
use control::velocity::Cutoff;
use control::{
    Cascade, Command, EncoderSettings, FrameSource, Gains, Mask, Motor, Parameters, PowerStage,
};
use core::array::from_fn;
use group::{Lanes, Masks, N};
use rig::*;

/// One field of four values, lane by lane.
fn lanes<T: Copy>(of: &[T; N], get: impl Fn(T) -> f32) -> Lanes {
    Lanes(of.map(get))
}

fn pi(of: &[Parameters<f32>; N], get: impl Fn(&Gains<f32>) -> Pi) -> Pi<Lanes> {
    Pi {
        kp: lanes(of, |p| get(&p.gains).kp),
        ki: lanes(of, |p| get(&p.gains).ki),
    }
}

fn cutoff(
    of: &[Parameters<f32>; N],
    get: impl Fn(&EncoderSettings<f32>) -> Cutoff<f32>,
) -> Cutoff<Lanes> {
    Cutoff {
        floor_hz: lanes(of, |p| get(&p.encoder).floor_hz),
        ceiling_hz: lanes(of, |p| get(&p.encoder).ceiling_hz),
        hz_per_turn_per_s: lanes(of, |p| get(&p.encoder).hz_per_turn_per_s),
    }
}

fn parameters(of: &[Parameters<f32>; N]) -> Parameters<Lanes> {
    Parameters {
        period_s: lanes(of, |p| p.period_s),
        pwm_period_s: lanes(of, |p| p.pwm_period_s),
        load_delay_s: lanes(of, |p| p.load_delay_s),
        motor: Motor {
            phase_resistance_ohm: lanes(of, |p| p.motor.phase_resistance_ohm),
            phase_inductance_h: lanes(of, |p| p.motor.phase_inductance_h),
            torque_constant_nm_per_a: lanes(of, |p| p.motor.torque_constant_nm_per_a),
            pole_pairs: of.map(|p| p.motor.pole_pairs),
        },
        encoder: EncoderSettings {
            counts_per_turn: of.map(|p| p.encoder.counts_per_turn),
            electrical_zero: of.map(|p| p.encoder.electrical_zero),
            electrical_polarity: of.map(|p| p.encoder.electrical_polarity),
            user_polarity: of.map(|p| p.encoder.user_polarity),
            lag_s: lanes(of, |p| p.encoder.lag_s),
            loop_cutoff: cutoff(of, |e| e.loop_cutoff),
            reported_cutoff: cutoff(of, |e| e.reported_cutoff),
        },
        stage: PowerStage {
            scales: of[0].stage.scales,
            current_zero: [0, 1].map(|i| lanes(of, |p| p.stage.current_zero[i])),
            voltage_limit_v: lanes(of, |p| p.stage.voltage_limit_v),
            current_limit_a: lanes(of, |p| p.stage.current_limit_a),
            duty_margin: lanes(of, |p| p.stage.duty_margin),
            dead_time_s: lanes(of, |p| p.stage.dead_time_s),
            propagation_s: lanes(of, |p| p.stage.propagation_s),
        },
        gains: Gains {
            current_d: pi(of, |g| g.current_d),
            current_q: pi(of, |g| g.current_q),
            decoupling: lanes(of, |p| p.gains.decoupling),
            emf_feed_forward: lanes(of, |p| p.gains.emf_feed_forward),
            velocity: pi(of, |g| g.velocity),
            velocity_integral_limit_a: lanes(of, |p| p.gains.velocity_integral_limit_a),
            speed_limit: lanes(of, |p| p.gains.speed_limit),
            position: pi(of, |g| g.position),
            position_derivative: lanes(of, |p| p.gains.position_derivative),
            velocity_derivative: lanes(of, |p| p.gains.velocity_derivative),
            position_integral_limit: lanes(of, |p| p.gains.position_integral_limit),
        },
        i2t: I2t {
            enabled: Masks(of.map(|p| p.i2t.enabled)),
            literal: Masks(of.map(|p| p.i2t.literal)),
            continuous_a: lanes(of, |p| p.i2t.continuous_a),
            peak_a: lanes(of, |p| p.i2t.peak_a),
            peak_time_s: lanes(of, |p| p.i2t.peak_time_s),
        },
    }
}

fn command(of: &[Command<f32>; N]) -> Command<Lanes> {
    Command {
        enabled: Masks(of.map(|c| c.enabled)),
        position_loop: Masks(of.map(|c| c.position_loop)),
        velocity_loop: Masks(of.map(|c| c.velocity_loop)),
        position: of.map(|c| c.position),
        fraction: lanes(of, |c| c.fraction),
        velocity: lanes(of, |c| c.velocity),
        acceleration: lanes(of, |c| c.acceleration),
        velocity_offset: lanes(of, |c| c.velocity_offset),
        current: lanes(of, |c| c.current),
        current_slope: lanes(of, |c| c.current_slope),
        acceleration_current: lanes(of, |c| c.acceleration_current),
        periods: of.map(|c| c.periods),
        current_limit: lanes(of, |c| c.current_limit),
        velocity_limit: lanes(of, |c| c.velocity_limit),
        frame: FrameSource {
            angle_given: Masks(of.map(|c| c.frame.angle_given)),
            angle: of.map(|c| c.frame.angle),
            turn: of.map(|c| c.frame.turn),
            voltage_given: Masks(of.map(|c| c.frame.voltage_given)),
            voltage_d_v: lanes(of, |c| c.frame.voltage_d_v),
            voltage_q_v: lanes(of, |c| c.frame.voltage_q_v),
        },
        shorted: Masks(of.map(|c| c.shorted)),
    }
}

#[test]
fn every_lane_has_the_bits_of_its_own_drive() {
    let mut all = [defaults(), defaults(), defaults(), defaults()];
    all[1].encoder.user_polarity = -1;
    all[1].motor.pole_pairs = 1;
    all[2] = rig::parameters(pole_zero(1500.0), 60.0, 10.0);
    all[2].i2t.enabled = true;
    all[2].stage.dead_time_s = 200e-9;
    all[3].stage.duty_margin = 0.04;
    all[3].stage.dead_time_s = 50e-9;
    all[3].stage.propagation_s = 1e-6;
    all[3].encoder.electrical_polarity = -1;
    let mut rigs: [Rig; N] = from_fn(|i| Rig::new(&all[i]));
    rigs[3].swapped = true;
    let mut batch = Cascade::<Lanes>::new(&parameters(&all));

    let base = Command::<f32> {
        enabled: true,
        ..Command::idle()
    };
    for ms in 0..400 {
        let at = ms * 37;
        let commands = [
            Command {
                position_loop: true,
                position: at,
                velocity: 37_000.0,
                periods: 20,
                enabled: ms % 100 > 5,
                ..base
            },
            Command {
                velocity_loop: true,
                velocity: 300_000.0,
                acceleration: -1e5,
                periods: 20,
                ..base
            },
            Command {
                current: if ms < 200 { 3.0 } else { -0.4 },
                velocity_limit: 700_000.0,
                ..base
            },
            Command {
                frame: FrameSource {
                    angle_given: true,
                    angle: at.wrapping_mul(99_999),
                    turn: 1 << 27,
                    voltage_given: ms % 50 < 25,
                    voltage_d_v: 2.0,
                    voltage_q_v: 0.1,
                },
                shorted: ms % 70 < 20,
                current: 0.2,
                ..base
            },
        ];
        for (rig, command) in rigs.iter_mut().zip(&commands) {
            rig.cascade.load(command);
        }
        batch.load(&command(&commands));
        // Two encoders fail at times, not at the same.
        rigs[1].blind = ms % 10 == 3;
        rigs[2].blind = ms % 7 == 4;
        for _ in 0..20 {
            let samples: [Sample<f32>; N] = from_fn(|i| rigs[i].sample());
            let together = batch.period(&Sample {
                phase_adc: [0, 1].map(|phase| lanes(&samples, |s| s.phase_adc[phase])),
                encoder: samples.map(|s| s.encoder),
                bus_adc: lanes(&samples, |s| s.bus_adc),
                temperature_adc: lanes(&samples, |s| s.temperature_adc),
                overcurrent: Mask::splat(false),
                encoder_valid: Masks(samples.map(|s| s.encoder_valid)),
            });
            for (i, rig) in rigs.iter_mut().enumerate() {
                let mut alone = rig.cascade;
                let duty = alone.period(&samples[i]);
                for phase in 0..3 {
                    let bits = together.phase[phase].0[i].to_bits();
                    assert_eq!(bits, duty.phase[phase].to_bits(), "lane {i} at {ms} ms");
                }
                assert_eq!(together.enabled.0[i], duty.enabled);
                rig.period();
            }
        }
    }
    // The runs were not idle: every drive moved.
    for rig in &rigs {
        assert!(rig.angle.abs() > 1.0);
    }
    let feedback = batch.feedback();
    for (i, rig) in rigs.iter().enumerate() {
        let alone = rig.cascade.feedback();
        assert_eq!(feedback.position[i], alone.position);
        assert_eq!(feedback.velocity_reported.0[i], alone.velocity_reported);
        assert_eq!(feedback.following_error.0[i], alone.following_error);
    }
    assert_eq!(
        CurrentGains::back_calculation(Lanes([2.0, 0.0, -1.0, 4.0]), Lanes([1.0; N])).0,
        [0.5, 1.0, 1.0, 0.25]
    );
}
