//! SYNC consumer against CiA 301 7.2.5, and the order in which a SYNC's frames leave.

mod harness;

use harness::{Bench, P3_LIKE, STANDARD};

/// SYNC is what comes on 0x1005, with or without its counter byte; a new COB-ID holds at once.
#[test]
fn cob_id() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
        for data in [&[][..], &[1], &[1, 2, 3, 4, 5, 6, 7, 8]] {
            assert_eq!(bench.send(0x80, data).len(), 1);
            assert!(bench.events.sync);
        }
        assert_eq!(bench.send(0x81, &[]), []);
        bench
            .write(0x1005, 0, &0x100u32.to_le_bytes())
            .expect("a new COB-ID");
        assert_eq!(bench.send(0x80, &[]), []);
        assert!(!bench.events.sync);
        assert_eq!(bench.send(0x100, &[]).len(), 1);
        // Bit 31 says nothing to a consumer (7.5.2.5).
        bench
            .write(0x1005, 0, &0x8000_0080u32.to_le_bytes())
            .expect("a COB-ID");
        assert_eq!(bench.sync().len(), 1);
    }
}

/// Remote and 29-bit frames of the same number are no SYNC.
#[test]
fn not_sync() {
    let mut bench = Bench::operational(&P3_LIKE);
    bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
    let standard = can::StandardId::new(0x80).expect("11 bits");
    let extended = can::ExtendedId::new(0x80).expect("29 bits");
    for frame in [
        can::Frame::remote_frame(standard, 0),
        can::Frame::data_frame(extended, &[]),
        can::Frame::remote_frame(extended, 0),
    ] {
        assert_eq!(bench.frame(frame.expect("a frame")), []);
        assert!(!bench.events.sync);
    }
}

/// Of the frames that wait the one with the lowest identifier leaves first, as on the bus.
#[test]
fn priority() {
    let mut bench = Bench::operational(&STANDARD);
    bench.write(0x1017, 0, &[10, 0]).expect("heartbeat");
    for (n, cob_id) in [(0, 0x485), (1, 0x380), (2, 0x57F), (3, 0x181)] {
        bench.map(0x1800 + n, cob_id, 1, &[0x200A_0108 + (u32::from(n) << 8)]);
    }
    let sync = can::Frame::classic(0x80, [0; 8], 0);
    let request = can::Frame::classic(0x605, [0x40, 0x01, 0x10, 0, 0, 0, 0, 0], 8);
    bench.node.receive(&request, bench.now, &mut bench.owner);
    bench.node.poll(bench.now.plus_ms(10), &mut bench.owner);
    bench.node.receive(&sync, bench.now, &mut bench.owner);
    bench.node.announce(0x1000, 1, [0; 5], bench.now);
    let ids: Vec<u16> = bench.drain().iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0x085, 0x181, 0x380, 0x485, 0x57F, 0x585, 0x705]);
    assert_eq!(bench.node.lost_transmissions(), 0);
}
