//! The P3's dictionary against the tables of its manual, copied by hand: index, sub-indices, type,
//! access.

mod manual;

use canopen::Access;
use manual::{Printed, type_of};
use personalities::p3::{OBJECTS, P3};

/// "Object Dictionary" (l.770-985) and the objects of "Faults and Warnings" (l.990-1020), in the
/// manual's order. An object that the manual lists twice stands here once.
const MANUAL: &str = "
    0002 0 I08 RW   0003 0 I16 RW   0004 0 I32 RW   0005 0 U08 RW   0006 0 U16 RW   0007 0 U32 RW
    1000 0 U32 RO   1001 0 U08 RO   1002 0 U32 RO   1003 0 U08 RO   1003 1-8 U32 RO
    1005 0 U32 RW   1006 0 U32 RO   1008 0 STR RO   1009 0 STR RO
    1010 1 U32 RW   1010 2 U32 RW   1010 3 U32 RW   1010 4 U32 RW   100A 0 STR RO
    1014 0 U32 RW   1015 0 U16 RW   1017 0 U16 RW
    1018 1 U32 RO   1018 2 U32 RO   1018 3 U32 RO   1018 4 U32 RO
    1200 1 U32 RO   1200 2 U32 RO   1F80 0 U32 RW

    1400 1 U32 RW   1401 1 U32 RW   1402 1 U32 RW   1403 1 U32 RW
    1400 2 U08 RW   1401 2 U08 RW   1402 2 U08 RW   1403 2 U08 RW
    1600 0 U08 RW   1601 0 U08 RW   1602 0 U08 RW   1603 0 U08 RW
    1600 1-4 U32 RW 1601 1-4 U32 RW 1602 1-4 U32 RW 1603 1-4 U32 RW
    1800 1 U32 RW   1801 1 U32 RW   1802 1 U32 RW   1803 1 U32 RW
    1800 2 U08 RW   1801 2 U08 RW   1802 2 U08 RW   1803 2 U08 RW
    1800 3 U16 RW   1801 3 U16 RW   1802 3 U16 RW   1803 3 U16 RW
    1800 4 U08 RO   1801 4 U08 RO   1802 4 U08 RO   1803 4 U08 RO
    1800 5 U16 RW   1801 5 U16 RW   1802 5 U16 RW   1803 5 U16 RW
    1A00 0 U08 RW   1A01 0 U08 RW   1A02 0 U08 RW   1A03 0 U08 RW
    1A00 1-4 U32 RW 1A01 1-4 U32 RW 1A02 1-4 U32 RW 1A03 1-4 U32 RW

    6040 0 U16 RW   6041 0 U16 RO   605A 0 U16 RW   6060 0 U08 RW   6061 0 U08 RO   6502 0 U32 RO
    603F 0 U16 RO   6064 0 I32 RW   606C 0 I32 RO   6078 0 I16 RO

    6076 0 I32 RW   607E 0 I08 RW   6080 0 I32 RW   60C5 0 I32 RW   60C6 0 I32 RW   60EA 0 I16 RW
    3011 1 I16 RW   3011 2 I08 RW   3011 3 I08 RW   3011 4 U16 RW   3011 5 U16 RW   3011 6 U16 RW
    3011 7 U32 RW   3011 8 I16 RW   3011 9 I16 RW   3011 10 I16 RW
    3012 1 I16 RO   3013 1 U32 RW   3013 5 U32 RW

    3000 1 U16 RO   3000 2 U16 RO   3001 1 U32 RW   3001 2 U16 RW   3001 3 U16 RW   3001 4 U16 RW
    3001 5 U16 RW   3001 6 U16 RW   3001 7 U16 RW   3001 8 I16 RW   3001 9 I16 RW
    3022 1 U16 RO   3022 2 U16 RO

    3019 1 U16 RW   3019 2 U16 RW   3019 3 U16 RW   3019 4 U16 RW
    6071 0 I16 RW   3023 1 I16 RO   6077 0 I16 RO   60B2 0 I16 RW   6072 0 I16 RW
    60FF 0 I32 RW   6043 0 I32 RO   3023 2 I32 RO
    60B1 0 I32 RW   607F 0 I32 RW   6083 0 U32 RW   6084 0 U32 RW
    3019 10 U16 RW  3019 11 U16 RW  3019 12 I32 RW  3019 13 I32 RW  3019 14 I32 RW
    607A 0 I32 RW   60FC 0 I32 RO   60F4 0 I32 RO
    60B0 0 I32 RW   607D 1 I32 RW   607D 2 I32 RW   6081 0 I32 RW
    6065 0 U32 RW   6066 0 U16 RW   2120 0 U32 RW   2121 0 U16 RW
    3019 5 U16 RW   3019 6 U16 RW   3019 7 I32 RW   3019 8 I32 RW   3019 9 I32 RW
    60C2 1 U08 RW   60C2 2 I08 RW

    2403 0 U08 RW   2111 0 U16 RW   2110 0 U16 RW   2112 0 U16 RW   2384 6 U16 RW   2384 7 U16 RW
    2384 9 U08 RW   220A 0 U08 RW   2404 0 U08 RW   2406 0 U16 RW   2405 0 U08 RW
    606D 0 U16 RW   606E 0 U16 RW   2104 0 U16 RW   2105 0 U16 RW   6046 1 U32 RW   6046 2 U32 RW
