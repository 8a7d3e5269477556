//! PDO mapping and communication parameters against CiA 301 7.5.2.35 to 7.5.2.38.

mod harness;

use canopen::Abort;
use harness::{BASIC, Bench, P3_LIKE, STANDARD};

const UNSUPPORTED: u32 = Abort::UNSUPPORTED_ACCESS.0;
const NOT_MAPPABLE: u32 = Abort::NOT_MAPPABLE.0;
const TOO_LONG: u32 = Abort::MAP_TOO_LONG.0;
const INVALID: u32 = Abort::INVALID_VALUE.0;

/// A mapping entry written as the standard writes it: index, sub-index, length in bits.
const fn entry(index: u32, sub: u32, bits: u32) -> u32 {
    index << 16 | sub << 8 | bits
}

/// Switches a PDO off and its mapping to 0, ready for entries.
fn open(bench: &mut Bench, index: u16) {
    bench
        .write(index, 1, &0x8000_0000u32.to_le_bytes())
        .expect("off");
    bench.write(index + 0x200, 0, &[0]).expect("count 0");
}

/// What each entry gets when it is written.
#[test]
fn entries() {
    // (entry, abort in a receive PDO, abort in a transmit PDO)
    let table = [
        (entry(0x2000, 1, 8), None, None),
        (entry(0x2000, 2, 16), None, None),
        (entry(0x2000, 3, 32), None, None),
        (entry(0x2000, 7, 32), None, None),
        (entry(0x200A, 100, 8), None, None),
        // One direction only.
        (entry(0x2001, 0, 16), Some(NOT_MAPPABLE), None),
        (entry(0x2002, 0, 16), None, Some(NOT_MAPPABLE)),
        (entry(0x2008, 0, 32), Some(NOT_MAPPABLE), None),
        // Neither.
        (entry(0x200B, 0, 8), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        (entry(0x1600, 1, 32), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        // A length that is not the object's, 0 and 255 among them.
        (entry(0x2000, 3, 16), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        (entry(0x2000, 1, 16), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        (entry(0x2000, 1, 0), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        (
            entry(0x2000, 1, 255),
            Some(NOT_MAPPABLE),
            Some(NOT_MAPPABLE),
        ),
        // Nothing there.
        (
            entry(0x2FFF, 0, 8),
            Some(Abort::NO_OBJECT.0),
            Some(Abort::NO_OBJECT.0),
        ),
        (
            entry(0x2000, 9, 8),
            Some(Abort::NO_SUB_INDEX.0),
            Some(Abort::NO_SUB_INDEX.0),
        ),
        // Dummies fill a receive PDO, not a transmit PDO (7.4.7.1).
        (entry(0x0002, 0, 8), None, Some(NOT_MAPPABLE)),
        (entry(0x0003, 0, 16), None, Some(NOT_MAPPABLE)),
        (entry(0x0004, 0, 32), None, Some(NOT_MAPPABLE)),
        (entry(0x0005, 0, 8), None, Some(NOT_MAPPABLE)),
        (entry(0x0006, 0, 16), None, Some(NOT_MAPPABLE)),
        (entry(0x0007, 0, 32), None, Some(NOT_MAPPABLE)),
        (entry(0x0006, 0, 8), Some(NOT_MAPPABLE), Some(NOT_MAPPABLE)),
        (
            entry(0x0001, 0, 8),
            Some(Abort::NO_OBJECT.0),
            Some(Abort::NO_OBJECT.0),
        ),
        // 0 marks an entry as unused.
        (0, None, None),
    ];
    for device in [&STANDARD, &P3_LIKE] {
        for (entry, receive, transmit) in table {
            for (index, expected) in [(0x1400, receive), (0x1800, transmit)] {
                let mut bench = Bench::new(device);
                open(&mut bench, index);
                let written = bench.write(index + 0x200, 1, &entry.to_le_bytes());
                assert_eq!(written.err(), expected, "{entry:08X} at {index:04X}");
                let kept = if expected.is_none() { entry } else { 0 };
                assert_eq!(bench.read(index + 0x200, 1), Ok(kept));
            }
        }
    }
}

/// Counts: what is more than there are entries, than eight bytes, or than exist is refused.
#[test]
fn counts() {
    let eight: &[u32] = &[entry(0x200A, 1, 8); 8];
    let table: &[(&[u32], u8, Option<u32>)] = &[
        (&[], 0, None),
        (eight, 8, None),
        (eight, 3, None),
        (eight, 9, Some(TOO_LONG)),
        (eight, 64, Some(TOO_LONG)),
        (eight, 65, Some(TOO_LONG)),
        (eight, 254, Some(TOO_LONG)),
        (eight, 255, Some(TOO_LONG)),
        (&[entry(0x2000, 3, 32), entry(0x2000, 6, 32)], 2, None),
        // 96 bits.
        (
            &[
                entry(0x2000, 3, 32),
                entry(0x2000, 6, 32),
                entry(0x2007, 0, 32),
            ],
            3,
            Some(TOO_LONG),
        ),
        // 72 bits.
        (
            &[
                entry(0x2000, 3, 32),
                entry(0x2000, 6, 32),
                entry(0x2000, 1, 8),
            ],
            3,
            Some(TOO_LONG),
        ),
        // The third is there but does not count.
        (
            &[
                entry(0x2000, 3, 32),
                entry(0x2000, 6, 32),
                entry(0x2007, 0, 32),
            ],
            2,
            None,
        ),
        // An unused entry counts: there is no object 0.
        (&[entry(0x2000, 3, 32), 0], 2, Some(Abort::NO_OBJECT.0)),
        (&[], 1, Some(Abort::NO_OBJECT.0)),
    ];
    for device in [&STANDARD, &P3_LIKE] {
        for index in [0x1400u16, 0x1403, 0x1800, 0x1803] {
            for &(entries, count, expected) in table {
                let mut bench = Bench::new(device);
                open(&mut bench, index);
                for (entry, sub) in entries.iter().zip(1..) {
                    bench
                        .write(index + 0x200, sub, &entry.to_le_bytes())
                        .expect("an entry");
                }
                let written = bench.write(index + 0x200, 0, &[count]);
                assert_eq!(written.err(), expected, "{count} of {entries:08X?}");
                let kept = if expected.is_none() { count } else { 0 };
                assert_eq!(bench.read(index + 0x200, 0), Ok(u32::from(kept)));
            }
        }
    }
}

/// A standard device is mapped anew only while the PDO is off, and entries change only while the
/// count is 0. The P3 wants only the second (P49).
#[test]
fn while_valid() {
    for (device, lenient) in [(&STANDARD, false), (&P3_LIKE, true)] {
        for index in [0x1400u16, 0x1800] {
            let mapping = index + 0x200;
            let valid = u32::from(index == 0x1400) * 0x80 + 0x185;
            let mut bench = Bench::new(device);
            let refused_if_standard = if lenient { None } else { Some(UNSUPPORTED) };
            assert_eq!(bench.write(mapping, 0, &[0]).err(), refused_if_standard);
            assert_eq!(
                bench
                    .write(mapping, 1, &entry(0x2000, 1, 8).to_le_bytes())
                    .err(),
                refused_if_standard
            );
            bench.map(index, valid, 255, &[entry(0x2000, 1, 8)]);
            // Count 1: entries are closed in both, the COB-ID off or on.
            for cob_id in [valid, valid | 1 << 31] {
                bench
                    .write(index, 1, &cob_id.to_le_bytes())
                    .expect("on, off");
                assert_eq!(
                    bench.write(mapping, 1, &entry(0x2000, 2, 16).to_le_bytes()),
                    Err(UNSUPPORTED)
                );
            }
            assert_eq!(bench.read(mapping, 1), Ok(entry(0x2000, 1, 8)));
        }
    }
}

/// The example of the manual: setting the count to 0 is enough, a COB-ID may change while valid
/// (P3 l.309-324, with the count of P3).
#[test]
fn the_p3s_own_procedure() {
    let mut bench = Bench::operational(&P3_LIKE);
    for request in [
        &[0x22, 0x00, 0x16, 0x00, 0x00][..],
        &[0x22, 0x00, 0x14, 0x01, 0x01, 0x02, 0x00, 0x00],
        &[0x22, 0x00, 0x14, 0x02, 0xFF],
        &[0x22, 0x00, 0x16, 0x01, 0x10, 0x00, 0x05, 0x20],
        &[0x22, 0x00, 0x16, 0x00, 0x01],
        &[0x22, 0x00, 0x1A, 0x00, 0x00],
        &[0x22, 0x00, 0x18, 0x01, 0x81, 0x01, 0x00, 0x00],
        &[0x22, 0x00, 0x18, 0x02, 0x00],
        &[0x22, 0x00, 0x1A, 0x01, 0x20, 0x00, 0x07, 0x20],
        &[0x22, 0x00, 0x1A, 0x00, 0x01],
    ] {
        let answer = bench.sdo(request).expect("an answer");
        assert_eq!(
            answer,
            [0x60, request[1], request[2], request[3], 0, 0, 0, 0]
        );
    }
    assert_eq!(bench.send(0x201, &[0x64, 0x00]), []);
    assert_eq!(bench.owner.asked, [(0x2005, vec![0x64, 0x00], 0)]);
    assert_eq!(bench.sync(), [(0x181, vec![0, 0, 0, 0])]);
    // A COB-ID of 0 is "off" to the P3.
    assert!(bench.sdo(&[0x22, 0x00, 0x18, 1, 0, 0, 0, 0]).is_some());
    assert_eq!(bench.read(0x1800, 1), Ok(0));
    assert_eq!(bench.sync(), []);
}

/// What python-canopen's `save()` sends, with and without "RTR not allowed" (bit 30): both dialects
/// take it, whatever was configured before.
#[test]
fn python_canopen_save() {
    for device in [&STANDARD, &P3_LIKE] {
        for rtr in [0, 1 << 30] {
            for twice in 0..2 {
                let mut bench = Bench::operational(device);
                for _ in 0..=twice {
                    for (index, id, entries) in [
                        (0x1400u16, 0x205, &[entry(0x2005, 0, 16)][..]),
                        (0x1800, 0x185, &[entry(0x2005, 0, 16), entry(0x2007, 0, 32)]),
                    ] {
                        let mapping = index + 0x200;
                        let mut write = |index, sub, bytes: &[u8]| {
                            assert_eq!(bench.write(index, sub, bytes), Ok(()), "{index:04X},{sub}");
                        };
                        write(index, 1, &(id | rtr | 1u32 << 31).to_le_bytes());
                        write(index, 2, &[1]);
                        write(mapping, 0, &[0]);
                        for (entry, sub) in entries.iter().zip(1..) {
                            write(mapping, sub, &entry.to_le_bytes());
                        }
                        write(mapping, 0, &[entries.len() as u8]);
                        write(index, 1, &(id | rtr).to_le_bytes());
                    }
                }
                assert_eq!(bench.send(0x205, &[0x34, 0x12]), []);
                // Type 1: applied with the SYNC, then sampled.
                assert_eq!(bench.sync(), [(0x185, vec![0x34, 0x12, 0, 0, 0, 0])]);
            }
        }
    }
}

/// COB-IDs: the restricted ones (CiA 301 table 40) and 29-bit ones are refused; others, and "off",
/// are taken. The number of a valid PDO changes only by way of "off", except in the P3.
#[test]
fn cob_ids() {
    let restricted = |id: u32| {
        matches!(
            id,
            0x000..=0x07F
                | 0x101..=0x180
                | 0x581..=0x5FF
                | 0x601..=0x67F
                | 0x6E0..=0x6FF
                | 0x701..=0x7FF
        )
    };
    for (device, lenient) in [(&BASIC, false), (&P3_LIKE, true)] {
        for (index, sub) in [(0x1400, 1), (0x1803, 1), (0x1005, 0), (0x1014, 0)] {
            let mut bench = Bench::new(device);
            for id in 0..0x800u32 {
                // 0x1005 has no "off"; it may always change.
                if index != 0x1005 {
                    bench
                        .write(index, sub, &(1u32 << 31).to_le_bytes())
                        .expect("off");
                }
                let zero_is_off = lenient && id == 0 && sub == 1;
                let expected = (restricted(id) && !zero_is_off).then_some(INVALID);
                let written = bench.write(index, sub, &id.to_le_bytes());
                assert_eq!(written.err(), expected, "{id:03X} at {index:04X}");
            }
            for value in [
                0x2000_0285u32,
                0x0000_0A85,
                0x1000_0285,
                0x3FFF_FFFF,
                0x0000_0800,
            ] {
                assert_eq!(
                    bench.write(index, sub, &value.to_le_bytes()),
                    Err(INVALID),
                    "{value:08X} at {index:04X}"
                );
            }
        }
        for (index, sub) in [(0x1401, 1), (0x1801, 1), (0x1014, 0)] {
            let mut bench = Bench::new(device);
            let own = bench.read(index, sub).expect("a COB-ID");
            let moved = 0x3A5u32;
            assert_eq!(
                bench.write(index, sub, &own.to_le_bytes()),
                Ok(()),
                "itself"
            );
            let expected = if lenient { Ok(()) } else { Err(INVALID) };
            assert_eq!(bench.write(index, sub, &moved.to_le_bytes()), expected);
            bench
                .write(index, sub, &(moved | 1 << 31).to_le_bytes())
                .expect("off");
            assert_eq!(bench.write(index, sub, &moved.to_le_bytes()), Ok(()));
        }
        // Bit 30: a SYNC producer this is not; reserved in 0x1014; "no RTR" in a PDO.
        let mut bench = Bench::new(device);
        for (index, sub, value, expected) in [
            (0x1005, 0, 0x4000_0080u32, Err(INVALID)),
            (0x1014, 0, 0x4000_0085, Err(INVALID)),
            (0x1400, 1, 0x4000_0205, Ok(())),
            (0x1800, 1, 0x4000_0185, Ok(())),
        ] {
            assert_eq!(bench.write(index, sub, &value.to_le_bytes()), expected);
        }
    }
}

/// Transmission types: 241 to 251 are reserved, 252 and 253 (remote requests) not offered.
#[test]
fn transmission_types() {
    for device in [&BASIC, &P3_LIKE] {
        for index in [0x1400, 0x1403, 0x1800, 0x1803] {
            let mut bench = Bench::new(device);
            for transmission_type in 0..=255 {
                let expected = match transmission_type {
                    241..=253 => Err(INVALID),
                    _ => Ok(()),
                };
                let written = bench.write(index, 2, &[transmission_type]);
                assert_eq!(written, expected, "{transmission_type}");
            }
        }
    }
}

/// Parameters put into the image from outside (a store of another firmware): what cannot be is
/// empty or off after the start, not half applied.
#[test]
fn impossible_parameters_at_start() {
    use harness::devices::OBJECTS_CONST;
    const COUNT: canopen::Handle<u8> = OBJECTS_CONST.handle(0x1A00, 0);
    const FIRST: canopen::Handle<u32> = OBJECTS_CONST.handle(0x1A00, 1);
    const TYPE: canopen::Handle<u8> = OBJECTS_CONST.handle(0x1800, 2);
    const COB_ID: canopen::Handle<u32> = OBJECTS_CONST.handle(0x1800, 1);
    const EMCY: canopen::Handle<u32> = OBJECTS_CONST.handle(0x1014, 0);
    const SYNC: canopen::Handle<u32> = OBJECTS_CONST.handle(0x1005, 0);
    for (count, first, transmission_type, cob_id, sends) in [
        (1u8, entry(0x2000, 1, 8), 1u8, 0x185u32, true),
        (1, entry(0x2FFF, 1, 8), 1, 0x185, false),
        (1, entry(0x2002, 0, 16), 1, 0x185, false),
        (2, entry(0x2000, 1, 8), 1, 0x185, false),
        (255, entry(0x2000, 1, 8), 1, 0x185, false),
        (1, entry(0x2000, 1, 8), 241, 0x185, false),
        (1, entry(0x2000, 1, 8), 1, 0x000, false),
        (1, entry(0x2000, 1, 8), 1, 0x605, false),
        (1, entry(0x2000, 1, 8), 1, 0x2000_0185, false),
    ] {
        let mut bench = Bench::unstarted(&BASIC);
        let mut image = bench.node.image();
        image.set(COUNT, count);
        image.set(FIRST, first);
        image.set(TYPE, transmission_type);
        image.set(COB_ID, cob_id);
        bench.node.start(bench.now);
        bench.drain();
        bench.nmt(0x01);
        let expected: &[(u16, Vec<u8>)] = &[(0x185, vec![0])];
        assert_eq!(
            bench.sync(),
            if sends { expected } else { &[] },
            "{count} {first:08X} {transmission_type} {cob_id:08X}"
        );
    }
    // SYNC moved onto NMT, EMCY onto NMT: neither takes NMT's place.
    let mut bench = Bench::unstarted(&STANDARD);
    bench.node.image().set(SYNC, 0);
    bench.node.image().set(EMCY, 0);
    bench.node.start(bench.now);
    bench.drain();
    bench.nmt(0x01);
    assert_eq!(bench.node.state(), canopen::NmtState::Operational);
    bench.node.announce(0x1000, 1, [0; 5], bench.now);
    assert_eq!(bench.drain(), []);
}
