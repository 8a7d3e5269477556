//! Loads behind a spring, with and without play; cogging and pendulums. Against closed forms.

mod support;

use std::f64::consts::{PI, TAU};

use plant::{Cogging, Coupling, Invalid, Load, Parameters, Pendulum, Plant, Stops, Switch, Truth};
use support::{OPEN, frictionless};

const JM: f64 = 4.45e-7;
const JL: f64 = 2e-6;
const H: f64 = 10e-6;

fn elastic(stiffness: f64, damping: f64, backlash: f64) -> Parameters {
    let mut parameters = frictionless();
    parameters.load = Load {
        inertia_kgm2: JL,
        coupling: Some(Coupling {
            stiffness_nm_per_rad: stiffness,
            damping_nms: damping,
            backlash_rad: backlash,
        }),
        ..Load::NONE
    };
    parameters
}

/// Free of the supply, so that no diode brakes it.
fn free(parameters: &Parameters) -> Plant<f32> {
    assert_eq!(parameters.check(), Ok(()));
    let mut plant = Plant::<f32>::new(parameters);
    plant.set_supply_v(0.0);
    plant.load(&OPEN);
    plant
}

fn twist(truth: &Truth<f32>) -> f64 {
    (truth.position_turns() - truth.load_position_turns()) * TAU
}

/// Kinetic energy of both, and of a spring.
fn energy(truth: &Truth<f32>, stiffness: f64, backlash: f64) -> f64 {
    let (rotor, load) = (
        f64::from(truth.speed_rad_s),
        f64::from(truth.load_speed_rad_s),
    );
    let bent = (twist(truth).abs() - 0.5 * backlash).max(0.0);
    0.5 * (JM * rotor * rotor + JL * load * load + stiffness * bent * bent)
}

/// Sets the rotor against the load by a torque upon the load for some time.
fn set_swinging(plant: &mut Plant<f32>) {
    plant.set_load_torque_nm(5e-3);
    for _ in 0..200 {
        plant.step();
    }
    plant.set_load_torque_nm(0.0);
    // The speed between two periods still has half of the last period's torque to come.
    plant.step();
}

/// Times at which the twist passes zero upward, s, between the periods.
fn crossings(plant: &mut Plant<f32>, periods: u32) -> Vec<f64> {
    let mut last = twist(&plant.truth());
    let mut times = Vec::new();
    for n in 0..periods {
        plant.step();
        let now = twist(&plant.truth());
        if last < 0.0 && now >= 0.0 {
            times.push((f64::from(n) + last / (last - now)) * H);
        }
        last = now;
    }
    times
}

#[test]
fn two_masses_swing_at_their_resonance() {
    for stiffness in [0.05, 1.0, 20.0] {
        let mut plant = free(&elastic(stiffness, 0.0, 0.0));
        set_swinging(&mut plant);
        let times = crossings(&mut plant, 100_000);
        let periods = (times.len() - 1) as f64;
        let measured = periods / (times[times.len() - 1] - times[0]);
        let expected = (stiffness * (1.0 / JM + 1.0 / JL)).sqrt() / TAU;
        println!("{stiffness} Nm/rad: {measured:.3} Hz, closed form {expected:.3} Hz");
        // What steps of h add: (ωh)²/24.
        let steps = (TAU * expected * H).powi(2) / 24.0;
        let error = measured / expected - 1.0 - steps;
        assert!(error.abs() < 2e-5, "{measured} {expected} {error}");
    }
}

