//! 0x2003 and 0x1010: commands, and when they are taken.

use crate::bench::*;

#[test]
fn system_commands_want_the_service_mode() {
    const STATE: Result<(), u32> = Err(0x0800_0022);
    let mut master = quiet();
    for sub in 1..=6 {
        assert_eq!(master.try_write(NODE, 0x2003, sub, &[1]), STATE, "{sub}");
    }
    // As the maker's tool does it: 8, 6, 15, then −2, which shows as −1 (M3, M4).
    for word in [8, 6, 15] {
        master.write_u16(NODE, 0x6040, 0, word);
    }
    mode(&mut master, -2);
    assert_eq!(master.read(NODE, 0x6060, 0) as i8, -2);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, -1);
    // It writes a 6 here, too, before it saves.
    mode(&mut master, 6);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, -1);
    assert_eq!(master.try_write(NODE, 0x6060, 0, &[4]), Err(0x0609_0030));
    master.write(NODE, 0x2003, 1, &[1]);
    master.write(NODE, 0x2003, 3, &[0]);
    // Not in "ready to switch on".
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.try_write(NODE, 0x2003, 1, &[1]), STATE);
    // As the page says it.
    master.write_u16(NODE, 0x6040, 0, 0);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 5, &[1]);
    master.run_ms(3);
    assert_eq!(master.position(NODE), 0);
    // There is no output encoder.
    assert_eq!(master.try_write(NODE, 0x2003, 4, &[1]), STATE);
    master.log.clear();
    master.write(NODE, 0x2003, 2, &[1]);
    master.run_ms(100);
    assert!(booted(&master), "reset");
}

#[test]
fn a_save_wants_switch_on_disabled_and_ends_in_a_reset() {
    let mut master = quiet();
    master.write(NODE, 0x2001, 1, &1.5_f32.to_le_bytes());
    master.write_u16(NODE, 0x6040, 0, 6);
    assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Err(0x0800_0022));
    master.write_u16(NODE, 0x6040, 0, 0);
    assert_eq!(master.try_write(NODE, 0x1010, 1, b"evas"), Err(0x0800_0020));
    master.log.clear();
    assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Ok(()));
    assert!(!booted(&master), "the acknowledge comes first");
    master.run_ms(200);
    assert!(booted(&master));
    assert_eq!(real(&mut master, 0x2001, 1), 1.5);
    assert_eq!(master.read(NODE, 0x2000, 10), i32::from(NODE));
}

#[test]
fn a_position_set_to_zero_and_saved_is_there_after_the_start() {
    let mut master = quiet();
    ramps(&mut master, 600);
    enable(&mut master, 1);
    let start = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, start + 500);
    master.run_ms(1500);
    master.write_u16(NODE, 0x6040, 0, 0);
    mode(&mut master, -1);
    master.write(NODE, 0x2003, 5, &[1]);
    master.run_ms(5);
    assert!(master.position(NODE).abs() <= 1);
    master.write(NODE, 0x1010, 1, &SAVE);
    master.run_ms(300);
    assert!(
        master.position(NODE).abs() <= 1,
        "{}",
        master.position(NODE)
    );
}

/// Controlwords that lead from "switch on disabled" to each state.
const WAYS: &[(u16, &[u16])] = &[
    (SWITCH_ON_DISABLED, &[]),
    (READY_TO_SWITCH_ON, &[6]),
    (0x23, &[6, 7]),
    (OPERATION_ENABLED, &[6, 15]),
];

#[test]
fn every_command_is_refused_in_every_other_state_and_mode() {
    let mut refused = 0;
    for (state, words) in WAYS {
        for in_mode in [-1, 0, 1, 3, 8, 9] {
            let may = matches!(*state, SWITCH_ON_DISABLED | OPERATION_ENABLED) && in_mode == -1;
            if may {
                continue;
            }
            let mut master = quiet();
            mode(&mut master, in_mode);
            for word in *words {
                master.write_u16(NODE, 0x6040, 0, *word);
            }
            assert_eq!(master.state(NODE), *state);
            for sub in 1..=6 {
                let result = master.try_write(NODE, 0x2003, sub, &[1]);
                assert_eq!(result, Err(0x0800_0022), "{sub} {state:02X} {in_mode}");
                refused += 1;
                // 0 starts nothing, anywhere.
                assert_eq!(master.try_write(NODE, 0x2003, sub, &[0]), Ok(()));
                assert_eq!(master.read(NODE, 0x2003, sub) as u8, 0);
            }
        }
    }
    assert_eq!(refused, 6 * (4 * 6 - 2));
    // Nor in a fault.
    let mut master = quiet();
    mode(&mut master, -1);
    master.drive(NODE).plant().set_supply_v(60.0);
    master.run_ms(50);
    assert_eq!(master.state(NODE), FAULT);
    for sub in 1..=6 {
        assert_eq!(master.try_write(NODE, 0x2003, sub, &[1]), Err(0x0800_0022));
    }
    assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Err(0x0800_0022));
}

#[test]
fn a_save_is_refused_in_every_state_but_one() {
    for (state, words) in WAYS {
        let mut master = quiet();
        for word in *words {
            master.write_u16(NODE, 0x6040, 0, *word);
        }
        let wanted = match *state {
            SWITCH_ON_DISABLED => Ok(()),
            _ => Err(0x0800_0022),
        };
        let result = master.try_write(NODE, 0x1010, 1, &SAVE);
        assert_eq!(result, wanted, "{state:02X}");
    }
    let mut master = quiet();
    for wrong in [[0; 4], [1, 0, 0, 0], *b"SAVE", *b"evas"] {
        let result = master.try_write(NODE, 0x1010, 1, &wrong);
        assert_eq!(result, Err(0x0800_0020), "no signature");
    }
    assert_eq!(master.try_write(NODE, 0x1010, 1, b"sav"), Err(0x0607_0013));
}

#[test]
fn nothing_else_is_taken_while_a_command_is_at_work() {
    for (at_work, value) in [(3, 1), (6, 0xFF)] {
        let mut master = quiet();
        mode(&mut master, -1);
        // M28: any value other than 0.
        master.write(NODE, 0x2003, at_work, &[value]);
        master.run_ms(100);
        for sub in 1..=6 {
            let result = master.try_write(NODE, 0x2003, sub, &[1]);
            assert_eq!(result, Err(0x0800_0022), "{at_work} {sub}");
        }
        assert_eq!(master.try_write(NODE, 0x1010, 1, &SAVE), Err(0x0800_0022));
        assert_eq!(master.read(NODE, 0x2003, at_work) as u8, 0);
    }
}
