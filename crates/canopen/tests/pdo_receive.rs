//! Receive PDOs against CiA 301 7.2.2 and the P3's types.

mod harness;

use canopen::{Abort, Verdict};
use harness::{Bench, P3_LIKE, STANDARD};

const TARGET: u32 = 0x2007_0020;
const COMMAND: u32 = 0x2005_0010;
const MODE: u32 = 0x2006_0008;

/// An event-driven PDO is applied at once, little-endian, in the order of its mapping.
#[test]
fn applied_at_once() {
    for transmission_type in [254, 255] {
        let mut bench = Bench::operational(&STANDARD);
        bench.map(
            0x1401,
            0x305,
            transmission_type,
            &[0x2000_0108, 0x2000_0210, 0x2000_0408, 0x2000_0620],
        );
        assert_eq!(bench.send(0x305, &[1, 2, 3, 4, 5, 6, 7, 8]), []);
        for (sub, value) in [(1, 0x01), (2, 0x0302), (4, 0x04), (6, 0x0807_0605)] {
            assert_eq!(bench.read(0x2000, sub), Ok(value));
        }
    }
}

/// What the owner is told: the classes of what was mapped.
#[test]
fn tells() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
    bench.map(0x1401, 0x305, 255, &[TARGET]);
    bench.send(0x205, &[1]);
    assert!(bench.events.changed.has(harness::devices::PLAIN));
    assert!(!bench.events.changed.has(harness::devices::TARGET));
    bench.send(0x305, &[1, 0, 0, 0]);
    assert!(!bench.events.changed.has(harness::devices::PLAIN));
    assert!(bench.events.changed.has(harness::devices::TARGET));
}

/// Shorter than the mapping: not applied, and told. Longer: applied with what is mapped.
#[test]
fn lengths() {
    for device in [&STANDARD, &P3_LIKE] {
        for transmission_type in [1, 255] {
            for length in 0..=8u8 {
                let mut bench = Bench::operational(device);
                bench.map(
                    0x1400,
                    0x205,
                    transmission_type,
                    &[0x2000_0210, 0x2000_0108],
                );
                let data = [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88];
                bench.send(0x205, &data[..usize::from(length)]);
                let errors = bench.node.errors();
                assert_eq!(
                    errors.has(canopen::CommunicationErrors::RPDO_TOO_SHORT),
                    length < 3
                );
                assert_eq!(
                    errors.has(canopen::CommunicationErrors::RPDO_TOO_LONG),
                    length > 3
                );
                bench.sync();
                let applied = if length < 3 { (0, 0) } else { (0x2211, 0x33) };
                assert_eq!(bench.read(0x2000, 2), Ok(applied.0));
                assert_eq!(bench.read(0x2000, 1), Ok(applied.1));
            }
        }
    }
}

/// Dummies hold the place of what is meant for other nodes (CiA 301 7.4.7.1).
#[test]
fn dummies() {
    for device in [&STANDARD, &P3_LIKE] {
        for (dummies, width) in [
            (&[0x0002_0008u32][..], 1),
            (&[0x0003_0010], 2),
            (&[0x0004_0020], 4),
            (&[0x0005_0008], 1),
            (&[0x0006_0010], 2),
            (&[0x0007_0020], 4),
            (&[0x0005_0008, 0x0006_0010, 0x0004_0020], 7),
        ] {
            let mut bench = Bench::operational(device);
            let entries: Vec<u32> = dummies.iter().copied().chain([0x2000_0108]).collect();
            bench.map(0x1400, 0x205, 255, &entries);
            bench.send(0x205, &[10, 11, 12, 13, 14, 15, 16, 17]);
            assert_eq!(bench.read(0x2000, 1), Ok(10 + width));
        }
    }
}

