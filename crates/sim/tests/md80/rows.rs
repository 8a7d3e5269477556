//! Each row over the bus: length, access, range, and what a save keeps.

use canopen::{Access, DataType, Default, Group, Row};
use personalities::md80::OBJECTS;

use crate::bench::*;

/// Rows that a master may see, in order.
fn rows() -> Vec<Row> {
    let table = OBJECTS.table();
    let seen = table
        .rows()
        .iter()
        .filter(|row| row.access != Access::Internal);
    seen.copied().collect()
}

fn is_number(row: &Row) -> bool {
    !matches!(row.data_type, DataType::Text)
}

fn bytes_of(row: &Row, value: i64) -> Vec<u8> {
    value.to_le_bytes()[..usize::from(row.data_type.size())].to_vec()
}

/// Whether writing it does something beside setting it.
fn acts(row: &Row) -> bool {
    // Commands, status words, the controlword, the save, and modes, which only some values name.
    matches!(
        row.address.index,
        0x1010 | 0x2003 | 0x2004 | 0x6040 | 0x6060
    )
}

#[test]
fn every_number_is_read_with_its_own_length() {
    let mut master = quiet();
    for row in rows().iter().filter(|row| is_number(row)) {
        // Its length is what `try_read` looks at.
        let value = master.try_read(NODE, row.address.index, row.address.sub);
        assert!(value.is_ok(), "{}", row.address);
    }
}

#[test]
fn what_is_read_only_cannot_be_written() {
    let mut master = quiet();
    let mut count = 0;
    for row in rows().iter().filter(|row| !row.writable()) {
        let value = bytes_of(row, 0);
        let value = if is_number(row) { value } else { vec![b'x'] };
        let result = master.try_write(NODE, row.address.index, row.address.sub, &value);
        assert_eq!(result, Err(0x0601_0002), "{}", row.address);
        count += 1;
    }
    // The page's 16, of 0x1018 and 0x1200 six, and those that count sub-indices.
    assert!(count >= 22, "{count}");
    assert_eq!(
        master.try_write(NODE, 0x2007, 0, &[0]),
        Err(0x0602_0000),
        "no such object"
    );
    assert_eq!(
        master.try_write(NODE, 0x2003, 9, &[0]),
        Err(0x0609_0011),
        "no such sub-index"
    );
}

#[test]
fn a_wrong_length_is_refused() {
    let mut master = quiet();
    for row in rows().iter().filter(|row| row.writable() && is_number(row)) {
        let size = usize::from(row.data_type.size());
        let (index, sub) = (row.address.index, row.address.sub);
        if size > 1 {
            let short = vec![1; size - 1];
            let result = master.try_write(NODE, index, sub, &short);
            assert_eq!(result, Err(0x0607_0013), "{}", row.address);
        }
        if size < 4 {
            // M19: only zeros may be too many.
            let long = vec![1; 4];
            let result = master.try_write(NODE, index, sub, &long);
            assert_eq!(result, Err(0x0607_0012), "{}", row.address);
        }
    }
}

#[test]
fn values_outside_the_range_are_refused_and_the_ends_are_taken() {
    let mut master = quiet();
    let mut checked = 0;
    for row in rows().iter().filter(|row| row.writable() && !acts(row)) {
        let (Some(least), Some(greatest)) = (row.minimum, row.maximum) else {
            continue;
        };
        // PDO parameters have rules of their own.
        if (0x1400..0x1C00).contains(&row.address.index)
            || row.address == canopen::Address::new(0x2000, 10)
        {
            continue;
        }
        let size = u32::from(row.data_type.size());
        let (floor, ceiling) = match row.data_type {
            DataType::I8 | DataType::I16 | DataType::I32 => {
                let half = 1i64 << (8 * size - 1);
                (-half, half - 1)
            }
            _ => (0, (1i64 << (8 * size)) - 1),
        };
        let mut write = |value: i64| {
            let bytes = bytes_of(row, value);
            master.try_write(NODE, row.address.index, row.address.sub, &bytes)
        };
        if least > floor {
            assert_eq!(write(least - 1), Err(0x0609_0032), "{}", row.address);
            checked += 1;
        }
        if greatest < ceiling {
            assert_eq!(write(greatest + 1), Err(0x0609_0031), "{}", row.address);
            checked += 1;
        }
        for value in [greatest, least] {
            assert_eq!(write(value), Ok(()), "{} := {value}", row.address);
        }
    }
    assert_eq!(checked, 19, "ends of ranges that a value can lie beyond");
}

/// Another value than the default that the row may have.
fn another(row: &Row) -> Option<Vec<u8>> {
    if row.data_type == DataType::Text {
        return Some(b"abc".to_vec());
    }
    if row.data_type == DataType::F32 {
        return Some(0.25_f32.to_le_bytes().to_vec());
    }
    let default = match row.default {
        Default::Value(value) => value,
        _ => return None,
    };
    let value = match (row.minimum, row.maximum) {
        (_, Some(greatest)) if greatest != default => greatest,
        (Some(least), Some(_)) => least,
        _ => default + 3,
    };
    Some(bytes_of(row, value))
}

#[test]
fn a_save_keeps_what_the_page_marks_and_nothing_else() {
    let mut settings = md80().factory();
    settings.plant.output_encoder = Some(plant::OutputEncoder::ideal(1.0 / 9.0));
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    let mut written = Vec::new();
    for row in rows().iter().filter(|row| row.writable() && !acts(row)) {
        let address = row.address;
        // Its change moves the drive to another node ID; PDOs have a test of their own.
        if (0x1400..0x1C00).contains(&address.index) || address == canopen::Address::new(0x2000, 10)
        {
            continue;
        }
        let Some(value) = another(row).filter(|value| value.len() <= 4) else {
            continue;
        };
        if master
            .try_write(NODE, address.index, address.sub, &value)
            .is_ok()
        {
            written.push((*row, value));
        }
    }
    assert!(written.len() >= 35, "{}", written.len());
    master.log.clear();
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(400);
    assert!(booted(&master));
    for (row, value) in &written {
        let address = row.address;
        let read = master.upload(address.index, address.sub);
        let kept = row.group != Group::None;
        let same = read.starts_with(value);
        assert_eq!(same, kept, "{address}: {read:02X?}, written {value:02X?}");
    }
    let kept = written.iter().filter(|(row, _)| row.group != Group::None);
    assert!(kept.count() >= 25);
}

#[test]
fn a_can_id_counts_from_the_start_after_its_save() {
    let mut master = quiet();
    master.write(NODE, 0x2000, 10, &9u32.to_le_bytes());
    // Not yet.
    assert_eq!(master.read(NODE, 0x2000, 10), 9);
    master.log.clear();
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(400);
    let boots: Vec<u32> = master
        .log
        .iter()
        .filter(|t| t.frame.raw_id() & 0x780 == 0x700 && t.frame.data() == [0])
        .map(|t| t.frame.raw_id())
        .collect();
    assert_eq!(boots, [0x709]);
    assert_eq!(master.read(9, 0x2000, 10), 9);
}
