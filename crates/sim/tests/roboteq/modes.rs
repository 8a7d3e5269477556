//! One channel: its state machine, modes, units and ramps.

use personalities::roboteq::ROBOTEQ;

use crate::bench::{Channel, FSA, REACHED, controller, near, with_machine};

#[test]
fn without_the_state_machine_the_controlword_does_nothing_and_the_statusword_is_0() {
    let mut master = controller(&ROBOTEQ);
    for word in [0x00, 0x06, 0x07, 0x0F, 0x80] {
        master.word(1, word);
        master.run_ms(2);
        assert_eq!(master.status_of(1), 0);
    }
    // R24: it is driven all the same. Open loop at first: half the voltage is half the speed without
    // load, 24 V/√3 over the EMF.
    master.write_i32(1, 0x2000, 1, 500);
    master.run_ms(3000);
    near(master.rpm(1), 2145.0, 60.0);
    near(f64::from(master.read_i16(1, 0x2102, 1)), 500.0, 5.0);
}

#[test]
fn without_the_state_machine_speed_and_position_commands_act_at_once() {
    let mut master = controller(&ROBOTEQ);
    master.mode(1, 3);
    master.write_i32(1, 0x60FF, 0, 600);
    master.run_ms(1500);
    near(master.rpm(1), 600.0, 12.0);
    // S of the controller's own commands is the same variable.
    master.write_i32(1, 0x2002, 1, -600);
    master.run_ms(2000);
    near(master.rpm(1), -600.0, 12.0);
    assert_eq!(master.read(1, 0x60FF, 0), -600);
    assert_eq!(master.read_i16(1, 0x6042, 0), -600);
    master.write_i32(1, 0x60FF, 0, 0);
    master.run_ms(1500);
    master.mode(1, 1);
    let there = master.position(1) + 20_000;
    master.write_i32(1, 0x607A, 0, there);
    master.run_ms(3000);
    near(f64::from(master.position(1)), f64::from(there), 20.0);
    // And another one after it.
    master.write_i32(1, 0x607A, 0, there - 5000);
    master.run_ms(2000);
    near(f64::from(master.position(1)), f64::from(there - 5000), 20.0);
    master.mode(1, 2);
    master.write_i16(1, 0x6042, 0, 300);
    master.run_ms(1500);
    near(master.rpm(1), 300.0, 8.0);
}

#[test]
fn the_mode_at_the_start_is_configured_and_kept() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(master.read(1, 0x6061, 0) as u8, 0);
    master.write(1, 0x3027, 1, &[1]);
    master.write(1, FSA.0, FSA.1, &[1]);
    master.write_i32(1, 0x3033, 1, 5000);
    // %EESAV
    master.write(1, 0x2017, 0, &[1]);
    master.run_ms(500);
    master.send(0, &[0x81, 1]);
    master.run_ms(200);
    assert_eq!(master.status_of(1), 0x0250);
    assert_eq!(master.read(1, 0x6061, 0) as u8, 3);
    assert_eq!(master.read(1, 0x6060, 0) as u8, 3);
    assert_eq!(master.read(1, 0x6083, 0), 5000);
    assert_eq!(master.read(1, 0x6048, 1), 5000);
    assert_eq!(master.read(1, 0x6084, 0), 20_000);
}

/// R19: every state's statusword.
#[test]
fn statuswords_of_all_states() {
    let mut master = with_machine(&ROBOTEQ);
    assert_eq!(master.status_of(1), 0x0250);
    master.mode(1, 3);
    for (word, status) in [
        (0x06, 0x0231),
        (0x07, 0x0233),
        (0x06, 0x0231),
        (0x07, 0x0233),
    ] {
        master.word(1, word);
        assert_eq!(
            master.status_of(1) & !(REACHED | 0x1000),
            status,
            "{word:04X}"
        );
    }
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & !(REACHED | 0x1000), 0x0237);
    master.write_i32(1, 0x60FF, 0, 1000);
    master.run_ms(1500);
    master.word(1, 0x02);
    assert_eq!(master.status_of(1) & !REACHED, 0x0217);
    // R3: no way back into operation; at rest switch on disabled follows.
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & !REACHED, 0x0217);
    master.run_ms(2000);
    assert_eq!(master.status_of(1), 0x0250);
    // A fault: the emergency stop. It frees the motor, or brakes it, and stays until it is reset.
    for word in [6, 7, 15] {
        master.word(1, word);
    }
    master.write(1, 0x200C, 0, &[1]);
    master.run_ms(10);
    assert_eq!(master.status_of(1), 0x0218);
    assert_eq!(master.read(1, 0x2112, 0) as u16, 0x10);
    master.word(1, 0x80);
    master.run_ms(5);
    assert_eq!(master.status_of(1), 0x0218, "its cause is there");
    master.write(1, 0x200D, 0, &[1]);
    master.word(1, 0x00);
    master.word(1, 0x80);
    // R4: the reset leads to switch on disabled.
    assert_eq!(master.status_of(1), 0x0250);
}

