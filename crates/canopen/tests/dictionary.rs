//! The dictionary's layout and look-up against a plain list of its rows.

mod harness;

use canopen::row::{f32, i16, text, u8, u16, u32};
use canopen::{
    Abort, Address, Changed, DataType, Default, Dictionary, Handle, Image, NodeId, Row, Wire,
    dictionary,
};
use harness::devices::{IMAGE_BYTES, OBJECTS};

/// Every address there can be in the used indices, found or not as a walk over the rows says.
#[test]
fn find_agrees_with_the_rows() {
    let table = OBJECTS.table();
    let mut indices: Vec<u16> = table.rows().iter().map(|row| row.address.index).collect();
    indices.extend([0x0000, 0x0001, 0x0FFF, 0x1FFF, 0x2FFF, 0xFFFF]);
    indices.dedup();
    for index in indices {
        let subs: Vec<u8> = table
            .rows()
            .iter()
            .filter(|row| row.address.index == index)
            .flat_map(|row| row.address.sub..row.address.sub + row.count)
            .collect();
        for sub in 0..=255 {
            let expected = match (subs.contains(&sub), subs.is_empty()) {
                (true, _) => None,
                (false, false) => Some(Abort::NO_SUB_INDEX),
                (false, true) => Some(Abort::NO_OBJECT),
            };
            let found = table.find(index, sub);
            assert_eq!(found.err(), expected, "{index:04X},{sub}");
            if let Ok(entry) = found {
                let row = table.row(&entry).expect("its row");
                assert_eq!(row.address.index, index);
                assert!(sub >= row.address.sub && sub - row.address.sub < row.count);
                assert_eq!(entry.field.data_type(), row.data_type);
                assert_eq!(entry.maps_rpdo(), row.maps_rpdo);
                assert_eq!(entry.maps_tpdo(), row.maps_tpdo);
            }
        }
        let highest = subs.iter().copied().max().filter(|sub| *sub != 0);
        assert_eq!(table.highest_sub_index(index), highest, "{index:04X}");
    }
}

/// No two objects share a byte of the image, and none lies outside it: each is filled with ones in
/// turn, and only it may change.
#[test]
fn objects_do_not_overlap() {
    let table = OBJECTS.table();
    let objects: Vec<(u16, u8)> = table
        .rows()
        .iter()
        .filter(|row| row.data_type != DataType::Text)
        .flat_map(|row| {
            (row.address.sub..row.address.sub + row.count).map(|sub| (row.address.index, sub))
        })
        .collect();
    let mut ones = [0u32; IMAGE_BYTES];
    for (index, sub) in &objects {
        let field = table.find(*index, *sub).expect("an object").field;
        let mut bytes = [0u8; IMAGE_BYTES];
        Image::new(&mut bytes).set_raw(field, u32::MAX);
        let written = bytes.iter().filter(|byte| **byte == 0xFF).count();
        assert_eq!(written, usize::from(field.size()), "{index:04X},{sub}");
        for (count, byte) in ones.iter_mut().zip(bytes) {
            *count += u32::from(byte == 0xFF);
        }
    }
    assert!(ones.iter().all(|count| *count <= 1));
    // What is left unused is what alignment to the value's own size costs.
    let needed = table.rows().iter().fold(0usize, |end, row| {
        let size = usize::from(row.data_type.size());
        end.next_multiple_of(size.max(1)) + size * usize::from(row.count)
    });
    assert_eq!(IMAGE_BYTES, needed);
    assert_eq!(OBJECTS.image_bytes(), IMAGE_BYTES);
    assert_eq!(table.image_bytes(), IMAGE_BYTES);
}

