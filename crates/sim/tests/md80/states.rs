//! The state machine, its words, and the watchdog of the bus.

use crate::bench::*;

#[test]
fn it_boots_operational_with_short_states_and_its_heartbeat() {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(2100);
    let beats: Vec<_> = master
        .log
        .iter()
        .filter(|t| t.frame.raw_id() == 0x705)
        .map(|t| t.frame.data().to_vec())
        .collect();
    assert_eq!(beats, [[0x05], [0x05]]);
    // Neither voltage nor remote: the page names no such bits (M4).
    assert_eq!(master.status(NODE), 0x0040);
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.status(NODE), 0x0021);
    master.write_u16(NODE, 0x6040, 0, 7);
    assert_eq!(master.status(NODE), 0x0023);
    master.write_u16(NODE, 0x6040, 0, 15);
    assert_eq!(master.status(NODE), 0x0027);
    assert_eq!(master.read(NODE, 0x6502, 0), 647);
    assert_eq!(
        master.try_read(NODE, 0x0022, 0),
        Err(0x0602_0000),
        "not to be seen"
    );
    assert_eq!(master.try_write(NODE, 0x0022, 0, &[0]), Err(0x0602_0000));
}

#[test]
fn a_bus_that_is_silent_stops_it() {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(50);
    assert_eq!(master.read(NODE, 0x2000, 12), 250);
    ramps(&mut master, 300);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 100);
    for _ in 0..20 {
        master.run_ms(200);
        // A SYNC is enough.
        master.send(0x80, &[]);
    }
    master.run_ms(10);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    master.log.clear();
    master.run_ms(600);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
    assert!(status_bit(&mut master, 8, 30));
    assert_eq!(master.emergency_codes(NODE), [0x8130]);
    assert_eq!(master.read(NODE, 0x1001, 0), 1);
    // A fault reset ends the warning.
    master.write_u16(NODE, 0x6040, 0, 0x80);
    master.run_ms(5);
    assert!(!status_bit(&mut master, 8, 30));
    assert_eq!(master.emergency_codes(NODE), [0x8130, 0]);
    // Without a mode of motion it does not matter.
    master.write_u16(NODE, 0x6040, 0, 0);
    enable(&mut master, 0);
    master.run_ms(600);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
}
