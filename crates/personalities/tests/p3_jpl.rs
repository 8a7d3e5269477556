//! The dictionary of the P3 of 2016 against the table of its manual, copied by hand: index,
//! sub-indices, type, access.

mod manual;

use canopen::{Access, DataType};
use personalities::p3_jpl::{OBJECTS, P3_JPL, properties};
use personalities::{Cause, Kind, States};

/// "Object Dictionary" (l.99-170), in the manual's order.
const MANUAL: &str = "
    1000 0 U32 RO   1001 0 U08 RO   1005 0 U32 RW   1006 0 U32 RO   1008 0 STR RO   1009 0 STR RO
    1010 0 U08 RO   1010 1 U32 RW   100A 0 STR RO   1014 0 U32 RW   1015 0 U16 RW   1017 0 U16 RW
    1018 0 U08 RO   1018 1 U32 RO   1018 2 U32 RO   1018 3 U32 RO   1018 4 U32 RO
    1018 5 U32 RW   1018 6 U32 RW   1200 0 U08 RO   1200 1 U32 RO   1200 2 U32 RO

    1400 0 U08 RO   1401 0 U08 RO   1402 0 U08 RO   1403 0 U08 RO
    1400 1 U32 RW   1401 1 U32 RW   1402 1 U32 RW   1403 1 U32 RW
    1400 2 U08 RW   1401 2 U08 RW   1402 2 U08 RW   1403 2 U08 RW
    1600 0 U08 RW   1601 0 U08 RW   1602 0 U08 RW   1603 0 U08 RW
    1600 1-4 U32 RW 1601 1-4 U32 RW 1602 1-4 U32 RW 1603 1-4 U32 RW
    1800 0 U08 RO   1801 0 U08 RO   1802 0 U08 RO   1803 0 U08 RO
    1800 1 U32 RW   1801 1 U32 RW   1802 1 U32 RW   1803 1 U32 RW
    1800 2 U08 RW   1801 2 U08 RW   1802 2 U08 RW   1803 2 U08 RW
    1800 3 U16 RW   1801 3 U16 RW   1802 3 U16 RW   1803 3 U16 RW
    1800 4 U08 RO   1801 4 U08 RO   1802 4 U08 RO   1803 4 U08 RO
    1800 5 U16 RW   1801 5 U16 RW   1802 5 U16 RW   1803 5 U16 RW
    1A00 0 U08 RW   1A01 0 U08 RW   1A02 0 U08 RW   1A03 0 U08 RW
    1A00 1-4 U32 RW 1A01 1-4 U32 RW 1A02 1-4 U32 RW 1A03 1-4 U32 RW

    2201 0 I16 RO   2202 0 I16 RO   2A01 0 U16 RO   2A01 1 U16 RO
    2A10 0 U08 RW   2A10 1 U08 RW   2A10 2 U08 RW   2A11 0 U08 RO   2A11 1 U08 RO   2A11 2 U08 RO
    2A12 0 U08 RW   2A12 1 U08 RW   2A12 2 U08 RW
    3F63 0 I32 RW   3F60 0 I08 RW   3F00 0-127 U32 RO

    603F 0 U16 RO   6040 0 U16 RW   6041 0 U16 RO   6060 0 I08 RW   6061 0 I08 RO
    6062 0 I32 RO   6063 0 I32 RO   6064 0 I32 RO   6069 0 I32 RO   606B 0 I32 RO   606C 0 I32 RO
    606F 0 U32 RW   6074 0 I16 RW   607A 0 I32 RW   60FF 0 I32 RW   6083 0 I32 RW   6084 0 I32 RW
    1F80 0 U32 RW
";

#[test]
fn every_object_of_the_manual_is_there_and_no_other() {
    let table = OBJECTS.table();
    let objects = manual::objects(MANUAL);
    assert_eq!(objects.len(), 22 + 4 * (3 + 5 + 6 + 5) + 13 + 130 + 18);
    let mut rows = 0;
    for &(index, sub, kind, writable) in &objects {
        let name = format!("{index:04X},{sub}");
        let Ok(entry) = table.find(index, sub) else {
            // Sub-index 0 of an object whose other sub-indices are there reads as the last of them.
            assert_eq!((sub, kind, writable), (0, DataType::U8, false), "{name}");
            let highest = match index {
                0x1010 => 1,
                0x1018 => 6,
                0x1200 | 0x1400..=0x1403 => 2,
                0x1800..=0x1803 => 5,
                _ => panic!("{name} is not there"),
            };
            assert_eq!(table.highest_sub_index(index), Some(highest), "{name}");
            continue;
        };
        rows += 1;
        let row = table.row(&entry).unwrap();
        assert_eq!(row.data_type, kind, "{name}");
        assert_eq!(row.access == Access::ReadWrite, writable, "{name}");
        assert!(row.readable(), "{name}");
    }
    let all: usize = table.rows().iter().map(|row| usize::from(row.count)).sum();
    assert_eq!(all, rows);
}