#[test]
fn a_free_swing_keeps_its_energy_and_its_momentum() {
    let stiffness = 1.0;
    let mut plant = free(&elastic(stiffness, 0.0, 0.0));
    set_swinging(&mut plant);
    let mut start = 0.0;
    let swing = 10_000;
    // The energy between two steps trembles with the phase of the swing; its mean does not.
    for round in 0..100 {
        let mut sum = 0.0;
        for _ in 0..swing {
            plant.step();
            sum += energy(&plant.truth(), stiffness, 0.0) / f64::from(swing);
        }
        if round == 0 {
            start = sum;
        }
        assert!((sum / start - 1.0).abs() < 1e-4, "{round}: {sum} {start}");
    }
    let truth = plant.truth();
    let momentum = JM * f64::from(truth.speed_rad_s) + JL * f64::from(truth.load_speed_rad_s);
    // 5 mNm for 2 ms.
    assert!((momentum / -1e-5 - 1.0).abs() < 1e-4, "{momentum}");
}

#[test]
fn a_damped_swing_dies_away_exponentially() {
    let (stiffness, zeta) = (1.0, 0.05);
    let reduced = 1.0 / (1.0 / JM + 1.0 / JL);
    let natural = (stiffness / reduced).sqrt();
    let mut plant = free(&elastic(stiffness, 2.0 * zeta * natural * reduced, 0.0));
    set_swinging(&mut plant);
    let mut peaks = Vec::new();
    let (mut older, mut last) = (0.0, 0.0);
    for n in 0..60_000 {
        plant.step();
        let now = twist(&plant.truth());
        if last > older && last > now && last > 0.0 {
            peaks.push((f64::from(n) * H, last));
        }
        (older, last) = (last, now);
    }
    let (t0, first) = peaks[2];
    let (t1, later) = peaks[20];
    let decay = (first / later).ln() / (t1 - t0);
    assert!(
        (decay / (zeta * natural) - 1.0).abs() < 3e-3,
        "{decay} {}",
        zeta * natural
    );
}

#[test]
fn beyond_critical_damping_nothing_swings_and_nothing_explodes() {
    for damping in [1e-2, 1.0, 1e6] {
        let mut plant = free(&elastic(1e7, damping, 0.0));
        set_swinging(&mut plant);
        let energy_before = energy(&plant.truth(), 0.0, 0.0);
        for _ in 0..100_000 {
            plant.step();
            assert!(energy(&plant.truth(), 0.0, 0.0) <= energy_before * 1.001);
        }
        let truth = plant.truth();
        assert!((truth.speed_rad_s - truth.load_speed_rad_s).abs() < 1e-3);
    }
}

#[test]
fn the_spring_twists_by_the_torque_that_it_passes() {
    // The rotor blocked, the load pulled: torque over stiffness, to the f32's digits.
    let mut plant = free(&elastic(0.5, 1e-4, 0.0));
    plant.set_blocked(true);
    plant.set_load_torque_nm(20e-3);
    for _ in 0..200_000 {
        plant.step();
    }
    let truth = plant.truth();
    assert_eq!(truth.angle, 0);
    assert!(
        (twist(&truth) / (20e-3 / 0.5) - 1.0).abs() < 1e-5,
        "{}",
        twist(&truth)
    );
    // Wound up by several turns it still knows.
    let mut plant = free(&elastic(2e-3, 1e-5, 0.0));
    plant.set_blocked(true);
    plant.set_load_torque_nm(60e-3);
    for _ in 0..2_000_000 {
        plant.step();
    }
    let twist = twist(&plant.truth());
    assert!((twist / 30.0 - 1.0).abs() < 1e-4, "{twist}");
}

