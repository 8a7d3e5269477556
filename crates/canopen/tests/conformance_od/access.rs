//! Which objects there are, and who may do what with them.

use std::collections::BTreeSet;

use canopen::{Access, Address, DataType};

use crate::harness::FULL;
use crate::master::{Master, STREAM, initiate, number};

/// The first byte of a request that announces `size` bytes expedited.
fn download(size: u8) -> u8 {
    0x23 | (4 - size) << 2
}

/// The abort code of an answer, if it is an abort.
fn code(answer: [u8; 8]) -> Option<u32> {
    (answer[0] == 0x80).then(|| number(answer))
}

pub(crate) fn no_such_object() {
    let known: BTreeSet<u16> = FULL
        .table
        .rows()
        .iter()
        .map(|row| row.address.index)
        .collect();
    let mut master = Master::new();
    for index in (0..=0xFFFF).filter(|index| !known.contains(index)) {
        for (command, sub) in [
            (0x40, 0),
            (0x40, 1),
            (0x2F, 0),
            (0x21, 0xFF),
            (0xA4, 0),
            (0xC6, 0),
        ] {
            let object = Address::new(index, sub);
            let answer = master.ask(&initiate(command, object, 1));
            assert_eq!(answer, initiate(0x80, object, 0x0602_0000));
        }
    }
}

pub(crate) fn no_such_sub_index() {
    let mut known = BTreeSet::new();
    for row in FULL.table.rows() {
        for step in 0..row.count {
            known.insert((row.address.index, row.address.sub + step));
        }
    }
    let indices: BTreeSet<u16> = known.iter().map(|(index, _)| *index).collect();
    let mut master = Master::new();
    for index in indices {
        let is_record = known.iter().any(|&(other, sub)| other == index && sub > 0);
        for sub in 0..=255 {
            if known.contains(&(index, sub)) || (is_record && sub == 0) {
                continue;
            }
            for command in [0x40, 0x2F, 0x21, 0xA4, 0xC6] {
                let object = Address::new(index, sub);
                let answer = master.ask(&initiate(command, object, 1));
                assert_eq!(answer, initiate(0x80, object, 0x0609_0011), "{object}");
            }
        }
    }
}

/// Every object of the dictionary, by every way of reading.
pub(crate) fn every_object_by_its_access() {
    let mut master = Master::reading(b"a stream");
    for row in FULL.table.rows() {
        for step in 0..row.count {
            let object = Address::new(row.address.index, row.address.sub + step);
            let expected = match row.access {
                Access::WriteOnly => Some(0x0601_0001),
                Access::Internal => Some(0x0602_0000),
                // An empty place of the error history.
                _ if object.index == 0x1003 && object.sub > 0 => Some(0x0800_0024),
                _ => None,
            };
            assert_eq!(master.upload(object).err(), expected, "{object}");
            let answer = master.ask(&initiate(0xA4, object, 127));
            assert_eq!(code(answer), expected, "{object}");
            master.send(&initiate(0x80, object, 0));
            let read_only = matches!(row.access, Access::ReadOnly | Access::Constant);
            for command in [0x22, 0x23, 0x2F, 0x20, 0x21, 0xC2] {
                let answer = code(master.ask(&initiate(command, object, 1)));
                assert_eq!(answer == Some(0x0601_0002), read_only, "{object}");
                master.send(&initiate(0x80, object, 0));
            }
        }
    }
}

pub(crate) fn constants_stay() {
    let mut master = Master::new();
    for (index, sub, value) in [
        (0x1000, 0, 0x0002_0192),
        (0x2003, 0, 0xCAFE_F00D),
        (0x1018, 1, 0x408),
    ] {
        let object = Address::new(index, sub);
        let answer = master.ask(&initiate(0x23, object, 1));
        assert_eq!(answer, initiate(0x80, object, 0x0601_0002));
        assert_eq!(
            master.ask(&initiate(0x40, object, 0)),
            initiate(0x43, object, value)
        );
    }
}

/// What is wrong in more than one way is told by the first of: object, sub-index, access, length,
/// range.
pub(crate) fn order_of_the_checks() {
    let mut master = Master::new();
    for (index, sub, size, value, expected) in [
        (0x2FFF, 9, 1, 0, 0x0602_0000),
        (0x2004, 99, 1, 0, 0x0609_0011),
        (0x2001, 0, 1, 0, 0x0601_0002),
        (0x2004, 1, 1, 0xFF, 0x0607_0013),
        (0x2004, 1, 4, 0xFFFF, 0x0607_0012),
        (0x2004, 1, 2, 0x7FFF, 0x0609_0031),
    ] {
        let object = Address::new(index, sub);
        let answer = master.ask(&initiate(download(size), object, value));
        assert_eq!(answer, initiate(0x80, object, expected));
    }
}

