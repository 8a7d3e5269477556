//! Modes 11 and 12: torque and voltage in an electrical frame that the master turns.

mod rig;

use cia402::{Demand, Mode, Target};
use rig::*;

fn enabled(mode: Mode) -> Rig {
    let mut rig = Rig::new(&P3);
    rig.word(0x06);
    rig.word(0x0F);
    rig.actual.electrical_angle = 4321;
    rig.mode(mode).expect("the mode");
    rig
}

#[test]
fn torque_with_angle_begins_without_torque_at_the_present_angle() {
    let rig = enabled(Mode::CYCLIC_TORQUE_WITH_ANGLE);
    let none = Demand::TorqueWithAngle {
        angle: 4321,
        start_pm: 0.0,
        slope_pm_per_s: 0.0,
        duration_ns: 0,
    };
    assert_eq!(rig.demand, none);
    // Also out of a torque mode under torque: that torque had the rotor's direction.
    let mut rig = enabled(Mode::CYCLIC_TORQUE);
    rig.targets.torque_pm = 500;
    rig.receive(Target::Torque);
    rig.run_ms(5);
    rig.mode(Mode::CYCLIC_TORQUE_WITH_ANGLE).expect("mode 11");
    assert_eq!(rig.demand, none);
}

#[test]
fn torque_is_interpolated_and_an_angle_counts_at_once() {
    let mut rig = enabled(Mode::CYCLIC_TORQUE_WITH_ANGLE);
    rig.configuration.interpolation_period_ns = 2_000_000;
    rig.targets.torque_pm = 100;
    rig.targets.torque_offset_pm = 20;
    rig.receive(Target::Torque);
    assert_eq!(rig.status() & (1 << 12), 1 << 12);
    assert_eq!(
        rig.demand,
        Demand::TorqueWithAngle {
            angle: 4321,
            start_pm: 0.0,
            slope_pm_per_s: 60_000.0,
            duration_ns: 2_000_000,
        }
    );
    // Half way: the angle jumps, the torque goes on to where it was going.
    rig.run_ms(1);
    rig.targets.angle = -32_768;
    rig.receive(Target::Angle);
    let Demand::TorqueWithAngle {
        angle: -32_768,
        start_pm,
        slope_pm_per_s,
        duration_ns: 1_000_000,
    } = rig.demand
    else {
        panic!("{:?}", rig.demand)
    };
    assert!((start_pm - 60.0).abs() < 1e-3 && (slope_pm_per_s - 60_000.0).abs() < 1.0);
    rig.run_ms(3);
    assert!((rig.sample().torque_pm - 120.0).abs() < 1e-3);
    // At rest an angle alone keeps the torque.
    rig.targets.angle = 16_384;
    rig.receive(Target::Angle);
    assert_eq!(
        rig.demand,
        Demand::TorqueWithAngle {
            angle: 16_384,
            start_pm: 120.0,
            slope_pm_per_s: 0.0,
            duration_ns: 0,
        }
    );
    // Both at once, as one RPDO brings them: the angle first.
    rig.targets.angle = 100;
    rig.targets.torque_pm = -20;
    rig.receive(Target::Angle);
    rig.receive(Target::Torque);
    rig.run_ms(2);
    let Demand::TorqueWithAngle { angle: 100, .. } = rig.demand else {
        panic!("{:?}", rig.demand)
    };
    assert!(rig.sample().torque_pm.abs() < 1e-3);
}

#[test]
fn torque_with_angle_is_limited_and_says_so() {
    let mut rig = enabled(Mode::CYCLIC_TORQUE_WITH_ANGLE);
    rig.configuration.max_torque_pm = 250.0;
    rig.targets.torque_pm = -900;
    rig.receive(Target::Torque);
    assert_eq!(rig.status() & (1 << 11), 1 << 11);
    rig.run_ms(2);
    assert!((rig.sample().torque_pm + 250.0).abs() < 1e-3);
    rig.targets.torque_pm = 100;
    rig.receive(Target::Torque);
    assert_eq!(rig.status() & (1 << 11), 0);
}

#[test]
fn phase_voltage_begins_at_none_and_takes_angle_and_voltage() {
    let mut rig = enabled(Mode::PHASE_VOLTAGE_WITH_ANGLE);
    let voltage = |angle, voltage_d, voltage_q| Demand::PhaseVoltage {
        angle,
        voltage_d,
        voltage_q,
    };
    assert_eq!(rig.demand, voltage(4321, 0, 0));
    // A voltage that an object still holds from before is not taken with the angle.
    rig.targets.voltage_d = 3000;
    rig.receive(Target::Angle);
    assert_eq!(rig.demand, voltage(0, 0, 0));
    rig.targets.voltage_d = 2218;
    rig.targets.voltage_q = -5;
    rig.receive(Target::PhaseVoltage);
    assert_eq!(rig.demand, voltage(0, 2218, -5));
    // Neither torque nor time changes it, and it has no bits of its own.
    rig.targets.torque_pm = 100;
    rig.receive(Target::Torque);
    rig.run_ms(10);
    assert_eq!(rig.demand, voltage(0, 2218, -5));
    assert_eq!(rig.status() & 0x3400, 0);
    // Left and entered again: without voltage, at the angle where the frame stands.
    rig.mode(Mode::IDLE).expect("idle");
    assert_eq!(rig.demand, Demand::Idle);
    rig.mode(Mode::PHASE_VOLTAGE_WITH_ANGLE).expect("mode 12");
    assert_eq!(rig.demand, voltage(0, 0, 0));
}

#[test]
fn a_quick_stop_and_a_fault_end_both_modes() {
    for mode in [
        Mode::CYCLIC_TORQUE_WITH_ANGLE,
        Mode::PHASE_VOLTAGE_WITH_ANGLE,
    ] {
        let mut rig = enabled(mode);
        rig.targets.voltage_d = 1000;
        rig.targets.torque_pm = 100;
        rig.receive(Target::PhaseVoltage);
        rig.receive(Target::Torque);
        rig.word(0x0B);
        assert_eq!(rig.demand, Demand::Off, "{mode}");

        // Codes 5 to 8 hold the position of that moment (l.841).
        let mut rig = enabled(mode);
        rig.configuration.quick_stop_option = 6;
        rig.word(0x0B);
        rig.run_ms(1);
        assert!(matches!(rig.demand, Demand::Position { .. }), "{mode}");

        let mut rig = enabled(mode);
        rig.axis.fault();
        rig.run_ms(1);
        assert_eq!(rig.demand, Demand::Off, "{mode}");
    }
}
