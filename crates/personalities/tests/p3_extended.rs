//! The extended P3 against the faithful one: what it shares, what it adds, and what CiA 402 says of
//! the objects that it adds.

use canopen::{Access, DataType, Row, Table};
use personalities::p3::{self, P3};
use personalities::p3_extended::{self, P3_EXTENDED};
use personalities::{Cause, FaultRow, Kind, States, Switch};

fn tables() -> (Table, Table) {
    (p3::OBJECTS.table(), p3_extended::OBJECTS.table())
}

fn row_of(table: &Table, index: u16, sub: u8) -> Option<Row> {
    let entry = table.find(index, sub).ok()?;
    table.row(&entry).copied()
}

/// Whether an object belongs to the application, 0x2000 and above.
fn is_application(row: &Row) -> bool {
    row.address.index >= 0x2000
}

#[test]
fn every_application_object_of_the_p3_is_there_and_all_but_four_are_the_same() {
    let (faithful, extended) = tables();
    let mut otherwise = Vec::new();
    for row in faithful.rows().iter().filter(|row| is_application(row)) {
        let address = row.address;
        // The node ID: LSS gives it here.
        if address.index == 0x21B0 {
            continue;
        }
        let other = row_of(&extended, address.index, address.sub)
            .unwrap_or_else(|| panic!("{address} is missing"));
        if other != *row {
            otherwise.push(address.index);
        }
    }
    // The quick stop option code is an INTEGER16, 0x603F the present error, and there are more homing
    // methods and modes.
    assert_eq!(otherwise, [0x603F, 0x605A, 0x6098, 0x6502]);
}

#[test]
fn what_it_adds() {
    use DataType::{Domain, I8, I16, I32, U8, U16, U32};
    // Targets and commands, which are not stored.
    const TARGETS: [(u16, u8); 2] = [(0x6042, 0), (0x60C1, 1)];
    // Neither is what never changes or cannot be read.
    const CONSTANT: [(u16, u8); 4] = [(0x60A3, 0), (0x60C4, 1), (0x60C4, 5), (0x60C4, 6)];
    let (faithful, extended) = tables();
    let mut added = Vec::new();
    for row in extended.rows().iter().filter(|row| is_application(row)) {
        let address = row.address;
        if faithful.find(address.index, address.sub).is_err() {
            let writable = row.access == Access::ReadWrite;
            added.push((address.index, address.sub, row.data_type, writable));
        }
    }
    // Which reading of the I²t formula; the P4's name for the terminating resistor.
    let mut expected: Vec<_> = vec![(0x2113, 0, U8, true), (0x21B2, 0, U8, true)];
    expected.extend((1..=12).map(|sub| (0x2410, sub, U8, true)));
    // Memory for transfers of masters under test; then types and access of CiA 402.
    expected.extend([
        (0x2420, 0, Domain, true),
        // Homing and inputs, what the standard leaves to makers.
        (0x2430, 1, I16, true),
        (0x2430, 2, U16, true),
        (0x2430, 3, U32, true),
        (0x2430, 4, U32, true),
        (0x2430, 5, U32, true),
        (0x2430, 6, U8, false),
        (0x2430, 7, U32, true),
        (0x2431, 1, U32, true),
        (0x2431, 2, U8, true),
        (0x2431, 3, U8, true),
        (0x2431, 4, U8, true),
        (0x2431, 5, U8, true),
        (0x2431, 6, U16, true),
        (0x2431, 7, U16, true),
        (0x2432, 1, U8, true),
        (0x2432, 2, U16, true),
        (0x2432, 3, I32, true),
        (0x2432, 4, U16, true),
        (0x2432, 5, U16, false),
        (0x2432, 6, U16, false),
        (0x2433, 1, U8, true),
        (0x2433, 2, U8, false),
        (0x6007, 0, I16, true),
        (0x6042, 0, I16, true),
        (0x6044, 0, I16, false),
        (0x6048, 1, U32, true),
        (0x6048, 2, U16, true),
        (0x6049, 1, U32, true),
        (0x6049, 2, U16, true),
        (0x604A, 1, U32, true),
        (0x604A, 2, U16, true),
        (0x604B, 1, I16, true),
        (0x604B, 2, I16, true),
        (0x604C, 1, I32, true),
        (0x604C, 2, I32, true),
        (0x605B, 0, I16, true),
        (0x605C, 0, I16, true),
        (0x605D, 0, I16, true),
        (0x605E, 0, I16, true),
        (0x6067, 0, U32, true),
        (0x6068, 0, U16, true),
        (0x606B, 0, I32, false),
        (0x6074, 0, I16, false),
        (0x6085, 0, U32, true),
        (0x6086, 0, I16, true),
        (0x6087, 0, U32, true),
        (0x6099, 1, U32, true),
        (0x6099, 2, U32, true),
        (0x609A, 0, U32, true),
        (0x60A3, 0, U8, false),
        (0x60A4, 1, U32, true),
        (0x60C0, 0, I16, true),
        (0x60C1, 1, I32, true),
        (0x60C4, 1, U32, false),
        (0x60C4, 2, U32, true),
        (0x60C4, 3, U8, true),
        (0x60C4, 4, U16, false),
        (0x60C4, 5, U8, false),
        (0x60C4, 6, U8, false),
    ]);
    // Touch probes.
    expected.extend([(0x60B8, 0, U16, true), (0x60B9, 0, U16, false)]);
    expected.extend((0x60BA..=0x60BD).map(|index| (index, 0, I32, false)));
    expected.extend((0x60D5..=0x60D8).map(|index| (index, 0, U16, false)));
    let methods = cia402::HomingMethod::ALL.len() as u8;
    expected.extend((1..=methods).map(|sub| (0x60E3, sub, I8, false)));
    expected.push((0x60FD, 0, U32, false));
    expected.extend([(0x60FE, 1, U32, true), (0x60FE, 2, U32, true)]);
    expected.sort_by_key(|object| (object.0, object.1));
    assert_eq!(added, expected);
    for (index, sub, _, writable) in added {
        let row = row_of(&extended, index, sub).expect("the row");
        if TARGETS.contains(&(index, sub)) {
            assert!(row.maps_rpdo && row.group == canopen::Group::None);
        } else if CONSTANT.contains(&(index, sub)) {
            assert!(!row.is_live && !row.maps_tpdo, "{}", row.address);
        } else if row.data_type == Domain {
            assert_eq!(row.group, canopen::Group::None, "a stream is not stored");
        } else if [(0x60B8, 0), (0x60FE, 1)].contains(&(index, sub)) {
            assert!(row.maps_rpdo, "what a master asks for is not stored");
            assert_eq!(row.group, canopen::Group::None);
        } else if writable {
            assert_eq!(row.group, canopen::Group::Application, "{}", row.address);
        } else if index == 0x60E3 {
            let method = i64::from(cia402::HomingMethod::ALL[usize::from(sub) - 1]);
            assert_eq!(row.default, canopen::row::Default::Value(method));
        } else {
            assert!(row.is_live && row.maps_tpdo, "{}", row.address);
        }
    }
}

