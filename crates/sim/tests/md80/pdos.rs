//! The eight PDOs as the page maps them, over the bus, and the other communication objects.

use crate::bench::*;

/// The last frame with that identifier since the log was cleared.
fn last(master: &Master, id: u32) -> Option<Vec<u8>> {
    let frames = master.log.iter().rev();
    let mut of_id = frames.filter(|t| t.frame.raw_id() == id);
    of_id.next().map(|t| t.frame.data().to_vec())
}

#[test]
fn received_pdos_are_the_pages() {
    let mut master = quiet();
    ramps(&mut master, 600);
    let node = u16::from(NODE);
    // 1: control word.
    master.send(0x200 + node, &[6, 0]);
    master.run_ms(5);
    assert_eq!(master.state(NODE), READY_TO_SWITCH_ON);
    // 2: control word, mode.
    master.send(0x300 + node, &[15, 0, 3]);
    master.run_ms(5);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    assert_eq!(master.read(NODE, 0x6061, 0), 3);
    // 4: control word, target velocity.
    let [a, b, c, d] = 60_i32.to_le_bytes();
    master.send(0x500 + node, &[15, 0, a, b, c, d]);
    master.run_ms(500);
    assert!((master.read(NODE, 0x606C, 0) - 60).abs() < 4);
    // 3: control word, target position.
    mode(&mut master, 1);
    let target = master.position(NODE) + TURN;
    let [a, b, c, d] = target.to_le_bytes();
    master.send(0x400 + node, &[15, 0, a, b, c, d]);
    master.run_ms(1500);
    assert_eq!(master.read(NODE, 0x607A, 0), target);
    assert!((master.position(NODE) - target).abs() < 100);
    // One that is too short for its mapping does nothing but an emergency (M32); the next good one ends it.
    master.log.clear();
    master.send(0x400 + node, &[0, 0]);
    master.run_ms(5);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    assert_eq!(master.emergency_codes(NODE), [0x8210]);
    assert_eq!(master.read(NODE, 0x1001, 0), 1);
    master.send(0x400 + node, &[15, 0, a, b, c, d]);
    master.run_ms(5);
    assert_eq!(master.emergency_codes(NODE), [0x8210, 0]);
}

#[test]
fn transmitted_pdos_are_the_pages() {
    let mut master = quiet();
    ramps(&mut master, 600);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(500);
    let node = u32::from(NODE);
    master.log.clear();
    master.run_ms(50);
    for base in [0x180, 0x280, 0x380, 0x480] {
        // M26: type 254 without an event timer sends nothing.
        assert_eq!(last(&master, base + node), None, "{base:X}");
    }
    for index in 0x1800..=0x1803 {
        master.write_u16(NODE, index, 5, 10);
    }
    master.log.clear();
    master.run_ms(100);
    let status = master.status(NODE);
    let word = status.to_le_bytes();
    // Status word, and mode, position, velocity or torque.
    let mode_shown = last(&master, 0x180 + node).expect("TPDO 1");
    assert_eq!(mode_shown, [word[0], word[1], 3]);
    let position = last(&master, 0x280 + node).expect("TPDO 2");
    let shown = i32::from_le_bytes(position[2..].try_into().expect("four bytes"));
    let now = master.position(NODE);
    // 60 RPM are 164 increments in 10 ms; requests take a few.
    assert!((0..600).contains(&(now - shown)), "{now} {shown}");
    let velocity = last(&master, 0x380 + node).expect("TPDO 3");
    let shown = i32::from_le_bytes(velocity[2..].try_into().expect("four bytes"));
    assert!((shown - 60).abs() < 4, "{shown}");
    let torque = last(&master, 0x480 + node).expect("TPDO 4");
    assert_eq!(torque.len(), 4);
    for pdo in [position, velocity, torque] {
        assert_eq!(pdo[..2], word);
    }
    let beat = master
        .log
        .iter()
        .filter(|t| t.frame.raw_id() == 0x180 + node);
    assert!((9..=12).contains(&beat.count()));
}

#[test]
fn pdos_can_be_mapped_anew_with_what_the_page_lets_into_them() {
    let mut master = quiet();
    master.send(0, &[0x80, NODE]);
    master.run_ms(5);
    let cob_id = 0x180 + u32::from(NODE);
    master.write(NODE, 0x1800, 1, &(cob_id | 1 << 31).to_le_bytes());
    master.write(NODE, 0x1A00, 0, &[0]);
    for (object, result) in [
        (0x1001_0008_u32, Ok(())),
        (0x2005_0420, Ok(())),
        (0x2006_0120, Ok(())),
        // M21, and what is not marked.
        (0x6067_0020, Ok(())),
        (0x6079_0020, Ok(())),
        (0x6062_0020, Err(0x0604_0041)),
        (0x607A_0020, Err(0x0604_0041)),
        (0x2004_0120, Err(0x0604_0041)),
        (0x0022_0008, Err(0x0604_0041)),
    ] {
        let got = master.try_write(NODE, 0x1A00, 1, &object.to_le_bytes());
        assert_eq!(got, result, "{object:08X}");
    }
    master.write(NODE, 0x1A00, 1, &0x2006_0220_u32.to_le_bytes());
    master.write(NODE, 0x1A00, 0, &[1]);
    master.write(NODE, 0x1800, 2, &[1]);
    master.write(NODE, 0x1800, 1, &cob_id.to_le_bytes());
    master.send(0, &[1, NODE]);
    master.run_ms(5);
    master.log.clear();
    master.send(0x80, &[]);
    master.run_ms(5);
    let data = last(&master, cob_id).expect("a PDO");
    let celsius = f32::from_le_bytes(data.try_into().expect("four bytes"));
    assert!((20.0..40.0).contains(&celsius), "{celsius}");
}

#[test]
fn the_heartbeat_has_the_period_that_is_written() {
    let mut master = quiet();
    master.write_u16(NODE, 0x1017, 0, 50);
    master.log.clear();
    master.run_ms(1010);
    let beats = master.log.iter().filter(|t| t.frame.raw_id() == 0x705);
    assert_eq!(beats.count(), 20);
    master.write_u16(NODE, 0x1017, 0, 0);
    master.log.clear();
    master.run_ms(1000);
    assert_eq!(last(&master, 0x705), None);
}

#[test]
fn a_name_of_twenty_characters_comes_in_segments_and_one_more_is_too_long() {
    let name = b"T-Motor_AK80-9_KV100";
    assert_eq!(name.len(), 20);
    let mut master = quiet();
    assert_eq!(master.download(0x2000, 6, name), Ok(()));
    assert_eq!(master.upload(0x2000, 6), name);
    let long = b"T-Motor_AK80-9_KV100x";
    assert_eq!(master.download(0x2000, 6, long), Err(0x0607_0012));
    assert_eq!(master.upload(0x2000, 6), name);
    assert_eq!(master.upload(0x1008, 0), b"MD80");
    // Kept by a save.
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(300);
    assert_eq!(master.upload(0x2000, 6), name);
    // A REAL32 in segments, and one that is too short.
    let half = 0.5_f32.to_le_bytes();
    assert_eq!(master.download(0x2001, 1, &half), Ok(()));
    assert_eq!(real(&mut master, 0x2001, 1), 0.5);
    assert_eq!(master.download(0x2001, 1, &half[..3]), Err(0x0607_0013));
    assert_eq!(master.download(0x2001, 1, &[0; 5]), Err(0x0607_0012));
}
