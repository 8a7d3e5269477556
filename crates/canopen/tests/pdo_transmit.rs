//! Transmit PDOs against CiA 301 7.2.2 and the P3's types.

mod harness;

use harness::{Bench, P3_LIKE, STANDARD};

const TARGET: u32 = 0x2007_0020;
const POSITION: u32 = 0x2008_0020;
const VELOCITY: u32 = 0x2009_0020;

/// Which of ten SYNCs are answered, by type. Type 0 is acyclic in the standard and waits for an
/// event that nothing here gives; in the P3 it is every SYNC (P13). 254 and 255 wait for events.
#[test]
fn types() {
    for (device, transmission_type, every) in [
        (&STANDARD, 0, None),
        (&STANDARD, 1, Some(1)),
        (&STANDARD, 2, Some(2)),
        (&STANDARD, 3, Some(3)),
        (&STANDARD, 240, Some(240)),
        (&STANDARD, 254, None),
        (&STANDARD, 255, None),
        (&P3_LIKE, 0, Some(1)),
        (&P3_LIKE, 1, Some(1)),
        (&P3_LIKE, 2, Some(2)),
        (&P3_LIKE, 240, Some(240)),
        (&P3_LIKE, 254, None),
        (&P3_LIKE, 255, None),
    ] {
        let mut bench = Bench::operational(device);
        bench.map(0x1802, 0x385, transmission_type, &[0x2001_0010]);
        for n in 1..=721u32 {
            let sent = bench.sync();
            let expected = every.is_some_and(|every: u32| n.is_multiple_of(every));
            let frames: &[(u16, Vec<u8>)] = &[(0x385, vec![0x34, 0x12])];
            assert_eq!(
                sent,
                if expected { frames } else { &[] },
                "SYNC {n} of type {transmission_type}"
            );
        }
    }
}

/// In which states SYNC is answered: operational; pre-operational, too, by the P3 (P14).
#[test]
fn states() {
    for (device, pre_operational) in [(&STANDARD, false), (&P3_LIKE, true)] {
        for (command, sends) in [(0x01, true), (0x80, pre_operational), (0x02, false)] {
            let mut bench = Bench::new(device);
            bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
            bench.nmt(command);
            assert_eq!(!bench.sync().is_empty(), sends, "{command:02X}");
            assert_eq!(bench.events.sync, command != 0x02);
        }
    }
}

/// Nothing is sent by a PDO that is off or empty.
#[test]
fn off_and_empty() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 1, &[]);
    assert_eq!(bench.sync(), []);
    bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
    assert_eq!(bench.sync().len(), 1);
    bench
        .write(0x1800, 1, &0x8000_0185u32.to_le_bytes())
        .expect("off");
    assert_eq!(bench.sync(), []);
}

/// Eight bytes in the order of the mapping, whatever order the objects have in the dictionary.
#[test]
fn layout() {
    let mut bench = Bench::operational(&STANDARD);
    bench.write(0x2007, 0, &[1, 2, 3, 4]).expect("target");
    bench.write(0x2006, 0, &[0xAA]).expect("mode");
    bench.write(0x2000, 1, &[0xBB]).expect("byte");
    bench.map(
        0x1800,
        0x185,
        1,
        &[0x2006_0008, TARGET, 0x2000_0108, 0x2001_0010],
    );
    assert_eq!(
        bench.sync(),
        [(0x185, vec![0xAA, 1, 2, 3, 4, 0xBB, 0x34, 0x12])]
    );
}

/// Live objects are published once per SYNC, before the first sample; and not for others.
#[test]
fn live() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 1, &[TARGET]);
    bench.sync();
    assert_eq!(bench.owner.publications, 0);
    bench.map(0x1801, 0x285, 1, &[POSITION, VELOCITY]);
    bench.map(0x1802, 0x385, 1, &[VELOCITY]);
    bench.owner.position = 7;
    assert_eq!(
        bench.sync(),
        [
            (0x185, vec![0, 0, 0, 0]),
            (0x285, vec![7, 0, 0, 0, 0xF9, 0xFF, 0xFF, 0xFF]),
            (0x385, vec![0xF9, 0xFF, 0xFF, 0xFF]),
        ]
    );
    assert_eq!(bench.owner.publications, 1);
}

