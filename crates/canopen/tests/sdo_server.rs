//! The SDO server against CiA 301 7.2.4, and against the P3's own examples.

mod harness;

use canopen::{Abort, Verdict};
use harness::{BASIC, Bench, P3_LIKE, STANDARD, devices::ECHOING};

/// Request and answer; `None` is silence.
type Dialogue = (&'static [u8], Option<[u8; 8]>);

fn play(device: &'static canopen::Device, dialogues: &[Dialogue]) {
    for (request, expected) in dialogues {
        let mut bench = Bench::new(device);
        let answer = bench.sdo(request);
        assert_eq!(answer, *expected, "request {request:02X?}");
    }
}

/// An upload answer says its size: 0x43 four bytes, 0x4B two, 0x4F one (7.2.4.3.6).
#[test]
fn standard_uploads() {
    play(
        &STANDARD,
        &[
            (
                &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0],
                Some([0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]),
            ),
            (
                &[0x40, 0x01, 0x20, 0, 0, 0, 0, 0],
                Some([0x4B, 0x01, 0x20, 0, 0x34, 0x12, 0, 0]),
            ),
            (
                &[0x40, 0x01, 0x10, 0, 0, 0, 0, 0],
                Some([0x4F, 0x01, 0x10, 0, 0, 0, 0, 0]),
            ),
            // Text of four and of two characters.
            (
                &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0],
                Some([0x43, 0x08, 0x10, 0, b'T', b'e', b's', b't']),
            ),
            (
                &[0x40, 0x09, 0x10, 0, 0, 0, 0, 0],
                Some([0x4B, 0x09, 0x10, 0, b'B', b'2', 0, 0]),
            ),
            // An empty text cannot be said in an expedited answer: a segment of no bytes follows.
            (
                &[0x40, 0x0A, 0x10, 0, 0, 0, 0, 0],
                Some([0x41, 0x0A, 0x10, 0, 0, 0, 0, 0]),
            ),
            // Sub-index 0 that no row declares: the highest sub-index as UNSIGNED8 (7.4.3).
            (
                &[0x40, 0x18, 0x10, 0, 0, 0, 0, 0],
                Some([0x4F, 0x18, 0x10, 0, 4, 0, 0, 0]),
            ),
            (
                &[0x40, 0x0C, 0x20, 0, 0, 0, 0, 0],
                Some([0x4F, 0x0C, 0x20, 0, 3, 0, 0, 0]),
            ),
            // The default of 0x1014 is 0x80 plus the node ID.
            (
                &[0x40, 0x14, 0x10, 0, 0, 0, 0, 0],
                Some([0x43, 0x14, 0x10, 0, 0x85, 0, 0, 0]),
            ),
            // The bytes that the standard reserves are not looked at.
            (
                &[0x5F, 0x01, 0x20, 0, 1, 2, 3, 4],
                Some([0x4B, 0x01, 0x20, 0, 0x34, 0x12, 0, 0]),
            ),
        ],
    );
}

/// The P3 answers 0x42 with eight bytes whatever the size (P2).
#[test]
fn p3_uploads() {
    play(
        &P3_LIKE,
        &[
            (
                &[0x40, 0x01, 0x20, 0],
                Some([0x42, 0x01, 0x20, 0, 0x34, 0x12, 0, 0]),
            ),
            (
                &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0],
                Some([0x42, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]),
            ),
            (
                &[0x40, 0x18, 0x10, 0],
                Some([0x42, 0x18, 0x10, 0, 4, 0, 0, 0]),
            ),
            (
                &[0x40, 0x09, 0x10, 0],
                Some([0x42, 0x09, 0x10, 0, b'B', b'2', 0, 0]),
            ),
        ],
    );
}

