//! Block uploads.

use canopen::{Abort, Address};

use crate::harness::full::LONG_TEXT;
use crate::master::{Master, STREAM, TEXT, abort, bytes, checksum, initiate, number};

pub(crate) fn dialogue() {
    assert_eq!(checksum(b"1234567890"), 0xD321);
    Master::reading(b"1234567890").play(
        "> A4 20 20 00 02 00 00 00    ; with a checksum, blocks of two
         < C6 20 20 00 0A 00 00 00    ; ten bytes
         > A3 00 00 00 00 00 00 00
         < 01 31 32 33 34 35 36 37
         < 82 38 39 30 00 00 00 00
         > A2 02 02 00 00 00 00 00
         < D1 21 D3 00 00 00 00 00
         > A1 00 00 00 00 00 00 00",
    );
}

pub(crate) fn every_size() {
    for with_crc in [true, false] {
        for says_size in [true, false] {
            for size in (0..30).chain([882, 888, 889, 890, 896, 1778, 1779, 5000]) {
                let mut master = Master::reading(&bytes(size));
                master.bench.owner.says_size = says_size;
                let first = if says_size { 0xC6 } else { 0xC4 };
                let said = if says_size { size as u32 } else { 0 };
                let answer = master.ask(&initiate(0xA4, STREAM, 127));
                assert_eq!(answer, initiate(first, STREAM, said));
                let data = master.upload_blocks(STREAM, with_crc, |_| 127, |_| false);
                assert_eq!(data, Ok(bytes(size)), "{size}");
                master.is_usable();
            }
        }
    }
}

pub(crate) fn kinds_of_objects() {
    let mut master = Master::new();
    master
        .download(TEXT, b"a text of the image", true)
        .expect("written");
    for (object, expected) in [
        (Address::new(0x2001, 0), vec![0x34, 0x12]),
        (Address::new(0x1018, 0), vec![4]),
        (
            Address::new(0x2018, 0),
            0x0123_4567_89AB_CDEF_u64.to_le_bytes().to_vec(),
        ),
        (Address::new(0x2013, 1), LONG_TEXT.as_bytes().to_vec()),
        (TEXT, b"a text of the image".to_vec()),
        (Address::new(0x2011, 1), vec![0; 20]),
    ] {
        let data = master.upload_blocks(object, true, |_| 127, |_| false);
        assert_eq!(data, Ok(expected), "{object}");
    }
}

pub(crate) fn block_sizes_that_do_not_exist() {
    let mut master = Master::reading(&bytes(100));
    for size in (0..=255_u32).filter(|size| !(1..=127).contains(size)) {
        let answer = master.ask(&initiate(0xA4, STREAM, size));
        assert_eq!(answer, abort(STREAM, Abort::BLOCK_SIZE), "{size}");
    }
    master.is_usable();
    // Of a later block, too.
    for size in [0, 128, 255] {
        master.play(
            "> A4 20 20 00 02 00 00 00
             < C6 20 20 00 64 00 00 00",
        );
        assert_eq!(master.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]).len(), 2);
        let answer = master.ask(&[0xA2, 2, size, 0, 0, 0, 0, 0]);
        assert_eq!(answer, abort(STREAM, Abort::BLOCK_SIZE), "{size}");
        master.is_usable();
    }
}

pub(crate) fn every_block_size() {
    for size in 1..=127 {
        let mut master = Master::reading(&bytes(2000));
        let data = master.upload_blocks(STREAM, true, |_| size, |_| false);
        assert_eq!(data, Ok(bytes(2000)), "{size}");
    }
}

/// The client may want blocks of another size at every acknowledge.
pub(crate) fn block_sizes_that_change() {
    for (factor, offset) in [(1, 0), (37, 5), (126, 1), (64, 63)] {
        let mut master = Master::reading(&bytes(5000));
        let size = |block: usize| ((factor * block + offset) % 127 + 1) as u8;
        let data = master.upload_blocks(STREAM, true, size, |_| false);
        assert_eq!(data, Ok(bytes(5000)));
        let mut master = Master::reading(&bytes(5000));
        let data = master.upload_blocks(STREAM, true, size, |n| n % 11 == 3 && n < 800);
        assert_eq!(data, Ok(bytes(5000)), "with loss");
    }
}

/// Any one segment lost: it and those after it are sent again, and the checksum counts all once.
pub(crate) fn any_segment_lost() {
    for size in [1, 2, 3, 5, 10, 127] {
        for lost in 0..30 {
            let mut master = Master::reading(&bytes(200));
            let data = master.upload_blocks(STREAM, true, |_| size, |n| n == lost);
            assert_eq!(data, Ok(bytes(200)), "{size}, {lost}");
            master.is_usable();
        }
    }
}

pub(crate) fn a_whole_block_again() {
    let mut master = Master::reading(&bytes(14));
    master.play(
        "> A4 20 20 00 02 00 00 00
         < C6 20 20 00 0E 00 00 00",
    );
    let block = master.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(block.len(), 2);
    for _ in 0..5 {
        assert_eq!(master.send(&[0xA2, 0, 2, 0, 0, 0, 0, 0]), block);
    }
    let [low, high] = checksum(&bytes(14)).to_le_bytes();
    let end = master.ask(&[0xA2, 2, 2, 0, 0, 0, 0, 0]);
    assert_eq!(end, [0xC1, low, high, 0, 0, 0, 0, 0]);
}

