//! The Roboteq's rows against the tables of its document, and its state machine.

use can::BitRate;
use canopen::{Access, Address, DataType, Default, Group, Row};
use cia402::{Controlword, Mode, State};
use personalities::Personality;
use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2, ROBOTEQ_3, mode, with_channels};

const ALL: [&Personality; 3] = [&ROBOTEQ, &ROBOTEQ_2, &ROBOTEQ_3];

fn row(personality: &Personality, index: u16, sub: u8) -> Row {
    let table = personality.device.table;
    let entry = table.find(index, sub).expect("the object");
    *table.row(&entry).expect("its row")
}

/// The columns of tables 4 to 39: offset from the window, sub-index, type, access, PDO, default. What a
/// resolution changes is marked.
const TABLES: [(u16, u8, DataType, Access, &str, i64); 26] = {
    use Access::{Constant, ReadOnly, ReadWrite};
    use DataType::{I8, I16, I32, U16, U32};
    [
        (0x40, 0, U16, ReadWrite, "R", 0),
        (0x41, 0, U16, ReadOnly, "T", 0),
        (0x42, 0, I16, ReadWrite, "R", 0),
        (0x43, 0, I16, ReadOnly, "T", 0),
        (0x44, 0, I16, ReadOnly, "T", 0),
        (0x46, 1, U32, ReadWrite, "R", 0),
        (0x46, 2, U32, ReadWrite, "R", 1000),
        (0x48, 1, U32, ReadWrite, "R", 20_000),
        (0x48, 2, U16, ReadWrite, "R", 1),
        (0x49, 1, U32, ReadWrite, "R", 20_000),
        (0x49, 2, U16, ReadWrite, "R", 1),
        (0x60, 0, I8, ReadWrite, "R", 0),
        (0x61, 0, I8, ReadOnly, "T", 0), // R15: blank in the table
        (0x64, 0, I32, ReadOnly, "T", 0),
        (0x6C, 0, I32, ReadOnly, "T", 0),
        (0x71, 0, I16, ReadWrite, "R", 0),
        (0x77, 0, I16, ReadOnly, "T", 0),
        (0x7A, 0, I32, ReadWrite, "R", 0),
        (0x81, 0, U32, ReadWrite, "R", 1000),
        (0x83, 0, U32, ReadWrite, "R", 20_000),
        (0x84, 0, U32, ReadWrite, "R", 20_000),
        (0x87, 0, U32, ReadWrite, "R", 20_000),
        (0xFF, 0, I32, ReadWrite, "R", 0), // R8: U32 in the table
        (0x502, 0, U32, Constant, "N", 0x0F),
        (0x7FE, 0, U32, Constant, "N", 0x0004_0100),
        (0x46, 0, DataType::U8, Constant, "N", 2), // generated
    ]
};

#[test]
fn every_object_of_the_tables_is_there_in_each_channel_as_printed() {
    for (personality, channels) in ALL.into_iter().zip(1_u16..) {
        for window in (0..channels).map(|n| 0x6000 + 0x800 * n) {
            for (offset, sub, data_type, access, pdo, default) in TABLES {
                if sub == 0 && offset == 0x46 {
                    let table = personality.device.table;
                    assert_eq!(table.highest_sub_index(window + offset), Some(2));
                    continue;
                }
                let row = row(personality, window + offset, sub);
                let name = row.name;
                assert_eq!(row.data_type, data_type, "{name}");
                assert_eq!(row.access, access, "{name}");
                assert_eq!(
                    (row.maps_rpdo, row.maps_tpdo),
                    (pdo == "R", pdo == "T"),
                    "{name}"
                );
                assert_eq!(row.default, Default::Value(default), "{name}");
                // No range is printed, and none is stored: what is kept is what ^ sets.
                assert_eq!((row.minimum, row.maximum), (None, None), "{name}");
                assert_eq!(row.group, Group::None, "{name}");
            }
        }
    }
}

#[test]
fn a_window_holds_what_the_document_has_and_nothing_else() {
    for (personality, channels) in ALL.into_iter().zip(1..) {
        let table = personality.device.table;
        let in_profile = table
            .rows()
            .iter()
            .filter(|row| row.address.index >= 0x6000);
        assert_eq!(in_profile.count(), 25 * channels);
        assert_eq!(personality.axes.len(), channels);
        assert!(std::ptr::eq(
            with_channels(channels as u8).expect("so many"),
            personality
        ));
    }
    assert!(with_channels(0).is_none() && with_channels(4).is_none());
}