/// PDOs are received in operational only, by the P3, too; and not by a PDO that is off.
#[test]
fn states() {
    for device in [&STANDARD, &P3_LIKE] {
        for (command, applied) in [(0x01, true), (0x80, false), (0x02, false)] {
            let mut bench = Bench::new(device);
            bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
            bench.nmt(command);
            assert_eq!(bench.send(0x205, &[9]), []);
            bench.nmt(0x80);
            assert_eq!(bench.read(0x2000, 1), Ok(if applied { 9 } else { 0 }));
        }
        let mut bench = Bench::operational(device);
        bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
        bench
            .write(0x1400, 1, &0x8000_0205u32.to_le_bytes())
            .expect("off");
        bench.send(0x205, &[9]);
        assert_eq!(bench.read(0x2000, 1), Ok(0));
    }
}

/// A synchronous PDO waits for its SYNC: the next one in the standard, the nth in the P3 (P50); of
/// several receptions the last counts.
#[test]
fn synchronous_types() {
    for (device, transmission_type, syncs) in [
        (&STANDARD, 0, 1),
        (&STANDARD, 1, 1),
        (&STANDARD, 3, 1),
        (&STANDARD, 240, 1),
        (&P3_LIKE, 0, 1),
        (&P3_LIKE, 1, 1),
        (&P3_LIKE, 2, 2),
        (&P3_LIKE, 3, 3),
        (&P3_LIKE, 240, 240),
    ] {
        let mut bench = Bench::operational(device);
        bench.map(0x1400, 0x205, transmission_type, &[TARGET]);
        bench.sync();
        bench.send(0x205, &[1, 0, 0, 0]);
        bench.send(0x205, &[2, 0, 0, 0]);
        for n in 1..syncs {
            bench.sync();
            assert!(bench.events.changed.is_empty());
            assert_eq!(bench.read(0x2007, 0), Ok(0), "SYNC {n} of {syncs}");
        }
        bench.sync();
        assert!(bench.events.changed.has(harness::devices::TARGET));
        assert_eq!(bench.read(0x2007, 0), Ok(2), "type {transmission_type}");
        // Once only.
        bench.write(0x2007, 0, &[7, 0, 0, 0]).expect("a write");
        for _ in 0..=syncs {
            bench.sync();
            assert!(bench.events.changed.is_empty());
        }
        assert_eq!(bench.read(0x2007, 0), Ok(7));
    }
}

/// What is sent more often than it is applied is applied all the same: the count runs from the
/// first reception (P50).
#[test]
fn nth_sync_is_not_put_off() {
    let mut bench = Bench::operational(&P3_LIKE);
    bench.map(0x1400, 0x205, 3, &[TARGET]);
    for cycle in 1..=9u32 {
        bench.send(0x205, &cycle.to_le_bytes());
        bench.sync();
        assert_eq!(bench.read(0x2007, 0), Ok(cycle / 3 * 3));
    }
}

/// Leaving operational, or new parameters, forget what waits for a SYNC.
#[test]
fn what_waits_is_forgotten() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.map(0x1400, 0x205, 1, &[TARGET]);
        bench.send(0x205, &[5, 0, 0, 0]);
        bench.nmt(0x80);
        bench.nmt(0x01);
        bench.sync();
        assert_eq!(bench.read(0x2007, 0), Ok(0));
        bench.send(0x205, &[5, 0, 0, 0]);
        bench.write(0x1400, 2, &[1]).expect("the type");
        bench.sync();
        assert_eq!(bench.read(0x2007, 0), Ok(0));
    }
}

/// Plain objects are committed before the owner is asked, then by index, wherever in the PDO they
/// stand: the command sees the target that came with it, and 0x2005 acts before 0x2006 (P10).
#[test]
fn order() {
    for (mapping, data) in [
        (
            &[MODE, COMMAND, TARGET][..],
            [0x06, 0x0F, 0x00, 0x2A, 0, 0, 0, 0],
        ),
        (
            &[COMMAND, MODE, TARGET],
            [0x0F, 0x00, 0x06, 0x2A, 0, 0, 0, 0],
        ),
        (
            &[TARGET, MODE, COMMAND],
            [0x2A, 0, 0, 0, 0x06, 0x0F, 0x00, 0],
        ),
    ] {
        let mut bench = Bench::operational(&STANDARD);
        bench.map(0x1400, 0x205, 255, mapping);
        bench.send(0x205, &data);
        assert_eq!(
            bench.owner.asked,
            [(0x2005, vec![0x0F, 0x00], 0x2A), (0x2006, vec![0x06], 0x2A)]
        );
        assert_eq!(bench.read(0x2005, 0), Ok(0x0F));
        assert_eq!(bench.read(0x2006, 0), Ok(0x06));
    }
}