#[test]
fn within_the_play_the_masses_are_strangers() {
    let backlash = 0.2;
    let mut plant = free(&elastic(5.0, 0.0, backlash));
    // The rotor is pushed by hand, so to say: the load stands until half the play is used up.
    plant.set_motion(0, 0.0);
    plant.set_load_torque_nm(1e-3);
    let mut periods = 0;
    while plant.truth().speed_rad_s == 0.0 {
        plant.step();
        periods += 1;
        assert!(periods < 10_000);
    }
    // The load has fallen through half the play: ½ (T/J) t² = 0.1.
    let time = (2.0 * 0.1 * JL / 1e-3_f64).sqrt();
    assert!(
        (f64::from(periods) * H - time).abs() < 5.0 * H,
        "{periods} {time}"
    );
    assert!((twist(&plant.truth()) - 0.1).abs() < 1e-3);
    // Elastic flanks: the masses bounce off each other without loss of energy.
    plant.set_load_torque_nm(0.0);
    let before = energy(&plant.truth(), 5.0, backlash);
    for _ in 0..400_000 {
        plant.step();
    }
    let after = energy(&plant.truth(), 5.0, backlash);
    assert!((after / before - 1.0).abs() < 0.03, "{before} {after}");
}

#[test]
fn damped_flanks_lose_energy_and_never_stick() {
    let mut plant = free(&elastic(5.0, 2e-4, 0.2));
    set_swinging(&mut plant);
    let mut last = energy(&plant.truth(), 5.0, 0.2);
    let mut worst = 0.0_f64;
    for n in 0..400_000 {
        plant.step();
        if n % 1_000 == 0 {
            let now = energy(&plant.truth(), 5.0, 0.2);
            worst = worst.max(now / last - 1.0);
            last = now;
        }
    }
    assert!(worst < 2e-3, "{worst}");
    // In the end they go together.
    let truth = plant.truth();
    assert!(
        (truth.speed_rad_s - truth.load_speed_rad_s).abs() < 0.5,
        "{truth:?}"
    );
}

#[test]
fn stops_and_switches_are_the_load_s() {
    let mut parameters = elastic(0.1, 1e-6, 0.0);
    parameters.load.stops = Some(Stops::between(-1.0, 0.5));
    parameters.switches.positive_limit = Some(Switch::above(0.49));
    let mut plant = free(&parameters);
    plant.set_motion(0, 100.0);
    let (mut highest, mut shaft, mut pressed) = (0.0_f64, 0.0_f64, false);
    for _ in 0..10_000 {
        plant.step();
        let truth = plant.truth();
        highest = highest.max(truth.load_position_turns());
        shaft = shaft.max(truth.position_turns());
        let inputs = plant.signals().inputs;
        assert_eq!(inputs == 2, plant.truth().load_position_turns() >= 0.49);
        pressed |= inputs == 2;
    }
    assert!(pressed && (0.5..0.52).contains(&highest), "{highest}");
    // The rotor goes on against the spring: √(JM/k) · 100 rad/s.
    let beyond = (JM / 0.1_f64).sqrt() * 100.0 / TAU;
    assert!(
        (shaft - 0.5 - beyond).abs() < 0.3 * beyond,
        "{shaft} {beyond}"
    );
}

#[test]
fn friction_of_the_load_is_behind_the_spring() {
    let mut parameters = elastic(0.5, 1e-5, 0.0);
    parameters.load.coulomb_friction_nm = 10e-3;
    let mut plant = free(&parameters);
    // 8 mNm on the load do not move it, nor do they twist the spring.
    plant.set_load_torque_nm(8e-3);
    for _ in 0..10_000 {
        plant.step();
    }
    let truth = plant.truth();
    assert_eq!((truth.load_angle, truth.angle), (0, 0));
    // The other 2.5 mNm do; and when they are gone, friction holds both where they stand.
    plant.set_load_torque_nm(12.5e-3);
    for _ in 0..1_000 {
        plant.step();
    }
    let speed = f64::from(plant.truth().load_speed_rad_s);
    assert!(
        (speed / (-2.5e-3 / (JM + JL) * 0.01) - 1.0).abs() < 0.02,
        "{speed}"
    );
    plant.set_load_torque_nm(0.0);
    for _ in 0..200_000 {
        plant.step();
    }
    let truth = plant.truth();
    assert_eq!(
        (truth.load_speed_rad_s, twist(&truth).abs() < 1e-6),
        (0.0, true),
        "{truth:?}"
    );
}