pub(crate) fn more_acknowledged_than_sent() {
    for sent in 1..=10_u8 {
        for more in [sent + 1, 11, 127, 128, 255] {
            let mut master = Master::reading(&bytes(7 * usize::from(sent)));
            master.ask(&initiate(0xA0, STREAM, 10));
            let block = master.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(block.len(), usize::from(sent));
            let answer = master.ask(&[0xA2, more, 10, 0, 0, 0, 0, 0]);
            assert_eq!(answer, abort(STREAM, Abort::SEQUENCE_NUMBER), "{more}");
            master.is_usable();
        }
    }
}

/// The protocol switch: an object of at most so many bytes comes as if it had been asked for by an
/// ordinary upload; with 0 never.
pub(crate) fn the_protocol_switch() {
    for size in [1, 2, 4, 5, 20, 254, 255, 256, 300_usize] {
        for threshold in [0, 1, 4, 5, 20, 254, 255_usize] {
            let mut master = Master::reading(&bytes(size));
            let number_of = |block_size| block_size | (threshold as u32) << 8;
            let answer = master.ask(&initiate(0xA4, STREAM, number_of(10)));
            if threshold == 0 || size > threshold {
                assert_eq!(answer, initiate(0xC6, STREAM, size as u32));
                assert_eq!(master.send(&abort(STREAM, Abort::GENERAL)), [[0; 8]; 0]);
            } else {
                assert_eq!(answer[0] >> 5, 2, "the ordinary upload's answer");
                assert_eq!(master.take_segments(answer), Ok(bytes(size)));
            }
            master.is_usable();
        }
    }
}

pub(crate) fn nothing_is_sent_before_the_start() {
    let mut master = Master::reading(&bytes(100));
    master.play(
        "> A4 20 20 00 02 00 00 00
         < C6 20 20 00 64 00 00 00
         ~ 500
         > A2 00 02 00 00 00 00 00    ; an acknowledge is no start
         < 80 20 20 00 01 00 04 05",
    );
    master.is_usable();
}

/// An acknowledge that comes while the block is being sent: it counts, and what has not been sent
/// of that block is not.
pub(crate) fn an_early_acknowledge() {
    let mut master = Master::reading(&bytes(70));
    master.ask(&initiate(0xA0, STREAM, 10));
    let start = crate::master::frame(0x605, &[0xA3, 0, 0, 0, 0, 0, 0, 0]);
    master.hand_over(start);
    for n in 1..=3 {
        let bench = &mut master.bench;
        let segment = bench.node.transmit(&mut bench.owner).expect("a segment");
        assert_eq!(segment.bytes()[0], n);
    }
    // Two have come; blocks of two from now on.
    let block = master.send(&[0xA2, 2, 2, 0, 0, 0, 0, 0]);
    let at = |n: u8| {
        let from = 7 * usize::from(n);
        bytes(70)[from..from + 7].to_vec()
    };
    assert_eq!(block.len(), 2);
    for (n, segment) in (0..2).zip(&block) {
        assert_eq!(segment[0], n + 1);
        assert_eq!(segment[1..], at(2 + n));
    }
}

/// A wire that has no room for the block is no client that is silent.
pub(crate) fn a_slow_wire() {
    let mut master = Master::reading(&bytes(70));
    master.ask(&initiate(0xA0, STREAM, 10));
    master.hand_over(crate::master::frame(0x605, &[0xA3, 0, 0, 0, 0, 0, 0, 0]));
    for n in 1..=10 {
        let bench = &mut master.bench;
        bench.now = bench.now.plus_ms(1500);
        bench.node.poll(bench.now, &mut bench.owner);
        let segment = bench.node.transmit(&mut bench.owner).expect("a segment");
        assert_eq!(segment.bytes()[0] & 0x7F, n);
    }
    assert_eq!(master.ask(&[0xA2, 10, 10, 0, 0, 0, 0, 0])[0], 0xC1);
}

/// The source fails in the middle of a block.
pub(crate) fn a_source_that_fails() {
    let mut master = Master::reading(&bytes(70));
    master.bench.owner.broken_at = 40;
    let data = master.upload_blocks(STREAM, true, |_| 10, |_| false);
    assert_eq!(data, Err(0x0606_0000));
    master.is_usable();
    master.bench.owner.is_unreadable = true;
    let answer = master.ask(&initiate(0xA4, STREAM, 10));
    assert_eq!(number(answer), 0x0800_0024);
    master.is_usable();
}

/// The object's own errors come before the block size's.
pub(crate) fn objects_that_cannot_be_read() {
    let mut master = Master::new();
    for (object, code) in [
        (Address::new(0x2FFF, 0), Abort::NO_OBJECT),
        (Address::new(0x2010, 9), Abort::NO_SUB_INDEX),
        (Address::new(0x2010, 5), Abort::WRITE_ONLY),
        (Address::new(0x2022, 0), Abort::WRITE_ONLY),
    ] {
        for block_size in [0, 10] {
            let answer = master.ask(&initiate(0xA4, object, block_size));
            assert_eq!(answer, abort(object, code));
        }
    }
    master.is_usable();
}
