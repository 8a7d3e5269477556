//! The MD80's dictionary against the tables of its page, copied by hand column by column, and the bits,
//! limits and sample parameters that the page leaves to other papers of the maker.

use canopen::{Access, Address, DataType, Default, Group, Row};
use cia402::Mode;
use personalities::md80::{
    CANOPEN, CIA402, Effect, MD80, OBJECTS, REAL_RANGES, SAMPLE_MOTOR, STATUS_BITS,
};
use personalities::{Cause, Kind, MotionLoop};

/// Index, sub-index, type, SDO, PDO, NVM, range, default; "-" as on the page.
const PAGE: &str = "
    1000 00 UINT32  RO -  -   -             0x00020192
    1001 00 UINT8   RO TX -   -             0x00
    1008 00 STR     RO -  -   -             MD80
    1010 01 UINT32  RW -  -   -             -
    1017 00 UINT16  RW -  -   -             -
    2000 01 UINT32  RW -  yes 2..255        0
    2000 02 FLOAT32 RW -  yes -             0
    2000 03 FLOAT32 RW -  yes 5e-9..0.1     0
    2000 04 FLOAT32 RW -  yes 5e-3..20      0
    2000 05 UINT16  RW -  yes 50..2500      0
    2000 06 STR(20) RW -  yes -             0
    2000 07 UINT8   RW -  yes 10..80        0
    2000 08 FLOAT32 RW -  yes -             1
    2000 09 UINT8   RW -  yes 0..1          0
    2000 0A UINT32  RW -  yes 1..31         1
    2001 01 FLOAT32 RW -  yes -             0
    2001 02 FLOAT32 RW -  yes -             0
    2001 03 FLOAT32 RW -  yes -             0
    2001 04 FLOAT32 RW -  yes -             0
    2002 01 FLOAT32 RW -  yes -             0
    2002 02 FLOAT32 RW -  yes -             0
    2002 03 FLOAT32 RW -  yes -             0
    2002 04 FLOAT32 RW -  yes -             0
    2003 01 BOOL    RW -  -   -             0
    2003 02 BOOL    RW -  -   -             0
    2003 03 BOOL    RW -  -   -             0
    2003 04 BOOL    RW -  -   -             0
    2003 05 BOOL    RW -  -   -             0
    2003 06 BOOL    RW -  -   -             0
    2004 01 UINT32  RW -  -   -             0
    2004 02 UINT32  RW -  -   -             0
    2004 03 UINT32  RW -  -   -             0
    2004 04 UINT32  RW -  -   -             0
    2004 05 UINT32  RW -  -   -             0
    2004 06 UINT32  RW -  -   -             0
    2004 07 UINT32  RW -  -   -             0
    2004 08 UINT32  RW -  -   -             0
    2005 01 UINT32  RW -  yes 1..3          0
    2005 02 UINT32  RW -  yes 0..1          0
    2005 03 UINT32  RW -  yes 0..3          0
    2005 04 FLOAT32 RO TX -   -             0.0
    2005 05 FLOAT32 RO TX -   -             0.0
    2006 01 FLOAT32 RO TX -   -             0.0
    2006 02 FLOAT32 RO TX -   -             0.0
    6040 00 UINT16  RW RX -   -             0x00
    6041 00 UINT16  RO TX -   -             0x00
    6060 00 INT8    RW RX -   -             0x00
    6061 00 INT8    RO TX -   -             0x00
    6062 00 INT32   RO -  -   -             0x00
    6064 00 INT32   RO TX -   -             0x00
    6067 00 INT32   RW TX -   -             0x00
    606B 00 INT32   RO TX -   -             0x00
    606C 00 INT32   RO TX -   -             0x00
    606D 00 INT32   RW TX -   -             0x00
    6072 00 UINT16  RW RX yes ..32767       0x00
    6073 00 UINT16  RW RX yes ..50000       0x00
    6075 00 INT32   RW -  yes ..1000000     0x00
    6076 00 INT32   RW -  yes ..1000000     0x00
    6077 00 INT16   RO TX -   -             0x00
    6079 00 UINT32  RO RX -   -             0x00
    607A 00 INT32   RW RX -   -             0x00
    607D 01 INT32   RW RX yes -             0x00
    607D 02 INT32   RW RX yes -             0x00
    6080 00 UINT32  RW RX -   -             1000
    6081 00 UINT32  RW RX yes -             0
    6083 00 UINT32  RW RX -   -             0
    6084 00 UINT32  RW RX -   -             0
    60FF 00 INT32   RW RX -   -             0
    6502 00 INT32   RO -  -   -             647
