//! COB-IDs and transmission types of PDOs (CiA 301 7.5.2.35, 7.5.2.37, 7.3.5).

use crate::harness::devices::BASIC;
use crate::harness::stand::{BIT_29, BIT_30, OFF, Stand};

use super::identifiers::is_restricted;
use super::mapping::PDOS;

const INVALID: u32 = 0x0609_0030;

pub(crate) fn defaults() {
    let mut stand = Stand::new();
    for (index, cob_id) in PDOS
        .iter()
        .zip([0x205, 0x305, 0x405, 0x505, 0x185, 0x285, 0x385, 0x485])
    {
        assert_eq!(stand.read(*index, 1), Ok(cob_id));
    }
}

pub(crate) fn reserved_types() {
    for index in PDOS {
        let mut stand = Stand::new();
        for transmission_type in 0..=255 {
            let expected = match transmission_type {
                241..=251 => Err(INVALID),
                252 | 253 if index < 0x1800 => Err(INVALID),
                _ => Ok(()),
            };
            let before = stand.read(index, 2);
            assert_eq!(stand.write(index, 2, transmission_type), expected);
            let kept = expected.map_or(before, |()| Ok(transmission_type));
            assert_eq!(stand.read(index, 2), kept);
        }
    }
}

pub(crate) fn restricted_identifiers() {
    for index in [0x1400, 0x1803] {
        let mut stand = Stand::new();
        for id in 0..0x800 {
            stand.must(index, 1, OFF);
            let expected = if is_restricted(id) {
                Err(INVALID)
            } else {
                Ok(())
            };
            assert_eq!(stand.write(index, 1, id), expected, "{id:03X}");
        }
    }
}

pub(crate) fn wide_identifiers() {
    for index in PDOS {
        let mut stand = Stand::new();
        // Among 29 bits none is restricted; of eleven bits no other may be set.
        for id in [0, 1, 0x80, 0x601, 0x7FF, 0x800, 0x1555_5555, 0x1FFF_FFFF] {
            stand.must(index, 1, OFF);
            assert_eq!(stand.write(index, 1, id | BIT_29), Ok(()));
            assert_eq!(stand.read(index, 1), Ok(id | BIT_29));
        }
        stand.must(index, 1, OFF);
        for bit in 11..=28 {
            assert_eq!(stand.write(index, 1, 0x285 | 1 << bit), Err(INVALID));
        }
    }
}

pub(crate) fn without_wide_identifiers() {
    for index in PDOS {
        let mut stand = Stand::unstarted(&BASIC);
        stand.start();
        stand.must(index, 1, OFF);
        assert_eq!(stand.write(index, 1, 0x285 | BIT_29), Err(INVALID));
    }
}

pub(crate) fn fixed_while_valid() {
    for index in PDOS {
        let mut stand = Stand::new();
        let own = stand.read(index, 1).expect("a COB-ID");
        assert_eq!(stand.write(index, 1, own), Ok(()), "no change");
        for bit in (0..29).filter(|bit| !is_restricted((own ^ 1 << bit) & 0x7FF)) {
            assert_eq!(
                stand.write(index, 1, own ^ 1 << bit),
                Err(INVALID),
                "bit {bit}"
            );
        }
        assert_eq!(stand.write(index, 1, own ^ BIT_29), Err(INVALID));
        assert_eq!(stand.read(index, 1), Ok(own));
        stand.must(index, 1, own | OFF);
        assert_eq!(stand.write(index, 1, own ^ 1), Ok(()));
        // Of 29 bits, too.
        stand.must(index, 1, OFF);
        stand.must(index, 1, 0x1000_0000 | BIT_29);
        assert_eq!(stand.write(index, 1, 0x1000_0001 | BIT_29), Err(INVALID));
        assert_eq!(stand.write(index, 1, 0x1000_0000 | BIT_29 | BIT_30), Ok(()));
    }
}

pub(crate) fn bit_30_of_a_receive_pdo() {
    let mut stand = Stand::operational();
    stand.map(0x1400, 0x205 | BIT_30, 255, &[0x2000_0108]);
    stand.send(0x205, &[7]);
    assert_eq!(stand.get(0x2000, 1), 7, "it says nothing");
}

pub(crate) fn no_sub_index_4() {
    let mut stand = Stand::new();
    for index in PDOS {
        assert_eq!(stand.read(index, 4), Err(0x0609_0011));
        assert_eq!(stand.write(index, 4, 0), Err(0x0609_0011));
    }
}

pub(crate) fn highest_sub_index() {
    let mut stand = Stand::new();
    for index in PDOS {
        let expected = if index < 0x1800 { 5 } else { 6 };
        assert_eq!(stand.read(index, 0), Ok(expected));
        assert!(stand.write(index, 0, expected).is_err());
    }
}

pub(crate) fn off_takes_effect() {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 1, &[0x2000_0108]);
    stand.map(0x1400, 0x205, 255, &[0x2000_0108]);
    stand.must(0x1800, 1, 0x185 | OFF);
    stand.must(0x1400, 1, 0x205 | OFF);
    assert_eq!(stand.sync(), []);
    stand.send(0x205, &[7]);
    stand.must(0x1800, 1, 0x185);
    stand.must(0x1400, 1, 0x205);
    assert_eq!(stand.sync(), [(0x185, vec![0])]);
    stand.send(0x205, &[8]);
    assert_eq!(stand.sync(), [(0x185, vec![8])]);
}
