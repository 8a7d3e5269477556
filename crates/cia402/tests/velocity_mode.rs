//! Mode 2, velocity: unit, ramps, and what bits 4, 5 and 6 of the controlword do.

mod rig;

use cia402::{Demand, Mode, State, Target, VlConfiguration};
use rig::{Rig, STANDARD};

const REACHED: u16 = 0x0400;
const LIMIT: u16 = 0x0800;

/// Enable operation with the ramp open, following and filled.
const RUN: u16 = 0x7F;

/// One unit is 10 counts/s; up at 1000 units/s, down at 2000, quick stop at 4000.
fn rig() -> Rig {
    let mut rig = Rig::new(&STANDARD);
    rig.configuration.vl = VlConfiguration {
        counts_per_s: 10.0,
        acceleration: 10_000.0,
        deceleration: 20_000.0,
        quick_stop_deceleration: 40_000.0,
    };
    // The profile's own ramps are others.
    rig.configuration.acceleration = 1.0;
    rig.configuration.deceleration = 1.0;
    rig.mode(Mode::VELOCITY).expect("mode 2");
    rig.word(0x06);
    rig.word(RUN);
    assert_eq!(rig.axis.state(), State::OperationEnabled);
    rig
}

fn target(rig: &mut Rig, units: i16) {
    rig.targets.vl_velocity = units;
    rig.receive(Target::VlVelocity);
}

#[track_caller]
fn at(rig: &Rig, velocity: f64) {
    let seen = rig.sample().velocity;
    assert!((seen - velocity).abs() < 1e-2, "{seen}, not {velocity}");
}

/// At 1000 counts/s.
fn running() -> Rig {
    let mut rig = rig();
    target(&mut rig, 100);
    rig.run_ms(101);
    at(&rig, 1000.0);
    assert_eq!(rig.status() & REACHED, REACHED);
    rig
}

#[test]
fn the_target_is_reached_on_ramps_of_its_own() {
    let mut rig = rig();
    rig.run_ms(2);
    assert_eq!(rig.status() & 0x3C00, REACHED, "at rest, as asked");
    for (units, some, then, until) in [
        (100, 20, 200.0, 100),
        (-50, 30, 400.0, 100), // 50 ms to zero, 50 ms on
        (-10, 5, -400.0, 20),
        (0, 2, -60.0, 5),
    ] {
        target(&mut rig, units);
        assert_eq!(rig.status() & REACHED, 0, "{units}");
        rig.run_ms(some);
        at(&rig, then);
        rig.run_ms(until - some);
        at(&rig, f64::from(units) * 10.0);
        assert_eq!(rig.status() & REACHED, 0, "{units}");
        rig.run_ms(1);
        assert_eq!(rig.status() & REACHED, REACHED, "{units}");
        // The same target again changes nothing.
        rig.receive(Target::VlVelocity);
        assert_eq!(rig.status() & 0x3C00, REACHED, "{units}");
    }
    // Targets of other modes are none of its business.
    rig.targets.velocity = 5000;
    rig.receive(Target::Velocity);
    rig.run_ms(5);
    at(&rig, 0.0);
}

#[test]
fn bit_6_fills_the_ramp_with_zero() {
    let mut rig = running();
    rig.word(RUN & !0x40);
    assert_eq!(rig.status() & REACHED, 0);
    rig.run_ms(25);
    at(&rig, 500.0);
    rig.run_ms(26);
    at(&rig, 0.0);
    assert_eq!(rig.status() & REACHED, REACHED);
    rig.word(RUN);
    rig.run_ms(101);
    at(&rig, 1000.0);
}

#[test]
fn bit_5_locks_the_ramp() {
    let mut rig = running();
    target(&mut rig, 200);
    rig.run_ms(50);
    at(&rig, 1500.0);
    rig.word(RUN & !0x20);
    target(&mut rig, -200);
    rig.run_ms(100);
    at(&rig, 1500.0);
    assert_eq!(rig.status() & REACHED, 0);
    rig.word(RUN);
    rig.run_ms(25);
    at(&rig, 1000.0);
}

#[test]
fn bit_4_switches_the_ramp_off_and_the_axis_to_rest() {
    let mut rig = running();
    rig.word(RUN & !0x10);
    rig.run_ms(10);
    at(&rig, 600.0);
    // Locked or not.
    rig.word(0x0F);
    rig.run_ms(10);
    at(&rig, 200.0);
    rig.run_ms(6);
    at(&rig, 0.0);
    assert_eq!(rig.axis.state(), State::OperationEnabled);
    assert_eq!(rig.status() & REACHED, REACHED);
    // Nothing but enable operation: nothing moves.
    target(&mut rig, 300);
    rig.run_ms(100);
    at(&rig, 0.0);
    rig.word(RUN);
    rig.run_ms(50);
    at(&rig, 500.0);
}

#[test]
fn halt_quick_stop_and_the_way_out_use_its_ramps() {
    for (option, velocity) in [(1, 800.0), (2, 600.0)] {
        let mut rig = running();
        rig.configuration.halt_option = option;
        rig.word(RUN | 0x100);
        rig.run_ms(10);
        at(&rig, velocity);
        rig.run_ms(60);
        assert_eq!(rig.status() & REACHED, REACHED, "{option}");
        assert!(matches!(rig.demand, Demand::Position { .. }));
        rig.word(RUN);
        rig.run_ms(101);
        at(&rig, 1000.0);
    }
    for (option, velocity) in [(1, 800.0), (2, 600.0)] {
        let mut rig = running();
        rig.configuration.quick_stop_option = option;
        rig.word(0x02);
        rig.run_ms(10);
        at(&rig, velocity);
        rig.run_ms(60);
        assert_eq!(rig.axis.state(), State::SwitchOnDisabled);
    }
    let mut rig = running();
    rig.word(0x07);
    rig.run_ms(10);
    at(&rig, 800.0);
    rig.run_ms(60);
    assert_eq!(rig.axis.state(), State::SwitchedOn);
}

#[test]
fn limits_bind() {
    let mut rig = rig();
    rig.configuration.max_velocity = Some(700.0);
    target(&mut rig, 100);
    rig.run_ms(5);
    assert_eq!(rig.status() & LIMIT, LIMIT);
    rig.run_ms(100);
    at(&rig, 700.0);
    rig.configuration.max_velocity = None;
    rig.configuration.max_deceleration = Some(5000.0);
    rig.run_ms(100);
    target(&mut rig, 0);
    rig.run_ms(100);
    at(&rig, 500.0);
    assert_eq!(rig.status() & LIMIT, LIMIT);
}

#[test]
fn unusable_units_move_nothing() {
    for odd in [0.0, f32::NAN] {
        let mut rig = rig();
        rig.configuration.vl.counts_per_s = odd;
        target(&mut rig, 100);
        rig.run_ms(10);
        at(&rig, 0.0);
    }
}