/// Every verdict but "accept" leaves the value; the other objects are written; nobody is answered,
/// and nothing waits for completion.
#[test]
fn verdicts() {
    for (verdict, committed, told) in [
        (Verdict::Accept, true, true),
        (Verdict::Done, false, true),
        (Verdict::Refuse(Abort::GENERAL), false, false),
        (Verdict::Later, false, false),
    ] {
        let mut bench = Bench::operational(&STANDARD);
        bench.owner.verdicts.push((0x2005, verdict));
        bench.map(0x1400, 0x205, 255, &[COMMAND, MODE, TARGET]);
        assert_eq!(bench.send(0x205, &[0x0F, 0x00, 0x06, 0x2A, 0, 0, 0]), []);
        assert_eq!(bench.events.changed.has(harness::devices::COMMAND), told);
        bench.node.complete(Ok(()), bench.now);
        assert_eq!(bench.drain(), []);
        assert_eq!(bench.read(0x2005, 0), Ok(if committed { 0x0F } else { 0 }));
        assert_eq!(bench.read(0x2006, 0), Ok(6));
        assert_eq!(bench.read(0x2007, 0), Ok(0x2A));
    }
}

/// A value out of range keeps the old one; its neighbours are written.
#[test]
fn ranges() {
    for device in [&STANDARD, &P3_LIKE] {
        for (sent, kept) in [(10i16, 10), (-10, -10), (11, 0), (-11, 0), (i16::MIN, 0)] {
            let mut bench = Bench::operational(device);
            bench.map(0x1400, 0x205, 255, &[0x2004_0110, 0x2000_0108]);
            let [low, high] = sent.to_le_bytes();
            bench.send(0x205, &[low, high, 0x55]);
            assert_eq!(bench.read(0x2004, 1), Ok(u32::from(kept as u16)));
            assert_eq!(bench.read(0x2000, 1), Ok(0x55));
        }
        // No NaN gets past a range.
        let mut bench = Bench::operational(device);
        bench.map(0x1400, 0x205, 255, &[0x2004_0320]);
        bench.send(0x205, &f32::NAN.to_le_bytes());
        assert_eq!(bench.read(0x2004, 3), Ok(0));
    }
}

/// The node judges its own parameters in a PDO as it does in an SDO: SYNC does not move onto NMT.
#[test]
fn communication_parameters() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1400, 0x205, 255, &[0x1005_0020]);
    for (sent, kept) in [(0x81u32, 0x81), (0, 0x81), (0x605, 0x81), (0x80, 0x80)] {
        bench.send(0x205, &sent.to_le_bytes());
        assert_eq!(bench.read(0x1005, 0), Ok(kept));
        bench.send(kept as u16, &[]);
        assert!(bench.events.sync);
    }
}

/// Two PDOs on one identifier are both served, in their order.
#[test]
fn two_on_one_identifier() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
    bench.map(0x1403, 0x205, 255, &[0x2006_0008]);
    bench.send(0x205, &[3]);
    assert_eq!(bench.read(0x2000, 1), Ok(3));
    assert_eq!(bench.read(0x2006, 0), Ok(3));
}

/// Remote frames and 29-bit frames of the same number are not the PDO.
#[test]
fn not_ours() {
    let mut bench = Bench::operational(&STANDARD);
    bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
    let standard = can::StandardId::new(0x205).expect("11 bits");
    let extended = can::ExtendedId::new(0x205).expect("29 bits");
    for frame in [
        can::Frame::remote_frame(standard, 1),
        can::Frame::data_frame(extended, &[9]),
        can::Frame::remote_frame(extended, 1),
    ] {
        assert_eq!(bench.frame(frame.expect("a frame")), []);
        assert_eq!(bench.read(0x2000, 1), Ok(0));
    }
}
