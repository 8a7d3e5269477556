//! What a PDO may carry and how it is mapped anew (CiA 301 7.2.2, 7.5.2.36, 7.5.2.38).

use crate::harness::stand::{OFF, Stand};

const UNSUPPORTED: u32 = 0x0601_0000;
const NO_OBJECT: u32 = 0x0602_0000;
const NO_SUB_INDEX: u32 = 0x0609_0011;
const NOT_MAPPABLE: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;
const U8: u32 = 0x2000_0108;

/// Communication parameter indices of all PDOs, receive first.
pub(crate) const PDOS: [u16; 8] = [
    0x1400, 0x1401, 0x1402, 0x1403, 0x1800, 0x1801, 0x1802, 0x1803,
];

/// A node with the PDO whose parameters are at `index` off and its count 0.
fn open(index: u16) -> Stand {
    let mut stand = Stand::new();
    stand.map_off(index, 255, &[]);
    stand
}

/// What writing `entries` and then their number gives, and that a refusal changes nothing.
fn attempt(index: u16, entries: &[u32], count: u32) -> Result<(), u32> {
    let mut stand = open(index);
    for (entry, sub) in entries.iter().zip(1..) {
        let written = stand.write(index + 0x200, sub, *entry);
        let kept = if written.is_ok() { *entry } else { 0 };
        assert_eq!(stand.read(index + 0x200, sub), Ok(kept));
        written?;
    }
    let written = stand.write(index + 0x200, 0, count);
    let kept = if written.is_ok() { count } else { 0 };
    assert_eq!(stand.read(index + 0x200, 0), Ok(kept));
    written
}

/// Numbers that look like chance (Marsaglia's xorshift), the same in every run.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}

/// Objects of every width that take every value: index, sub-index, bits.
const OBJECTS: [(u16, u8, u32); 12] = [
    (0x2000, 1, 8),
    (0x2000, 2, 16),
    (0x2000, 3, 32),
    (0x2000, 4, 8),
    (0x2000, 5, 16),
    (0x2000, 6, 32),
    (0x2000, 7, 32),
    (0x2000, 8, 1),
    (0x2000, 9, 64),
    (0x2000, 10, 64),
    (0x2000, 11, 64),
    (0x2007, 0, 32),
];

/// The `n`th object to map: the switches 0x2030,1 to 64, then [`OBJECTS`].
fn object(n: u64) -> (u16, u8, u32) {
    match n % 76 {
        switch @ 0..64 => (0x2030, switch as u8 + 1, 1),
        other => OBJECTS[other as usize - 64],
    }
}

fn entry((index, sub, bits): (u16, u8, u32)) -> u32 {
    u32::from(index) << 16 | u32::from(sub) << 8 | bits
}

/// The frame of objects and their values, bit by bit: the first object's lowest bit is bit 0 of
/// byte 0.
fn bit_by_bit(objects: &[(u16, u8, u32)], values: &[u64]) -> Vec<u8> {
    let mut bits = Vec::new();
    for ((_, _, width), value) in objects.iter().zip(values) {
        bits.extend((0..*width).map(|bit| value >> bit & 1 != 0));
    }
    let mut bytes = vec![0u8; bits.len().div_ceil(8)];
    for (at, bit) in bits.iter().enumerate() {
        bytes[at / 8] |= u8::from(*bit) << (at % 8);
    }
    bytes
}

/// Both ways of one list of objects with random values, against the naive model.
fn both_ways(objects: &[(u16, u8, u32)], chance: &mut Chance) {
    let entries: Vec<u32> = objects.iter().copied().map(entry).collect();
    let mut stand = Stand::operational();
    stand.map(0x1400, 0x205, 255, &entries);
    stand.map(0x1803, 0x485, 1, &entries);
    for _ in 0..3 {
        // An object that is mapped twice has one value.
        let mut values: Vec<u64> = Vec::new();
        for (n, object) in objects.iter().enumerate() {
            let twin = objects[..n].iter().position(|other| other == object);
            let random = chance.next() & u64::MAX >> (64 - object.2);
            values.push(twin.map_or(random, |twin| values[twin]));
        }
        let data = bit_by_bit(objects, &values);
        assert_eq!(stand.send(0x205, &data), []);
        for ((index, sub, bits), value) in objects.iter().zip(&values) {
            let got = stand.get(*index, *sub);
            assert_eq!(
                got, *value,
                "0x{index:04X},{sub} of {bits} bits in {data:02X?}"
            );
        }
        assert_eq!(stand.sync(), [(0x485, data)]);
    }
}

