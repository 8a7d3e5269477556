//! Segmented downloads.

use canopen::{Abort, Address, Verdict};

use crate::harness::Call;
use crate::master::{
    LONGEST_TEXT, Master, OCTETS, STREAM, TEXT, WIDE, bytes, characters, initiate,
};

/// Sizes at which segments are one more, one byte short, full, or a block of 127.
pub(crate) const SIZES: [usize; 12] = [0, 1, 3, 4, 5, 6, 7, 8, 13, 14, 15, 889];

pub(crate) fn dialogue() {
    Master::new().play(
        "> 21 10 20 01 0A 00 00 00    ; ten bytes will come
         < 60 10 20 01 00 00 00 00
         > 00 61 62 63 64 65 66 67    ; seven
         < 20 00 00 00 00 00 00 00
         > 19 68 69 6A 00 00 00 00    ; three, the last
         < 30 00 00 00 00 00 00 00
         > 40 10 20 01 00 00 00 00
         < 41 10 20 01 0A 00 00 00
         > 60 00 00 00 00 00 00 00
         < 00 61 62 63 64 65 66 67
         > 70 00 00 00 00 00 00 00
         < 19 68 69 6A 00 00 00 00",
    );
}

pub(crate) fn every_size() {
    for say_size in [true, false] {
        for size in SIZES {
            let mut master = Master::new();
            let data = bytes(size);
            assert_eq!(master.download(STREAM, &data, say_size), Ok(()), "{size}");
            assert_eq!(master.bench.owner.taken, data, "{size}");
            let owner = &mut master.bench.owner;
            let said = say_size.then_some(size as u32);
            assert_eq!(owner.calls.first(), Some(&Call::Begin(STREAM, said)));
            assert_eq!(owner.calls.last(), Some(&Call::End(STREAM, size as u32)));
            assert!(owner.is_balanced());
        }
        for size in 0..=32 {
            let mut master = Master::new();
            master.download(TEXT, &characters(32), true).expect("full");
            let text = characters(size);
            assert_eq!(master.download(TEXT, &text, say_size), Ok(()), "{size}");
            assert_eq!(master.upload(TEXT), Ok(text), "{size}");
        }
    }
}

/// A segment may carry fewer bytes than seven, also if it is not the last.
pub(crate) fn segments_need_not_be_full() {
    let mut master = Master::new();
    master.play(
        "> 20 10 20 01 00 00 00 00
         < 60 10 20 01 00 00 00 00
         > 0C 61 FF FF FF FF FF FF    ; one
         < 20 00 00 00 00 00 00 00
         > 1E FF FF FF FF FF FF FF    ; none
         < 30 00 00 00 00 00 00 00
         > 06 62 63 64 65 FF FF FF    ; four
         < 20 00 00 00 00 00 00 00
         > 1F FF FF FF FF FF FF FF    ; none, the last
         < 30 00 00 00 00 00 00 00",
    );
    assert_eq!(master.upload(TEXT), Ok(b"abcde".to_vec()));
}

pub(crate) fn toggle_begins_with_0() {
    Master::new().play(
        "> 20 10 20 01 00 00 00 00
         < 60 10 20 01 00 00 00 00
         > 11 61 62 63 64 65 66 67
         < 80 10 20 01 00 00 03 05",
    );
}

pub(crate) fn toggle_alternates() {
    for segments in 1..=8_u8 {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0x20, LONGEST_TEXT, 0));
        assert_eq!(answer, initiate(0x60, LONGEST_TEXT, 0));
        for n in 0..segments {
            let toggle = (n & 1) << 4;
            let answer = master.ask(&[toggle, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61]);
            assert_eq!(answer, [0x20 | toggle, 0, 0, 0, 0, 0, 0, 0]);
        }
        // The last one once more.
        let again = ((segments - 1) & 1) << 4;
        let answer = master.ask(&[again, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61]);
        assert_eq!(answer, initiate(0x80, LONGEST_TEXT, 0x0503_0000));
        assert_eq!(master.upload(LONGEST_TEXT), Ok(vec![]));
        master.is_usable();
    }
}

pub(crate) fn more_than_announced() {
    for announced in 0..=20_u8 {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0x21, TEXT, u32::from(announced)));
        assert_eq!(answer, initiate(0x60, TEXT, 0));
        let code = master.send_segments(&characters(usize::from(announced) + 1));
        assert_eq!(code, Err(0x0607_0012), "{announced}");
        assert_eq!(master.upload(TEXT), Ok(vec![]));
        master.is_usable();
    }
}

pub(crate) fn less_than_announced() {
    for announced in 1..=20_u8 {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0x21, TEXT, u32::from(announced)));
        assert_eq!(answer, initiate(0x60, TEXT, 0));
        let code = master.send_segments(&characters(usize::from(announced) - 1));
        assert_eq!(code, Err(0x0607_0013), "{announced}");
        assert_eq!(master.upload(TEXT), Ok(vec![]));
        master.is_usable();
    }
}

