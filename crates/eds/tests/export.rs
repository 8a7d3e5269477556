//! Every personality's dictionary as an EDS: without findings, and unchanged when it is read.

use std::collections::HashSet;

use canopen::NodeId;
use eds::{Access, DataType, Exported, FileDate, List, ObjectType, Value};
use personalities::Personality;

fn exported(personality: &Personality) -> eds::Eds {
    eds::export(&Exported {
        table: personality.device.table,
        file_name: "test.eds",
        description: personality.title,
        author: "test",
        date: FileDate {
            year: 2026,
            month: 1,
            day: 1,
            hour: 0,
            minute: 0,
        },
        vendor_name: "Vendor",
        product_name: personality.title,
        order_code: personality.name,
        bit_rates_kbit: &[125, 1000],
        granularity_bits: 8,
        lss: false,
    })
}

/// What the reader finds in a drive that its manual has so: sub-index 0 of these objects is a value
/// like the others, not the highest sub-index (CiA 301 7.4.3).
fn findings_of(name: &str) -> &'static [&'static str] {
    match name {
        "p3-jpl" => &[
            "sub-index 0 of 2A01",
            "sub-index 0 of 2A10",
            "sub-index 0 of 2A11",
            "sub-index 0 of 2A12",
            "sub-index 0 of 3F00",
        ],
        _ => &[],
    }
}

#[test]
fn every_personality_reads_as_it_was_written() {
    for personality in personalities::ALL {
        let eds = exported(personality);
        let text = eds::write(&eds);
        let reading = eds::read(text.as_bytes());
        let findings: Vec<String> = reading.findings.iter().map(ToString::to_string).collect();
        let expected = findings_of(personality.name);
        assert_eq!(findings.len(), expected.len(), "{findings:?}");
        for (finding, expected) in findings.iter().zip(expected) {
            assert!(finding.contains(expected), "{finding}");
        }
        assert_eq!(reading.eds, eds);
        assert_eq!(eds::write(&reading.eds), text);
    }
}

#[test]
fn every_row_is_there() {
    let node = NodeId::new(7).unwrap();
    for personality in personalities::ALL {
        let eds = exported(personality);
        let mut found = 0;
        for row in personality.device.table.rows() {
            let index = row.address.index;
            if row.access == canopen::Access::Internal {
                assert!(eds.entry(index, row.address.sub).is_none());
                continue;
            }
            if index < 0x1000 {
                assert!(eds.dummies().contains(&index));
                continue;
            }
            for step in 0..row.count {
                let sub = row.address.sub + step;
                let entry = eds.entry(index, sub).unwrap();
                found += 1;
                assert_eq!(
                    entry.data_type.and_then(DataType::name),
                    Some(row.data_type.name())
                );
                assert_eq!(entry.pdo_mapping, Some(row.maps_rpdo || row.maps_tpdo));
                let access = entry.access.unwrap();
                assert_eq!(access.readable(), row.readable());
                assert_eq!(access.writable(), row.writable());
                let number = |value: &Option<Value>| value.as_ref()?.number(node);
                assert_eq!(number(&entry.low_limit), row.minimum.map(i128::from));
                assert_eq!(number(&entry.high_limit), row.maximum.map(i128::from));
                let default = match row.default {
                    // A stream has none.
                    _ if row.data_type == canopen::DataType::Domain => None,
                    // Not within the limits: nothing was written yet.
                    _ if row.is_unset => None,
                    canopen::Default::Value(value) => Some(value.into()),
                    canopen::Default::PlusNode(base) => Some(i128::from(base) + 7),
                    _ => continue,
                };
                assert_eq!(number(&entry.default), default, "{index:04X},{sub}");
            }
        }
        let generated = eds.objects.values().filter(|object| {
            let declared = personality.device.table.find(object.index, 0);
            object.has_subs() && declared.is_err()
        });
        assert_eq!(eds.entries().count(), found + generated.count());
    }
}

#[test]
fn names_are_unique() {
    for personality in personalities::ALL {
        let eds = exported(personality);
        let mut names = HashSet::new();
        for object in eds.objects.values() {
            assert!(names.insert(&object.entry.name), "{}", object.entry.name);
            let mut inside = HashSet::new();
            for entry in object.subs.values() {
                assert!(inside.insert(&entry.name), "{}", entry.name);
            }
        }
    }
}

/// What CiA 301, 306 and the P3's manual say of single objects.
#[test]
fn objects_of_the_p3() {
    let eds = exported(&personalities::p3::P3);
    let types = [
        (0x1000, ObjectType::Var),
        (0x1003, ObjectType::Array),
        (0x1010, ObjectType::Array),
        (0x1018, ObjectType::Record),
        (0x1200, ObjectType::Record),
        (0x1401, ObjectType::Record),
        (0x1600, ObjectType::Record),
        (0x1800, ObjectType::Record),
        (0x1A03, ObjectType::Record),
        (0x3009, ObjectType::Array),
        (0x3011, ObjectType::Record),
        (0x607D, ObjectType::Array),
        (0x60C2, ObjectType::Record),
    ];
    for (index, object_type) in types {
        let object = &eds.objects[&index];
        assert_eq!(object.entry.object_type, object_type, "{index:04X}");
    }
    let lists = [
        (0x1000, List::Mandatory),
        (0x1001, List::Mandatory),
        (0x1002, List::Optional),
        (0x1018, List::Mandatory),
        (0x3011, List::Manufacturer),
        (0x6040, List::Optional),
    ];
    for (index, list) in lists {
        assert_eq!(eds.objects[&index].list, list, "{index:04X}");
    }
    let text = |index, sub| {
        let entry = eds.entry(index, sub).unwrap();
        entry.default.as_ref().unwrap().text().to_owned()
    };
    assert_eq!(text(0x1800, 1), "$NODEID+0x180");
    assert_eq!(text(0x1018, 0), "4");
    assert_eq!(text(0x1A00, 4), "0x00000000");
    assert_eq!(text(0x1008, 0), "P3");
    let name = |index, sub| eds.entry(index, sub).unwrap().name.clone();
    assert_eq!(name(0x1A00, 0), "TPDO mapping, number of mapped objects");
    assert_eq!(name(0x1A00, 4), "TPDO mapping 4");
    assert_eq!(name(0x1018, 0), "Highest sub-index supported");
    assert_eq!(eds.objects[&0x1A00].entry.name, "TPDO mapping parameter 1");
    let access = |index| eds.entry(index, 0).unwrap().access;
    assert_eq!(access(0x6040), Some(Access::ReadWriteOutput));
    assert_eq!(access(0x6041), Some(Access::ReadOnly));
    assert_eq!(access(0x1000), Some(Access::Constant));
    let device = eds.device_info().unwrap();
    assert_eq!(device.vendor_number, Some(0x408));
    assert_eq!((device.rpdos, device.tpdos), (Some(4), Some(4)));
    assert_eq!(device.bit_rates_kbit, [125, 1000]);
    assert_eq!(eds.dummies(), [2, 3, 4, 5, 6, 7]);
}
