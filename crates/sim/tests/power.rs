//! Logic supply, motor supply and watchdog: what a drive survives, and what it says after it.

mod master;
use master::*;

#[test]
fn a_program_that_hangs_is_reset_by_the_watchdog_which_the_drive_tells() {
    let mut master = Master::new(&[1]);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 20_000);
    master.run_ms(200);
    let now = master.now();
    master.drive(1).hang(now);
    // It hears nothing, and the bridge keeps its last duty.
    assert_eq!(master.try_read_within(1, 0x6041, 0, 15), None);
    master.log.clear();
    master.run_ms(60);
    let boot = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x701)
        .unwrap();
    assert_eq!(boot.frame.bytes()[0], 0);
    assert!(boot.at.since_ns(now) >= 20_000_000);
    // "Emitted after boot-up message if reset was due to watchdog" (P3, fault table).
    assert_eq!(master.emergencies(1), [[0x10, 0x60, 0x01, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(master.read(1, 0x1002, 0), 1);
    assert_eq!(master.read(1, 0x603F, 0), 0x6010);
    // The next start follows no watchdog.
    master.send(0, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(master.state(1), SWITCH_ON_DISABLED);
}

/// What the last reset was is in the processor, and gone with its supply.
#[test]
fn a_power_cut_after_the_watchdog_is_a_start_like_any_other() {
    let mut master = Master::new(&[1]);
    let now = master.now();
    master.drive(1).hang(now);
    master.run_ms(21);
    assert!(master.drive(1).is_booting());
    master.drive(1).plant().set_logic_supply_v(0.0);
    master.run_ms(20);
    master.log.clear();
    master.drive(1).plant().set_logic_supply_v(24.0);
    master.run_ms(60);
    assert!(master.emergencies(1).is_empty());
    assert_eq!(master.state(1), SWITCH_ON_DISABLED);
}

#[test]
fn without_logic_supply_there_is_no_drive_and_with_it_again_it_boots() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x6081, 0, 1234);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 50_000);
    master.run_ms(100);
    master.drive(1).plant().set_logic_supply_v(0.0);
    master.run_ms(20);
    assert!(master.drive(1).core().is_none());
    assert_eq!(master.try_read_within(1, 0x6041, 0, 20), None);
    // The motor runs out: nothing brakes it but friction and the diodes.
    let turning = master.drive(1).plant().truth().speed_rad_s;
    assert!(turning > 1.0, "{turning}");
    master.run_ms(500);
    assert!(master.drive(1).plant().truth().phase_current_a[0].abs() < 1e-3);
    master.log.clear();
    master.drive(1).plant().set_logic_supply_v(24.0);
    master.run_ms(60);
    let boots = master.log.iter().filter(|t| t.frame.raw_id() == 0x701);
    assert_eq!(boots.count(), 1);
    assert!(master.emergencies(1).is_empty());
    assert_eq!(master.state(1), SWITCH_ON_DISABLED);
    // What was not saved is gone.
    assert_eq!(master.read(1, 0x6081, 0), 200_000);
}

#[test]
fn without_motor_supply_the_node_and_its_position_stay() {
    let mut master = Master::new(&[1]);
    master.write_i32(1, 0x6064, 0, 1_000_000);
    master.drive(1).plant().set_supply_v(0.0);
    master.run_ms(600);
    assert_eq!(master.emergency_codes(1), [0x3220]);
    assert_eq!(master.position(1), 1_000_000);
    let angle = master.drive(1).plant().truth().angle;
    master
        .drive(1)
        .plant()
        .set_motion(angle.wrapping_add(1 << 30), 0.0);
    master.run_ms(10);
    assert_eq!(master.position(1), 1_001_024);
}