#[test]
fn halt_and_quick_stop_are_on_the_fault_deceleration() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, 5000); // 500 RPM/s
    master.write_i32(1, 0x6083, 0, 50_000);
    master.write_i32(1, 0x6084, 0, 50_000);
    master.enable_channel(1, 3);
    master.write_i32(1, 0x60FF, 0, 1000);
    master.run_ms(800);
    near(master.rpm(1), 1000.0, 20.0);
    master.word(1, 0x10F);
    master.run_ms(1000);
    near(master.rpm(1), 500.0, 15.0);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.run_ms(1200);
    near(master.rpm(1), 0.0, 3.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    master.word(1, 0x0F);
    master.run_ms(800);
    near(master.rpm(1), 1000.0, 20.0);
    master.word(1, 0x02);
    master.run_ms(1000);
    near(master.rpm(1), 500.0, 15.0);
}

#[test]
fn velocity_mode_has_its_ramp_bits_limits_and_fault_deceleration() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, 2500); // 250 RPM/s
    master.write_i32(1, 0x6046, 1, 100);
    master.write_i32(1, 0x6046, 2, 800);
    master.write_i32(1, 0x6048, 1, 10_000); // 1000 RPM in 2 s
    master.write_u16(1, 0x6048, 2, 2);
    master.enable_channel(1, 2);
    master.word(1, 0x7F);
    master.write_i16(1, 0x6042, 0, 20);
    master.run_ms(800);
    near(master.rpm(1), 100.0, 5.0);
    master.write_i16(1, 0x6042, 0, 2000);
    master.run_ms(700);
    near(master.rpm(1), 450.0, 15.0);
    near(f64::from(master.read_i16(1, 0x6043, 0)), 450.0, 10.0);
    // Bit 5: locked.
    master.word(1, 0x5F);
    let locked = master.rpm(1);
    master.run_ms(500);
    near(master.rpm(1), locked, 8.0);
    master.word(1, 0x7F);
    master.run_ms(1500);
    near(master.rpm(1), 800.0, 15.0);
    near(f64::from(master.read_i16(1, 0x6044, 0)), 800.0, 15.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    // Bit 4: to rest on EDEC.
    master.word(1, 0x6F);
    master.run_ms(1000);
    near(master.rpm(1), 550.0, 15.0);
    // Bit 6: to rest on SDC.
    master.word(1, 0x7F);
    master.run_ms(1500);
    master.word(1, 0x3F);
    master.run_ms(600);
    near(master.rpm(1), 0.0, 5.0);
}

#[test]
fn torque_is_in_tenths_of_an_ampere() {
    let mut master = with_machine(&ROBOTEQ);
    master.drive(1).plant().set_blocked(true);
    master.enable_channel(1, 4);
    master.write_i32(1, 0x6087, 0, 100_000); // 10 A/s
    master.write_i16(1, 0x6071, 0, 10);
    master.run_ms(300);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 10.0, 1.0);
    near(f64::from(master.read_i16(1, 0x2100, 1)), 10.0, 1.0);
    let torque = f64::from(master.drive(1).plant().truth().torque_nm);
    near(torque, 0.0462, 2e-3);
    // The slope: 1 A more in 0.1 s.
    master.write_i16(1, 0x6071, 0, 20);
    master.run_ms(50);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 15.0, 1.0);
    // ALIM: 3 A. The statusword says so.
    master.write_i16(1, 0x6071, 0, 3000);
    master.run_ms(400);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 30.0, 1.0);
    assert_ne!(master.status_of(1) & 0x800, 0);
}

/// Table 7 knows no exception: halt stops torque mode on EDEC, too, and it goes on when that ends.
#[test]
fn halt_of_torque_mode_stops_the_motor() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, 10_000); // 1000 RPM/s
    master.enable_channel(1, 4);
    master.write_i16(1, 0x6071, 0, 1);
    master.run_ms(800);
    let speed = master.rpm(1);
    assert!(speed > 1200.0, "{speed}");
    master.word(1, 0x10F);
    master.run_ms(500);
    near(master.rpm(1), speed - 500.0, 25.0);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.run_ms(4000);
    near(master.rpm(1), 0.0, 3.0);
    assert_eq!(master.status_of(1) & (REACHED | 0x6F), REACHED | 0x27);
    assert_eq!(master.read(1, 0x6061, 0) as i8, 4);
    // A target of meanwhile counts.
    master.write_i16(1, 0x6071, 0, -1);
    master.run_ms(100);
    near(master.rpm(1), 0.0, 3.0);
    master.word(1, 0x0F);
    master.run_ms(800);
    assert!(master.rpm(1) < -1200.0);
    near(f64::from(master.read_i16(1, 0x6077, 0)), -1.0, 1.0);
}

