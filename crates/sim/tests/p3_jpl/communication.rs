//! What the manual lists under "Supports" and "Does not yet support" (l.20-52), and PDOs by SYNC.

use can::Frame;

use crate::bench::{answers, of, operational, quiet};
use crate::master::Master;

/// Maps 32 bits of an object to PDO 1.
fn map(master: &mut Master, mapping: u16, object: u16) {
    let [low, high] = object.to_le_bytes();
    master.write(1, mapping, 1, &[32, 0, low, high]);
    master.write(1, mapping, 0, &[1]);
}

/// "Wait at least 5 ms for P3 to boot up" (l.266): after that it hears the first NMT message, and every
/// property before it.
#[test]
fn five_milliseconds_after_power_on_it_listens() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x81, 1]);
    let reset = master.now();
    master.run_ms(5);
    assert!(master.now().since_ns(reset) >= 5_000_000);
    assert_eq!(of(&mut master, 0, &[0x01, 1]), [(0x701, vec![0x05])]);
    assert_eq!(master.read(1, 0x1000, 0), 0x0002_0192);
}

/// l.123: "Apply on nth Sync", the nth after it came; 0 counts as 1, 254 and 255 apply upon receipt.
#[test]
fn an_rpdo_is_applied_with_its_nth_sync() {
    let mut master = operational(&[1]);
    map(&mut master, 0x1600, 0x60FF);
    for (kind, syncs) in [(0, 1), (1, 1), (3, 3), (240, 240), (254, 0), (255, 0)] {
        master.write(1, 0x1400, 2, &[kind]);
        master.write_i32(1, 0x60FF, 0, 0);
        let wanted = 1000 + i32::from(kind);
        master.send(0x201, &wanted.to_le_bytes());
        master.run_ms(2);
        for n in 0..syncs {
            assert_eq!(master.read(1, 0x60FF, 0), 0, "type {kind}, after {n} SYNCs");
            master.send(0x080, &[]);
            master.run_ms(2);
        }
        assert_eq!(master.read(1, 0x60FF, 0), wanted, "type {kind}");
    }
}

/// l.130: "Tx on nth Sync". 254 and 255 are not sent by events: neither for a change nor by the timer
/// (l.49, l.50, J16).
#[test]
fn a_tpdo_is_sent_with_every_nth_sync_and_by_nothing_else() {
    let mut master = operational(&[1]);
    map(&mut master, 0x1A00, 0x60FF);
    for (kind, each) in [(0, 1), (1, 1), (2, 2), (5, 5)] {
        master.write(1, 0x1800, 2, &[kind]);
        master.log.clear();
        for _ in 0..20 {
            master.send(0x080, &[]);
            master.run_ms(2);
        }
        let tpdos = answers(&master);
        assert_eq!(tpdos.len(), 20 / each, "type {kind}");
        assert!(
            tpdos
                .iter()
                .all(|(id, data)| (*id, data.len()) == (0x181, 4))
        );
    }
    master.write_u16(1, 0x1800, 5, 10);
    master.write_u16(1, 0x1800, 3, 1);
    for kind in [254, 255] {
        master.write(1, 0x1800, 2, &[kind]);
        for value in [5, -5] {
            master.write_i32(1, 0x60FF, 0, value);
            master.log.clear();
            master.run_ms(200);
            master.send(0x080, &[]);
            master.run_ms(5);
            assert_eq!(answers(&master), [], "type {kind}");
        }
    }
    assert_eq!(master.read(1, 0x1800, 5), 10, "stored");
    assert_eq!(master.read(1, 0x1800, 3), 1);
}

/// l.48: "Remote Transmit Request messages" are not supported.
#[test]
fn remote_requests_have_no_answer() {
    let mut master = operational(&[1]);
    map(&mut master, 0x1A00, 0x60FF);
    // The types for it cannot be chosen, either.
    for kind in [252, 253] {
        assert_eq!(master.try_write(1, 0x1800, 2, &[kind]), Err(0x0609_0030));
    }
    for kind in [0, 1, 254, 255] {
        master.write(1, 0x1800, 2, &[kind]);
        for (id, length) in [(0x181, 4), (0x701, 1), (0x581, 8)] {
            let id = can::StandardId::new(id).unwrap();
            master.log.clear();
            master.bus.send(0, Frame::remote_frame(id, length).unwrap());
            master.run_ms(20);
            let data = master
                .log
                .iter()
                .filter(|traffic| !traffic.frame.is_remote());
            assert_eq!(data.count(), 0, "type {kind}, {id:?}");
        }
    }
}