#[test]
fn another_pwm_period_keeps_the_swing() {
    let mut plant = free(&elastic(1.0, 0.0, 0.0));
    set_swinging(&mut plant);
    let before = energy(&plant.truth(), 1.0, 0.0);
    plant.set_pwm_period_s(20e-6);
    for _ in 0..50_000 {
        plant.step();
    }
    let after = energy(&plant.truth(), 1.0, 0.0);
    assert!((after / before - 1.0).abs() < 0.05, "{before} {after}");
}

#[test]
fn a_load_may_be_changed_while_it_turns() {
    let rigid = Load {
        inertia_kgm2: JL,
        ..Load::NONE
    };
    let mut parameters = frictionless();
    parameters.load = rigid;
    let mut plant = free(&parameters);
    plant.set_motion(0, 100.0);
    for _ in 0..1_000 {
        plant.step();
    }
    // Coupled elastically, it goes on; uncoupled, the rotor does.
    for load in [elastic(1.0, 0.0, 0.0).load, rigid, Load::NONE] {
        plant.set_load(&load);
        for _ in 0..1_000 {
            plant.step();
        }
        let truth = plant.truth();
        for speed in [truth.speed_rad_s, truth.load_speed_rad_s] {
            assert!((speed - 100.0).abs() < 1e-3, "{load:?}: {speed}");
        }
        assert!(twist(&truth).abs() < 1e-6);
    }
    // And the weight of the new one pulls.
    plant.set_load(&Load {
        pendulum: Some(Pendulum {
            torque_nm: 50e-3,
            hanging_turns: 0.0,
        }),
        ..rigid
    });
    let mut slowest = 100.0;
    for _ in 0..10_000 {
        plant.step();
        let speed = plant.truth().speed_rad_s;
        slowest = if speed < slowest { speed } else { slowest };
    }
    assert!(slowest < 0.0, "{slowest}");
}

fn cogging(torque: f64, periods: u16, rest: f64) -> Parameters {
    let mut parameters = frictionless();
    parameters.motor.cogging = Cogging {
        torque_nm: torque,
        periods_per_turn: periods,
        rest_turns: rest,
    };
    parameters
}

#[test]
fn cogging_pulls_to_its_rests_at_its_frequency() {
    for (torque, periods, rest) in [(1e-3, 12_u16, 0.01), (0.5e-3, 6, -0.3), (2e-3, 1, 7.25)] {
        let mut plant = free(&cogging(torque, periods, rest));
        // Close to the rest that is nearest to zero, and let go.
        let step = 1.0 / f64::from(periods);
        let rest = rest - (rest / step).round() * step;
        let off = 0.01 * step;
        plant.set_motion(((rest + off) * 4_294_967_296.0) as i64 as i32, 0.0);
        let around = |truth: &Truth<f32>| {
            let turns = truth.position_turns() - rest;
            turns - turns.round()
        };
        let (mut last, mut times) = (around(&plant.truth()), Vec::new());
        for n in 0..400_000 {
            plant.step();
            let now = around(&plant.truth());
            assert!(now.abs() < 1.01 * off);
            if last < 0.0 && now >= 0.0 {
                times.push((f64::from(n) + last / (last - now)) * H);
            }
            last = now;
        }
        let count = (times.len() - 1) as f64;
        let measured = count / (times[times.len() - 1] - times[0]);
        // ω² = n T/J for small swings; the arc of ±0.01 periods takes (2π 0.01)²/16 longer.
        let expected = (f64::from(periods) * torque / JM).sqrt() / TAU * (1.0 - 2.5e-4);
        assert!(
            (measured / expected - 1.0).abs() < 2e-4,
            "{measured} {expected}"
        );
    }
}