/// The object that makes an error possible, as a field of the image.
fn field(switch: Switch) -> Option<canopen::Field> {
    match switch {
        Switch::Object(object) => Some(object.field),
        _ => None,
    }
}

#[test]
fn each_error_of_the_manual_has_an_object_and_is_otherwise_the_same() {
    let alike = |row: &FaultRow| {
        (
            row.cause,
            row.code,
            row.kind,
            row.register_bit,
            row.status_bit,
            row.states,
        )
    };
    assert!(P3_EXTENDED.faults.len() > P3.faults.len());
    let mut sub = 0;
    for (faithful, extended) in P3.faults.iter().zip(P3_EXTENDED.faults) {
        assert_eq!(alike(faithful), alike(extended));
        let unnamed = matches!(faithful.switch, Switch::Always | Switch::Off);
        if unnamed {
            sub += 1;
            let object = p3_extended::OBJECTS.field(0x2410, sub);
            assert!(
                object.is_some() && field(extended.switch) == object,
                "{sub}"
            );
            // At first on where the faithful drive has it always on.
            let row = row_of(&p3_extended::OBJECTS.table(), 0x2410, sub).expect("the row");
            let on = matches!(faithful.switch, Switch::Always);
            assert_eq!(
                row.default,
                canopen::row::Default::Value(on.into()),
                "{sub}"
            );
            assert_eq!((row.minimum, row.maximum), (Some(0), Some(1)), "{sub}");
        } else {
            assert!(!matches!(extended.switch, Switch::Always | Switch::Off));
        }
    }
    assert_eq!(sub, 12);
}

#[test]
fn errors_of_communication_are_warnings_in_bit_4() {
    let (torque_off, communication) = P3_EXTENDED.faults[P3.faults.len()..]
        .split_last()
        .expect("rows");
    assert_eq!(torque_off.cause, Cause::TorqueOff);
    let object = p3_extended::OBJECTS.field(0x2433, 1);
    assert!(object.is_some() && field(torque_off.switch) == object);
    let more: Vec<_> = communication
        .iter()
        .map(|row| {
            assert_eq!(row.kind, Kind::Warning);
            assert_eq!(row.states, States::All);
            assert_eq!(row.register_bit, 4, "CiA 301, 0x1001: communication");
            assert!(matches!(row.switch, Switch::Always));
            (row.cause, row.code, row.status_bit)
        })
        .collect();
    assert_eq!(
        more,
        [
            (Cause::HeartbeatLost, 0x8130, 27),
            (Cause::PdoTooShort, 0x8210, 28),
            (Cause::PdoTooLong, 0x8220, 28),
            (Cause::SyncLength, 0x8240, 29),
            (Cause::RpdoTimeout, 0x8250, 30),
            (Cause::ErrorPassive, 0x8120, 31),
        ]
    );
}

#[test]
fn its_dialects_are_the_standards() {
    let canopen = canopen::Dialect {
        // 0x1F80 says whether, and holds it back at first.
        boots_to_operational: true,
        ..canopen::Dialect::STANDARD
    };
    assert_eq!(P3_EXTENDED.device.dialect, canopen);
    let standard = cia402::Dialect {
        modes: P3
            .cia402
            .modes
            .with(cia402::Mode::VELOCITY)
            .with(cia402::Mode::INTERPOLATED_POSITION),
        ..cia402::Dialect::STANDARD
    };
    assert_eq!(P3_EXTENDED.cia402, standard);
    assert_eq!(P3_EXTENDED.cia402.supported_drive_modes(), 0x07EF);
    assert_eq!(P3.cia402.supported_drive_modes(), 0x07AD);
    assert!(standard.halt_bit && standard.remote_bit && standard.ramps_on_stop);
    assert!(!P3.cia402.halt_bit);
    assert!(personalities::by_name("p3-extended").is_some());
}

#[test]
fn names_are_unique() {
    let mut names: Vec<_> = personalities::ALL.iter().map(|drive| drive.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), personalities::ALL.len());
    assert_eq!(personalities::ALL[0].name, "p3", "the default");
}
