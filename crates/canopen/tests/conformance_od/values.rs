//! Types, ranges and defaults.

use canopen::{Abort, Address, DataType, Default, Row};

use crate::harness::{Bench, FULL, ID, Streams};
use crate::master::{Master, initiate, number};

/// The rows whose objects can be read and written by anybody, without rules of their own.
fn plain_rows() -> impl Iterator<Item = &'static Row> {
    FULL.table
        .rows()
        .iter()
        .filter(|row| row.address.index >= 0x2000 && row.readable() && row.writable())
        .filter(|row| row.data_type != DataType::Domain)
}

fn type_of(object: Address) -> DataType {
    let entry = FULL.table.find(object.index, object.sub);
    entry.expect("an object").field.data_type()
}

/// Writes by whatever transfer the size asks for.
fn write(master: &mut Master, object: Address, value: &[u8]) -> Result<(), u32> {
    if !matches!(value.len(), 1..=4) {
        return master.download(object, value, true);
    }
    let mut data = [0; 4];
    data[..value.len()].copy_from_slice(value);
    let command = 0x23 | (4 - value.len() as u8) << 2;
    let answer = master.ask(&initiate(command, object, u32::from_le_bytes(data)));
    match answer[0] {
        0x60 => Ok(()),
        0x80 => Err(number(answer)),
        other => panic!("{other:02X}"),
    }
}

pub(crate) fn every_type() {
    let values: &[(u8, DataType, &[&[u8]])] = &[
        (1, DataType::U8, &[&[0], &[0x7F], &[0x80], &[0xFF]]),
        (2, DataType::U16, &[&[0x34, 0x12], &[0xFF, 0xFF]]),
        (3, DataType::U32, &[&[0x78, 0x56, 0x34, 0x12], &[0xFF; 4]]),
        (4, DataType::I8, &[&[0x80], &[0xFF], &[0x7F]]),
        (5, DataType::I16, &[&[0x00, 0x80], &[0xFE, 0xFF]]),
        (
            6,
            DataType::I32,
            &[&[0, 0, 0, 0x80], &[0xFE, 0xFF, 0xFF, 0xFF]],
        ),
        (
            7,
            DataType::F32,
            &[&[0, 0, 0x80, 0x3F], &[0, 0, 0xC0, 0xFF]],
        ),
        (8, DataType::Bool, &[&[1], &[0]]),
        (
            9,
            DataType::I64,
            &[&[0, 0, 0, 0, 0, 0, 0, 0x80], &[0xFE; 8]],
        ),
        (10, DataType::U64, &[&[1, 2, 3, 4, 5, 6, 7, 8], &[0xFF; 8]]),
        (
            11,
            DataType::F64,
            &[&[0, 0, 0, 0, 0, 0, 0xF0, 0x3F], &[0xFF; 8]],
        ),
    ];
    let mut master = Master::new();
    for (sub, data_type, values) in values {
        let object = Address::new(0x2000, *sub);
        assert_eq!(type_of(object), *data_type);
        for value in *values {
            assert_eq!(write(&mut master, object, value), Ok(()), "{object}");
            assert_eq!(master.upload(object), Ok(value.to_vec()), "{object}");
        }
    }
}

/// CiA 301 table 44.
pub(crate) fn codes_of_types() {
    for (data_type, code) in [
        (DataType::Bool, 0x0001),
        (DataType::I8, 0x0002),
        (DataType::I16, 0x0003),
        (DataType::I32, 0x0004),
        (DataType::U8, 0x0005),
        (DataType::U16, 0x0006),
        (DataType::U32, 0x0007),
        (DataType::F32, 0x0008),
        (DataType::Text, 0x0009),
        (DataType::Bytes, 0x000A),
        (DataType::Domain, 0x000F),
        (DataType::F64, 0x0011),
        (DataType::I64, 0x0015),
        (DataType::U64, 0x001B),
    ] {
        assert_eq!(data_type.code(), code, "{}", data_type.name());
    }
}