/// Rows are sorted whatever order and parts they are declared in; values start at their defaults.
#[test]
fn sorted_with_defaults() {
    const PARTS: &[&[Row]] = &[
        &[],
        &[
            u16(0x3000, 2, "d").default(0xBEEF),
            u32(0x2000, 0, "b").default_plus_node(0x600),
        ],
        &[f32(0x2001, 0, "c").default_value(Default::Real(1.5))],
        &[
            i16(0x4000, 7, "e").subs(3).default(-2),
            u8(0x1000, 0, "a").default(9),
            text(0x5000, 0, "f", "abc"),
        ],
    ];
    static SORTED: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);
    let table = SORTED.table();
    let names: String = table.rows().iter().map(|row| row.name).collect();
    assert_eq!(names, "abcdef");
    let mut bytes = [0xAAu8; 64];
    let mut image = Image::new(&mut bytes);
    table.defaults(&mut image, NodeId::new(0x23).expect("a node ID"));
    let raw = |index, sub| {
        let entry = table.find(index, sub).expect("an object");
        (image.raw(entry.field), image.number(entry.field))
    };
    assert_eq!(raw(0x1000, 0), (9, 9));
    assert_eq!(raw(0x2000, 0), (0x623, 0x623));
    assert_eq!(raw(0x2001, 0), (0x3FC0_0000, 1));
    assert_eq!(raw(0x3000, 2), (0xBEEF, 0xBEEF));
    for sub in 7..=9 {
        assert_eq!(raw(0x4000, sub), (0xFFFE, -2));
    }
    assert!(
        bytes[SORTED.image_bytes()..]
            .iter()
            .all(|byte| *byte == 0xAA)
    );
}

/// Typed handles read and write what an SDO of the same object does.
#[test]
fn handles() {
    use harness::devices::OBJECTS_CONST as OD;
    fn check<T: Wire + PartialEq + core::fmt::Debug>(handle: Handle<T>, sub: u8, value: T) {
        let mut bench = harness::Bench::new(&harness::STANDARD);
        bench.node.image().set(handle, value);
        assert_eq!(bench.node.image().get(handle), value);
        assert_eq!(bench.read(0x2000, sub), Ok(value.to_raw() as u32));
        assert_eq!(T::from_raw(value.to_raw()), value);
        assert_eq!(handle.field().data_type(), T::TYPE);
    }
    check::<u8>(const { OD.handle(0x2000, 1) }, 1, 0xF0);
    check::<u16>(const { OD.handle(0x2000, 2) }, 2, 0xF00D);
    check::<u32>(const { OD.handle(0x2000, 3) }, 3, 0xF00D_CAFE);
    check::<i8>(const { OD.handle(0x2000, 4) }, 4, -128);
    check::<i16>(const { OD.handle(0x2000, 5) }, 5, -2);
    check::<i32>(const { OD.handle(0x2000, 6) }, 6, i32::MIN);
    check::<f32>(const { OD.handle(0x2000, 7) }, 7, -0.5);
    check::<bool>(const { OD.handle(0x2000, 8) }, 8, true);
    assert!(const { OD.optional::<u16>(0x2FFF, 0) }.is_none());
    assert_eq!(
        const { OD.field(0x200A, 100) }.map(|field| field.data_type()),
        Some(DataType::U8)
    );
}

/// Numbers are held within their type; a missing place reads 0 and keeps nothing.
#[test]
fn numbers_in_the_image() {
    let table = OBJECTS.table();
    let field = |sub| table.find(0x2000, sub).expect("an object").field;
    let mut bytes = [0u8; IMAGE_BYTES];
    let mut image = Image::new(&mut bytes);
    for (sub, set, got) in [
        (1, 300, 255),
        (1, -1, 0),
        (2, 70_000, 65_535),
        (3, i64::MAX, 4_294_967_295),
        (4, 128, 127),
        (4, -129, -128),
        (5, -40_000, -32_768),
        (6, i64::MIN, i64::from(i32::MIN)),
        (6, -5, -5),
        (7, -12, -12),
        (8, 3, 1),
    ] {
        image.set_number(field(sub), set);
        assert_eq!(image.number(field(sub)), got, "sub-index {sub}");
        assert_eq!(image.real(field(sub)), got as f32);
    }
    image.set_raw(field(7), 1.75f32.to_bits());
    assert_eq!(image.real(field(7)), 1.75);
    assert_eq!(image.number(field(7)), 1);
    let mut none = Image::new(&mut []);
    none.set_raw(field(3), 7);
    assert_eq!(none.raw(field(3)), 0);
}

