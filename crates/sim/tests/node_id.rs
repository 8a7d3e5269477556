//! 0x21B0: another node ID over the bus, without LSS.

mod master;
use master::*;

use sim::NoticeKind;

/// 0x1010,4: the entry 0x21B0,0 (P4).
const SAVE_ID: [u8; 4] = [0x00, 0xB0, 0x21, 0x00];

#[test]
fn an_id_is_usable_at_once_and_the_motion_goes_on() {
    let mut master = Master::new(&[1, 3]);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 50_000);
    master.run_ms(200);
    master.write(1, 0x1A00, 0, &[0]);
    master.write(1, 0x1A00, 1, &[0x20, 0x00, 0x64, 0x60]);
    master.write(1, 0x1A00, 0, &[1]);
    master.log.clear();
    // The acknowledge comes from the old one.
    master.write(1, 0x21B0, 0, &[2, 0]);
    assert_eq!(master.read(2, 0x21B0, 0), 2);
    assert_eq!(master.state(2), OPERATION_ENABLED);
    assert!((master.read(2, 0x606C, 0) - 50_000).abs() < 2_000);
    let boot_up = master.log.iter().any(|t| t.frame.raw_id() == 0x702);
    assert!(!boot_up, "no boot-up");
    // A mapped PDO keeps its identifier.
    master.log.clear();
    master.send(0x80, &[]);
    master.run_ms(2);
    let seen: Vec<u32> = master.log.iter().map(|t| t.frame.raw_id()).collect();
    assert!(seen.contains(&0x181) && !seen.contains(&0x182), "{seen:X?}");
    // NMT goes by the new one; so do emergencies.
    master.send(0, &[0x80, 1]);
    master.send(0x601, &[0x40, 0x41, 0x60, 0]);
    master.run_ms(2);
    assert!(!master.log.iter().any(|t| t.frame.raw_id() == 0x581));
    master.log.clear();
    master.write_u16(2, 0x3019, 3, 1_000);
    master.run_ms(3);
    assert_eq!(master.emergency_codes(2), [0x6320]);
    assert!(master.emergency_codes(1).is_empty());
}

#[test]
fn only_what_is_saved_outlives_a_reset_and_reset_communication_keeps_it() {
    let mut master = Master::new(&[1]);
    master.write(1, 0x21B0, 0, &[9, 0]);
    master.send(0, &[0x82, 9]);
    master.run_ms(5);
    assert_eq!(master.read(9, 0x21B0, 0), 9);
    // A PDO's identifier starts from its default again, which is the new node's.
    assert_eq!(master.read(9, 0x1800, 1), 0x189);
    master.send(0, &[0x81, 9]);
    master.run_ms(50);
    assert_eq!(master.read(1, 0x21B0, 0), 1);

    master.write(1, 0x21B0, 0, &[9, 0]);
    master.write(9, 0x1010, 4, &SAVE_ID);
    master.send(0, &[0x81, 9]);
    master.run_ms(50);
    assert_eq!(master.read(9, 0x21B0, 0), 9);
    assert_eq!(master.read(9, 0x1014, 0), 0x89);
}

#[test]
fn what_is_no_node_id_is_refused_and_changes_nothing() {
    let mut master = Master::new(&[1]);
    for bad in [0_u16, 128, 255, 0x101, 0xFFFF] {
        let refused = master.try_write(1, 0x21B0, 0, &bad.to_le_bytes());
        assert_eq!(refused, Err(0x0609_0030), "{bad}");
        assert_eq!(master.read(1, 0x21B0, 0), 1);
    }
    // Its own once more is none.
    master.write(1, 0x21B0, 0, &[1, 0]);
    assert_eq!(master.read(1, 0x21B0, 0), 1);
    master.write(1, 0x21B0, 0, &[127, 0]);
    assert_eq!(master.read(127, 0x21B0, 0), 127);
}

/// 0x1010,4 saves an object that can be stored and refuses all others (CiA 301 7.5.2.13).
#[test]
fn a_single_entry_must_be_one_that_can_be_stored() {
    let mut master = Master::new(&[1]);
    let key = |index: u16, sub: u8| (u32::from(index) << 8 | u32::from(sub)).to_le_bytes();
    for (index, sub) in [
        (0x6064, 0),
        (0x6041, 0),
        (0x6071, 0),
        (0x1000, 0),
        (0x1018, 4),
        (0x3012, 1),
        (0x3010, 4),
        (0x1600, 5),
        (0x5000, 0),
    ] {
        let refused = master.try_write(1, 0x1010, 4, &key(index, sub));
        assert_eq!(refused, Err(0x0800_0020), "{index:04X},{sub}");
    }
    assert_eq!(
        master.try_write(1, 0x1010, 4, &[0x00, 0xB0, 0x21, 0x01]),
        Err(0x0800_0020)
    );
    for (index, sub) in [(0x3009, 1), (0x3011, 1), (0x21B0, 0), (0x1600, 4)] {
        assert_eq!(master.try_write(1, 0x1010, 4, &key(index, sub)), Ok(()));
    }
}

/// The caution of l.229: two nodes of one ID answer at once, with different data. Each such answer
/// costs both a row of errors, until one is off the bus.
#[test]
fn two_nodes_with_one_id_go_offline() {
    let mut master = Master::new(&[1, 2]);
    master.write(1, 0x21B0, 0, &[2, 0]);
    master.run_ms(2);
    let mut asked = 0;
    let off = |master: &mut Master| {
        let notices = master.bus.take_notices();
        notices.iter().any(|n| matches!(n.kind, NoticeKind::BusOff))
    };
    while !off(&mut master) {
        asked += 1;
        assert!(asked < 60, "still on the bus");
        // Their serial numbers differ. The frame behind the request keeps the bus until both have
        // their answers ready.
        master.send(0x602, &[0x40, 0x18, 0x10, 4]);
        master.send(0x010, &[0x55; 8]);
        master.run_ms(2);
        assert!(master.drive(2).error_counters().transmit >= 100);
    }
    println!("{asked} answers");
}
