//! What a drive's document offers a master, and what it calls things, is there in its dictionary.

use canopen::{Address, DataType, Row};
use personalities::operation::Machine;
use personalities::{ALL, Personality};

fn row(drive: &Personality, object: Address) -> &'static Row {
    let table = &drive.device.table;
    let entry = table.find(object.index, object.sub);
    let entry = entry.unwrap_or_else(|_| panic!("{}: {object}", drive.name));
    table.row(&entry).unwrap()
}

#[test]
fn every_named_bit_is_one_of_an_object() {
    for drive in ALL {
        let mut last = None;
        for (object, bit, name) in drive.words.bits {
            // FM of channels that this controller does not have.
            if object.index == 0x2122 && usize::from(object.sub) > drive.axes.len() {
                continue;
            }
            let bits = 8 * u32::from(row(drive, *object).data_type.size());
            assert!(u32::from(*bit) < bits, "{}: {object} {bit}", drive.name);
            assert!(!name.is_empty(), "{}: {object} {bit}", drive.name);
            let key = Some((object.index, object.sub, *bit));
            assert!(last < key, "{}: {object} {bit} is there twice", drive.name);
            last = key;
        }
    }
}

#[test]
fn named_modes_can_be_chosen_and_named_errors_are_announced() {
    for drive in ALL {
        for (mode, name) in drive.words.modes {
            // The MD80's -2 is taken for -1 (M3).
            let offered = drive.offers(*mode) || *mode == -2;
            assert!(offered && !name.is_empty(), "{}: {mode}", drive.name);
        }
        for (mode, standard) in drive.words.mode_bits {
            assert!(drive.offers(*mode) && *mode < 0, "{}: {mode}", drive.name);
            assert!(standard.0 > 0, "{}: {mode}", drive.name);
        }
        for (code, _) in drive.words.errors {
            let announced = drive.faults.iter().any(|fault| fault.code == *code);
            assert!(announced, "{}: 0x{code:04X}", drive.name);
        }
    }
}

#[test]
fn a_master_can_do_what_it_is_told() {
    for drive in ALL {
        let operation = &drive.operation;
        for setting in operation.prepare {
            let row = row(drive, setting.object);
            let size = usize::from(row.data_type.size());
            assert_eq!(
                setting.bytes.len(),
                size,
                "{}: {}",
                drive.name,
                setting.object
            );
        }
        assert!(!operation.ways.is_empty(), "{}", drive.name);
        for way in operation.ways {
            assert!(drive.offers(way.mode), "{}: {}", drive.name, way.mode);
            for index in [way.target, way.actual] {
                for axis in 0..drive.axes.len() as u16 {
                    row(drive, Address::new(index + 0x800 * axis, 0));
                }
            }
        }
        // Without a state machine the statusword does not change by itself.
        let statusword = row(drive, Address::new(0x6041, 0));
        assert_eq!(
            operation.machine == Machine::None,
            !statusword.is_live,
            "{}",
            drive.name
        );
    }
}

#[test]
fn calibrations_are_of_objects_that_are_there() {
    for drive in ALL {
        for own in drive.commissioning.calibrations {
            for command in [own.command, own.probe] {
                assert_eq!(
                    row(drive, command).data_type,
                    DataType::Bool,
                    "{}",
                    own.name
                );
            }
            assert!(drive.offers(own.mode), "{}", own.name);
            for set_up in own.set_up {
                row(drive, set_up.object);
            }
            for object in own.results.iter().chain(own.status) {
                row(drive, *object);
            }
            let (object, bit) = own.failed.unwrap();
            assert!(own.status.contains(&object), "{}", own.name);
            let named = drive.words.bits.iter();
            assert!(
                named
                    .clone()
                    .any(|(of, number, _)| (*of, *number) == (object, bit)),
                "{}",
                own.name
            );
        }
        let has_own = !drive.commissioning.calibrations.is_empty();
        assert!(
            !has_own || drive.commissioning.calibrating.is_some(),
            "{}",
            drive.name
        );
    }
}