/// "CHAR[4]".
#[test]
fn texts_are_four_characters() {
    let table = OBJECTS.table();
    for index in [0x1008, 0x1009, 0x100A] {
        let row = table.row(&table.find(index, 0).unwrap()).unwrap();
        let canopen::Default::Text(text) = row.default else {
            panic!("{index:04X}")
        };
        assert_eq!(text.len(), 4, "{index:04X}");
    }
}

/// Defaults that the manual states, and those of its examples.
#[test]
fn defaults() {
    manual::identifiers_carry_the_nodes(&OBJECTS.table());
    manual::with_defaults(&OBJECTS.table(), 9, |image| {
        let number = |index, sub| image.number(OBJECTS.need(index, sub));
        assert_eq!(number(0x1000, 0) & 0xFFFF, 402, "low 16: profile");
        assert_eq!(number(0x1010, 1), 1, "reading this object returns 1");
        // The property example (l.334).
        assert_eq!(number(0x3F00, 50), 0x8000);
        assert_eq!(number(0x6083, 0), 2_000_000);
        // Nothing that is not implemented, and no target, is other than 0.
        for (index, sub) in [
            (0x2A01, 0),
            (0x2A01, 1),
            (0x2A10, 0),
            (0x2A11, 2),
            (0x2A12, 1),
            (0x603F, 0),
            (0x6040, 0),
            (0x6041, 0),
            (0x606F, 0),
            (0x3F60, 0),
            (0x6060, 0),
            (0x6074, 0),
            (0x607A, 0),
            (0x60FF, 0),
            (0x1006, 0),
            (0x1F80, 0),
        ] {
            assert_eq!(number(index, sub), 0, "{index:04X},{sub}");
        }
    });
}

/// Only 0x6083 and 0x6084 have a range: a profile needs a rate, and their type has a sign (J21).
#[test]
fn ranges() {
    let with_range: Vec<_> = OBJECTS
        .table()
        .rows()
        .iter()
        .filter(|row| row.minimum.is_some() || row.maximum.is_some())
        .map(|row| (row.address.index, row.minimum, row.maximum))
        .collect();
    let whole = (Some(1), Some(i64::from(i32::MAX)));
    assert_eq!(
        with_range,
        [(0x6083, whole.0, whole.1), (0x6084, whole.0, whole.1)]
    );
}

/// Units of the manual's texts (l.102-169), and ours where it has none.
#[test]
fn units() {
    let units = [
        (0x1006, "us"),
        (0x1015, "100us"),
        (0x1017, "ms"),
        (0x2201, "V/256"),
        (0x2202, "degC/256"),
        (0x3F63, "cts"),
        (0x6062, "cts"),
        (0x6063, "cts"),
        (0x6064, "cts"),
        (0x6069, "cts/s"),
        (0x606B, "rad/s/65536"),
        (0x606C, "rad/s/65536"),
        (0x607A, "cts"),
        (0x60FF, "rad/s/65536"),
        // J15, J21: the manual has none.
        (0x6074, "permille"),
        (0x6083, "cts/s2"),
        (0x6084, "cts/s2"),
    ];
    let mut built: Vec<_> = OBJECTS
        .table()
        .rows()
        .iter()
        .filter(|row| !row.unit.is_empty() && !(0x1400..0x1F00).contains(&row.address.index))
        .filter(|row| row.address.index != properties::INDEX)
        .map(|row| (row.address.index, row.unit))
        .collect();
    let mut expected = units.to_vec();
    expected.sort_unstable();
    built.sort_unstable();
    assert_eq!(built, expected);
}