pub(crate) fn low_byte_first() {
    let mut master = Master::new();
    let wide = Address::new(0x2018, 0);
    let value = 0x0123_4567_89AB_CDEF_u64.to_le_bytes();
    assert_eq!(master.upload(wide), Ok(value.to_vec()));
    master.play(
        "> 40 03 20 00 00 00 00 00
         < 43 03 20 00 0D F0 FE CA",
    );
    // What a C program of the device would call the same.
    let target = crate::harness::full::OBJECTS_CONST.handle::<u32>(0x2007, 0);
    let object = Address::new(0x2007, 0);
    assert_eq!(
        write(&mut master, object, &[0x78, 0x56, 0x34, 0x12]),
        Ok(())
    );
    assert_eq!(master.bench.node.image().get(target), 0x1234_5678);
}

pub(crate) fn booleans() {
    for sub in 1..=64 {
        let mut master = Master::new();
        let switch = Address::new(0x2030, sub);
        for (value, code) in [
            (1, None),
            (0, None),
            (2, Some(0x0609_0031)),
            (255, Some(0x0609_0031)),
        ] {
            assert_eq!(write(&mut master, switch, &[value]).err(), code);
        }
        assert_eq!(master.upload(switch), Ok(vec![0]));
    }
}

/// A value of each type: the smallest and the greatest that the range allows, and the next ones.
type Range = (u8, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>);

fn ranges() -> Vec<Range> {
    fn of<const N: usize>(sub: u8, values: [[u8; N]; 4]) -> Range {
        let [below, low, high, above] = values.map(|value| value.to_vec());
        (sub, below, low, high, above)
    }
    vec![
        of(1, [-11_i16, -10, 10, 11].map(i16::to_le_bytes)),
        of(2, [4_u16, 5, 100, 101].map(u16::to_le_bytes)),
        of(3, [-1.000_1_f32, -1.0, 1.0, 1.000_1].map(f32::to_le_bytes)),
        of(4, [-4_i8, -3, 3, 4].map(i8::to_le_bytes)),
        of(5, [0_u8, 1, 9, 10].map(u8::to_le_bytes)),
        of(
            6,
            [-100_001, -100_000, 100_000, 100_001].map(i32::to_le_bytes),
        ),
        of(
            7,
            [0, 1, 0x8000_0000_u32, 0x8000_0001].map(u32::to_le_bytes),
        ),
        of(
            8,
            [
                -0x1_0000_0001,
                -0x1_0000_0000,
                0x1_0000_0000,
                0x1_0000_0001_i64,
            ]
            .map(i64::to_le_bytes),
        ),
        of(
            9,
            [0, 1, 0x1_0000_0000, 0x1_0000_0001_u64].map(u64::to_le_bytes),
        ),
        of(
            10,
            [-1.000_000_000_1, -1.0, 1.0, 1.000_000_000_1_f64].map(f64::to_le_bytes),
        ),
    ]
}

pub(crate) fn both_bounds_of_every_type() {
    for (sub, below, low, high, above) in ranges() {
        let mut master = Master::new();
        let object = Address::new(0x2004, sub);
        for value in [low.clone(), high.clone()] {
            assert_eq!(write(&mut master, object, &value), Ok(()), "{object}");
            assert_eq!(master.upload(object), Ok(value));
        }
        assert_eq!(
            write(&mut master, object, &below),
            Err(0x0609_0032),
            "{object}"
        );
        assert_eq!(
            write(&mut master, object, &above),
            Err(0x0609_0031),
            "{object}"
        );
        assert_eq!(master.upload(object), Ok(high), "{object} is as it was");
    }
}