/// A node with less memory than its image needs loses values but never panics.
#[test]
fn short_memory() {
    let id = NodeId::new(5).expect("a node ID");
    for length in 0..IMAGE_BYTES {
        let mut node = canopen::Node::new(&harness::STANDARD, vec![0u8; length], id);
        node.start(canopen::Instant::ZERO);
        for command in [0x40, 0x23] {
            let request = can::Frame::classic(0x605, [command, 0, 0x20, 3, 1, 2, 3, 4], 8);
            node.receive(&request, canopen::Instant::ZERO, &mut canopen::NoOwner);
            while node.transmit(&mut canopen::NoOwner).is_some() {}
        }
    }
}

/// Addresses in the form of the P3's 0x1010,4 (P4) and as text.
#[test]
fn addresses() {
    assert_eq!(
        Address::from_key(0x0021_B000),
        Some(Address::new(0x21B0, 0))
    );
    assert_eq!(
        Address::from_key(0x0030_0901),
        Some(Address::new(0x3009, 1))
    );
    assert_eq!(Address::from_key(0x0100_0000), None);
    assert_eq!(
        Address::from_key(0x6576_6173),
        None,
        "\"save\" is no address"
    );
    assert_eq!(Address::new(0x1018, 4).to_string(), "0x1018,4");
}

/// The codes of CiA 301 table 22, and that each has its own text.
#[test]
fn abort_codes() {
    let standard: [u32; 31] = [
        0x0503_0000,
        0x0504_0000,
        0x0504_0001,
        0x0504_0002,
        0x0504_0003,
        0x0504_0004,
        0x0504_0005,
        0x0601_0000,
        0x0601_0001,
        0x0601_0002,
        0x0602_0000,
        0x0604_0041,
        0x0604_0042,
        0x0604_0043,
        0x0604_0047,
        0x0606_0000,
        0x0607_0010,
        0x0607_0012,
        0x0607_0013,
        0x0609_0011,
        0x0609_0030,
        0x0609_0031,
        0x0609_0032,
        0x0609_0036,
        0x060A_0023,
        0x0800_0000,
        0x0800_0020,
        0x0800_0021,
        0x0800_0022,
        0x0800_0023,
        0x0800_0024,
    ];
    let ours: Vec<u32> = Abort::ALL.iter().map(|abort| abort.0).collect();
    assert_eq!(ours, standard);
    let mut texts: Vec<&str> = Abort::ALL.iter().filter_map(|abort| abort.text()).collect();
    texts.sort_unstable();
    texts.dedup();
    assert_eq!(texts.len(), standard.len());
    assert_eq!(
        Abort(0x0602_0000).to_string(),
        "0x06020000: object does not exist in the object dictionary"
    );
    assert_eq!(
        Abort(0x1234_5678).to_string(),
        "0x12345678: unknown abort code"
    );
}

/// A set of classes.
#[test]
fn changed() {
    assert!(Changed::NOTHING.is_empty());
    assert!((1..=31).all(|class| Changed::EVERYTHING.has(class)));
    assert!(!(1..=31).any(|class| Changed::NOTHING.has(class)));
    let mut bench = harness::Bench::new(&harness::STANDARD);
    bench.write(0x2007, 0, &[0; 4]).expect("a write");
    let mut changed = bench.events.changed;
    bench.write(0x2000, 1, &[0]).expect("a write");
    changed.merge(bench.events.changed);
    for class in 1..=31 {
        let expected = [harness::devices::TARGET, harness::devices::PLAIN].contains(&class);
        assert_eq!(changed.has(class), expected, "class {class}");
    }
}