/// The highest sub-index as a constant UNSIGNED8.
pub(crate) fn sub_index_0() {
    let mut master = Master::new();
    for (index, highest) in [
        (0x1010, 3),
        (0x1016, 8),
        (0x1018, 4),
        (0x1020, 2),
        (0x1029, 2),
        (0x1200, 2),
        (0x1201, 3),
        (0x1400, 5),
        (0x1800, 6),
        (0x2000, 11),
        (0x200A, 100),
        (0x200C, 3),
        (0x2030, 64),
    ] {
        let object = Address::new(index, 0);
        assert_eq!(
            master.ask(&initiate(0x40, object, 0)),
            initiate(0x4F, object, highest)
        );
        let answer = master.ask(&initiate(0x2F, object, highest));
        assert_eq!(answer, initiate(0x80, object, 0x0601_0002));
        let answer = master.ask(&initiate(0x21, object, 1));
        assert_eq!(answer, initiate(0x80, object, 0x0601_0002));
    }
    // Sub-index 0 of an object that has no others is its value.
    let object = Address::new(0x2001, 0);
    assert_eq!(
        master.ask(&initiate(0x40, object, 0)),
        initiate(0x4B, object, 0x1234)
    );
}

/// Where sub-index 0 counts what is in use, it can be read and written as a value.
pub(crate) fn sub_index_0_that_counts() {
    let mut master = Master::new();
    for index in [0x1600, 0x1603, 0x1A00, 0x1A03, 0x1003] {
        let object = Address::new(index, 0);
        assert_eq!(
            master.ask(&initiate(0x40, object, 0)),
            initiate(0x4F, object, 0)
        );
    }
    let cob_id = Address::new(0x1800, 1);
    assert_eq!(master.ask(&initiate(0x23, cob_id, 0x8000_0185))[0], 0x60);
    let entry = Address::new(0x1A00, 1);
    assert_eq!(master.ask(&initiate(0x23, entry, 0x2000_0108))[0], 0x60);
    let count = Address::new(0x1A00, 0);
    assert_eq!(master.ask(&initiate(0x2F, count, 1))[0], 0x60);
    assert_eq!(
        master.ask(&initiate(0x40, count, 0)),
        initiate(0x4F, count, 1)
    );
}

pub(crate) fn gaps() {
    let mut master = Master::new();
    for (sub, expected) in [
        (0, None),
        (1, None),
        (2, Some(0x0609_0011)),
        (3, None),
        (4, Some(0x0609_0011)),
    ] {
        let answer = master.ask(&initiate(0x40, Address::new(0x200C, sub), 0));
        assert_eq!(code(answer), expected, "{sub}");
    }
}

/// Streams and texts are of no fixed length, numbers are.
pub(crate) fn lengths() {
    let mut master = Master::reading(&[1; 9]);
    assert_eq!(master.upload(STREAM).map(|bytes| bytes.len()), Ok(9));
    for row in FULL.table.rows().iter().filter(|row| row.readable()) {
        let object = row.address;
        if object.index == 0x1003 {
            continue;
        }
        let read = master.upload(object).expect("readable").len();
        match row.data_type {
            DataType::Text | DataType::Domain => {}
            DataType::Bytes => assert_eq!(read, usize::from(row.length), "{object}"),
            number => assert_eq!(read, usize::from(number.size()), "{object}"),
        }
    }
}

pub(crate) fn who_is_told() {
    let mut master = Master::new();
    let wide = Address::new(0x2000, 9);
    assert_eq!(master.download(wide, &[1; 7], false), Err(0x0607_0013));
    assert!(
        master.bench.events.changed.is_empty(),
        "nothing was written"
    );
    assert_eq!(master.download(wide, &[1; 8], true), Ok(()));
    assert!(master.bench.events.changed.has(crate::harness::full::WIDE));
    let text = Address::new(0x2010, 1);
    assert_eq!(master.download(text, b"text", true), Ok(()));
    assert!(master.bench.events.changed.has(crate::harness::full::TEXT));
    assert!(!master.bench.events.changed.has(crate::harness::full::WIDE));
}