/// The extremes of each type lie beyond every range, on the right side.
pub(crate) fn extremes_of_every_type() {
    let high: &[(u8, &[u8])] = &[
        (1, &i16::MAX.to_le_bytes()),
        (2, &u16::MAX.to_le_bytes()),
        (3, &f32::INFINITY.to_le_bytes()),
        (4, &i8::MAX.to_le_bytes()),
        (5, &u8::MAX.to_le_bytes()),
        (6, &i32::MAX.to_le_bytes()),
        (7, &u32::MAX.to_le_bytes()),
        (8, &i64::MAX.to_le_bytes()),
        (9, &u64::MAX.to_le_bytes()),
        (9, &(1_u64 << 63).to_le_bytes()),
        (10, &f64::INFINITY.to_le_bytes()),
    ];
    let low: &[(u8, &[u8])] = &[
        (1, &i16::MIN.to_le_bytes()),
        (3, &f32::NEG_INFINITY.to_le_bytes()),
        (4, &i8::MIN.to_le_bytes()),
        (6, &i32::MIN.to_le_bytes()),
        (8, &i64::MIN.to_le_bytes()),
        (10, &f64::NEG_INFINITY.to_le_bytes()),
    ];
    let mut master = Master::new();
    for (values, code) in [(high, 0x0609_0031), (low, 0x0609_0032)] {
        for (sub, value) in values {
            let object = Address::new(0x2004, *sub);
            assert_eq!(write(&mut master, object, value), Err(code), "{object}");
        }
    }
    for value in [f32::NAN, -f32::NAN] {
        let object = Address::new(0x2004, 3);
        assert_eq!(
            write(&mut master, object, &value.to_le_bytes()),
            Err(0x0609_0030)
        );
    }
    let object = Address::new(0x2004, 10);
    assert_eq!(
        write(&mut master, object, &f64::NAN.to_le_bytes()),
        Err(0x0609_0030)
    );
}

/// The bounds of a range are exact, also where a REAL32 has no such number, and up to those of
/// 64 bits.
pub(crate) fn exact_bounds() {
    use canopen::row::{f32, f64, i64, u32, u64};
    use canopen::{Device, Dialect, Dictionary, dictionary};
    const LARGE: i64 = 16_777_219;
    const PARTS: &[&[Row]] = &[&[
        f32(0x2000, 1, "REAL32").rw().range(-LARGE, LARGE),
        f64(0x2000, 2, "REAL64").rw().range(-LARGE, LARGE),
        u64(0x2000, 3, "UNSIGNED64").rw().range(0, i64::MAX),
        i64(0x2000, 4, "INTEGER64").rw().range(-i64::MAX, i64::MAX),
        u32(0x2001, 0, "UNSIGNED32").rw(),
    ]];
    static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);
    static DEVICE: Device = Device::new(&OBJECTS, Dialect::STANDARD);
    let mut master = Master::of(&DEVICE, Streams::default());
    let cases: &[(u8, &[u8], Result<(), u32>)] = &[
        // The next REAL32 after 16777218 is 16777220.
        (1, &16_777_218_f32.to_le_bytes(), Ok(())),
        (1, &16_777_220_f32.to_le_bytes(), Err(0x0609_0031)),
        (1, &(-16_777_220_f32).to_le_bytes(), Err(0x0609_0032)),
        (2, &16_777_219_f64.to_le_bytes(), Ok(())),
        (2, &16_777_219.5_f64.to_le_bytes(), Err(0x0609_0031)),
        (3, &(i64::MAX as u64).to_le_bytes(), Ok(())),
        (3, &(1_u64 << 63).to_le_bytes(), Err(0x0609_0031)),
        (3, &u64::MAX.to_le_bytes(), Err(0x0609_0031)),
        (4, &i64::MAX.to_le_bytes(), Ok(())),
        (4, &i64::MIN.to_le_bytes(), Err(0x0609_0032)),
    ];
    for (sub, value, expected) in cases {
        let written = write(&mut master, Address::new(0x2000, *sub), value);
        assert_eq!(written, *expected, "{sub}, {value:02X?}");
    }
}