/// Every type, its size and the command bytes that say it; and those that say another (P1).
#[test]
fn sizes_and_command_bytes() {
    let too_long = Err(Abort::TOO_LONG.0);
    let too_short = Err(Abort::TOO_SHORT.0);
    let size_of = |sub: u8| match sub {
        1 | 4 | 8 => 1,
        2 | 5 => 2,
        _ => 4,
    };
    for device in [&STANDARD, &P3_LIKE] {
        for sub in 1..=8 {
            // 0x22 does not say a size; 0x2F says 1, 0x2B 2, 0x27 3, 0x23 4. Without the size bit
            // the count bits say nothing (7.2.4.3.3), so 0x2E is like 0x22.
            for (command, said) in [
                (0x22, None),
                (0x2E, None),
                (0x2F, Some(1)),
                (0x2B, Some(2)),
                (0x27, Some(3)),
                (0x23, Some(4)),
            ] {
                let mut bench = Bench::new(device);
                let answer = bench
                    .sdo(&[command, 0x00, 0x20, sub, 1, 0, 0, 0])
                    .expect("an answer");
                let expected = match said {
                    Some(said) if said > size_of(sub) => too_long,
                    Some(said) if said < size_of(sub) => too_short,
                    _ => Ok(()),
                };
                let code = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
                let got = match answer[0] {
                    0x60 => {
                        assert_eq!(code, 0, "an acknowledge carries zeros");
                        Ok(())
                    }
                    0x80 => Err(code),
                    other => panic!("{other:02X}"),
                };
                assert_eq!(got, expected, "command {command:02X}, sub-index {sub}");
                assert_eq!(answer[1..4], [0x00, 0x20, sub]);
                let now = bench.read(0x2000, sub).expect("a value");
                assert_eq!(now, u32::from(expected.is_ok()), "{command:02X} {sub}");
            }
        }
    }
}

/// Only the object's own bytes of an unsized write count.
#[test]
fn an_unsized_write_takes_the_objects_bytes() {
    let mut bench = Bench::new(&STANDARD);
    for (sub, expected) in [(1, 0x78), (2, 0x5678), (3, 0x1234_5678)] {
        let answer = bench.sdo(&[0x22, 0x00, 0x20, sub, 0x78, 0x56, 0x34, 0x12]);
        assert_eq!(answer, Some([0x60, 0x00, 0x20, sub, 0, 0, 0, 0]));
        assert_eq!(bench.read(0x2000, sub), Ok(expected));
    }
}

/// Frames of 0 to 8 bytes. The standard device wants 8; the P3 wants 4 to read and as many more as
/// the object has to write, else 0x06070013 (P55).
#[test]
fn frame_lengths() {
    let upload = [0x40, 0x00, 0x20, 3, 0, 0, 0, 0];
    // Unsized and sized.
    for write in [
        [0x22, 0x00, 0x20, 3, 1, 2, 3, 4],
        [0x23, 0x00, 0x20, 3, 1, 2, 3, 4],
    ] {
        for length in 0..=8 {
            let mut bench = Bench::new(&STANDARD);
            assert_eq!(bench.sdo(&upload[..length]).is_some(), length == 8);
            assert_eq!(bench.sdo(&write[..length]).is_some(), length == 8);

            let mut bench = Bench::new(&P3_LIKE);
            assert_eq!(bench.sdo(&upload[..length]).is_some(), length >= 4);
            let expected = match length {
                0..4 => None,
                4..8 => Some([0x80, 0x00, 0x20, 3, 0x13, 0x00, 0x07, 0x06]),
                _ => Some([0x60, 0x00, 0x20, 3, 0, 0, 0, 0]),
            };
            assert_eq!(bench.sdo(&write[..length]), expected, "{length} bytes");
            let value = if length == 8 { 0x0403_0201 } else { 0 };
            assert_eq!(bench.read(0x2000, 3), Ok(value));
        }
    }
    // The P3's own examples: 5 bytes for an UNSIGNED8, 6 for an UNSIGNED16 (P3 l.234, l.256).
    play(
        &P3_LIKE,
        &[
            (
                &[0x22, 0x06, 0x20, 0, 0x04],
                Some([0x60, 0x06, 0x20, 0, 0, 0, 0, 0]),
            ),
            (
                &[0x22, 0x05, 0x20, 0, 0x86, 0x00],
                Some([0x60, 0x05, 0x20, 0, 0, 0, 0, 0]),
            ),
        ],
    );
}