";

/// Where the manual contradicts itself or says nothing: what is built, and why.
const OTHERWISE: &[(u16, u8, &str)] = &[
    (0x6060, 0, "I08"), // P11: U08 in the table; a mode is an INTEGER8
    (0x6061, 0, "I08"), // P11
    (0x60C5, 0, "U32"), // P21: I32 in one table, U32 in the other
    (0x60C6, 0, "U32"), // P21
    (0x3000, 2, "I16"), // "units TBD"; a temperature has a sign
];

/// The manual's objects, as they are built.
fn manual() -> Vec<Printed> {
    let printed = manual::objects(MANUAL).into_iter();
    let built = |(index, sub, kind, writable)| {
        let otherwise = OTHERWISE.iter().find(|o| (o.0, o.1) == (index, sub));
        let kind = otherwise.map_or(kind, |o| type_of(o.2));
        (index, sub, kind, writable)
    };
    printed.map(built).collect()
}

#[test]
fn every_object_of_the_manual_is_there() {
    let table = OBJECTS.table();
    let objects = manual();
    assert_eq!(objects.len(), 203);
    for (index, sub, kind, writable) in objects {
        let name = format!("{index:04X},{sub}");
        let entry = table
            .find(index, sub)
            .unwrap_or_else(|abort| panic!("{name}: {abort}"));
        let row = table.row(&entry).unwrap();
        assert_eq!(row.data_type, kind, "{name}");
        assert_eq!(row.access == Access::ReadWrite, writable, "{name}");
        assert!(row.readable(), "{name}");
    }
}

#[test]
fn what_the_manual_does_not_list_is_little_and_has_a_reason() {
    let listed = manual();
    let mut more = Vec::new();
    for row in OBJECTS.table().rows() {
        for sub in row.address.sub..row.address.sub + row.count {
            let index = row.address.index;
            if !listed
                .iter()
                .any(|object| (object.0, object.1) == (index, sub))
            {
                more.push((index, sub));
            }
        }
    }
    assert_eq!(
        more,
        [
            (0x21B0, 0), // node ID, l.225 (P5)
            (0x2402, 0), // change of 2017-07-20, l.1176 (P61)
            (0x3008, 1), // current sense of l.249, and the second phase
            (0x3008, 2),
            (0x3009, 1), // its calibration, l.259
            (0x3009, 2),
            (0x3010, 3), // motor thermistor, voltages of mode 12 (l.262), current of the d axis
            (0x3010, 4),
            (0x3010, 5),
            (0x3010, 6),
            (0x3011, 11), // calibration current of the successor
            (0x607C, 0),  // homing, P38
            (0x6098, 0),
        ]
    );
}