#[test]
fn pdos_carry_user_variables() {
    for (n, first) in (0_u16..4).zip([1_i64, 3, 5, 7]) {
        let rpdo = |sub: i64| 0x2005_0020 | (first + 7 + sub) << 8;
        let tpdo = |sub: i64| 0x2106_0020 | (first - 1 + sub) << 8;
        for sub in 1..=2_u8 {
            let received = row(&ROBOTEQ, 0x1600 + n, sub).default;
            assert_eq!(received, Default::Value(rpdo(i64::from(sub))));
            let sent = row(&ROBOTEQ, 0x1A00 + n, sub).default;
            assert_eq!(sent, Default::Value(tpdo(i64::from(sub))));
        }
        assert_eq!(row(&ROBOTEQ, 0x1600 + n, 0).default, Default::Value(2));
        assert_eq!(row(&ROBOTEQ, 0x1A00 + n, 0).default, Default::Value(2));
        let base = 0x180 + 0x100 * u32::from(n);
        let cob_id = row(&ROBOTEQ, 0x1800 + n, 1).default;
        assert_eq!(cob_id, Default::PlusNode(0x4000_0000 | base));
        let cob_id = row(&ROBOTEQ, 0x1400 + n, 1).default;
        assert_eq!(cob_id, Default::PlusNode(base + 0x80));
    }
}

#[test]
fn what_a_serial_line_configures_is_kept() {
    let stored: Vec<Address> = ROBOTEQ_3
        .device
        .table
        .rows()
        .iter()
        .filter(|row| row.group == Group::Application)
        .map(|row| row.address)
        .collect();
    // FSA, RWD and three limits, and ten things for each channel.
    assert_eq!(stored.len(), 5 + 3 * 10);
    assert!(stored.iter().all(|address| address.index >> 12 == 3));
    assert_eq!(row(&ROBOTEQ, 0x30F1, 0).default, Default::Value(0));
    // The maker's user manual V1.8: 0 to 65,000 ms, at first 1,000.
    let watchdog = row(&ROBOTEQ, 0x3008, 0);
    assert_eq!(watchdog.default, Default::Value(1000));
    assert_eq!(
        (watchdog.minimum, watchdog.maximum),
        (Some(0), Some(65_000))
    );
}

/// Table 1.
#[test]
fn numbers_of_modes() {
    let table = [
        (-4, Mode::VELOCITY),
        (-3, Mode::PROFILE_VELOCITY),
        (-2, Mode::CYCLIC_POSITION), // profile position, without a profile
        (-1, Mode::PROFILE_POSITION),
        (0, Mode::IDLE), // open loop
        (1, Mode::PROFILE_POSITION),
        (2, Mode::VELOCITY),
        (3, Mode::PROFILE_VELOCITY),
        (4, Mode::PROFILE_TORQUE),
    ];
    for number in i8::MIN..=i8::MAX {
        let expected = table.iter().find(|(other, _)| *other == number);
        assert_eq!(mode(number), expected.map(|(_, mode)| *mode), "{number}");
    }
    assert_eq!(BitRate::Kbit125, ROBOTEQ.bit_rates[0]);
}

/// Table 6 with R1, R3 and R22: the command that bits 7 and 3 to 0 mean, and what it does in each state.
fn by_the_document(state: State, before: u16, word: u16) -> State {
    use State::{
        Fault, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn,
    };
    if word & 0x80 != 0 {
        return match state {
            Fault if before & 0x80 == 0 => SwitchOnDisabled, // 15, R4
            _ => state,
        };
    }
    match (word & 0x0F, state) {
        // Disable voltage, bit 1 is 0: 7, 10, 9, 12.
        (0x0 | 0x1 | 0x4 | 0x5 | 0x8 | 0x9 | 0xC | 0xD, ReadyToSwitchOn | SwitchedOn)
        | (0x0 | 0x1 | 0x4 | 0x5 | 0x8 | 0x9 | 0xC | 0xD, OperationEnabled | QuickStopActive) => {
            SwitchOnDisabled
        }
        // Quick stop, bits 2 and 1 are 01: 7, 10, 11.
        (0x2 | 0x3 | 0xA | 0xB, ReadyToSwitchOn | SwitchedOn) => SwitchOnDisabled,
        (0x2 | 0x3 | 0xA | 0xB, OperationEnabled) => QuickStopActive,
        // Shutdown, R1: bits 2 to 0 are 110: 2, 6, 8.
        (0x6 | 0xE, SwitchOnDisabled | SwitchedOn | OperationEnabled) => ReadyToSwitchOn,
        // Switch on, or disable operation: 3, 5.
        (0x7, ReadyToSwitchOn | OperationEnabled) => SwitchedOn,
        // Enable operation: 3 with 4, 4. R3: no 16.
        (0xF, ReadyToSwitchOn | SwitchedOn) => OperationEnabled,
        _ => state,
    }
}

#[test]
fn every_controlword_in_every_state_after_every_other() {
    let mut count = 0;
    for state in State::ALL {
        for before in [0x00_u16, 0x80] {
            for word in 0..=u16::MAX {
                let step = state.written(
                    Controlword(before),
                    Controlword(word),
                    // Quick stop mode is always 2.
                    false,
                    &ROBOTEQ.cia402,
                );
                let expected = by_the_document(state, before, word);
                assert_eq!(step.state, expected, "{state}, {before:04X}, {word:04X}");
                count += 1;
            }
        }
    }
    assert_eq!(count, 8 * 2 * 65_536);
}