pub(crate) fn announced_sizes_that_do_not_fit() {
    let too_long = 0x0607_0012;
    let too_short = 0x0607_0013;
    for (object, size, code) in [
        (TEXT, 33, too_long),
        (TEXT, u32::MAX, too_long),
        (TEXT, u32::MAX - 1, too_long),
        (OCTETS, 21, too_long),
        (OCTETS, 19, too_short),
        (OCTETS, 0, too_short),
        (WIDE, 9, too_long),
        (WIDE, 7, too_short),
        (WIDE, 0x0001_0008, too_long),
        (Address::new(0x2000, 1), 2, too_long),
        (Address::new(0x2000, 1), 0, too_short),
        (Address::new(0x2000, 3), 8, too_long),
        (Address::new(0x2000, 3), 3, too_short),
    ] {
        let mut master = Master::new();
        let answer = master.ask(&initiate(0x21, object, size));
        assert_eq!(answer, initiate(0x80, object, code), "{object}, {size}");
        master.is_usable();
    }
}

pub(crate) fn unannounced_sizes_that_do_not_fit() {
    for (object, size, code) in [
        (TEXT, 33, 0x0607_0012),
        (OCTETS, 21, 0x0607_0012),
        (OCTETS, 19, 0x0607_0013),
        (WIDE, 7, 0x0607_0013),
        (WIDE, 9, 0x0607_0012),
        (Address::new(0x2000, 2), 1, 0x0607_0013),
        (Address::new(0x2000, 2), 3, 0x0607_0012),
    ] {
        let mut master = Master::new();
        let before = master.upload(object);
        assert_eq!(master.download(object, &characters(size), false), Err(code));
        assert_eq!(master.upload(object), before);
        master.is_usable();
    }
}

/// Any object may be written in segments, also one that an expedited download could write.
pub(crate) fn short_objects() {
    for (sub, size) in [
        (1, 1),
        (2, 2),
        (3, 4),
        (4, 1),
        (5, 2),
        (6, 4),
        (7, 4),
        (9, 8),
        (10, 8),
    ] {
        for say_size in [true, false] {
            let mut master = Master::new();
            let object = Address::new(0x2000, sub);
            let value = bytes(size);
            assert_eq!(master.download(object, &value, say_size), Ok(()));
            assert_eq!(master.upload(object), Ok(value));
        }
    }
}

/// The value is judged when all of it has come: the last segment gets the verdict.
pub(crate) fn judged_at_the_end() {
    let mut master = Master::new();
    let ranged = Address::new(0x2004, 8);
    let high = (0x1_0000_0001_i64).to_le_bytes();
    assert_eq!(master.download(ranged, &high, true), Err(0x0609_0031));
    assert_eq!(master.upload(ranged), Ok(vec![0; 8]));
    let most = (0x1_0000_0000_i64).to_le_bytes();
    assert_eq!(master.download(ranged, &most, true), Ok(()));
    assert_eq!(master.upload(ranged), Ok(most.to_vec()));

    // The owner is asked once, with all bytes, and refuses.
    let text = characters(40);
    master.bench.owner.verdict = Verdict::Refuse(Abort::LOCAL_CONTROL);
    assert_eq!(master.download(LONGEST_TEXT, &text, true), Err(0x0800_0021));
    let asked = [Call::Write(LONGEST_TEXT, text)];
    assert_eq!(master.bench.owner.take_calls(), asked);
    assert_eq!(master.upload(LONGEST_TEXT), Ok(vec![]));
}

/// Until the last segment has been judged, the object has its old value.
pub(crate) fn the_old_value_until_the_end() {
    let mut master = Master::new();
    master.download(TEXT, b"old text", true).expect("written");
    let whole = master.bench.node.bytes().to_vec();
    let place = (whole.windows(8)).position(|bytes| bytes == b"old text");
    let place = place.expect("it is in the image");
    master.play(
        "> 21 10 20 01 0A 00 00 00
         < 60 10 20 01 00 00 00 00
         > 00 61 62 63 64 65 66 67
         < 20 00 00 00 00 00 00 00",
    );
    assert_eq!(master.bench.node.bytes()[place..place + 8], *b"old text");
    master.play(
        "> 19 68 69 6A 00 00 00 00
         < 30 00 00 00 00 00 00 00",
    );
    assert_eq!(master.upload(TEXT), Ok(b"abcdefghij".to_vec()));
}

pub(crate) fn verdict_later() {
    for (result, answer) in [
        (Ok(()), "30 00 00 00 00 00 00 00"),
        (Err(Abort::CANNOT_STORE), "80 15 20 00 20 00 00 08"),
    ] {
        let mut master = Master::new();
        master.bench.owner.verdict = Verdict::Later;
        master.play(
            "> 21 15 20 00 08 00 00 00
             < 60 15 20 00 00 00 00 00
             > 00 01 02 03 04 05 06 07
             < 20 00 00 00 00 00 00 00
             > 1D 08 00 00 00 00 00 00    ; silence
             ~ 60000",
        );
        let expected: [u8; 8] = crate::master::hex(answer).try_into().expect("eight bytes");
        assert_eq!(master.complete(result), [expected]);
        assert_eq!(master.upload(Address::new(0x2015, 0)), Ok(vec![0; 8]));
        master.is_usable();
    }
}
