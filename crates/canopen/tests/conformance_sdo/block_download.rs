//! Block downloads.

use canopen::{Abort, Address, Device, SdoTransfers};

use crate::blocks::{PLAIN, Way};
use crate::harness::full::with_blocks_of;
use crate::harness::{Call, FULL, Streams};
use crate::master::{
    LONGEST_TEXT, Master, STREAM, TEXT, WIDE, abort, bytes, characters, checksum, initiate, segment,
};

/// A device whose server wants blocks of so many segments. Leaked: devices are static.
pub(crate) fn device(block_size: u8) -> &'static Device {
    Box::leak(Box::new(with_blocks_of(block_size)))
}

fn master(block_size: u8) -> Master {
    Master::of(device(block_size), Streams::default())
}

pub(crate) fn dialogue() {
    let mut master = Master::new();
    master.play(
        "> C6 20 20 00 0A 00 00 00    ; ten bytes, with a checksum
         < A4 20 20 00 7F 00 00 00
         > 01 31 32 33 34 35 36 37
         > 82 38 39 30 00 00 00 00
         < A2 02 7F 00 00 00 00 00
         > D1 21 D3 00 00 00 00 00    ; four bytes of the last count not
         < A1 00 00 00 00 00 00 00",
    );
    assert_eq!(checksum(b"1234567890"), 0xD321);
    assert_eq!(master.bench.owner.taken, b"1234567890");
}

pub(crate) fn the_checksum() {
    assert_eq!(checksum(b"123456789"), 0x31C3, "7.2.4.3.16's example");
    for size in [0, 1, 6, 7, 8, 9, 256, 1000] {
        for flip in 0..16 {
            let mut master = Master::new();
            let data = bytes(size);
            let segments = size.div_ceil(7).max(1);
            master.announce_blocks(STREAM, size, PLAIN).expect("begun");
            for (n, part) in data.chunks(7).enumerate() {
                let number = (n % 127 + 1) as u8 | u8::from(n + 1 == segments) << 7;
                master.send(&segment(number, part));
            }
            if data.is_empty() {
                master.send(&segment(0x81, &[]));
            }
            let wrong = checksum(&data) ^ 1 << flip;
            let unused = 7 * segments - size;
            assert_eq!(master.end_blocks(unused, wrong), Err(0x0504_0004));
            let last = master.bench.owner.calls.last();
            assert_eq!(last, Some(&Call::Abort(STREAM, Abort::CRC)));
            master.is_usable();
        }
    }
}

/// A wrong checksum leaves an object of the image as it was.
pub(crate) fn a_wrong_checksum_writes_nothing() {
    let mut master = Master::new();
    master.download(TEXT, b"before", true).expect("written");
    master.announce_blocks(TEXT, 3, PLAIN).expect("begun");
    master.send(&segment(0x81, b"now"));
    let wrong = !checksum(b"now");
    assert_eq!(master.end_blocks(4, wrong), Err(0x0504_0004));
    assert_eq!(master.upload(TEXT), Ok(b"before".to_vec()));
}

pub(crate) fn without_a_checksum() {
    for say_size in [true, false] {
        let way = Way {
            with_crc: false,
            say_size,
        };
        for size in [0, 1, 7, 8, 889, 1000] {
            let mut master = Master::new();
            let data = bytes(size);
            master.announce_blocks(STREAM, size, way).expect("begun");
            let segments = size.div_ceil(7).max(1);
            for n in 0..segments {
                let part = &data[7 * n..size.min(7 * n + 7)];
                let number = (n % 127 + 1) as u8 | u8::from(n + 1 == segments) << 7;
                master.send(&segment(number, part));
            }
            // Whatever stands in the place of the checksum.
            assert_eq!(master.end_blocks(7 * segments - size, 0xBEEF), Ok(()));
            assert_eq!(master.bench.owner.taken, data);
        }
    }
}

pub(crate) fn every_size() {
    for with_crc in [true, false] {
        for say_size in [true, false] {
            let way = Way { with_crc, say_size };
            for size in (0..30).chain([882, 888, 889, 890, 896, 1778, 1779, 5000]) {
                let mut master = Master::new();
                let data = bytes(size);
                assert_eq!(
                    master.download_blocks(STREAM, &data, way, |_| false),
                    Ok(())
                );
                assert_eq!(master.bench.owner.taken, data, "{size}");
                assert!(master.bench.owner.is_balanced());
            }
        }
    }
}

pub(crate) fn every_block_size() {
    for block_size in 1..=127 {
        let mut master = master(block_size);
        assert_eq!(master.announce_blocks(STREAM, 9, PLAIN), Ok(block_size));
        master.send(&abort(STREAM, Abort::GENERAL));
        let data = bytes(2000);
        assert_eq!(
            master.download_blocks(STREAM, &data, PLAIN, |_| false),
            Ok(())
        );
        assert_eq!(master.bench.owner.taken, data);
    }
}