#[test]
fn supported_modes_are_the_modes_that_work() {
    // P54: 1 (bit 0), 3 (2), 4 (3), 6 (5), 8 (7), 9 (8), 10 (9), 11 (10); 12 has no bit.
    assert_eq!(P3.cia402.supported_drive_modes(), 0x07AD);
    let table = OBJECTS.table();
    manual::with_defaults(&table, 9, |image| {
        let number = |index, sub| image.number(OBJECTS.need(index, sub));
        assert_eq!(number(0x6502, 0), 0x07AD);
        assert_eq!(number(0x1000, 0), 0x0002_0192);
    });
    manual::identifiers_carry_the_nodes(&table);
}

#[test]
fn fault_rows_are_those_of_the_manual() {
    use personalities::Kind::{Fault, Warning};
    // Code, 0x1001 bit, 0x1002 bit, all states, warning or fault (the column that holds the object).
    let manual = [
        (0x6010, 0, 0, true, Fault),
        (0x6320, 0, 1, true, Fault),
        (0x7320, 0, 2, true, Fault),
        (0x7321, 0, 3, true, Fault),
        (0x2310, 1, 4, false, Warning),
        (0x2320, 1, 5, false, Fault),
        (0x3210, 2, 6, true, Fault),
        (0x3220, 2, 7, true, Fault),
        (0x4210, 3, 8, false, Fault),
        (0x4310, 3, 9, false, Fault),
        (0x8110, 4, 10, true, Fault),
        (0x8180, 4, 11, true, Fault),
        (0x8140, 4, 12, true, Fault),
        (0x7122, 7, 13, false, Fault),
        (0x7380, 7, 14, false, Fault),
        (0x7381, 7, 15, false, Fault),
        (0x7382, 7, 16, false, Fault),
        (0x7383, 7, 17, false, Warning),
        (0x7384, 7, 18, false, Warning),
        (0x73A0, 7, 19, true, Fault),
        (0x8411, 7, 20, false, Warning),
        (0x8414, 7, 21, false, Fault),
        (0x8418, 7, 22, false, Warning),
        (0x8480, 7, 23, false, Warning),
        (0x8611, 7, 24, false, Warning),
        (0x8613, 7, 25, false, Fault),
        (0x8614, 7, 26, false, Fault),
    ];
    let built: Vec<_> = P3
        .faults
        .iter()
        .map(|row| {
            let all = row.states == personalities::States::All;
            (row.code, row.register_bit, row.status_bit, all, row.kind)
        })
        .collect();
    assert_eq!(built, manual);
}

/// Units that the manual states (l.862-1020), as its tables have them.
const UNITS: &str = "
    1006 0 us       1015 0 100us    1017 0 ms
    1800 3 100us    1801 3 100us    1802 3 100us    1803 3 100us
    1800 5 ms       1801 5 ms       1802 5 ms       1803 5 ms
    6064 0 cts      606C 0 cts/s    6078 0 mA
    6076 0 mNm      6080 0 cts/s    60C5 0 cts/s2   60C6 0 cts/s2   60EA 0 1/65536turn
    3011 1 cts      3011 4 mNm/A    3011 5 0.01ohm  3011 6 0.01mH   3011 7 gcm2/32768
    3011 8 mA       3011 9 mA       3011 10 ms      3012 1 cts      3013 1 cts/rev
    3001 1 Hz       3001 2 ns       3001 3 ns       3001 4 ns       3001 5 ns
    3001 6 ns       3001 7 ns       3001 8 mA       3001 9 mV
    3019 1 0.1Hz    3019 2 1/256    3019 3 0.1Hz    3019 4 1/256    3019 5 0.1Hz
    3019 6 1/256    3019 10 0.1Hz   3019 11 1/256
    6071 0 permille 3023 1 permille 6077 0 permille 60B2 0 permille 6072 0 permille
    60FF 0 cts/s    6043 0 cts/s    3023 2 cts/s    60B1 0 cts/s    607F 0 cts/s
    6083 0 cts/s2   6084 0 cts/s2   607A 0 cts      60FC 0 cts      60F4 0 cts
    60B0 0 cts      607D 1 cts      607D 2 cts      6081 0 cts/s
    6065 0 cts      6066 0 ms       2120 0 cts      2121 0 ms
    2110 0 0.01A    2111 0 0.01A    2112 0 ms       2384 6 0.1V     2384 7 0.1V
    2384 9 degC     220A 0 degC     2406 0 ms       606D 0 cts/s    606E 0 ms
    2104 0 cts/s    2105 0 ms       6046 1 cts/s    6046 2 cts/s
