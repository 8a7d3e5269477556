//! 0x2004: what is wrong, and what ends it.

use crate::bench::*;
use plant::EncoderFault;

#[test]
fn a_reset_clears_faults_but_not_critical_ones() {
    let mut master = quiet();
    enable(&mut master, 3);
    master.log.clear();
    master.drive(NODE).plant().set_supply_v(60.0);
    master.run_ms(100);
    assert_eq!(master.state(NODE), FAULT);
    assert!(status_bit(&mut master, 5, 1));
    assert_eq!(master.emergency_codes(NODE), [0x3210]);
    master.drive(NODE).plant().set_supply_v(48.0);
    master.run_ms(100);
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert!(!status_bit(&mut master, 5, 1));

    let fault = EncoderFault::NoAnswer;
    master.write_u16(NODE, 0x6040, 0, 0);
    master.log.clear();
    master.drive(NODE).plant().set_encoder_fault(fault);
    master.run_ms(20);
    assert_eq!(master.state(NODE), FAULT);
    assert_eq!(master.emergency_codes(NODE), [0x7305]);
    let fault = EncoderFault::None;
    master.drive(NODE).plant().set_encoder_fault(fault);
    master.run_ms(5);
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert_eq!(master.state(NODE), FAULT, "critical");
    assert!(status_bit(&mut master, 1, 0));
    master.send(0, &[0x81, NODE]);
    master.run_ms(100);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert_eq!(master.read(NODE, 0x2004, 1), 0);
}

#[test]
fn heat_is_shown_and_too_much_is_a_fault() {
    let mut master = quiet();
    let motor = real(&mut master, 0x2006, 1);
    let mosfet = real(&mut master, 0x2006, 2);
    assert!(
        (motor - 25.0).abs() < 1.0 && (mosfet - 25.0).abs() < 6.0,
        "{motor} {mosfet}"
    );
    master.drive(NODE).plant().set_motor_temperature_c(81.0);
    master.run_ms(10);
    assert!(status_bit(&mut master, 5, 3));
    assert_eq!(master.state(NODE), FAULT);
    let volts = master.read(NODE, 0x6079, 0);
    assert!((volts - 48_000).abs() < 100, "{volts}");
}

#[test]
fn the_motors_limit_of_heat_is_the_one_that_is_written() {
    let mut master = quiet();
    master.write(NODE, 0x2000, 7, &[40]);
    master.drive(NODE).plant().set_motor_temperature_c(39.0);
    master.run_ms(20);
    assert!(!status_bit(&mut master, 5, 3));
    let shown = real(&mut master, 0x2006, 1);
    assert!((shown - 39.0).abs() < 0.2, "{shown}");
    master.drive(NODE).plant().set_motor_temperature_c(42.0);
    master.run_ms(20);
    assert!(status_bit(&mut master, 5, 3));
    assert_eq!(master.state(NODE), FAULT);
}
