//! Bad input: refused as the manual says, and where it is silent as CiA 301 says.

use crate::bench::{of, operational, quiet};

const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;

/// Every object of one, two or four bytes, with every other length said; without one, the first bytes
/// count, as in the manual's own requests (l.183).
#[test]
fn a_length_that_is_not_the_objects() {
    let mut master = operational(&[1]);
    let rows = personalities::p3_jpl::OBJECTS.table().rows();
    let writable: Vec<_> = rows.iter().filter(|row| row.writable()).collect();
    let mut refused = 0;
    for row in &writable {
        let size = row.data_type.size();
        let [low, high] = row.address.index.to_le_bytes();
        let before = master.try_read(1, row.address.index, row.address.sub);
        for said in 1..=4u8 {
            if said == size {
                continue;
            }
            let command = 0x23 | (4 - said) << 2;
            let request = [command, low, high, row.address.sub, 1, 1, 1, 1];
            let code = if said > size { TOO_LONG } else { TOO_SHORT };
            let mut expected = vec![0x80, low, high, row.address.sub];
            expected.extend(code.to_le_bytes());
            let answer = of(&mut master, 0x601, &request);
            assert_eq!(answer, [(0x581, expected)], "{} said {said}", row.address);
            refused += 1;
        }
        let after = master.try_read(1, row.address.index, row.address.sub);
        if row.address.index != 0x3F63 {
            assert_eq!(after, before, "{}", row.address);
        }
    }
    assert_eq!(refused, 3 * writable.len());
    // Too short a frame for what it carries, without a size.
    for (request, object) in [
        (&[0x22, 0x7A, 0x60, 0x00, 1, 2][..], (0x607A, 0)),
        (&[0x22, 0x17, 0x10, 0x00, 1], (0x1017, 0)),
        (&[0x22, 0x60, 0x60, 0x00], (0x6060, 0)),
    ] {
        let answer = of(&mut master, 0x601, request);
        let [(0x581, data)] = answer.as_slice() else {
            panic!("{answer:02X?}")
        };
        assert_eq!((data[0], &data[4..]), (0x80, &TOO_SHORT.to_le_bytes()[..]));
        assert_eq!(master.read(1, object.0, object.1), 0);
    }
}

/// What the table marks RO; 0x08000021 or a value never come of it.
#[test]
fn read_only_objects() {
    let mut master = operational(&[1]);
    let rows = personalities::p3_jpl::OBJECTS.table().rows();
    let mut refused = 0;
    for row in rows.iter().filter(|row| !row.writable()) {
        for sub in row.address.sub..row.address.sub + row.count {
            let result = master.try_write(1, row.address.index, sub, &[0; 4]);
            assert_eq!(result, Err(0x0601_0002), "{:04X},{sub}", row.address.index);
            refused += 1;
        }
    }
    assert!(refused > 150, "{refused}");
}

/// Beyond a range: 0x06090031 above it, 0x06090032 below; a value that is none of a list: 0x06090030.
#[test]
fn out_of_range() {
    let mut master = operational(&[1]);
    for index in [0x6083, 0x6084] {
        for value in [0, -1, i32::MIN] {
            let result = master.try_write(1, index, 0, &value.to_le_bytes());
            assert_eq!(result, Err(0x0609_0032), "{index:04X} {value}");
        }
        assert_eq!(master.read(1, index, 0), 2_000_000);
        master.write_i32(1, index, 0, 1);
        master.write_i32(1, index, 0, i32::MAX);
    }
    // l.123, l.130: 0 to 240, 254, 255.
    for index in [0x1400, 0x1800] {
        for kind in 0..=255 {
            let result = master.try_write(1, index, 2, &[kind]);
            let listed = matches!(kind, 0..=240 | 254 | 255);
            assert_eq!(result.is_ok(), listed, "{index:04X} {kind}: {result:X?}");
            assert!(listed || result == Err(0x0609_0030));
        }
    }
}

/// J9: nothing is answered in the wrong state: not before the first NMT message, not when stopped.
#[test]
fn in_the_wrong_state() {
    let mut master = quiet(&[1]);
    let request = [0x22, 0x60, 0x60, 0x00, 1];
    assert_eq!(of(&mut master, 0x601, &request), []);
    of(&mut master, 0, &[0x02, 1]);
    assert_eq!(of(&mut master, 0x601, &request), [], "stopped");
    of(&mut master, 0, &[0x80, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 0, "nor was it obeyed");
    assert_eq!(of(&mut master, 0x601, &request).len(), 1);
}

/// "save", whole and in small letters.
#[test]
fn a_save_without_its_signature() {
    let mut master = operational(&[1]);
    master.write(1, 0x1018, 6, &[9, 0, 0, 0]);
    for bytes in [
        *b"SAVE",
        *b"evas",
        *b"sav\0",
        *b"load",
        [1, 0, 0, 0],
        [0; 4],
    ] {
        assert_eq!(
            master.try_write(1, 0x1010, 1, &bytes),
            Err(0x0800_0020),
            "{bytes:02X?}"
        );
    }
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x1018, 6), 0, "nothing was saved");
}

/// Requests that are none.
#[test]
fn what_is_no_transfer() {
    let mut master = operational(&[1]);
    for (request, code) in [
        // Segments and blocks (l.42, l.43), and a command that there is not.
        ([0x21, 0x7A, 0x60, 0, 4, 0, 0, 0], 0x0504_0001u32),
        ([0x20, 0x7A, 0x60, 0, 4, 0, 0, 0], 0x0504_0001),
        ([0xC6, 0x7A, 0x60, 0, 4, 0, 0, 0], 0x0504_0001),
        ([0xA4, 0x7A, 0x60, 0, 4, 0, 0, 0], 0x0504_0001),
        ([0x60, 0x00, 0x00, 0, 0, 0, 0, 0], 0x0504_0001),
        ([0xE0, 0x00, 0x00, 0, 0, 0, 0, 0], 0x0504_0001),
        // No such object, no such sub-index.
        ([0x40, 0x71, 0x60, 0, 0, 0, 0, 0], 0x0602_0000),
        ([0x40, 0x00, 0x3F, 128, 0, 0, 0, 0], 0x0609_0011),
        ([0x40, 0x18, 0x10, 7, 0, 0, 0, 0], 0x0609_0011),
        ([0x40, 0x10, 0x2A, 3, 0, 0, 0, 0], 0x0609_0011),
    ] {
        let mut expected = vec![0x80, request[1], request[2], request[3]];
        expected.extend(code.to_le_bytes());
        let answer = of(&mut master, 0x601, &request);
        assert_eq!(answer, [(0x581, expected)], "{request:02X?}");
    }
    // Three bytes name no object, and an abort of the client has no answer.
    for request in [&[0x40, 0x7A, 0x60][..], &[], &[0x80, 0, 0, 0, 0, 0, 0, 0]] {
        assert_eq!(of(&mut master, 0x601, request), [], "{request:02X?}");
    }
}
