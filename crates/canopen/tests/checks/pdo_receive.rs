//! What becomes of a received PDO, and when (CiA 301 7.2.2, 7.5.2.35).

use canopen::{Abort, CommunicationErrors, News, Verdict};

use crate::harness::stand::{OFF, Stand, WIDE};

const U8: u32 = 0x2000_0108;
const U16: u32 = 0x2000_0210;
const TOO_SHORT: CommunicationErrors = CommunicationErrors::RPDO_TOO_SHORT;
const TOO_LONG: CommunicationErrors = CommunicationErrors::RPDO_TOO_LONG;
const TIMEOUT: CommunicationErrors = CommunicationErrors::RPDO_TIMEOUT;
const NOTHING: CommunicationErrors = CommunicationErrors::NOTHING;

/// An operational node whose first RPDO, 0x205, has a type and carries `entries`.
fn with(transmission_type: u8, entries: &[u32]) -> Stand {
    let mut stand = Stand::operational();
    stand.map(0x1400, 0x205, transmission_type, entries);
    stand
}

pub(crate) fn event_driven() {
    for transmission_type in [254, 255] {
        let mut stand = with(transmission_type, &[U16, U8]);
        assert_eq!(stand.send(0x205, &[0x34, 0x12, 0x56]), []);
        assert_eq!((stand.get(0x2000, 2), stand.get(0x2000, 1)), (0x1234, 0x56));
        stand.set(0x2000, 1, 0);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), 0, "a SYNC does not apply it again");
    }
}

pub(crate) fn synchronous() {
    for transmission_type in 0..=240 {
        let mut stand = with(transmission_type, &[U8]);
        stand.sync();
        stand.send(0x205, &[7]);
        stand.wait_ms(100);
        assert_eq!(stand.get(0x2000, 1), 0, "type {transmission_type} waits");
        stand.sync();
        assert_eq!(
            stand.get(0x2000, 1),
            7,
            "type {transmission_type}: the next SYNC"
        );
        stand.set(0x2000, 1, 0);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), 0, "once");
    }
}

pub(crate) fn last_counts() {
    let mut stand = with(1, &[U8]);
    for value in 1..=5 {
        stand.send(0x205, &[value]);
    }
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 5);
}

pub(crate) fn operational_only() {
    for transmission_type in [0, 1, 254, 255] {
        for command in [0x80, 0x02] {
            let mut stand = with(transmission_type, &[U8]);
            stand.nmt(command);
            stand.send(0x205, &[7]);
            stand.sync();
            stand.send(0x205, &[7, 7, 7]);
            assert_eq!(stand.get(0x2000, 1), 0);
            assert_eq!(stand.node.errors(), NOTHING);
            stand.nmt(0x01);
            stand.sync();
            assert_eq!(stand.get(0x2000, 1), 0, "nor later");
        }
    }
}

pub(crate) fn forgotten() {
    for command in [0x80, 0x02] {
        let mut stand = with(1, &[U8]);
        stand.send(0x205, &[7]);
        stand.nmt(command);
        stand.nmt(0x01);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), 0);
    }
}

pub(crate) fn too_short() {
    for transmission_type in [1, 255] {
        let mut stand = with(transmission_type, &[U16, U8]);
        for length in 0..3 {
            stand.fresh().send(0x205, &[9, 9, 9][..length]);
            stand.sync();
            assert_eq!((stand.get(0x2000, 2), stand.get(0x2000, 1)), (0, 0));
            assert_eq!(stand.node.errors(), TOO_SHORT);
            assert_eq!(stand.told(News::ERRORS), length == 0, "told once");
        }
        stand.fresh().send(0x205, &[1, 2, 3]);
        assert_eq!(stand.node.errors(), NOTHING);
        assert!(stand.told(News::ERRORS));
        stand.sync();
        assert_eq!(stand.get(0x2000, 2), 0x0201);
    }
}

pub(crate) fn too_long() {
    for transmission_type in [1, 255] {
        let mut stand = with(transmission_type, &[U16, U8]);
        for length in 4..=8u8 {
            let data = [length, 2, 3, 4, 5, 6, 7, 8];
            stand.fresh().send(0x205, &data[..usize::from(length)]);
            stand.sync();
            assert_eq!(stand.get(0x2000, 2), 0x0200 | u64::from(length));
            assert_eq!(stand.get(0x2000, 1), 3);
            assert_eq!(stand.node.errors(), TOO_LONG);
            assert_eq!(stand.told(News::ERRORS), length == 4);
        }
        stand.send(0x205, &[1, 2, 3]);
        assert_eq!(stand.node.errors(), NOTHING);
    }
}