/// Neither a SYNC producer (0x1006 is read only), nor identifiers of 29 bits (l.51), nor more or other
/// objects than the table has: consumers, time stamps, dummies, error history, restore.
#[test]
fn what_it_does_not_support_is_refused() {
    let mut master = operational(&[1]);
    let u32 = |value: u32| value.to_le_bytes();
    const VALUE: u32 = 0x0609_0030;
    const NO_OBJECT: u32 = 0x0602_0000;
    const READ_ONLY: u32 = 0x0601_0002;
    const CANNOT_MAP: u32 = 0x0604_0041;
    for (index, sub, value, code) in [
        (0x1005, 0, u32(0x4000_0080), VALUE),
        (0x1005, 0, u32(0x2000_0080), VALUE),
        (0x1006, 0, u32(1000), READ_ONLY),
        (0x1400, 1, u32(0x2000_0201), VALUE),
        (0x1800, 1, u32(0x2000_0181), VALUE),
        (0x1014, 0, u32(0x2000_0081), VALUE),
        (0x1200, 1, u32(0x602), READ_ONLY),
        (0x1012, 0, u32(0x100), NO_OBJECT),
        (0x1016, 1, u32(0x0002_0064), NO_OBJECT),
        (0x1003, 0, u32(0), NO_OBJECT),
        (0x1011, 1, u32(0x6461_6F6C), NO_OBJECT),
        // l.52: dummy entries, here an UNSIGNED32; and what is no PDO's.
        (0x1600, 1, u32(0x0007_0020), NO_OBJECT),
        (0x1600, 1, u32(0x3F60_0008), CANNOT_MAP),
        (0x1600, 1, u32(0x6064_0020), CANNOT_MAP),
        (0x1A00, 1, u32(0x1017_0010), CANNOT_MAP),
    ] {
        let before = master.try_read(1, index, sub);
        assert_eq!(
            master.try_write(1, index, sub, &value),
            Err(code),
            "{index:04X},{sub}"
        );
        assert_eq!(master.try_read(1, index, sub), before, "{index:04X},{sub}");
    }
    let produced = master
        .log
        .iter()
        .filter(|traffic| traffic.frame.raw_id() == 0x080);
    assert_eq!(produced.count(), 0);
}

/// "Up to 4 RPDOs and 4 TPDOs", "up to 4 configurable objects per PDO", "byte-level" (l.25-28).
#[test]
fn four_pdos_of_four_objects() {
    let mut master = operational(&[1]);
    for n in 0..4 {
        for (index, object) in [(0x1600 + n, 0x2A10), (0x1A00 + n, 0x2A11)] {
            for sub in 1..=4 {
                let [low, high] = u16::to_le_bytes(object);
                master.write(1, index, sub, &[8, 1, low, high]);
            }
            assert_eq!(
                master.try_write(1, index, 5, &[8, 1, 0x10, 0x2A]),
                Err(0x0609_0011)
            );
            master.write(1, index, 0, &[4]);
            // Refused as out of range, the object being known with its highest count.
            assert!(master.try_write(1, index, 0, &[5]).is_err());
            assert_eq!(master.read(1, index, 0), 4);
        }
    }
    for index in [0x1404, 0x1604, 0x1804, 0x1A04] {
        assert_eq!(master.try_read(1, index, 1), Err(0x0602_0000));
    }
    master.log.clear();
    master.send(0x080, &[]);
    master.run_ms(5);
    let ids: Vec<u32> = answers(&master).iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0x181, 0x281, 0x381, 0x481]);
    // More than eight bytes; bits.
    master.write(1, 0x1A00, 0, &[0]);
    for (sub, object) in [(1, 0x6063), (2, 0x6064), (3, 0x6069)] {
        let [low, high] = u16::to_le_bytes(object);
        master.write(1, 0x1A00, sub, &[32, 0, low, high]);
    }
    assert_eq!(master.try_write(1, 0x1A00, 0, &[3]), Err(0x0604_0042));
    for bits in [1, 4, 12, 24] {
        let entry = [bits, 0, 0x63, 0x60];
        assert_eq!(
            master.try_write(1, 0x1A00, 1, &entry),
            Err(0x0604_0041),
            "{bits} bits"
        );
    }
}