/// Properties with a meaning have the unit that the drive's page gives them; the others have none.
#[test]
fn units_of_properties() {
    let built: Vec<_> = OBJECTS
        .table()
        .rows()
        .iter()
        .filter(|row| row.address.index == properties::INDEX && !row.unit.is_empty())
        .map(|row| (row.address.sub, row.unit))
        .collect();
    assert_eq!(
        built,
        [
            (9, "degC/256"),
            (10, "degC/256"),
            (11, "degC/256"),
            (20, "degC/256"),
            (21, "V/256"),
            (22, "mA"),
            (42, "permille"),
            (43, "permille"),
            (44, "cts/ms"),
            (45, "cts/ms"),
            (46, "cts/ms"),
            (47, "cts/ms"),
            (48, "cts"),
            (50, "cts"),
            (52, "cts"),
            (61, "cts"),
            (62, "count"),
            (63, "s"),
            (66, "cts"),
            (68, "cts/rev"),
            (74, "count"),
            (82, "cts/ms2"),
            (86, "permille/Nm"),
            (94, "cts"),
            (96, "cts"),
        ]
    );
}

/// "Save All" covers what configures the drive; the manual has no column for it.
#[test]
fn stored() {
    let table = OBJECTS.table();
    let mut stored: Vec<_> = table
        .rows()
        .iter()
        .filter(|row| row.group != canopen::Group::None)
        .flat_map(|row| (0..row.count).map(|step| (row.address.index, row.address.sub + step)))
        .filter(|(index, _)| !(0x1400..0x1F00).contains(index))
        .collect();
    stored.sort_unstable();
    assert_eq!(
        stored,
        [
            (0x1005, 0),
            (0x1014, 0),
            (0x1015, 0),
            (0x1017, 0),
            (0x1018, 5),
            (0x1018, 6),
            (0x1F80, 0),
            (0x3F60, 0),
            (0x6083, 0),
            (0x6084, 0),
        ]
    );
    // Each writable parameter of a PDO.
    for row in table.rows() {
        if (0x1400..0x1F00).contains(&row.address.index) {
            let is_stored = row.group == canopen::Group::Communication;
            assert_eq!(is_stored, row.writable(), "{}", row.address);
        }
    }
}

/// The table has no column for PDOs. Numbers of the application and 0x1001 can be sent, those that can
/// be written can be received, but for the default mode, which is configuration.
#[test]
fn what_pdos_can_map() {
    for row in OBJECTS.table().rows() {
        let index = row.address.index;
        let is_ours = index >= 0x2000;
        let sends = match index {
            0x1001 => true,
            0x3F60 => false,
            _ => is_ours,
        };
        let receives = is_ours && row.writable() && index != 0x3F60;
        assert_eq!(row.maps_tpdo, sends, "{}", row.address);
        assert_eq!(row.maps_rpdo, receives, "{}", row.address);
    }
}

/// The two numbers of the manual, and some of Barrett's library.
#[test]
fn properties_have_their_numbers() {
    let name = |number| {
        let table = OBJECTS.table();
        let entry = table.find(properties::INDEX, number).unwrap();
        table.row(&entry).unwrap().name
    };
    for (number, expected) in [
        (0, "VERS"),
        (8, "MODE"),
        (20, "THERM"),
        (21, "VBUS"),
        (42, "T"),
        (48, "P"),
        (49, "P2"),
        (50, "DP"),
        (68, "CTS"),
        (82, "ACCEL"),
        (90, "POLES"),
        (108, "IHIT"),
        (109, "No property"),
        (127, "No property"),
    ] {
        assert_eq!(name(number), expected, "{number}");
    }
    // The second number of a long property has its name with a 2 behind.
    for number in 0..properties::LAST {
        let second = format!("{}2", name(number));
        let is_long = name(number + 1) == second && name(number) != "X";
        assert_eq!(properties::is_long(number), is_long, "{number}");
    }
}

/// 0x1001: "Bit 0 = Generic, Bit 1 = Current, Bit 3 = Temperature". What switches the motor off is
/// latched (J17).
#[test]
fn errors() {
    let rows: Vec<_> = P3_JPL
        .faults
        .iter()
        .map(|row| (row.cause, row.register_bit, row.kind, row.states))
        .collect();
    assert_eq!(
        rows,
        [
            (Cause::ParameterError, 0, Kind::Fault, States::All),
            (Cause::EncoderFeedback, 0, Kind::Fault, States::All),
            (Cause::CurrentLimit, 1, Kind::Warning, States::All),
            (Cause::ShortCircuit, 1, Kind::Fault, States::All),
            (Cause::AmplifierTemperature, 3, Kind::Fault, States::All),
            (Cause::MotorTemperature, 3, Kind::Fault, States::All),
        ]
    );
}