pub(crate) fn kinds_of_objects() {
    let mut master = Master::new();
    for (object, data) in [
        (Address::new(0x2000, 1), bytes(1)),
        (Address::new(0x2000, 2), bytes(2)),
        (Address::new(0x2000, 3), bytes(4)),
        (WIDE, bytes(8)),
        (TEXT, characters(32)),
        (TEXT, characters(0)),
        (LONGEST_TEXT, characters(255)),
        (Address::new(0x2011, 1), bytes(20)),
    ] {
        assert_eq!(
            master.download_blocks(object, &data, PLAIN, |_| false),
            Ok(())
        );
        assert_eq!(master.upload(object), Ok(data));
    }
}

/// Any one segment lost, of blocks of several sizes: it and those after it are sent again. A block
/// of which nothing comes is a client that has ceased.
pub(crate) fn any_segment_lost() {
    for block_size in [1, 2, 3, 5, 10, 127] {
        for lost in 0..29 {
            let mut master = master(block_size);
            let data = bytes(200);
            let alone = block_size == 1 || 29 % block_size == 1 && lost == 28;
            let done = master.download_blocks(STREAM, &data, PLAIN, |n| n == lost);
            if alone {
                assert_eq!(done, Err(0x0504_0000), "{block_size}, {lost}");
            } else {
                assert_eq!(done, Ok(()), "{block_size}, {lost}");
                assert_eq!(master.bench.owner.taken, data, "{block_size}, {lost}");
            }
            master.is_usable();
        }
    }
}

pub(crate) fn many_segments_lost() {
    for block_size in [2, 3, 7, 127] {
        for every in [2, 3, 5] {
            let mut master = master(block_size);
            let data = bytes(300);
            let lost = |n| n % every == 1 && n < 40;
            let done = master.download_blocks(STREAM, &data, PLAIN, lost);
            assert_eq!(done, Ok(()), "{block_size}, {every}");
            assert_eq!(master.bench.owner.taken, data);
        }
    }
}

pub(crate) fn acknowledges_what_came_in_order() {
    for (lost, came) in [("01", 0), ("02", 1), ("03", 2), ("04", 3)] {
        let mut master = master(5);
        master.play(
            "> C2 20 20 00 64 00 00 00
             < A4 20 20 00 05 00 00 00",
        );
        let mut answers = Vec::new();
        for number in ["01", "02", "03", "04", "05"] {
            assert!(answers.is_empty(), "not before the end of the block");
            if number != lost {
                let text = format!("{number} 01 02 03 04 05 06 07");
                answers = master.send(&crate::master::hex(&text));
            }
        }
        assert_eq!(answers, [[0xA2, came, 5, 0, 0, 0, 0, 0]], "{lost}");
    }
}

/// The end of a block is lost: what came is acknowledged after a silence shorter than a client's
/// patience, once, and then time runs.
pub(crate) fn the_end_of_a_block_lost() {
    master(5).play(
        "> C2 20 20 00 64 00 00 00
         < A4 20 20 00 05 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 01 02 03 04 05 06 07
         ~ 50
         > 03 01 02 03 04 05 06 07
         ~ 50
         > 04 01 02 03 04 05 06 07
         ~ 99
         ~ 1
         < A2 04 05 00 00 00 00 00
         > 01 01 02 03 04 05 06 07    ; the fifth
         ~ 100
         < A2 01 05 00 00 00 00 00
         ~ 999
         ~ 1
         < 80 20 20 00 00 00 04 05",
    );
}

/// Nothing of a block has come: that is a client that has ceased.
pub(crate) fn a_whole_block_lost() {
    master(2).play(
        "> C2 20 20 00 64 00 00 00
         < A4 20 20 00 02 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 01 02 03 04 05 06 07
         < A2 02 02 00 00 00 00 00
         ~ 999
         ~ 1
         < 80 20 20 00 00 00 04 05",
    );
}