pub(crate) fn single_bits() {
    let mut chance = Chance(1);
    for count in 1..=64 {
        let switches: Vec<_> = (0..count).map(object).collect();
        both_ways(&switches, &mut chance);
    }
}

pub(crate) fn wide_objects() {
    let mut chance = Chance(2);
    for sub in 9..=11 {
        both_ways(&[(0x2000, sub, 64)], &mut chance);
    }
}

pub(crate) fn more_than_four() {
    let mut chance = Chance(3);
    let run = |count: u8| -> Vec<_> { (1..=count).map(|sub| (0x200A, sub, 8)).collect() };
    for count in 1..=8 {
        both_ways(&run(count), &mut chance);
    }
}

pub(crate) fn across_bytes() {
    let mut chance = Chance(4);
    for shift in 1..=32 {
        let mut objects: Vec<_> = (0..shift).map(object).collect();
        objects.push((0x2000, 6, 32));
        both_ways(&objects, &mut chance);
    }
}

pub(crate) fn any_mixture() {
    let mut chance = Chance(5);
    for _ in 0..300 {
        let (mut objects, mut room) = (Vec::new(), 64);
        for _ in 0..80 {
            let object = object(chance.next() >> 20);
            if object.2 <= room && !chance.next().is_multiple_of(8) {
                room -= object.2;
                objects.push(object);
            }
        }
        both_ways(&objects, &mut chance);
    }
}

pub(crate) fn valid_bit_first() {
    for index in PDOS {
        let mut stand = Stand::new();
        let cob_id = stand.read(index, 1).expect("a COB-ID");
        for (sub, value) in [(0, 0), (0, 1), (1, U8), (1, 0), (64, U8)] {
            assert_eq!(stand.write(index + 0x200, sub, value), Err(UNSUPPORTED));
        }
        stand.must(index, 1, cob_id | OFF);
        assert_eq!(stand.write(index + 0x200, 1, U8), Ok(()));
        assert_eq!(stand.write(index + 0x200, 0, 1), Ok(()));
    }
}

pub(crate) fn count_zero_first() {
    for index in PDOS {
        let mut stand = open(index);
        stand.must(index + 0x200, 1, U8);
        stand.must(index + 0x200, 0, 1);
        for sub in [1, 2, 64] {
            assert_eq!(stand.write(index + 0x200, sub, U8), Err(UNSUPPORTED));
        }
        stand.must(index + 0x200, 0, 0);
        assert_eq!(stand.write(index + 0x200, 2, U8), Ok(()));
        assert_eq!(
            stand.read(index + 0x200, 1),
            Ok(U8),
            "what was not written stays"
        );
    }
}

pub(crate) fn existing() {
    for index in PDOS {
        for (entry, abort) in [
            (0x2FFF_0008, NO_OBJECT),
            (0x0008_0008, NO_OBJECT),
            (0x1401_0020, NOT_MAPPABLE),
            (0x2000_0C08, NO_SUB_INDEX),
            (0x2001_0110, NO_SUB_INDEX),
            (0x2030_4101, NO_SUB_INDEX),
        ] {
            assert_eq!(attempt(index, &[entry], 1), Err(abort), "{entry:08X}");
        }
    }
}

pub(crate) fn mappable() {
    for index in PDOS {
        let receive = index < 0x1800;
        for (entry, may_receive, may_transmit) in [
            (0x2001_0010, false, true),
            (0x2002_0010, true, false),
            (0x2003_0020, false, false),
            (0x2008_0020, false, true),
            (0x200B_0008, false, false),
            (0x1001_0008, false, true),
            (0x1017_0010, false, false),
            (0x2010_0120, false, false),
            (0x2010_0100, false, false),
            (0x2020_0000, false, false),
            (0x0001_0001, true, false),
            (0x0005_0008, true, false),
            (0x001B_0040, true, false),
            (0x2016_0040, false, true),
            (0x2017_0040, true, false),
        ] {
            let may = if receive { may_receive } else { may_transmit };
            let expected = if may { Ok(()) } else { Err(NOT_MAPPABLE) };
            assert_eq!(
                attempt(index, &[entry], 1),
                expected,
                "{entry:08X} at {index:04X}"
            );
        }
    }
}

