//! Whatever comes in, every duty stays within 0 and 1; and once it has gone, so has its effect.

mod rig;

use control::io::{Duty, Sample};
use control::tuning::Pi;
use control::velocity::Cutoff;
use control::{Cascade, Command, FrameSource, Parameters};
use rig::*;

/// A small generator (SplitMix64), so that every run is the same.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn chance(&mut self, of: u64) -> bool {
        self.next().is_multiple_of(of)
    }

    /// A number of any kind, or mostly `good`.
    fn odd(&mut self, good: f32) -> f32 {
        match self.next() % 16 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => 0.0,
            4 => -good,
            5 => f32::from_bits(self.next() as u32),
            6 => f32::MAX,
            _ => good,
        }
    }

    fn odd_count(&mut self, good: i32) -> i32 {
        match self.next() % 8 {
            0 => i32::MIN,
            1 => i32::MAX,
            2 => self.next() as i32,
            3 => 0,
            4 => -1,
            _ => good,
        }
    }

    fn pi(&mut self, good: Pi) -> Pi {
        Pi {
            kp: self.odd(good.kp),
            ki: self.odd(good.ki),
        }
    }

    fn cutoff(&mut self, good: Cutoff<f32>) -> Cutoff<f32> {
        Cutoff {
            floor_hz: self.odd(good.floor_hz),
            ceiling_hz: self.odd(good.ceiling_hz),
            hz_per_turn_per_s: self.odd(good.hz_per_turn_per_s),
        }
    }

    fn parameters(&mut self) -> Parameters<f32> {
        let mut p = defaults();
        p.period_s = self.odd(p.period_s);
        p.pwm_period_s = self.odd(p.pwm_period_s);
        p.load_delay_s = self.odd(p.load_delay_s);
        p.motor.phase_resistance_ohm = self.odd(p.motor.phase_resistance_ohm);
        p.motor.phase_inductance_h = self.odd(p.motor.phase_inductance_h);
        p.motor.torque_constant_nm_per_a = self.odd(p.motor.torque_constant_nm_per_a);
        p.motor.pole_pairs = self.odd_count(7);
        let e = &mut p.encoder;
        e.counts_per_turn = self.odd_count(4096);
        e.electrical_zero = self.odd_count(3576);
        e.electrical_polarity = self.odd_count(1);
        e.user_polarity = self.odd_count(1);
        e.lag_s = self.odd(3e-5);
        e.loop_cutoff = self.cutoff(e.loop_cutoff);
        e.reported_cutoff = self.cutoff(e.reported_cutoff);
        let s = &mut p.stage;
        s.scales.current_a = self.odd(s.scales.current_a);
        s.scales.current_zero = self.odd(2048.0);
        s.scales.voltage_v = self.odd(s.scales.voltage_v);
        s.scales.temperature_k = self.odd(s.scales.temperature_k);
        s.current_zero = [self.odd(2048.0), self.odd(2048.0)];
        s.voltage_limit_v = self.odd(27.7);
        s.current_limit_a = self.odd(3.5);
        s.duty_margin = self.odd(0.01);
        s.dead_time_s = self.odd(2e-7);
        s.propagation_s = self.odd(1e-7);
        let g = &mut p.gains;
        g.current_d = self.pi(g.current_d);
        g.current_q = self.pi(g.current_q);
        g.decoupling = self.odd(1.0);
        g.emf_feed_forward = self.odd(1.0);
        g.velocity = self.pi(g.velocity);
        g.velocity_integral_limit_a = self.odd(3.0);
        g.speed_limit = self.odd(g.speed_limit);
        g.position = self.pi(Pi { kp: 125.0, ki: 3.0 });
        g.position_derivative = self.odd(1.0);
        g.velocity_derivative = self.odd(1e-6);
        g.position_integral_limit = self.odd(1e4);
        p.i2t.enabled = self.chance(2);
        p.i2t.literal = self.chance(2);
        p.i2t.continuous_a = self.odd(0.716);
        p.i2t.peak_a = self.odd(3.5);
        p.i2t.peak_time_s = self.odd(0.5);
        p
    }

    fn command(&mut self) -> Command<f32> {
        Command {
            enabled: !self.chance(4),
            position_loop: self.chance(2),
            velocity_loop: self.chance(2),
            position: self.odd_count(1000),
            fraction: self.odd(0.5),
            velocity: self.odd(10_000.0),
            acceleration: self.odd(1e6),
            velocity_offset: self.odd(10.0),
            current: self.odd(0.5),
            current_slope: self.odd(100.0),
            acceleration_current: self.odd(1.0),
            periods: self.odd_count(20),
            current_limit: self.odd(2.0),
            velocity_limit: self.odd(900_000.0),
            frame: FrameSource {
                angle_given: self.chance(8),
                angle: self.odd_count(1 << 30),
                turn: 0,
                voltage_given: self.chance(8),
                voltage_d_v: self.odd(2.0),
                voltage_q_v: self.odd(2.0),
            },
            shorted: self.chance(8),
        }
    }

    fn sample(&mut self) -> Sample<f32> {
        Sample {
            phase_adc: [self.odd(2100.0), self.odd(2000.0)],
            encoder: self.odd_count(1234),
            bus_adc: self.odd(2458.0),
            temperature_adc: self.odd(1500.0),
            overcurrent: false,
            encoder_valid: true,
        }
    }
}