#[test]
fn cogging_takes_no_energy_from_a_turning_shaft() {
    let mut plant = free(&cogging(2e-3, 12, 0.0));
    plant.set_motion(0, 300.0);
    let (mut slowest, mut fastest) = (f64::MAX, 0.0_f64);
    for n in 0..3_000_000 {
        plant.step();
        if n > 2_900_000 {
            let speed = f64::from(plant.truth().speed_rad_s);
            (slowest, fastest) = (slowest.min(speed), fastest.max(speed));
        }
    }
    // From a rest on, where it is fastest: ½Jω² falls by 2 T/n at most.
    assert!((fastest / 300.0 - 1.0).abs() < 1e-3, "{fastest}");
    let least = (300.0_f64.powi(2) - 2.0 * 2.0 * 2e-3 / 12.0 / JM).sqrt();
    assert!((slowest / least - 1.0).abs() < 1e-3, "{slowest} {least}");
}

#[test]
fn a_pendulum_swings_and_holds_against_a_torque() {
    let mut parameters = frictionless();
    parameters.load.inertia_kgm2 = JL;
    parameters.load.pendulum = Some(Pendulum {
        torque_nm: 10e-3,
        hanging_turns: 0.25,
    });
    let mut plant = free(&parameters);
    // Let go horizontally: through the bottom at ½Jω² = T.
    let mut fastest = 0.0_f64;
    for _ in 0..20_000 {
        plant.step();
        fastest = fastest.max(plant.truth().speed_rad_s.into());
        assert!((-1e-3..0.501).contains(&plant.truth().position_turns()));
    }
    let expected = (2.0 * 10e-3 / (JM + JL)).sqrt();
    assert!(
        (fastest / expected - 1.0).abs() < 1e-3,
        "{fastest} {expected}"
    );
    // With friction and a steady pull it comes to rest where sin = pull/T, within the friction.
    parameters.motor.viscous_friction_nms = 1e-5;
    let mut plant = free(&parameters);
    plant.set_motion(1 << 30, 0.0);
    plant.set_load_torque_nm(-5e-3);
    for _ in 0..1_000_000 {
        plant.step();
    }
    let rest = 0.25 + 0.5_f64.asin() / TAU;
    assert!((plant.truth().position_turns() - rest).abs() < 1e-4);
    assert!((rest - 0.25 - PI / 6.0 / TAU).abs() < 1e-12);
}

#[test]
fn loads_that_cannot_be_are_refused() {
    let with = |change: fn(&mut Parameters)| {
        let mut parameters = elastic(1.0, 0.0, 0.0);
        change(&mut parameters);
        parameters.check()
    };
    assert_eq!(with(|_| ()), Ok(()));
    let coupling = |stiffness_nm_per_rad, damping_nms, backlash_rad| {
        let mut parameters = elastic(1.0, 0.0, 0.0);
        parameters.load.coupling = Some(Coupling {
            stiffness_nm_per_rad,
            damping_nms,
            backlash_rad,
        });
        parameters.check()
    };
    assert_eq!(coupling(0.0, 0.0, 0.0), Err(Invalid::Coupling(0.0)));
    assert_eq!(coupling(1.0, -1.0, 0.0), Err(Invalid::Coupling(-1.0)));
    assert!(coupling(1.0, 0.0, f64::NAN).is_err());
    assert_eq!(
        with(|p| p.load.inertia_kgm2 = 0.0),
        Err(Invalid::Inertia(0.0))
    );
    assert_eq!(
        with(|p| p.motor.cogging.torque_nm = -1.0),
        Err(Invalid::Cogging(-1.0))
    );
    assert_eq!(
        with(|p| p.motor.cogging.periods_per_turn = 0),
        Err(Invalid::Cogging(0.0))
    );
    assert!(with(|p| p.motor.cogging.rest_turns = f64::INFINITY).is_err());
    assert!(
        with(|p| {
            p.load.pendulum = Some(Pendulum {
                torque_nm: f64::NAN,
                hanging_turns: 0.0,
            });
        })
        .is_err()
    );
}