";

/// The page's mappings: PDO, mapped objects.
const MAPPINGS: &[(u16, &[u32])] = &[
    (0x1600, &[0x6040_0010]),
    (0x1601, &[0x6040_0010, 0x6060_0008]),
    (0x1602, &[0x6040_0010, 0x607A_0020]),
    (0x1603, &[0x6040_0010, 0x60FF_0020]),
    (0x1A00, &[0x6041_0010, 0x6061_0008]),
    (0x1A01, &[0x6041_0010, 0x6064_0020]),
    (0x1A02, &[0x6041_0010, 0x606C_0020]),
    (0x1A03, &[0x6041_0010, 0x6077_0010]),
];

/// Where a row is not as the page prints it, and why.
enum Otherwise {
    /// M10: a value that can only be read goes into transmit PDOs.
    Sent,
    /// M18, and "stores on command".
    Default(i64),
    /// 0, the default and what the maker's own files write, can be written too.
    FromZero,
    /// Communication parameters are stored (CiA 301 7.5.2.13), although the page has no "yes".
    Kept,
}

fn otherwise(index: u16, sub: u8) -> Vec<Otherwise> {
    match (index, sub) {
        (0x6079, 0) => vec![Otherwise::Sent],
        (0x1010, 1) => vec![Otherwise::Default(1)],
        (0x1017, 0) => vec![Otherwise::Default(1000), Otherwise::Kept],
        (0x2005, 1) => vec![Otherwise::FromZero],
        _ => Vec::new(),
    }
}

fn row_of(index: u16, sub: u8) -> Option<Row> {
    let table = OBJECTS.table();
    let entry = table.find(index, sub).ok()?;
    table.row(&entry).copied()
}

fn number(text: &str) -> f64 {
    match text.strip_prefix("0x") {
        Some(digits) => f64::from(u32::from_str_radix(digits, 16).expect("a number")),
        None => text.parse().expect("a number"),
    }
}

#[test]
fn every_object_of_the_page_is_there_as_printed() {
    let lines = PAGE.lines().filter(|line| !line.trim().is_empty());
    let mut count = 0;
    for line in lines {
        count += 1;
        let words: Vec<&str> = line.split_whitespace().collect();
        let [index, sub, kind, sdo, pdo, nvm, range, default] = words[..] else {
            panic!("{line}")
        };
        let index = u16::from_str_radix(index, 16).expect("an index");
        let sub = u8::from_str_radix(sub, 16).expect("a sub-index");
        let row = row_of(index, sub).unwrap_or_else(|| panic!("{line}: missing"));
        let other = otherwise(index, sub);
        let has = |wanted: fn(&Otherwise) -> bool| other.iter().any(wanted);

        let data_type = match kind {
            "UINT8" => DataType::U8,
            "UINT16" => DataType::U16,
            "UINT32" => DataType::U32,
            "INT8" => DataType::I8,
            "INT16" => DataType::I16,
            "INT32" => DataType::I32,
            "FLOAT32" => DataType::F32,
            "BOOL" => DataType::Bool,
            "STR" | "STR(20)" => DataType::Text,
            other => panic!("{other}"),
        };
        assert_eq!(row.data_type, data_type, "{line}");
        if kind == "STR(20)" {
            assert_eq!(row.length, 20, "{line}");
        }
        assert_eq!(row.access == Access::ReadWrite, sdo == "RW", "{line}");
        assert!(row.readable(), "{line}");

        let sent = has(|o| matches!(o, Otherwise::Sent));
        assert_eq!(row.maps_rpdo, pdo == "RX" && !sent, "{line}");
        assert_eq!(row.maps_tpdo, pdo == "TX" || sent, "{line}");
        let kept = nvm == "yes" || has(|o| matches!(o, Otherwise::Kept));
        assert_eq!(row.group != Group::None, kept, "{line}");

        check_range(&row, range, has(|o| matches!(o, Otherwise::FromZero)), line);
        let own = other.iter().find_map(|o| match o {
            Otherwise::Default(value) => Some(*value),
            _ => None,
        });
        check_default(&row, default, own, line);
    }
    assert_eq!(count, 69);
}

