//! 0x3019: gains by bandwidth and damping, and given directly (acc32_t).

mod master;
use master::*;

use std::f64::consts::TAU;

const ACC32: f64 = 32_768.0;
const OUT_OF_RANGE: u32 = 0x0609_0030;

/// Sub-index of the bandwidth; damping and the three gains stand behind it.
const POSITION: u8 = 5;
const VELOCITY: u8 = 10;

fn gain(master: &mut Master, of: u8, n: u8) -> f64 {
    f64::from(master.read(1, 0x3019, of + 2 + n)) / ACC32
}

fn by_rule(master: &mut Master, of: u8) -> (f64, f64) {
    (
        f64::from(master.read(1, 0x3019, of) as u16) * 0.1,
        f64::from(master.read(1, 0x3019, of + 1) as u16) / 256.0,
    )
}

fn give(master: &mut Master, of: u8, n: u8, value: f64) {
    master.write_i32(1, 0x3019, of + 2 + n, (value * ACC32).round() as i32);
}

/// A per turn/s²: what accelerates the rotor.
fn inertia(master: &mut Master) -> f64 {
    let inertia = f64::from(master.read(1, 0x3011, 7)) / 32_768.0 * 1e-7;
    inertia / (f64::from(master.read(1, 0x3011, 4)) * 1e-3) * TAU
}

fn near(got: f64, wanted: f64, part: f64) {
    assert!((got / wanted - 1.0).abs() < part, "{got} for {wanted}");
}

fn speed_after_a_step(master: &mut Master, ms: u64) -> Vec<i32> {
    master.enable(1, 9);
    master.write_i32(1, 0x60FF, 0, 40_000);
    let mut seen = Vec::new();
    for _ in 0..ms {
        master.run_ms(1);
        seen.push(master.read(1, 0x606C, 0));
    }
    master.write_u16(1, 0x6040, 0, 0);
    seen
}

#[test]
fn bandwidth_and_damping_show_the_gains_that_they_make() {
    let mut master = Master::new(&[1]);
    let c = inertia(&mut master);
    for (hz, damping) in [(100.0, 1.0), (60.0, 0.7), (200.0, 1.5)] {
        master.write_u16(1, 0x3019, VELOCITY, (hz * 10.0) as u16);
        master.write_u16(1, 0x3019, VELOCITY + 1, (damping * 256.0) as u16);
        let omega = TAU * hz;
        near(
            gain(&mut master, VELOCITY, 0),
            2.0 * damping * omega * c,
            3e-3,
        );
        near(gain(&mut master, VELOCITY, 1), omega * omega * c, 1e-4);
        assert_eq!(gain(&mut master, VELOCITY, 2), 0.0);
        master.write_u16(1, 0x3019, POSITION, hz as u16);
        near(gain(&mut master, POSITION, 0), TAU * hz * 0.1, 1e-5);
        assert_eq!(gain(&mut master, POSITION, 1), 0.0);
    }
    // They follow the motor's figures.
    let before = gain(&mut master, VELOCITY, 1);
    master.write_i32(1, 0x3011, 7, 2 * 145_818);
    near(gain(&mut master, VELOCITY, 1), 2.0 * before, 1e-4);
}

#[test]
fn given_gains_take_effect_and_show_their_bandwidth_and_damping() {
    let mut by_bandwidth = Master::new(&[1]);
    by_bandwidth.write_u16(1, 0x3019, VELOCITY, 400);
    by_bandwidth.write_u16(1, 0x3019, VELOCITY + 1, 512);
    let wanted = speed_after_a_step(&mut by_bandwidth, 40);

    let mut given = Master::new(&[1]);
    let c = inertia(&mut given);
    let omega = TAU * 40.0;
    give(&mut given, VELOCITY, 1, omega * omega * c);
    give(&mut given, VELOCITY, 0, 4.0 * omega * c);
    let (hz, damping) = by_rule(&mut given, VELOCITY);
    assert!(
        (hz - 40.0).abs() < 0.11 && (damping - 2.0).abs() < 0.02,
        "{hz} {damping}"
    );
    let got = speed_after_a_step(&mut given, 40);
    // The same loop: the same response, but for the rounding of the gains.
    for (a, b) in got.iter().zip(&wanted) {
        assert!((a - b).abs() < 1_200, "{got:?} {wanted:?}");
    }
    // And another than by default.
    let default = speed_after_a_step(&mut Master::new(&[1]), 40);
    let most = default.iter().zip(&got).map(|(a, b)| (a - b).abs()).max();
    assert!(most.unwrap() > 2_000, "{most:?}");

    // They do not follow the motor's figures; what they amount to does.
    let before = given.read(1, 0x3019, VELOCITY + 3);
    given.write_i32(1, 0x3011, 7, 4 * 145_818);
    assert_eq!(given.read(1, 0x3019, VELOCITY + 3), before);
    let (hz, damping) = by_rule(&mut given, VELOCITY);
    assert!(
        (hz - 20.0).abs() < 0.11 && (damping - 1.0).abs() < 0.02,
        "{hz} {damping}"
    );

    // A bandwidth takes over again, with the damping that is shown.
    given.write_u16(1, 0x3019, VELOCITY, 500);
    near(
        gain(&mut given, VELOCITY, 1),
        (TAU * 50.0_f64).powi(2) * 4.0 * c,
        1e-3,
    );
}