/// A segment that comes twice counts once.
pub(crate) fn segments_twice() {
    let mut master = master(3);
    master.play(
        "> C2 20 20 00 1C 00 00 00
         < A4 20 20 00 03 00 00 00
         > 01 01 02 03 04 05 06 07
         > 01 01 02 03 04 05 06 07
         > 02 11 12 13 14 15 16 17
         > 01 01 02 03 04 05 06 07
         > 02 11 12 13 14 15 16 17
         > 03 21 22 23 24 25 26 27
         < A2 03 03 00 00 00 00 00
         > 03 21 22 23 24 25 26 27    ; not one of the next block
         ~ 800                        ; whose silence has not begun
         > 81 31 32 33 34 35 36 37
         < A2 01 03 00 00 00 00 00
         > 81 31 32 33 34 35 36 37    ; nor an abort
         > C1 00 00 00 00 00 00 00
         < A1 00 00 00 00 00 00 00",
    );
    let mut expected = Vec::new();
    for ten in [0x00, 0x10, 0x20, 0x30] {
        expected.extend(1 + ten..=7 + ten);
    }
    assert_eq!(master.bench.owner.taken, expected);
    // Nor does it give its client more time, or less.
    self::master(2).play(
        "> C2 20 20 00 64 00 00 00
         < A4 20 20 00 02 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 11 12 13 14 15 16 17
         < A2 02 02 00 00 00 00 00
         > 02 11 12 13 14 15 16 17
         ~ 999
         ~ 1
         < 80 20 20 00 00 00 04 05",
    );
    // Another number is one of the next block, of which the beginning was lost.
    self::master(3).play(
        "> C2 20 20 00 64 00 00 00
         < A4 20 20 00 03 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 01 02 03 04 05 06 07
         > 03 01 02 03 04 05 06 07
         < A2 03 03 00 00 00 00 00
         > 02 01 02 03 04 05 06 07
         ~ 100
         < A2 00 03 00 00 00 00 00",
    );
}

/// The end of a block comes twice after its beginning was lost: one acknowledge, not two, of which
/// the second would be taken for the next block's.
pub(crate) fn one_acknowledge_a_block() {
    let mut master = master(2);
    master.play(
        "> C2 20 20 00 1C 00 00 00
         < A4 20 20 00 02 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 11 12 13 14 15 16 17
         < A2 02 02 00 00 00 00 00
         > 82 31 32 33 34 35 36 37    ; 01 was lost
         > 82 31 32 33 34 35 36 37
         < A2 00 02 00 00 00 00 00
         > 01 21 22 23 24 25 26 27
         > 82 31 32 33 34 35 36 37
         < A2 02 02 00 00 00 00 00
         > C1 00 00 00 00 00 00 00
         < A1 00 00 00 00 00 00 00",
    );
    assert_eq!(master.bench.owner.taken.len(), 28);
}

/// A client that repeats the announcement has not heard its answer, and gets it again.
pub(crate) fn announced_again() {
    let mut master = Master::new();
    let announcement = initiate(0xC2, STREAM, 7);
    for _ in 0..3 {
        assert_eq!(master.ask(&announcement), initiate(0xA4, STREAM, 127));
    }
    assert_eq!(master.ask(&segment(0x81, b"segment"))[..2], [0xA2, 1]);
    assert_eq!(master.end_blocks(0, 0), Ok(()));
    let begun = Call::Begin(STREAM, Some(7));
    let calls = [
        begun.clone(),
        Call::Abort(STREAM, Abort::GENERAL),
        begun.clone(),
        Call::Abort(STREAM, Abort::GENERAL),
        begun,
        Call::Bytes(0, b"segment".to_vec()),
        Call::End(STREAM, 7),
    ];
    assert_eq!(master.bench.owner.take_calls(), calls);
}

/// A client that repeats a block's last segment after a silence has not heard its acknowledge, and
/// gets it again: of a block, and of the last one.
pub(crate) fn acknowledges_lost() {
    let mut master = master(3);
    master.play(
        "> C2 20 20 00 1C 00 00 00
         < A4 20 20 00 03 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 11 12 13 14 15 16 17
         > 03 21 22 23 24 25 26 27
         < A2 03 03 00 00 00 00 00
         ~ 500
         > 03 21 22 23 24 25 26 27
         < A2 03 03 00 00 00 00 00
         ~ 999                        ; time has begun anew
         > 03 21 22 23 24 25 26 27
         < A2 03 03 00 00 00 00 00
         > 81 31 32 33 34 35 36 37
         < A2 01 03 00 00 00 00 00
         ~ 100
         > 81 31 32 33 34 35 36 37
         < A2 01 03 00 00 00 00 00
         > C1 00 00 00 00 00 00 00
         < A1 00 00 00 00 00 00 00",
    );
    assert_eq!(master.bench.owner.taken.len(), 28);
    master.is_usable();
}

pub(crate) fn numbers_out_of_order() {
    let mut master = master(4);
    master.play(
        "> C2 20 20 00 07 00 00 00
         < A4 20 20 00 04 00 00 00
         > 00 09 09 09 09 09 09 09    ; no segment has the number 0
         > 02 09 09 09 09 09 09 09
         > 03 09 09 09 09 09 09 09
         > 7F 09 09 09 09 09 09 09    ; beyond the block: it is over
         < A2 00 04 00 00 00 00 00
         > 81 01 02 03 04 05 06 07
         < A2 01 04 00 00 00 00 00
         > C1 00 00 00 00 00 00 00
         < A1 00 00 00 00 00 00 00",
    );
    assert_eq!(master.bench.owner.taken, [1, 2, 3, 4, 5, 6, 7]);
}