pub(crate) fn defaults() {
    let mut bench = Bench::unstarted_with(&FULL, Streams::default());
    for row in FULL.table.rows() {
        for step in 0..row.count {
            let sub = row.address.sub + step;
            let entry = FULL.table.find(row.address.index, sub).expect("a row");
            let image = bench.node.image();
            let expected = match row.default {
                Default::Value(value) => value,
                Default::Real(value) => value as i64,
                Default::PlusNode(base) => i64::from(base) + i64::from(ID),
                Default::Text(text) if row.length > 0 => {
                    let mut padded = text.as_bytes().to_vec();
                    padded.resize(usize::from(row.length), 0);
                    assert_eq!(image.bytes(entry.field), padded);
                    continue;
                }
                Default::Text(_) => continue,
            };
            let value = image.number(entry.field);
            assert_eq!(value, expected, "{:04X},{sub}", row.address.index);
        }
    }
    let mut master = Master::new();
    for (index, sub, value) in [
        (0x1005, 0, 0x80),
        (0x1012, 0, 0x100),
        (0x1014, 0, 0x85),
        (0x1400, 1, 0x205),
        (0x1403, 1, 0x505),
        (0x1800, 1, 0x185),
        (0x1803, 1, 0x485),
    ] {
        let answer = master.ask(&initiate(0x40, Address::new(index, sub), 0));
        assert_eq!(number(answer), value, "{index:04X}");
    }
}

/// A write changes its object's bytes, and no others.
pub(crate) fn nothing_else_changes() {
    for row in plain_rows().filter(|row| row.minimum.is_none()) {
        let mut master = Master::new();
        let object = row.address;
        let before = master.bench.node.bytes().to_vec();
        let field = FULL.table.find(object.index, object.sub).expect("it").field;
        let value = vec![0x55; usize::from(field.size())];
        assert_eq!(write(&mut master, object, &value), Ok(()), "{object}");
        let after = master.bench.node.bytes().to_vec();
        // Behind the values lies the room in which texts are gathered.
        let values = before.len() - 255;
        let changed: Vec<usize> = (0..values).filter(|at| before[*at] != after[*at]).collect();
        assert_eq!(changed.len(), value.len(), "{object}");
        let at = changed[0];
        assert_eq!(changed, (at..at + value.len()).collect::<Vec<_>>());
        assert_eq!(after[at..at + value.len()], value, "{object}");
    }
}

pub(crate) fn texts() {
    let mut master = Master::new();
    let text = Address::new(0x2010, 1);
    assert_eq!(master.upload(text), Ok(vec![]));
    for value in [
        &b"a"[..],
        b"ab",
        b"exactly thirty-two characters..",
        b"32 characters, not one of them 0",
        b"",
    ] {
        assert_eq!(write(&mut master, text, value), Ok(()));
        assert_eq!(master.upload(text), Ok(value.to_vec()));
    }
    assert_eq!(write(&mut master, text, &[b'x'; 33]), Err(0x0607_0012));
    // A text ends at its first 0.
    assert_eq!(write(&mut master, text, b"one\0two"), Ok(()));
    assert_eq!(master.upload(text), Ok(b"one".to_vec()));
}

pub(crate) fn octets() {
    let mut master = Master::new();
    let octets = Address::new(0x2011, 1);
    assert_eq!(master.upload(octets), Ok(vec![0; 20]));
    let mut value: Vec<u8> = (0..20).collect();
    assert_eq!(write(&mut master, octets, &value), Ok(()));
    assert_eq!(master.upload(octets), Ok(value.clone()), "zeros and all");
    assert_eq!(write(&mut master, octets, &value[..19]), Err(0x0607_0013));
    value.push(0);
    assert_eq!(write(&mut master, octets, &value), Err(0x0607_0012));
    assert_eq!(Abort::TOO_LONG.0, 0x0607_0012);
}
