//! Tables of Barrett's manuals, copied by hand, and what both say of identifiers.
#![allow(
    unreachable_pub,
    reason = "each test file is a crate of its own and uses it as a module"
)]

use canopen::{DataType, Image, NodeId, Table};

/// Index, sub-index, type, whether writable.
pub type Printed = (u16, u8, DataType, bool);

/// A type as the manuals write it.
pub fn type_of(name: &str) -> DataType {
    match name {
        "U08" => DataType::U8,
        "U16" => DataType::U16,
        "U32" => DataType::U32,
        "I08" => DataType::I8,
        "I16" => DataType::I16,
        "I32" => DataType::I32,
        "STR" => DataType::Text,
        other => panic!("{other}"),
    }
}

/// The objects of a table: four words each, index, sub-index or a run of them, type, access.
pub fn objects(table: &str) -> Vec<Printed> {
    let words: Vec<&str> = table.split_whitespace().collect();
    let mut objects = Vec::new();
    for object in words.chunks(4) {
        let [index, subs, kind, access] = object else {
            panic!("{object:?}")
        };
        let index = u16::from_str_radix(index, 16).unwrap();
        let (first, last) = subs.split_once('-').unwrap_or((subs, subs));
        for sub in first.parse().unwrap()..=last.parse().unwrap() {
            objects.push((index, sub, type_of(kind), *access == "RW"));
        }
    }
    objects
}

/// An image with the defaults of node `node`.
pub fn with_defaults(table: &Table, node: u8, look: impl FnOnce(&Image<'_>)) {
    let mut bytes = vec![0; table.image_bytes()];
    let mut image = Image::new(&mut bytes);
    table.defaults(&mut image, NodeId::new(node).unwrap());
    look(&image);
}

/// The predefined identifiers, which carry the node's: emergency, SDO, four PDOs each way.
pub fn identifiers_carry_the_nodes(table: &Table) {
    for node in [1, 9, 127] {
        with_defaults(table, node, |image| {
            let number = |index, sub| image.number(table.find(index, sub).unwrap().field);
            let node = i64::from(node);
            assert_eq!(number(0x1014, 0), 0x80 + node);
            assert_eq!(number(0x1200, 1), 0x600 + node);
            assert_eq!(number(0x1200, 2), 0x580 + node);
            for n in 0..4 {
                let base = 0x100 * (i64::from(n) + 1);
                assert_eq!(number(0x1400 + n, 1), base + 0x100 + node);
                assert_eq!(number(0x1800 + n, 1), base + 0x80 + node);
            }
        });
    }
}