/// Access against reading and writing.
#[test]
fn access() {
    let none = Abort::NO_OBJECT.0;
    let no_sub = Abort::NO_SUB_INDEX.0;
    /// Index, sub-index, size, what reading and what writing gives.
    type Case = (u16, u8, usize, Option<u32>, Option<u32>);
    let table: &[Case] = &[
        (0x2000, 2, 2, None, None),
        (0x2001, 0, 2, None, Some(Abort::READ_ONLY.0)),
        (0x2002, 0, 2, Some(Abort::WRITE_ONLY.0), None),
        (0x2003, 0, 4, None, Some(Abort::READ_ONLY.0)),
        (0x1008, 0, 4, None, Some(Abort::READ_ONLY.0)),
        // The access is looked at before the length.
        (0x2001, 0, 1, None, Some(Abort::READ_ONLY.0)),
        // Sub-index 0 that no row declares is a constant.
        (0x1018, 0, 1, None, Some(Abort::READ_ONLY.0)),
        // No such object; no such sub-index before, between and after those there are.
        (0x2FFF, 0, 1, Some(none), Some(none)),
        (0x0000, 0, 1, Some(none), Some(none)),
        (0xFFFF, 255, 1, Some(none), Some(none)),
        (0x1018, 5, 4, Some(no_sub), Some(no_sub)),
        (0x2001, 1, 2, Some(no_sub), Some(no_sub)),
        (0x200C, 2, 1, Some(no_sub), Some(no_sub)),
        (0x200A, 100, 1, None, None),
        (0x200A, 101, 1, Some(no_sub), Some(no_sub)),
        (0x200A, 255, 1, Some(no_sub), Some(no_sub)),
    ];
    for device in [&STANDARD, &P3_LIKE] {
        for &(index, sub, size, read, written) in table {
            let mut bench = Bench::new(device);
            assert_eq!(
                bench.read(index, sub).err(),
                read,
                "reading {index:04X},{sub}"
            );
            assert_eq!(
                bench.write(index, sub, &[1, 0, 0, 0][..size]).err(),
                written,
                "writing {index:04X},{sub}"
            );
        }
    }
}

/// A value out of range gets the side it is off (CiA 301) or 0x06090030 (P27), and is not taken.
#[test]
fn ranges() {
    let high = Abort::VALUE_TOO_HIGH.0;
    let low = Abort::VALUE_TOO_LOW.0;
    let invalid = Abort::INVALID_VALUE.0;
    let table: &[(u16, u8, &[u8], Option<u32>)] = &[
        (0x2004, 1, &10i16.to_le_bytes(), None),
        (0x2004, 1, &(-10i16).to_le_bytes(), None),
        (0x2004, 1, &11i16.to_le_bytes(), Some(high)),
        (0x2004, 1, &(-11i16).to_le_bytes(), Some(low)),
        (0x2004, 1, &i16::MIN.to_le_bytes(), Some(low)),
        (0x2004, 2, &5u16.to_le_bytes(), None),
        (0x2004, 2, &4u16.to_le_bytes(), Some(low)),
        (0x2004, 2, &101u16.to_le_bytes(), Some(high)),
        (0x2004, 2, &u16::MAX.to_le_bytes(), Some(high)),
        (0x2004, 3, &1.0f32.to_le_bytes(), None),
        (0x2004, 3, &(-1.0f32).to_le_bytes(), None),
        (0x2004, 3, &1.000_1f32.to_le_bytes(), Some(high)),
        (0x2004, 3, &(-1.000_1f32).to_le_bytes(), Some(low)),
        (0x2004, 3, &f32::INFINITY.to_le_bytes(), Some(high)),
        (0x2004, 3, &f32::NEG_INFINITY.to_le_bytes(), Some(low)),
        (0x2004, 3, &f32::NAN.to_le_bytes(), Some(invalid)),
        // A BOOLEAN is 0 or 1.
        (0x2000, 8, &[1], None),
        (0x2000, 8, &[2], Some(high)),
    ];
    for &(index, sub, bytes, expected) in table {
        for device in [&STANDARD, &P3_LIKE] {
            let mut bench = Bench::new(device);
            let before = bench.read(index, sub).expect("a value");
            let lenient = device.dialect.range_abort == canopen::RangeAbort::Invalid;
            let expected = expected.map(|code| if lenient { invalid } else { code });
            assert_eq!(bench.write(index, sub, bytes).err(), expected, "{bytes:?}");
            let mut wanted = [0; 4];
            wanted[..bytes.len()].copy_from_slice(bytes);
            let wanted = match expected {
                None => u32::from_le_bytes(wanted),
                Some(_) => before,
            };
            assert_eq!(bench.read(index, sub), Ok(wanted));
        }
    }
}

/// Where segmented and block transfers are not offered: 0x05040001. Every first byte that is neither an
/// expedited request nor an abort is answered so.
#[test]
fn unknown_commands() {
    for device in [&BASIC, &P3_LIKE] {
        for command in 0..=0xFF {
            let mut bench = Bench::new(device);
            let answer = bench.sdo(&[command, 0x00, 0x20, 3, 0, 0, 0, 0]);
            match command {
                0x40..=0x5F => assert_eq!(answer.map(|a| a[0] & 0xF0), Some(0x40)),
                // Initiate download, expedited (bit 1): answered somehow, by its size.
                0x20..=0x3F if command & 2 != 0 => assert!(answer.is_some()),
                // An abort is never answered.
                0x80..=0x9F => assert_eq!(answer, None),
                _ => assert_eq!(
                    answer,
                    Some([0x80, 0x00, 0x20, 3, 0x01, 0x00, 0x04, 0x05]),
                    "{command:02X}"
                ),
            }
        }
    }
}