";

#[test]
fn units_are_the_manuals() {
    let table = OBJECTS.table();
    let words: Vec<&str> = UNITS.split_whitespace().collect();
    for object in words.chunks(3) {
        let [index, sub, unit] = object else {
            panic!("{object:?}")
        };
        let index = u16::from_str_radix(index, 16).unwrap();
        let entry = table.find(index, sub.parse().unwrap()).unwrap();
        let row = table.row(&entry).unwrap();
        assert_eq!(row.unit, *unit, "{index:04X},{sub}");
    }
    // Where the manual has none, or leaves it open, ours are here: nothing else has a unit.
    let ours: Vec<_> = table
        .rows()
        .iter()
        .filter(|row| !row.unit.is_empty())
        .map(|row| (row.address.index, row.address.sub))
        .filter(|(index, sub)| {
            !words
                .chunks(3)
                .any(|o| u16::from_str_radix(o[0], 16) == Ok(*index) && o[1].parse() == Ok(*sub))
        })
        .collect();
    assert_eq!(
        ours,
        [
            (0x3000, 1), // "units TBD", P37
            (0x3000, 2),
            (0x3008, 1), // Q12.4, l.255
            (0x3008, 2),
            (0x3009, 1),
            (0x3009, 2),
            (0x3010, 3),
            (0x3010, 4), // l.262
            (0x3010, 5),
            (0x3010, 6),
            (0x3011, 11),
            (0x3013, 5), // "calibrated gain"
            (0x3019, 7), // acc32_t of what, the manual does not say
            (0x3019, 8),
            (0x3019, 9),
            (0x3019, 12),
            (0x3019, 13),
            (0x3019, 14),
            (0x3022, 1), // 0 to 4095
            (0x3022, 2),
            (0x607C, 0),
        ]
    );
}

/// Defaults that the manual states.
#[test]
fn defaults_are_the_manuals() {
    let table = OBJECTS.table();
    let mut bytes = vec![0; table.image_bytes()];
    let mut image = canopen::Image::new(&mut bytes);
    table.defaults(&mut image, canopen::NodeId::new(1).unwrap());
    let number = |index, sub| image.number(OBJECTS.need(index, sub));
    for sub in [2, 4, 6, 11] {
        assert_eq!(number(0x3019, sub), 256, "zeta * 256, default = 1.0 * 256");
    }
    for offset in [0x60B0, 0x60B1, 0x60B2] {
        assert_eq!(number(offset, 0), 0);
    }
    assert_eq!(number(0x1014, 0), 0x81);
    // The example's motor and calibrations (l.249-300).
    assert_eq!(number(0x3011, 1), 0x0DF8);
    assert_eq!(number(0x3009, 1), 0x0729);
    assert_eq!(number(0x3011, 5), 1310);
    assert_eq!(number(0x3011, 8), 716);
    assert_eq!(number(0x3013, 1), 4096, "4096 cts/rev (l.52)");
}
