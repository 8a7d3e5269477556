//! Emergency producer and error history against CiA 301 7.2.7, 7.5.2.2, 7.5.2.4.

mod harness;

use canopen::{Abort, Emergency};
use harness::{Bench, P3_LIKE, STANDARD};

/// Code, register and the manufacturer's bytes; 0x1001 follows.
#[test]
fn frame() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench
            .node
            .announce(0x8611, 0x21, [1, 2, 3, 4, 5], bench.now);
        assert_eq!(
            bench.drain(),
            [(0x085, vec![0x11, 0x86, 0x21, 1, 2, 3, 4, 5])]
        );
        assert_eq!(bench.read(0x1001, 0), Ok(0x21));
        // "Error reset": sent, not kept in the history.
        bench.node.announce(0x0000, 0, [0; 5], bench.now);
        assert_eq!(bench.drain(), [(0x085, vec![0; 8])]);
        assert_eq!(bench.read(0x1001, 0), Ok(0));
        assert_eq!(bench.read(0x1003, 0), Ok(1));
        assert_eq!(bench.read(0x1003, 1), Ok(0x8611));
    }
    let emergency = Emergency {
        code: 0x8611,
        register: 0x21,
        vendor: [1, 2, 3, 4, 5],
    };
    let bytes = [0x11, 0x86, 0x21, 1, 2, 3, 4, 5];
    assert_eq!(emergency.to_bytes(), bytes);
    assert_eq!(Emergency::from_bytes(bytes), emergency);
}

/// The newest error is at sub-index 1, the others move down, the count stops at eight; entries that
/// hold no error have no data.
#[test]
fn history() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::new(device);
        let mut errors: Vec<u32> = Vec::new();
        for n in 0..=12u16 {
            assert_eq!(bench.read(0x1003, 0), Ok(errors.len().min(8) as u32));
            for sub in 1..=8u8 {
                let expected = errors
                    .iter()
                    .rev()
                    .nth(usize::from(sub) - 1)
                    .copied()
                    .ok_or(Abort::NO_DATA.0);
                assert_eq!(bench.read(0x1003, sub), expected, "{n} errors, {sub}");
            }
            assert_eq!(bench.read(0x1003, 9), Err(Abort::NO_SUB_INDEX.0));
            // The same code twice is two errors.
            let code = 0x1000 + n / 2;
            errors.push(u32::from(code));
            bench.node.announce(code, 1, [0; 5], bench.now);
            bench.drain();
        }
    }
}

/// Writing 0 to 0x1003,0 clears it; another value is refused; the P3 refuses both (P40).
#[test]
fn clearing() {
    for (device, clearable) in [(&STANDARD, true), (&P3_LIKE, false)] {
        let mut bench = Bench::new(device);
        for code in [1, 2, 3] {
            bench.node.announce(code, 1, [0; 5], bench.now);
        }
        bench.drain();
        for value in 1..=255 {
            assert_eq!(
                bench.write(0x1003, 0, &[value]),
                Err(Abort::INVALID_VALUE.0)
            );
        }
        assert_eq!(bench.write(0x1003, 1, &[0; 4]), Err(Abort::READ_ONLY.0));
        assert_eq!(bench.read(0x1003, 0), Ok(3));
        let cleared = bench.write(0x1003, 0, &[0]);
        if clearable {
            assert_eq!(cleared, Ok(()));
            assert_eq!(bench.read(0x1003, 0), Ok(0));
            assert_eq!(bench.read(0x1003, 1), Err(Abort::NO_DATA.0));
            // It fills from the front again.
            bench.node.announce(0x7000, 1, [0; 5], bench.now);
            bench.drain();
            assert_eq!(bench.read(0x1003, 0), Ok(1));
            assert_eq!(bench.read(0x1003, 1), Ok(0x7000));
            assert_eq!(bench.read(0x1003, 2), Err(Abort::NO_DATA.0));
        } else {
            assert_eq!(cleared, Err(Abort::INVALID_VALUE.0));
            assert_eq!(bench.read(0x1003, 1), Ok(3));
        }
    }
}

/// Eight wait in a ring, in their order; what comes on top is counted as lost, and nothing else is.
#[test]
fn ring() {
    for announced in 0..=20u16 {
        let mut bench = Bench::new(&STANDARD);
        // Start in the middle of the ring.
        for code in 0..announced % 8 {
            bench.node.announce(code, 0, [0; 5], bench.now);
        }
        bench.drain();
        for code in 1..=announced {
            bench.node.announce(code, 0, [0; 5], bench.now);
        }
        let codes: Vec<u16> = bench
            .drain()
            .iter()
            .map(|(_, data)| u16::from_le_bytes([data[0], data[1]]))
            .collect();
        let expected: Vec<u16> = (1..=announced.min(8)).collect();
        assert_eq!(codes, expected);
        let lost = u32::from(announced.saturating_sub(8));
        assert_eq!(bench.node.lost_transmissions(), lost);
        // A node that fell silent speaks again.
        bench.node.announce(0x9999, 0, [0; 5], bench.now);
        assert_eq!(bench.drain().len(), 1);
    }
}

/// COB-ID EMCY: moved, off, on.
#[test]
fn cob_id() {
    let mut bench = Bench::new(&STANDARD);
    bench
        .write(0x1014, 0, &0x8000_0085u32.to_le_bytes())
        .expect("off");
    bench.node.announce(0x1000, 1, [0; 5], bench.now);
    assert_eq!(bench.drain(), []);
    assert_eq!(bench.read(0x1001, 0), Ok(1), "the register and");
    assert_eq!(bench.read(0x1003, 1), Ok(0x1000), "the history go on");
    bench
        .write(0x1014, 0, &0x0000_00F5u32.to_le_bytes())
        .expect("on");
    assert_eq!(bench.drain(), [], "what was not sent is not sent later");
    bench.node.announce(0x2000, 1, [0; 5], bench.now);
    assert_eq!(bench.drain()[0].0, 0x0F5);
    // What waits when it is switched off is not sent, nor when it is on again. The bench takes the
    // answers only if no other frame comes with them.
    bench.node.announce(0x3000, 1, [0; 5], bench.now);
    for cob_id in [0x8000_0085, 0x0000_0085u32] {
        bench
            .write(0x1014, 0, &cob_id.to_le_bytes())
            .expect("off, on");
    }
    bench.node.announce(0x4000, 1, [0; 5], bench.now);
    assert_eq!(bench.drain(), [(0x085, vec![0x00, 0x40, 1, 0, 0, 0, 0, 0])]);
}

/// Stopped: no emergency leaves; it waits for pre-operational (CiA 301 table 37).
#[test]
fn stopped() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.nmt(0x02);
        bench.node.announce(0x1000, 1, [0; 5], bench.now);
        bench.node.announce(0x2000, 1, [0; 5], bench.now);
        assert_eq!(bench.drain(), []);
        assert!(bench.node.is_silent());
        let sent = bench.send(0, &[0x80, harness::ID]);
        let codes: Vec<u8> = sent.iter().map(|(_, data)| data[1]).collect();
        assert_eq!(codes, [0x10, 0x20]);
    }
    // Before the start there is no one to tell; the register and the history know.
    let mut bench = Bench::unstarted(&STANDARD);
    bench.node.announce(0x1000, 1, [0; 5], bench.now);
    bench.node.start(bench.now);
    assert_eq!(bench.drain(), [(0x705, vec![0])]);
    assert_eq!(bench.read(0x1003, 1), Ok(0x1000));
}
