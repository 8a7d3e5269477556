//! Segmented uploads.

use canopen::{Abort, Address};

use crate::harness::full::LONG_TEXT;
use crate::master::{Master, STREAM, TEXT, abort, bytes, initiate};
use crate::segmented_download::SIZES;

pub(crate) fn dialogue() {
    Master::new().play(
        "> 40 08 10 00 00 00 00 00    ; eleven characters will come
         < 41 08 10 00 0B 00 00 00
         > 60 00 00 00 00 00 00 00
         < 00 46 75 6C 6C 20 64 65
         > 70 00 00 00 00 00 00 00
         < 17 76 69 63 65 00 00 00",
    );
}

pub(crate) fn every_size() {
    for size in SIZES {
        let mut master = Master::reading(&bytes(size));
        let answer = master.ask(&initiate(0x40, STREAM, 0));
        let expedited = [0x4F, 0x4B, 0x47, 0x43];
        match size {
            1..=4 => assert_eq!(answer[0], expedited[size - 1]),
            _ => assert_eq!(answer, initiate(0x41, STREAM, size as u32)),
        }
        assert_eq!(master.take_segments(answer), Ok(bytes(size)));
    }
}

/// Without a size there are segments, however few bytes there are.
pub(crate) fn every_size_unsaid() {
    for size in SIZES {
        let mut master = Master::reading(&bytes(size));
        master.bench.owner.says_size = false;
        let answer = master.ask(&initiate(0x40, STREAM, 0));
        assert_eq!(answer, initiate(0x40, STREAM, 0));
        assert_eq!(master.take_segments(answer), Ok(bytes(size)));
    }
}

pub(crate) fn nothing_to_send() {
    Master::new().play(
        "> 40 10 20 01 00 00 00 00    ; an empty text
         < 41 10 20 01 00 00 00 00
         > 60 00 00 00 00 00 00 00
         < 0F 00 00 00 00 00 00 00",
    );
}

pub(crate) fn toggle_begins_with_0() {
    Master::new().play(
        "> 40 13 20 01 00 00 00 00
         < 41 13 20 01 E8 03 00 00
         > 70 00 00 00 00 00 00 00
         < 80 13 20 01 00 00 03 05",
    );
}

pub(crate) fn toggle_alternates() {
    for segments in 1..=8_u8 {
        let mut master = Master::reading(&bytes(889));
        assert_eq!(master.ask(&initiate(0x40, STREAM, 0))[0], 0x41);
        for n in 0..segments {
            let toggle = (n & 1) << 4;
            let answer = master.ask(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(answer[0], toggle);
        }
        let again = ((segments - 1) & 1) << 4;
        let answer = master.ask(&[0x60 | again, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(answer, abort(STREAM, Abort::TOGGLE));
        master.is_usable();
    }
}

/// Constant text of any length, not only what a buffer would hold.
pub(crate) fn long_texts() {
    for (sub, text) in [
        (1, LONG_TEXT),
        (2, "four"),
        (3, "fives"),
        (4, "sevenup"),
        (5, "eight888"),
    ] {
        let read = Master::new().upload(Address::new(0x2013, sub));
        assert_eq!(read, Ok(text.as_bytes().to_vec()));
    }
    assert_eq!(LONG_TEXT.len(), 1000);
}

pub(crate) fn wide_numbers() {
    Master::new().play(
        "> 40 18 20 00 00 00 00 00
         < 41 18 20 00 08 00 00 00
         > 60 00 00 00 00 00 00 00
         < 00 EF CD AB 89 67 45 23
         > 70 00 00 00 00 00 00 00
         < 1D 01 00 00 00 00 00 00",
    );
}

/// What is read of a number is its value at the initiate, all of it.
pub(crate) fn a_number_is_of_one_moment() {
    let mut master = Master::new();
    let wide = Address::new(0x2000, 9);
    master.download(wide, &[0x11; 8], true).expect("written");
    master.play(
        "> 40 00 20 09 00 00 00 00
         < 41 00 20 09 08 00 00 00
         > 60 00 00 00 00 00 00 00
         < 00 11 11 11 11 11 11 11",
    );
    let handle = crate::harness::full::OBJECTS_CONST.handle::<i64>(0x2000, 9);
    master.bench.node.image().set(handle, 0x2222_2222_2222_2222);
    master.play(
        "> 70 00 00 00 00 00 00 00
         < 1D 11 00 00 00 00 00 00",
    );
}

/// The source fails in the middle: its abort code is delivered, and the transfer is over.
pub(crate) fn a_source_that_fails() {
    let mut master = Master::reading(&bytes(40));
    master.bench.owner.broken_at = 20;
    assert_eq!(master.upload(STREAM), Err(0x0606_0000));
    master.is_usable();
    master.bench.owner.is_unreadable = true;
    assert_eq!(master.upload(STREAM), Err(0x0800_0024));
    master.is_usable();
}

/// A download's segment in the middle of an upload, and the other way round.
pub(crate) fn the_other_direction_s_segment() {
    let mut master = Master::new();
    master.play(
        "> 40 13 20 01 00 00 00 00
         < 41 13 20 01 E8 03 00 00
         > 00 01 02 03 04 05 06 07
         < 80 13 20 01 01 00 04 05",
    );
    assert_eq!(
        master.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0])[0],
        0x80,
        "it is over"
    );
    assert_eq!(master.ask(&initiate(0x20, TEXT, 0))[0], 0x60);
    let answer = master.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(answer, abort(TEXT, Abort::COMMAND));
    master.is_usable();
}