fn check_range(row: &Row, range: &str, from_zero: bool, line: &str) {
    let real = REAL_RANGES.iter().find(|real| real.object == row.address);
    if range == "-" {
        let signed_only = matches!((row.address.index, row.data_type), (0x6067 | 0x606D, _));
        // M11: windows have no negative size.
        assert!(signed_only || row.minimum.is_none(), "{line}");
        return;
    }
    let (least, greatest) = range.split_once("..").expect("a range");
    if row.data_type == DataType::F32 {
        let real = real.unwrap_or_else(|| panic!("{line}: no range"));
        assert_eq!(
            f64::from(real.least),
            f64::from(number(least) as f32),
            "{line}"
        );
        assert_eq!(
            f64::from(real.greatest),
            f64::from(number(greatest) as f32),
            "{line}"
        );
        return;
    }
    let least = match (least, from_zero) {
        (_, true) | ("", _) => 0,
        (text, false) => number(text) as i64,
    };
    assert_eq!(row.minimum, Some(least), "{line}");
    assert_eq!(row.maximum, Some(number(greatest) as i64), "{line}");
}

fn check_default(row: &Row, default: &str, own: Option<i64>, line: &str) {
    match (row.default, own) {
        (Default::Value(value), Some(own)) => assert_eq!(value, own, "{line}"),
        (Default::Value(value), None) => assert_eq!(value as f64, number(default), "{line}"),
        (Default::Real(value), _) => assert_eq!(f64::from(value), number(default), "{line}"),
        // A name of which nothing was written is empty; the page's 0 is no text.
        (Default::Text(text), _) => assert_eq!(text, default.trim_start_matches('0'), "{line}"),
        (other, _) => panic!("{line}: {other:?}"),
    }
}

#[test]
fn what_the_page_does_not_list_is_little_and_has_a_reason() {
    let mut more = Vec::new();
    for row in OBJECTS.table().rows() {
        if row.access == Access::Internal || (0x1400..0x1C00).contains(&row.address.index) {
            continue;
        }
        let named = format!("{:04X} {:02X}", row.address.index, row.address.sub);
        if !PAGE.contains(&named) {
            more.push((row.address.index, row.address.sub));
        }
    }
    assert_eq!(
        more,
        [
            // What every CANopen device has, as in the maker's data sheet.
            (0x1005, 0),
            (0x1014, 0),
            (0x1015, 0),
            (0x1018, 1),
            (0x1018, 2),
            (0x1018, 3),
            (0x1018, 4),
            (0x1200, 1),
            (0x1200, 2),
            // The watchdog whose warning 0x2004,8 has.
            (0x2000, 12),
            // M17: the quick stop's ramp, and what clips an acceleration.
            (0x6085, 0),
            (0x60C5, 0),
            (0x60C6, 0),
        ]
    );
}

#[test]
fn what_the_drive_keeps_for_itself_is_no_object() {
    let mut count = 0;
    for row in OBJECTS.table().rows() {
        if row.access == Access::Internal {
            count += 1;
            // Below what data sheets list.
            assert!(row.address.index < 0x1000, "{}", row.address);
            assert!(!row.readable() && !row.writable() && !row.maps_rpdo && !row.maps_tpdo);
        }
    }
    // The two tables of 32 places are a row each.
    assert_eq!(count, 13);
}