pub(crate) fn exact_length() {
    for index in [0x1400, 0x1800] {
        for object in OBJECTS {
            for bits in 0..=255 {
                let wrong = entry((object.0, object.1, bits));
                let expected = if bits == object.2 {
                    Ok(())
                } else {
                    Err(NOT_MAPPABLE)
                };
                assert_eq!(attempt(index, &[wrong], 1), expected, "{wrong:08X}");
            }
        }
    }
}

pub(crate) fn at_most_64_bits() {
    let (wide, half, byte, switch) = (0x2000_0940, 0x2000_0320, U8, 0x2030_0101);
    for index in [0x1402, 0x1802] {
        for (entries, fits) in [
            (vec![wide], true),
            (vec![wide, switch], false),
            (vec![half, half], true),
            (vec![half; 3], false),
            (vec![half, half, byte], false),
            (vec![byte; 8], true),
            (vec![byte; 9], false),
            (vec![switch; 64], true),
            ([vec![switch; 57], vec![byte]].concat(), false),
            ([vec![switch; 56], vec![byte]].concat(), true),
        ] {
            let count = entries.len() as u32;
            let expected = if fits { Ok(()) } else { Err(TOO_LONG) };
            assert_eq!(attempt(index, &entries, count), expected, "{entries:08X?}");
        }
    }
}

pub(crate) fn at_most_64_entries() {
    for index in PDOS {
        for count in 65..=255 {
            assert_eq!(attempt(index, &[0x2030_0101; 64], count), Err(TOO_LONG));
        }
    }
}

pub(crate) fn unused_entries() {
    for index in PDOS {
        // Past the count anything that may be written stands there; 0 marks an unused entry.
        let half = 0x2000_0320;
        assert_eq!(attempt(index, &[half, half, half, 0], 2), Ok(()));
        assert_eq!(attempt(index, &[half, 0], 2), Err(NO_OBJECT));
        assert_eq!(attempt(index, &[], 1), Err(NO_OBJECT));
    }
}

pub(crate) fn refused_count() {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 1, &[U8]);
    stand.must(0x1800, 1, 0x185 | OFF);
    for (count, abort) in [(2, NO_OBJECT), (65, TOO_LONG), (255, TOO_LONG)] {
        assert_eq!(stand.write(0x1A00, 0, count), Err(abort));
    }
    assert_eq!(stand.read(0x1A00, 0), Ok(1));
    stand.must(0x1800, 1, 0x185);
    assert_eq!(stand.sync(), [(0x185, vec![0])]);
}

pub(crate) fn disabled() {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 1, &[U8]);
    stand.map(0x1400, 0x205, 255, &[U8]);
    for (index, cob_id) in [(0x1800, 0x185), (0x1400, 0x205)] {
        stand.must(index, 1, cob_id | OFF);
        stand.must(index + 0x200, 0, 0);
        stand.must(index, 1, cob_id);
    }
    assert_eq!(stand.sync(), []);
    stand.send(0x205, &[7]);
    assert_eq!(stand.get(0x2000, 1), 0);
    // The entries are still there.
    for (index, cob_id) in [(0x1800, 0x185), (0x1400, 0x205)] {
        stand.must(index, 1, cob_id | OFF);
        stand.must(index + 0x200, 0, 1);
        stand.must(index, 1, cob_id);
    }
    stand.send(0x205, &[7]);
    assert_eq!(stand.sync(), [(0x185, vec![7])]);
}

pub(crate) fn whole_procedure() {
    // In operational, from one mapping to another and back, each of the other PDOs unmoved.
    let mut stand = Stand::operational();
    stand.map(0x1801, 0x285, 1, &[0x2001_0010]);
    for round in 0..3u8 {
        stand.map(0x1800, 0x185, 1, &[U8]);
        stand.set(0x2000, 1, round.into());
        assert_eq!(
            stand.sync(),
            [(0x185, vec![round]), (0x285, vec![0x34, 0x12])]
        );
        stand.map(0x1800, 0x1A5, 1, &[0x2000_0210, U8]);
        assert_eq!(
            stand.sync(),
            [(0x1A5, vec![0, 0, round]), (0x285, vec![0x34, 0x12])]
        );
    }
}