/// An abort is answered by silence, whatever it carries; the next request is served.
#[test]
fn an_abort_is_never_answered() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::new(device);
        assert_eq!(
            bench.sdo(&[0x80, 0xFF, 0x2F, 9, 0x00, 0x00, 0x00, 0x08]),
            None
        );
        assert_eq!(bench.sdo(&[0x80, 0, 0, 0]), None);
        assert_eq!(bench.read(0x2001, 0), Ok(0x1234));
    }
}

/// No SDO in stopped (CiA 301 table 37), and none before the start.
#[test]
fn silence_in_stopped() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.nmt(0x02);
        for request in [
            [0x40, 0x01, 0x20, 0, 0, 0, 0, 0],
            [0x22, 0x00, 0x20, 3, 9, 0, 0, 0],
            [0x60, 0, 0, 0, 0, 0, 0, 0],
        ] {
            assert_eq!(bench.sdo(&request), None);
        }
        bench.nmt(0x80);
        assert_eq!(bench.read(0x2000, 3), Ok(0), "nothing was written either");
        let mut unstarted = Bench::unstarted(device);
        assert_eq!(unstarted.sdo(&[0x40, 0x01, 0x20, 0, 0, 0, 0, 0]), None);
    }
}

/// An answer that still waits when the node is stopped is not sent.
#[test]
fn stopping_withdraws_the_answer() {
    let mut bench = Bench::new(&STANDARD);
    let request = can::Frame::classic(0x605, [0x40, 0x01, 0x20, 0, 0, 0, 0, 0], 8);
    bench
        .node
        .receive(&request, bench.now, &mut harness::Recorder::default());
    bench.nmt(0x02);
    bench.nmt(0x80);
    assert_eq!(bench.drain(), []);
}

/// A JPL-like device echoes what was written (J1); an abort carries its code all the same.
#[test]
fn echoed_acknowledge() {
    let mut bench = Bench::new(&ECHOING);
    assert_eq!(
        bench.sdo(&[0x2B, 0x00, 0x20, 2, 0x34, 0x12, 0, 0]),
        Some([0x60, 0x00, 0x20, 2, 0x34, 0x12, 0, 0])
    );
    // Only the object's bytes.
    assert_eq!(
        bench.sdo(&[0x22, 0x00, 0x20, 1, 0x34, 0x12, 0, 0]),
        Some([0x60, 0x00, 0x20, 1, 0x34, 0, 0, 0])
    );
    assert_eq!(bench.write(0x2001, 0, &[0, 0]), Err(Abort::READ_ONLY.0));
}

/// What each verdict does with the answer, the value and the owner's notice.
#[test]
fn verdicts() {
    let refusal = Abort::DEVICE_STATE;
    for (verdict, answer, committed, told) in [
        (Verdict::Accept, Some(Ok(())), true, true),
        (Verdict::Done, Some(Ok(())), false, true),
        (Verdict::Refuse(refusal), Some(Err(refusal.0)), false, false),
        (Verdict::Later, None, false, false),
    ] {
        let mut bench = Bench::new(&STANDARD);
        bench.owner.verdicts.push((0x2005, verdict));
        let got = bench.sdo(&[0x2B, 0x05, 0x20, 0, 0x0F, 0x00, 0, 0]);
        let events = bench.events;
        let expected = answer.map(|answer: Result<(), u32>| match answer {
            Ok(()) => [0x60, 0x05, 0x20, 0, 0, 0, 0, 0],
            Err(_) => [0x80, 0x05, 0x20, 0, 0x22, 0x00, 0x00, 0x08],
        });
        assert_eq!(got, expected, "{verdict:?}");
        assert_eq!(bench.owner.asked, [(0x2005, vec![0x0F, 0x00], 0)]);
        assert_eq!(events.changed.has(harness::devices::COMMAND), told);
        assert_eq!(bench.read(0x2005, 0), Ok(if committed { 0x0F } else { 0 }));
    }
}

/// The owner is asked only about objects that ask, and only with a value in form.
#[test]
fn who_is_asked() {
    let mut bench = Bench::new(&STANDARD);
    bench.write(0x2007, 0, &[1, 0, 0, 0]).expect("plain");
    assert!(bench.events.changed.has(harness::devices::TARGET));
    assert!(!bench.events.changed.has(harness::devices::COMMAND));
    bench.write(0x2005, 0, &[1]).expect_err("too short");
    assert!(bench.events.changed.is_empty());
    bench.write(0x200B, 0, &[1]).expect("tells nobody");
    assert!(bench.events.changed.is_empty());
    assert_eq!(bench.owner.asked, []);
}