#[test]
fn pdos_are_mapped_as_the_page_says() {
    for (index, objects) in MAPPINGS {
        let count = row_of(*index, 0).expect("the count").default;
        assert_eq!(count, Default::Value(objects.len() as i64), "{index:04X}");
        for sub in 1..=8u8 {
            let row = row_of(*index, sub).expect("an entry");
            let wanted = objects.get(usize::from(sub) - 1).copied().unwrap_or(0);
            assert_eq!(
                row.default,
                Default::Value(wanted.into()),
                "{index:04X},{sub}"
            );
            if wanted != 0 {
                // Of that length, and mappable that way.
                let mapped = row_of((wanted >> 16) as u16, (wanted >> 8) as u8).expect("an object");
                assert_eq!(u32::from(mapped.data_type.bits()), wanted & 0xFF);
                assert!(if *index < 0x1800 {
                    mapped.maps_rpdo
                } else {
                    mapped.maps_tpdo
                });
            }
        }
    }
    // M8: the node ID is added.
    for (index, base) in [
        (0x1400, 0x200),
        (0x1403, 0x500),
        (0x1800, 0x180),
        (0x1803, 0x480),
    ] {
        let row = row_of(index, 1).expect("a COB-ID");
        assert_eq!(row.default, Default::PlusNode(base));
        assert_eq!(
            row_of(index, 2).expect("a type").default,
            Default::Value(254)
        );
    }
}

#[test]
fn modes_are_the_pages_and_6502_is_as_printed() {
    let offered = CIA402.modes();
    for mode in -16..=15 {
        let listed = [-1, 0, 1, 3, 8, 9].contains(&mode);
        assert_eq!(offered.contains(Mode(mode)), listed, "{mode}");
    }
    // M5: their true value is 389.
    assert_eq!(CIA402.supported_drive_modes(), 389);
    assert_eq!(row_of(0x6502, 0).expect("it").default, Default::Value(647));
    // What the page does not say is the standard's.
    assert_eq!(
        CIA402,
        cia402::Dialect {
            set_points_at_once: true,
            remote_bit: false,
            modes: CIA402.modes,
            resting_modes: CIA402.resting_modes,
            ..cia402::Dialect::STANDARD
        }
    );
    assert_eq!(
        CANOPEN,
        canopen::Dialect {
            zero_padded_writes: true,
            type_254_by_timer: true,
            boots_to_operational: true,
            lss: false,
            ..canopen::Dialect::STANDARD
        }
    );
}

#[test]
fn status_bits_are_in_order_and_errors_in_the_low_half() {
    let mut before = (0, 0);
    for bit in STATUS_BITS {
        assert!((bit.sub, bit.bit) > before, "{}", bit.name);
        before = (bit.sub, bit.bit);
        assert!((1..=8).contains(&bit.sub) && bit.sub != 6, "{}", bit.name);
        let is_error = matches!(bit.effect, Effect::Fault(_) | Effect::Critical(_));
        assert!(!is_error || bit.bit < 16, "{}", bit.name);
        if let Effect::Announced(_) = bit.effect {
            assert!(bit.bit >= 16, "{}", bit.name);
        }
    }
    let words: Vec<(u8, usize)> = (1..=8)
        .map(|sub| (sub, STATUS_BITS.iter().filter(|bit| bit.sub == sub).count()))
        .collect();
    assert_eq!(
        words,
        [
            (1, 8),
            (2, 8),
            (3, 5),
            (4, 3),
            (5, 6),
            (6, 0),
            (7, 6),
            (8, 1)
        ]
    );
}

#[test]
fn its_node_ids_are_the_can_ids_of_its_page() {
    assert_eq!(MD80.node_ids(), 1..=31);
    for other in personalities::ALL {
        if other.name != MD80.name {
            assert_eq!(other.node_ids(), 1..=127, "{}", other.name);
        }
    }
}