pub(crate) fn more_than_announced() {
    for announced in 0..=20 {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0xC2, STREAM, announced));
        assert_eq!(answer[0], 0xA4);
        let mut answers = Vec::new();
        let segments = announced / 7 + 1;
        for n in 1..=segments {
            let last = u8::from(n == segments) << 7;
            answers = master.send(&segment(last | n as u8, &[0; 7]));
        }
        // The last segment counts for one byte more than there was to be.
        assert_eq!(answers, [[0xA2, segments as u8, 127, 0, 0, 0, 0, 0]]);
        let unused = 7 * segments - announced - 1;
        assert_eq!(master.end_blocks(unused as usize, 0), Err(0x0607_0012));
        let last = master.bench.owner.calls.last();
        assert_eq!(last, Some(&Call::Abort(STREAM, Abort::TOO_LONG)));
        master.is_usable();
    }
}

pub(crate) fn less_than_announced() {
    for announced in 1..=20_u32 {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0xC2, TEXT, announced));
        assert_eq!(answer[0], 0xA4);
        let segments = announced.div_ceil(7);
        for n in 1..=segments {
            let last = u8::from(n == segments) << 7;
            master.send(&segment(last | n as u8, b"abcdefg"));
        }
        let unused = 7 * segments - announced + 1;
        assert_eq!(master.end_blocks(unused as usize, 0), Err(0x0607_0013));
        assert_eq!(master.upload(TEXT), Ok(vec![]));
        master.is_usable();
    }
}

pub(crate) fn announced_sizes_that_do_not_fit() {
    for (object, size, code) in [
        (TEXT, 33, Abort::TOO_LONG),
        (TEXT, u32::MAX, Abort::TOO_LONG),
        (WIDE, 9, Abort::TOO_LONG),
        (WIDE, 7, Abort::TOO_SHORT),
        (Address::new(0x2011, 1), 19, Abort::TOO_SHORT),
    ] {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0xC6, object, size));
        assert_eq!(answer, abort(object, code), "{size}");
        master.is_usable();
    }
}

/// What does not fit is refused as soon as it is clear that it counts.
pub(crate) fn unannounced_sizes_that_do_not_fit() {
    for (object, size, code) in [
        (TEXT, 33, Err(0x0607_0012)),
        (WIDE, 7, Err(0x0607_0013)),
        (WIDE, 9, Err(0x0607_0012)),
        (LONGEST_TEXT, 256, Err(0x0607_0012)),
        (LONGEST_TEXT, 255, Ok(())),
    ] {
        let mut master = Master::new();
        let way = Way {
            with_crc: true,
            say_size: false,
        };
        let done = master.download_blocks(object, &characters(size), way, |_| false);
        assert_eq!(done, code, "{object}, {size}");
        master.is_usable();
    }
}

/// The end is announced before the last segment.
pub(crate) fn an_end_too_early() {
    let mut master = master(2);
    master.play(
        "> C2 20 20 00 0E 00 00 00
         < A4 20 20 00 02 00 00 00
         > 01 01 02 03 04 05 06 07
         > 02 01 02 03 04 05 06 07    ; without bit 7
         < A2 02 02 00 00 00 00 00",
    );
    // It is taken for a segment of the next block, which it may be: number 65.
    master.play(
        "> C1 00 00 00 00 00 00 00
         ~ 100
         < A2 00 02 00 00 00 00 00
         ~ 1000
         < 80 20 20 00 00 00 04 05",
    );
    master.is_usable();
}

/// All 128 forms of a block size in the server's answers lie in 1 to 127, also where the device's
/// setting does not.
pub(crate) fn settings_out_of_range() {
    for (setting, used) in [(0, 1), (1, 1), (127, 127), (128, 127), (255, 127)] {
        let device = Device {
            dialect: canopen::Dialect {
                sdo: SdoTransfers::All {
                    timeout_ms: 1000,
                    block_size: setting,
                },
                ..FULL.dialect
            },
            ..FULL
        };
        let mut master = Master::of(Box::leak(Box::new(device)), Streams::default());
        assert_eq!(
            master.announce_blocks(STREAM, 9, PLAIN),
            Ok(used),
            "{setting}"
        );
        master.send(&abort(STREAM, Abort::GENERAL));
        let data = bytes(1000);
        assert_eq!(
            master.download_blocks(STREAM, &data, PLAIN, |_| false),
            Ok(())
        );
    }
}