#[test]
fn a_position_loop_can_have_an_integral_and_a_derivative_part() {
    let mut master = Master::new(&[1]);
    assert_eq!(by_rule(&mut master, POSITION), (20.0, 1.0));
    give(&mut master, POSITION, 1, 4_000.0);
    // s² + 125.7 s + 4000
    let (hz, damping) = by_rule(&mut master, POSITION);
    near(hz, 4_000_f64.sqrt() / TAU, 0.01);
    near(damping, 125.66 / (2.0 * 4_000_f64.sqrt()), 0.01);
    give(&mut master, POSITION, 2, 0.5);
    let (hz, _) = by_rule(&mut master, POSITION);
    near(hz, (4_000.0 / 1.5_f64).sqrt() / TAU, 0.01);
    give(&mut master, POSITION, 1, 0.0);
    let (hz, _) = by_rule(&mut master, POSITION);
    near(hz, 125.66 / 1.5 / TAU, 0.01);

    // The integral takes away what a velocity offset leaves: 2,000 counts/s at 125.7 1/s.
    let error = |integral: f64| {
        let mut master = Master::new(&[1]);
        give(&mut master, POSITION, 1, integral);
        master.enable(1, 8);
        let here = master.position(1);
        master.write_i32(1, 0x60B1, 0, 2_000);
        master.write_i32(1, 0x607A, 0, here);
        master.run_ms(1_000);
        master.read(1, 0x60F4, 0)
    };
    let without = error(0.0);
    assert!((without + 16).abs() <= 3, "{without}");
    let with = error(2_000.0);
    assert!(with.abs() <= 2, "{with}");
}

/// A torque from outside moves an axis under position control the less the higher its damping is, and
/// the axis comes back as fast: J·s³ + ζ·(Kp s + Ki)·(s + ω) is the loop's polynomial.
#[test]
fn a_damping_of_the_position_loop_is_its_stiffness() {
    let omega = TAU * 6.0;
    let velocity = TAU * 60.0;
    // A step of torque that accelerates the free rotor by 1, in steps of 10 µs.
    let model = |damping: f64| {
        let (mut position, mut speed, mut integral, mut greatest) = (0.0, 0.0, 0.0, 0.0_f64);
        let mut after = 0.0;
        for n in 0..20_000 {
            let error = damping * (-speed - omega * position);
            integral += velocity * velocity * error * 1e-5;
            speed += (1.0 + 2.0 * velocity * error + integral) * 1e-5;
            position += speed * 1e-5;
            greatest = greatest.max(position);
            if n == 5_000 {
                after = position;
            }
        }
        (greatest, after)
    };
    let measured = |damping: f64| {
        let mut settings = p3(1);
        settings.plant.motor.coulomb_friction_nm = 0.0;
        settings.plant.motor.static_friction_nm = 0.0;
        settings.plant.motor.viscous_friction_nms = 0.0;
        let inertia = settings.plant.motor.rotor_inertia_kgm2;
        let mut master = Master::with(vec![settings]);
        master.write_u16(1, 0x3019, VELOCITY, 600);
        master.write_u16(1, 0x3019, POSITION, 60);
        master.write_u16(1, 0x3019, POSITION + 1, (damping * 256.0) as u16);
        near(gain(&mut master, POSITION, 0), damping * omega, 1e-3);
        let derivative = gain(&mut master, POSITION, 2);
        assert!((derivative - (damping - 1.0)).abs() < 1e-4, "{derivative}");
        master.enable(1, 8);
        master.run_ms(100);
        let place = |master: &mut Master| master.drive(1).plant().truth().position_turns() * TAU;
        let from = place(&mut master);
        let torque = 8e-3;
        master.drive(1).plant().set_load_torque_nm(-torque as f32);
        let (mut greatest, mut after) = (0.0_f64, 0.0);
        for n in 0..2_000 {
            master.run_us(100);
            let moved = place(&mut master) - from;
            greatest = greatest.max(moved);
            if n == 500 {
                after = moved;
            }
        }
        (greatest * inertia / torque, after * inertia / torque)
    };
    for damping in [0.5, 1.0, 2.0] {
        let (wanted, got) = (model(damping), measured(damping));
        println!("{damping}: {got:?}, model {wanted:?}");
        near(got.0, wanted.0, 0.1);
        // Half way back.
        near(got.1, wanted.1, 0.15);
    }
}