pub(crate) fn length_in_bits() {
    let switches: Vec<u32> = (1..=9).map(|sub| 0x2030_0001 | sub << 8).collect();
    let mut stand = with(255, &switches);
    stand.send(0x205, &[0xFF]);
    assert_eq!((stand.node.errors(), stand.get(0x2030, 1)), (TOO_SHORT, 0));
    stand.send(0x205, &[0x01, 0xFF]);
    assert_eq!(
        stand.node.errors(),
        NOTHING,
        "the bits past the mapping are nobody's"
    );
    let on: Vec<u8> = (1..=64)
        .filter(|sub| stand.get(0x2030, *sub) != 0)
        .collect();
    assert_eq!(on, [1, 9]);
    stand.send(0x205, &[0, 0, 0]);
    assert_eq!(stand.node.errors(), TOO_LONG);
}

pub(crate) fn no_mapping() {
    for length in [0, 1, 8] {
        let mut stand = with(255, &[]);
        let before = stand.node.bytes().to_vec();
        stand.send(0x205, &[1; 8][..length]);
        assert_eq!(
            (stand.node.errors(), stand.node.bytes()),
            (NOTHING, &before[..])
        );
    }
}

pub(crate) fn each_pdo_its_error() {
    let mut stand = with(255, &[U16]);
    stand.map(0x1401, 0x305, 255, &[U8]);
    stand.send(0x205, &[1]);
    stand.send(0x305, &[1, 2]);
    let errors = stand.node.errors();
    assert!(errors.has(TOO_SHORT) && errors.has(TOO_LONG));
    stand.send(0x305, &[1]);
    assert_eq!(stand.node.errors(), TOO_SHORT, "the other's stays");
}

pub(crate) fn errors_go_with_the_pdo() {
    for (frame, error) in [(&[1u8][..], TOO_SHORT), (&[1, 2, 3], TOO_LONG)] {
        let mut stand = with(255, &[U16]);
        stand.send(0x205, frame);
        assert_eq!(stand.node.errors(), error);
        stand.fresh().must(0x1400, 1, 0x205 | OFF);
        assert_eq!(stand.node.errors(), NOTHING);
        assert!(stand.told(News::ERRORS));
        let mut stand = with(255, &[U16]);
        stand.send(0x205, frame);
        stand.fresh().nmt(0x80);
        assert_eq!(stand.node.errors(), NOTHING);
        assert!(stand.told(News::ERRORS));
    }
}

pub(crate) fn deadline() {
    for transmission_type in [0, 1, 240, 254, 255] {
        let mut stand = with(transmission_type, &[U8]);
        stand.must(0x1400, 5, 10);
        stand.fresh().wait_ms(1000);
        assert_eq!(
            stand.node.errors(),
            NOTHING,
            "it begins with the first reception"
        );
        for _ in 0..3 {
            stand.send(0x205, &[1]);
            stand.wait_us(9_999);
            assert_eq!(stand.node.errors(), NOTHING);
        }
        stand.fresh().wait_us(1);
        assert_eq!(stand.node.errors(), TIMEOUT);
        assert!(stand.told(News::ERRORS));
        stand.fresh().wait_ms(1000);
        assert!(!stand.told(News::ERRORS), "told once");
        stand.fresh().send(0x205, &[1]);
        assert_eq!(stand.node.errors(), NOTHING);
        assert!(stand.told(News::ERRORS));
        stand.wait_ms(10);
        assert_eq!(stand.node.errors(), TIMEOUT, "and begins again");
    }
}

pub(crate) fn deadline_exactly() {
    for ms in [1u32, 65_535] {
        let mut stand = with(255, &[U8]);
        stand.must(0x1400, 5, ms);
        stand.send(0x205, &[1]);
        assert_eq!(stand.node.next_deadline(), stand.now.plus_ms(ms.into()));
        stand.wait_us(1000 * u64::from(ms) - 1);
        assert_eq!(stand.node.errors(), NOTHING);
        stand.wait_us(1);
        assert_eq!(stand.node.errors(), TIMEOUT);
    }
    let mut stand = with(255, &[U8]);
    stand.send(0x205, &[1]);
    stand.wait_ms(1_000_000);
    assert_eq!(stand.node.errors(), NOTHING, "0 is none");
}