fn check(duty: &Duty<f32>) {
    for phase in duty.phase {
        assert!((0.0..=1.0).contains(&phase), "{duty:?}");
    }
}

#[test]
fn no_parameter_command_or_sample_makes_an_impossible_duty() {
    let mut dice = Dice(1);
    for _ in 0..20_000 {
        let mut cascade = Cascade::new(&dice.parameters());
        for _ in 0..4 {
            cascade.load(&dice.command());
            if dice.chance(8) {
                cascade.set_parameters(&dice.parameters());
            }
            if dice.chance(8) {
                cascade.preset_position(dice.odd_count(5));
            }
            for _ in 0..6 {
                check(&cascade.period(&dice.sample()));
            }
            let _ = cascade.feedback();
        }
    }
}

#[test]
fn good_numbers_heal_what_broken_ones_did() {
    let mut dice = Dice(2);
    for case in 0..200 {
        let mut rig = Rig::new(&dice.parameters());
        for _ in 0..40 {
            rig.cascade.load(&dice.command());
            check(&rig.cascade.period(&dice.sample()));
        }
        rig.cascade.set_parameters(&defaults());
        rig.cascade.load(&Command::idle());
        rig.run(0.02);
        rig.cascade.load(&Command {
            enabled: true,
            velocity_loop: true,
            velocity: counts(600.0),
            ..Command::idle()
        });
        rig.run(0.3);
        assert!(
            (rig.speed / RPM - 600.0).abs() < 8.0,
            "case {case}: {}",
            rig.speed / RPM
        );
        let f = rig.cascade.feedback();
        for value in [
            f.velocity,
            f.velocity_reported,
            f.current_q_a,
            f.current_d_a,
            f.following_error,
            f.demand_current_a,
            f.bus_voltage_v,
            f.temperature_c,
            f.phase_adc[0],
        ] {
            assert!(value.is_finite(), "case {case}: {f:?}");
        }
        assert!((f.bus_voltage_v - 48.0).abs() < 0.1 && (f.temperature_c - 25.0).abs() < 0.1);
    }
}

/// A broken number in a sample is no current at all, not full voltage.
#[test]
fn one_broken_sample_moves_nothing() {
    for broken in [f32::NAN, f32::INFINITY] {
        let mut rig = Rig::new(&defaults());
        rig.cascade.load(&Command {
            enabled: true,
            current: 0.1,
            ..Command::idle()
        });
        rig.run(0.001);
        let mut sample = rig.sample();
        sample.phase_adc = [broken, broken];
        let duty = rig.cascade.period(&sample);
        assert_eq!(duty.phase, [0.5; 3]);
    }
}

#[test]
fn the_bridge_is_off_in_the_period_after_the_command() {
    let mut rig = Rig::new(&defaults());
    rig.cascade.load(&Command {
        enabled: true,
        current: 0.5,
        ..Command::idle()
    });
    rig.run(0.01);
    rig.cascade.load(&Command::idle());
    let duty = rig.cascade.period(&rig.sample());
    assert!(!duty.enabled);
    assert_eq!(duty.phase, [0.5; 3]);
    assert_eq!(rig.cascade.feedback().demand_current_a, 0.0);
}