/// Data latch at SYNC: what changes before the frame is fetched is not in it. A sample that was
/// not fetched before the next is replaced and counted.
#[test]
fn latched_at_sync() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 1, &[POSITION]);
    let sync = can::Frame::classic(0x80, [0; 8], 0);
    bench.owner.position = 1;
    bench.node.receive(&sync, bench.now, &mut bench.owner);
    bench.owner.position = 2;
    bench
        .node
        .image()
        .set(harness::devices::OBJECTS_CONST.handle::<i32>(0x2008, 0), 3);
    assert_eq!(bench.drain(), [(0x185, vec![1, 0, 0, 0])]);
    bench.node.receive(&sync, bench.now, &mut bench.owner);
    bench.owner.position = 4;
    bench.node.receive(&sync, bench.now, &mut bench.owner);
    assert_eq!(bench.drain(), [(0x185, vec![4, 0, 0, 0])]);
    assert_eq!(bench.node.lost_transmissions(), 1);
}

/// A sample that waits is not sent after PDOs have ended, nor under new parameters.
#[test]
fn what_waits_is_withdrawn() {
    let sync = can::Frame::classic(0x80, [0; 8], 0);
    for (device, command, still_sent) in [
        (&STANDARD, 0x80, false),
        (&STANDARD, 0x02, false),
        (&P3_LIKE, 0x80, true),
        (&P3_LIKE, 0x02, false),
    ] {
        let mut bench = Bench::operational(device);
        bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
        bench.node.receive(&sync, bench.now, &mut bench.owner);
        let nmt = can::Frame::classic(0, [command, harness::ID, 0, 0, 0, 0, 0, 0], 2);
        bench.node.receive(&nmt, bench.now, &mut bench.owner);
        assert_eq!(bench.drain().len(), usize::from(still_sent));
    }
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
    bench.node.receive(&sync, bench.now, &mut bench.owner);
    bench
        .write(0x1800, 1, &0x8000_0185u32.to_le_bytes())
        .expect("off, and no PDO in between");
}

/// The count of SYNCs starts anew with a state and with parameters that matter, not with others.
#[test]
fn counting() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 3, &[0x2000_0108]);
    let counts = |bench: &mut Bench, before: u32, act: &mut dyn FnMut(&mut Bench)| {
        while bench.sync().is_empty() {}
        for _ in 0..before {
            assert_eq!(bench.sync(), []);
        }
        act(bench);
        let mut n = 1;
        while bench.sync().is_empty() {
            n += 1;
        }
        n
    };
    assert_eq!(counts(&mut bench, 2, &mut |_| {}), 1);
    assert_eq!(
        counts(&mut bench, 2, &mut |bench| {
            bench.nmt(0x80);
            bench.nmt(0x01);
        }),
        3
    );
    assert_eq!(counts(&mut bench, 2, &mut |bench| bench.nmt(0x01)), 1);
    assert_eq!(
        counts(&mut bench, 2, &mut |bench| {
            bench.write(0x1800, 2, &[3]).expect("the type");
        }),
        3
    );
    assert_eq!(
        counts(&mut bench, 2, &mut |bench| {
            bench.write(0x1800, 5, &[100, 0]).expect("event timer");
        }),
        1
    );
}

/// A received PDO of a SYNC is applied before the same SYNC's samples are taken.
#[test]
fn applied_before_sampled() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1400, 0x205, 1, &[TARGET]);
    bench.map(0x1800, 0x185, 1, &[TARGET]);
    bench.send(0x205, &[1, 2, 3, 4]);
    assert_eq!(bench.sync(), [(0x185, vec![1, 2, 3, 4])]);
}

/// Remote requests for a TPDO are not answered: types 252 and 253 are not offered.
#[test]
fn remote_requests() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1800, 0x185, 1, &[TARGET]);
    for length in 0..=8 {
        let id = can::StandardId::new(0x185).expect("11 bits");
        let frame = can::Frame::remote_frame(id, length).expect("a frame");
        assert_eq!(bench.frame(frame), []);
    }
}