pub(crate) fn deadline_ends() {
    for end in [
        (|stand: &mut Stand| stand.nmt(0x80)) as fn(&mut Stand),
        |stand| stand.must(0x1400, 5, 0),
        |stand| stand.must(0x1400, 1, 0x205 | OFF),
    ] {
        for late in [false, true] {
            let mut stand = with(255, &[U8]);
            stand.must(0x1400, 5, 10);
            stand.send(0x205, &[1]);
            stand.wait_ms(if late { 20 } else { 5 });
            end(&mut stand);
            stand.wait_ms(100);
            assert_eq!(stand.node.errors(), NOTHING);
        }
    }
}

pub(crate) fn deadline_leaves_data() {
    let mut stand = with(1, &[U8]);
    stand.send(0x205, &[7]);
    stand.must(0x1400, 5, 10);
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 7);
}

pub(crate) fn identifier() {
    let mut stand = with(255, &[U8]);
    stand.send(0x205 | WIDE, &[1]);
    stand.request(0x205, 1);
    stand.send(0x206, &[1]);
    assert_eq!(stand.get(0x2000, 1), 0);
    for id in [0, 0x205, 0x1FFF_FFFF] {
        stand.map(0x1400, 0x2000_0000 | id, 255, &[U8]);
        stand.set(0x2000, 1, 0);
        stand.send(id & 0x7FF, &[]);
        stand.request(id | WIDE, 1);
        assert_eq!(stand.get(0x2000, 1), 0);
        stand.send(id | WIDE, &[7]);
        assert_eq!(stand.get(0x2000, 1), 7);
    }
}

pub(crate) fn shared_identifier() {
    let mut stand = with(255, &[U8]);
    stand.map(0x1401, 0x205, 1, &[0x200A_0108]);
    stand.send(0x205, &[7]);
    assert_eq!((stand.get(0x2000, 1), stand.get(0x200A, 1)), (7, 0));
    stand.sync();
    assert_eq!(stand.get(0x200A, 1), 7);
}

pub(crate) fn dummies() {
    // A BOOLEAN is one bit; two of them and six more make the object's byte an uneven one.
    for (dummies, bits) in [
        (&[0x0001_0001u32][..], 1),
        (&[0x0001_0001; 7], 7),
        (&[0x0002_0008], 8),
        (&[0x0003_0010, 0x0001_0001], 17),
        (&[0x0004_0020], 32),
        (&[0x0005_0008, 0x0006_0010, 0x0007_0020], 56),
    ] {
        let mut entries = dummies.to_vec();
        entries.push(U8);
        let mut stand = with(255, &entries);
        let data = 0xA5u64 << bits | (u64::MAX >> 8 >> (56 - bits.min(56)));
        stand.send(0x205, &data.to_le_bytes()[..(bits + 8usize).div_ceil(8)]);
        assert_eq!(stand.get(0x2000, 1), 0xA5, "after {bits} bits");
        assert_eq!(stand.node.errors(), NOTHING);
    }
}

pub(crate) fn refused_alone() {
    for switch in [&[][..], &[0x2030_0101]] {
        // A range, an owner that refuses, and a plain object; as a list of copies and walked.
        let entries = [&[0x2004_0508, 0x2006_0008, U8], switch].concat();
        let mut stand = with(255, &entries);
        stand
            .host
            .verdicts
            .push((0x2006, Verdict::Refuse(Abort::GENERAL)));
        let data = [200, 3, 7, 1];
        stand.send(0x205, &data[..3 + switch.len()]);
        assert_eq!(
            (
                stand.get(0x2004, 5),
                stand.get(0x2006, 0),
                stand.get(0x2000, 1)
            ),
            (1, 0, 7)
        );
        stand.send(0x205, &[9, 3, 8, 1][..3 + switch.len()]);
        assert_eq!((stand.get(0x2004, 5), stand.get(0x2000, 1)), (9, 8));
    }
}

pub(crate) fn applied_before_sampled() {
    for transmission_type in [1, 255] {
        let mut stand = with(transmission_type, &[U8]);
        stand.map(0x1800, 0x185, 1, &[U8]);
        stand.send(0x205, &[7]);
        assert_eq!(stand.sync(), [(0x185, vec![7])]);
    }
}

pub(crate) fn off() {
    let mut stand = with(255, &[U8]);
    stand.must(0x1400, 1, 0x205 | OFF);
    stand.send(0x205, &[7]);
    stand.send(0x205, &[7, 7]);
    assert_eq!((stand.get(0x2000, 1), stand.node.errors()), (0, NOTHING));
}