/// A write whose owner answers later: uploads are served meanwhile, downloads refused, and the
/// answer comes once.
#[test]
fn later() {
    let store = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let answer = |bench: &mut Bench, result| {
        bench.node.complete(result, bench.now);
        bench.drain()
    };
    let mut bench = Bench::new(&STANDARD);
    bench.owner.verdicts.push((0x1010, Verdict::Later));
    assert_eq!(bench.sdo(&store), None);
    assert_eq!(bench.read(0x2001, 0), Ok(0x1234));
    assert_eq!(
        bench.write(0x2000, 1, &[1]),
        Err(Abort::DEVICE_STATE.0),
        "the connection is busy"
    );
    assert_eq!(bench.sdo(&store).map(|answer| answer[0]), Some(0x80));
    assert_eq!(bench.owner.asked.len(), 1, "a refused request asks nobody");
    assert_eq!(
        answer(&mut bench, Ok(())),
        [(0x585, vec![0x60, 0x10, 0x10, 1, 0, 0, 0, 0])]
    );
    assert_eq!(answer(&mut bench, Ok(())), [], "it was answered");
    assert_eq!(bench.read(0x1010, 1), Ok(1), "nothing was committed");

    // The end may be an abort.
    assert_eq!(bench.sdo(&store), None);
    assert_eq!(
        answer(&mut bench, Err(Abort::HARDWARE)),
        [(0x585, vec![0x80, 0x10, 0x10, 1, 0, 0, 0x06, 0x06])]
    );

    // The client gives up: no answer.
    assert_eq!(bench.sdo(&store), None);
    assert_eq!(bench.sdo(&[0x80, 0x10, 0x10, 1, 0, 0, 4, 5]), None);
    assert_eq!(answer(&mut bench, Ok(())), []);

    // The node is stopped: no answer, then or when it is no longer.
    for complete_in_stopped in [true, false] {
        assert_eq!(bench.sdo(&store), None);
        bench.nmt(0x02);
        if complete_in_stopped {
            assert_eq!(answer(&mut bench, Ok(())), []);
        }
        bench.nmt(0x80);
        assert_eq!(answer(&mut bench, Ok(())), []);
    }

    // A JPL-like device acknowledges a command with what its object reads as (J2).
    let mut bench = Bench::new(&ECHOING);
    bench.owner.verdicts.push((0x1010, Verdict::Later));
    assert_eq!(bench.sdo(&store), None);
    assert_eq!(
        answer(&mut bench, Ok(())),
        [(0x585, vec![0x60, 0x10, 0x10, 1, 1, 0, 0, 0])]
    );
}

/// Live objects are published before they are read, others are not.
#[test]
fn live_uploads() {
    let mut bench = Bench::new(&STANDARD);
    bench.owner.position = -2;
    assert_eq!(bench.read(0x2008, 0), Ok(0xFFFF_FFFE));
    assert_eq!(bench.owner.publications, 1);
    assert_eq!(bench.read(0x2001, 0), Ok(0x1234));
    assert_eq!(bench.owner.publications, 1);
}

/// The frame kinds that are not requests: remote, 29-bit, another node's.
#[test]
fn not_ours() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::new(device);
        let request = [0x40, 0x01, 0x20, 0, 0, 0, 0, 0];
        let standard = can::StandardId::new(0x605).expect("11 bits");
        let extended = can::ExtendedId::new(0x605).expect("29 bits");
        for frame in [
            can::Frame::remote_frame(standard, 8),
            can::Frame::data_frame(extended, &request),
            can::Frame::remote_frame(extended, 8),
        ] {
            assert_eq!(bench.frame(frame.expect("a frame")), []);
        }
        assert_eq!(bench.send(0x604, &request), []);
        assert_eq!(bench.send(0x585, &request), []);
    }
}

/// An answer that was not fetched before the next request is replaced and counted.
#[test]
fn an_overwritten_answer_is_counted() {
    let mut bench = Bench::new(&STANDARD);
    let mut owner = harness::Recorder::default();
    for sub in [1, 2, 3] {
        let request = can::Frame::classic(0x605, [0x40, 0x00, 0x20, sub, 0, 0, 0, 0], 8);
        bench.node.receive(&request, bench.now, &mut owner);
    }
    assert_eq!(
        bench.drain(),
        [(0x585, vec![0x43, 0x00, 0x20, 3, 0, 0, 0, 0])]
    );
    assert_eq!(bench.node.lost_transmissions(), 2);
}