#[test]
fn positions_of_the_relative_and_tracking_modes_are_scaled() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F2, 1, -10_000);
    master.write_i32(1, 0x30F3, 1, 30_000);
    master.enable_channel(1, -1);
    assert_eq!(master.read(1, 0x6061, 0) as i8, -1);
    assert_eq!(master.read(1, 0x6064, 0), -500);
    master.write_i32(1, 0x607A, 0, 250); // 15,000 counts
    master.word(1, 0x1F);
    assert_ne!(master.status_of(1) & 0x1000, 0, "acknowledged");
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & 0x1000, 0);
    master.run_ms(2500);
    assert_eq!(master.read(1, 0x6064, 0), 250);
    assert_eq!(master.read(1, 0x2110, 1), 250);
    near(f64::from(master.read(1, 0x2104, 1)), 15_000.0, 20.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    for beyond in [1001, -1001] {
        assert!(
            master
                .try_write(1, 0x607A, 0, &i32::to_le_bytes(beyond))
                .is_err()
        );
    }
    // Tracking: no profile, as fast as the controllers can.
    master.mode(1, -2);
    master.write_i32(1, 0x607A, 0, -250); // 5,000 counts
    master.run_ms(10);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.run_ms(1500);
    near(f64::from(master.read(1, 0x2104, 1)), 5000.0, 20.0);
    assert_eq!(master.read(1, 0x6064, 0), -250);
    assert_ne!(master.status_of(1) & REACHED, 0);
    // Halt stops on the way, and what was wanted follows when it is over.
    master.write_i32(1, 0x30F0, 1, 200_000);
    master.write_i32(1, 0x607A, 0, 1000); // 30,000 counts
    master.run_ms(20);
    master.word(1, 0x10F);
    master.run_ms(500);
    near(master.rpm(1), 0.0, 2.0);
    let halted = master.read(1, 0x2104, 1);
    assert!((6_000..29_000).contains(&halted), "{halted}");
    assert_eq!(master.read(1, 0x6061, 0) as i8, -2);
    master.word(1, 0x0F);
    master.run_ms(2500);
    near(f64::from(master.read(1, 0x2104, 1)), 30_000.0, 20.0);
    master.write_i32(1, 0x607A, 0, -250);
    master.run_ms(3000);
    // Count position has counts again.
    master.mode(1, 1);
    near(f64::from(master.read(1, 0x6064, 0)), 5000.0, 20.0);
}

#[test]
fn a_held_shaft_makes_up_for_what_it_lost_where_the_position_is_the_feedback() {
    // -3 goes on from where it should be, 3 from where it is.
    let travelled = |mode: i8| {
        let mut master = with_machine(&ROBOTEQ);
        master.write(1, 0x3038, 1, &[0]); // or the loop error stops it
        master.enable_channel(1, mode);
        let from = master.drive(1).plant().truth().position_turns();
        master.write_i32(1, 0x60FF, 0, 600);
        master.run_ms(1000);
        master.drive(1).plant().set_blocked(true);
        master.run_ms(300);
        master.drive(1).plant().set_blocked(false);
        master.run_ms(2700);
        near(master.rpm(1), 600.0, 15.0);
        master.drive(1).plant().truth().position_turns() - from
    };
    let (by_position, by_speed) = (travelled(-3), travelled(3));
    // 4 s at 10 turns/s, less the ramp of 0.3 s.
    near(by_position, 38.5, 0.5);
    assert!(by_position - by_speed > 2.0, "{by_speed}");
}

#[test]
fn open_loop_runs_with_the_state_machine_in_operation_enabled_only() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x2000, 1, 300);
    master.run_ms(500);
    near(master.rpm(1), 0.0, 1.0);
    master.enable_channel(1, 0);
    master.run_ms(2000);
    near(master.rpm(1), 1290.0, 60.0);
    // Halt takes the voltage back on EDEC, disabling frees the motor.
    master.word(1, 0x10F);
    master.run_ms(3000);
    near(master.rpm(1), 0.0, 10.0);
    master.word(1, 0x0F);
    master.run_ms(2000);
    near(master.rpm(1), 1290.0, 60.0);
    master.word(1, 0x00);
    master.run_ms(2);
    assert_eq!(master.read_i16(1, 0x2102, 1), 0);
    for beyond in [1001, -1001] {
        assert!(
            master
                .try_write(1, 0x2000, 1, &i32::to_le_bytes(beyond))
                .is_err()
        );
    }
}