#[test]
fn each_error_has_a_row_of_the_fault_table() {
    let mut announced = STATUS_BITS.iter().filter_map(|bit| match bit.effect {
        Effect::Fault(code) => Some((code, Kind::Fault)),
        Effect::Critical(code) => Some((code, Kind::Critical)),
        Effect::Announced(code) => Some((code, Kind::Warning)),
        Effect::Shown => None,
    });
    // M32: errors of the bus have none.
    let of_bus: Vec<u16> = MD80
        .faults
        .iter()
        .filter(|row| !matches!(row.cause, Cause::Own(_)))
        .map(|row| row.code)
        .collect();
    assert_eq!(of_bus, [0x8110, 0x8120, 0x8140, 0x8210, 0x8220]);
    let own = MD80.faults.len() - of_bus.len();
    for (number, row) in MD80.faults.iter().take(own).enumerate() {
        assert_eq!(Some((row.code, row.kind)), announced.next());
        assert_eq!(row.cause, Cause::Own(number as u8));
        // M18.
        assert_eq!(row.register_bit, 0);
    }
    assert_eq!(announced.next(), None);
    // Critical ones, which a fault reset does not end.
    let critical = STATUS_BITS
        .iter()
        .filter(|bit| matches!(bit.effect, Effect::Critical(_)));
    let critical: Vec<(u8, u8)> = critical.map(|bit| (bit.sub, bit.bit)).collect();
    assert_eq!(critical, [(1, 0), (1, 5), (1, 6), (4, 0), (5, 5)]);
}

#[test]
fn the_sample_motor_can_be_stored() {
    let mut before = Vec::new();
    for setting in SAMPLE_MOTOR {
        let Address { index, sub } = setting.object;
        let row = row_of(index, sub).unwrap_or_else(|| panic!("{}", setting.object));
        assert!(row.group == Group::Application, "{}", setting.object);
        let room = usize::from(row.length.max(row.data_type.size()));
        if row.data_type == DataType::Text {
            assert!(setting.bytes.len() <= room);
        } else {
            assert_eq!(setting.bytes.len(), room, "{}", setting.object);
        }
        assert!(!before.contains(&setting.object), "{}", setting.object);
        before.push(setting.object);
        if let Some(range) = REAL_RANGES.iter().find(|r| r.object == setting.object) {
            let value = f32::from_le_bytes(setting.bytes.try_into().expect("a REAL32"));
            assert!((range.least..=range.greatest).contains(&value), "{value}");
        }
    }
}

#[test]
fn motion_is_in_counts_and_rpm_of_the_output() {
    let axis = &MD80.axes[0].objects;
    assert!(axis.gear.is_some());
    let counts = 16_384.0;
    assert_eq!(axis.targets.position.scale, 1.0);
    assert_eq!(axis.targets.velocity.scale, counts / 60.0);
    assert_eq!(axis.feedback.velocity.scale, counts / 60.0);
    assert_eq!(axis.configuration.acceleration.scale, counts / 60.0);
    assert!(matches!(
        MD80.axes[0].amplifier.gains.velocity,
        MotionLoop::Gains(_)
    ));
    assert_eq!(f64::from(REAL_RANGES[1].least), f64::from(5e-9_f32));
}

/// The line of each status bit in the drive's page of the documentation.
#[test]
fn the_documentation_has_every_status_bit() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/md80.md");
    let page = std::fs::read_to_string(page).expect("the page");
    for bit in STATUS_BITS {
        let effect = match bit.effect {
            Effect::Fault(code) => format!("fault 0x{code:04X}"),
            Effect::Critical(code) => format!("critical fault 0x{code:04X}"),
            Effect::Announced(code) => format!("warning 0x{code:04X}"),
            Effect::Shown => "shown".to_owned(),
        };
        let (sub, number, name, when) = (bit.sub, bit.bit, bit.name, bit.when);
        let line = format!("| {sub} | {number} | {name} | {effect} | {when} |");
        assert!(page.contains(&line), "{line}");
    }
}