/// Given gains without an integral part show both: bandwidth and damping are those that make them.
#[test]
fn bandwidth_and_damping_of_the_position_loop_come_back_from_its_gains() {
    let mut master = Master::new(&[1]);
    for (hz, damping) in [(20.0, 0.5), (10.0, 1.0), (15.0, 1.75)] {
        master.write_u16(1, 0x3019, POSITION, (hz * 10.0) as u16);
        master.write_u16(1, 0x3019, POSITION + 1, (damping * 256.0) as u16);
        let shown = gain(&mut master, POSITION, 0);
        if damping < 1.0 {
            assert_eq!(gain(&mut master, POSITION, 2), damping - 1.0);
        }
        // Written as it is shown, it is given from now on.
        give(&mut master, POSITION, 0, shown);
        let (seen_hz, seen_damping) = by_rule(&mut master, POSITION);
        assert!((seen_hz - hz).abs() < 0.11, "{seen_hz} {hz}");
        assert!((seen_damping - damping).abs() < 0.01, "{seen_damping}");
    }
}

/// A derivative part of the velocity loop adds to the inertia: a torque from outside moves the shaft
/// more slowly, and in the end as far. Without an integral it is a loop of first order.
#[test]
fn a_velocity_derivative_acts_like_inertia() {
    let run = |milliamperes: f64| {
        let mut master = Master::new(&[1]);
        give(&mut master, VELOCITY, 0, 0.02);
        give(&mut master, VELOCITY, 1, 0.0);
        give(&mut master, VELOCITY, 2, milliamperes);
        let hz = by_rule(&mut master, VELOCITY).0;
        master.enable(1, 9);
        master.write_i16(1, 0x60B2, 0, 200);
        master.write_i32(1, 0x60FF, 0, 0);
        master.run_ms(4);
        let early = f64::from(master.read(1, 0x606C, 0));
        master.run_ms(200);
        (hz, early, f64::from(master.read(1, 0x606C, 0)))
    };
    // The rotor's own is 0.087 mA per turn/s²: 0.02 A over it are 229 1/s.
    let (hz, early, late) = run(0.0);
    let (hz_damped, early_damped, late_damped) = run(0.26);
    println!("{hz} Hz {early} {late}, {hz_damped} Hz {early_damped} {late_damped} counts/s");
    near(hz, 0.02 / 8.74e-5 / TAU, 0.01);
    near(hz_damped, hz * 0.0874 / 0.3474, 0.01);
    assert!(early_damped < 0.6 * early, "{early} {early_damped}");
    near(late_damped, late, 0.05);
}

#[test]
fn what_makes_no_controller_is_refused_and_changes_nothing() {
    let mut master = Master::new(&[1]);
    let all = |master: &mut Master| -> Vec<i32> {
        (1..=14).map(|sub| master.read(1, 0x3019, sub)).collect()
    };
    let before = all(&mut master);
    for sub in [1, 2, 3, 4, 5, 6, 10, 11] {
        let refused = master.try_write(1, 0x3019, sub, &[0, 0]);
        assert_eq!(refused, Err(OUT_OF_RANGE), "{sub}");
    }
    for sub in [7, 8, 9, 12, 13, 14] {
        let refused = master.try_write(1, 0x3019, sub, &(-1_i32).to_le_bytes());
        assert_eq!(refused, Err(OUT_OF_RANGE), "{sub}");
    }
    for sub in [7, 12] {
        assert_eq!(master.try_write(1, 0x3019, sub, &[0; 4]), Err(OUT_OF_RANGE));
    }
    assert_eq!(all(&mut master), before);
    assert!(master.emergencies(1).is_empty());
}

#[test]
fn gains_are_stored_as_they_count() {
    let mut master = Master::new(&[1]);
    give(&mut master, VELOCITY, 0, 0.25);
    give(&mut master, VELOCITY, 1, 50.0);
    master.write_u16(1, 0x3019, POSITION, 150);
    let c = inertia(&mut master);
    // One of them saved is all of them saved, and nothing else.
    master.write(1, 0x1010, 4, &[VELOCITY + 2, 0x19, 0x30, 0x00]);
    assert_eq!(
        gain(&mut master, POSITION, 0),
        f64::from(master.read(1, 0x3019, 7)) / ACC32
    );
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    assert_eq!(gain(&mut master, VELOCITY, 0), 0.25);
    assert_eq!(gain(&mut master, VELOCITY, 1), 50.0);
    near(
        by_rule(&mut master, VELOCITY).0,
        (50.0 / c).sqrt() / TAU,
        0.01,
    );
    assert_eq!(master.read(1, 0x3019, POSITION), 200);
    // Still given: the motor's figures do not change them.
    master.write_i32(1, 0x3011, 7, 300_000);
    assert_eq!(gain(&mut master, VELOCITY, 1), 50.0);

    // All saved: the rule's are made anew from the bandwidth.
    master.write_u16(1, 0x3019, VELOCITY, 800);
    master.write_u16(1, 0x3019, POSITION, 150);
    master.write(1, 0x1010, 1, &SAVE);
    let shown = gain(&mut master, VELOCITY, 1);
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    assert_eq!(gain(&mut master, VELOCITY, 1), shown);
    near(gain(&mut master, POSITION, 0), TAU * 15.0, 1e-4);
    master.write_i32(1, 0x3011, 7, 150_000);
    near(gain(&mut master, VELOCITY, 1), shown / 2.0, 1e-3);
}
