//! The page's tables of states, commands and transitions, exhaustively: each state × each combination of
//! the controlword's bits 7, 3, 2, 1, 0 × bit 7 before.

use crate::bench::*;

const SWITCHED_ON: u16 = 0x23;

/// "Command" table: bits 7, 3, 2, 1, 0. M2: bit 1 is "enable voltage".
const COMMANDS: &[(&str, &str)] = &[
    ("shutdown", "0 x110"),
    ("switch on", "0 0111"),
    ("switch on and enable operation", "0 1111"),
    ("disable voltage", "0 xx0x"),
    ("quick stop", "0 x01x"),
    ("disable operation", "0 0111"),
    ("enable operation", "0 1111"),
];

/// "Transition" table: number, state, command, state. Those that are not here have no command (0, 1,
/// 12, 13, 14), or are the fault reset's (15). M23: 7 and 10 are the standard's.
const TRANSITIONS: &[(u8, u16, &str, u16)] = &[
    (2, SWITCH_ON_DISABLED, "shutdown", READY_TO_SWITCH_ON),
    (3, READY_TO_SWITCH_ON, "switch on", SWITCHED_ON),
    // 3 and 4 at once: the page's example goes 6, 15.
    (
        3,
        READY_TO_SWITCH_ON,
        "switch on and enable operation",
        OPERATION_ENABLED,
    ),
    (4, SWITCHED_ON, "enable operation", OPERATION_ENABLED),
    (5, OPERATION_ENABLED, "disable operation", SWITCHED_ON),
    (6, SWITCHED_ON, "shutdown", READY_TO_SWITCH_ON),
    (7, READY_TO_SWITCH_ON, "quick stop", SWITCH_ON_DISABLED),
    (7, READY_TO_SWITCH_ON, "disable voltage", SWITCH_ON_DISABLED),
    (8, OPERATION_ENABLED, "shutdown", READY_TO_SWITCH_ON),
    (9, OPERATION_ENABLED, "disable voltage", SWITCH_ON_DISABLED),
    (10, SWITCHED_ON, "disable voltage", SWITCH_ON_DISABLED),
    (10, SWITCHED_ON, "quick stop", SWITCH_ON_DISABLED),
    (11, OPERATION_ENABLED, "quick stop", QUICK_STOP_ACTIVE),
    (12, QUICK_STOP_ACTIVE, "disable voltage", SWITCH_ON_DISABLED),
];

fn matches(pattern: &str, word: u16) -> bool {
    let bits = pattern.chars().filter(|c| *c != ' ').zip([7, 3, 2, 1, 0]);
    bits.into_iter().all(|(wanted, bit)| match wanted {
        '0' => word & 1 << bit == 0,
        '1' => word & 1 << bit != 0,
        _ => true,
    })
}

fn expected(from: u16, word: u16, bit_7_before: bool) -> u16 {
    if word & 0x80 != 0 {
        // 15, on a rising edge; any other command wants bit 7 to be 0.
        return match from {
            FAULT if !bit_7_before => SWITCH_ON_DISABLED,
            other => other,
        };
    }
    let commands: Vec<&str> = COMMANDS
        .iter()
        .filter(|(_, pattern)| matches(pattern, word))
        .map(|(name, _)| *name)
        .collect();
    let mut found: Vec<u16> = TRANSITIONS
        .iter()
        .filter(|(_, state, command, _)| *state == from && commands.contains(command))
        .map(|(.., to)| *to)
        .collect();
    found.dedup();
    assert!(found.len() <= 1, "{from:02X} {word:02X}: {found:02X?}");
    found.first().copied().unwrap_or(from)
}

/// Turns at 100 RPM; a quick stop would take a second.
fn turning() -> Master {
    let mut master = quiet();
    ramps(&mut master, 2000);
    master.write_i32(NODE, 0x6085, 0, 100);
    master.write_i32(NODE, 0x60FF, 0, 100);
    enable(&mut master, 3);
    master.run_ms(300);
    master
}

/// A drive in that state; the controlword's bit 7 was last written so.
fn brought(to: u16, bit_7: bool) -> Master {
    let mut master = match to {
        QUICK_STOP_ACTIVE => turning(),
        _ => quiet(),
    };
    let words: &[u16] = match to {
        READY_TO_SWITCH_ON => &[6],
        SWITCHED_ON => &[6, 7],
        OPERATION_ENABLED => &[6, 7, 15],
        QUICK_STOP_ACTIVE => &[2],
        FAULT_REACTION_ACTIVE => &[6, 15],
        _ => &[0],
    };
    for word in words {
        master.write_u16(NODE, 0x6040, 0, *word);
    }
    if bit_7 {
        // No other state than a fault knows it.
        master.write_u16(NODE, 0x6040, 0, 0x80);
    }
    if to == FAULT {
        master.drive(NODE).plant().set_supply_v(60.0);
        master.run_ms(50);
        master.drive(NODE).plant().set_supply_v(48.0);
        master.run_ms(50);
    }
    if to == FAULT_REACTION_ACTIVE {
        // Beyond its limits in a mode of motion: until the next millisecond (13, 14).
        let here = master.position(NODE);
        master.write_i32(NODE, 0x607D, 1, here + TURN);
        master.write_i32(NODE, 0x607D, 2, here + 2 * TURN);
        mode(&mut master, 3);
        for _ in 0..10 {
            if master.state(NODE) == to {
                return master;
            }
            master.run_us(100);
        }
    }
    assert_eq!(master.state(NODE), to);
    master
}

#[test]
fn every_command_in_every_state_leads_where_the_page_says() {
    let mut taken = Vec::new();
    for from in [
        SWITCH_ON_DISABLED,
        READY_TO_SWITCH_ON,
        SWITCHED_ON,
        OPERATION_ENABLED,
        QUICK_STOP_ACTIVE,
        FAULT,
    ] {
        for bits in 0..32u16 {
            let word = bits & 0x0F | (bits & 0x10) << 3;
            for bit_7_before in [false, true] {
                let mut master = brought(from, bit_7_before);
                master.write_u16(NODE, 0x6040, 0, word);
                let to = master.state(NODE);
                let wanted = expected(from, word, bit_7_before);
                assert_eq!(to, wanted, "{from:02X}, {word:02X}, {bit_7_before}");
                taken.push((from, to));
            }
        }
    }
    // Each of the page's transitions was among them.
    for (number, from, _, to) in TRANSITIONS {
        assert!(taken.contains(&(*from, *to)), "{number}");
    }
    assert!(taken.contains(&(FAULT, SWITCH_ON_DISABLED)), "15");
}

/// "Status Word" table, with the state that shows each. M1: the last row is the fault's. "Not ready to
/// switch on" is over with the boot-up message, before anybody can ask.
const PATTERNS: &[(&str, u16)] = &[
    ("xxxx xxxx x1xx 0000", SWITCH_ON_DISABLED),
    ("xxxx xxxx x01x 0001", READY_TO_SWITCH_ON),
    ("xxxx xxxx x01x 0011", SWITCHED_ON),
    ("xxxx xxxx x01x 0111", OPERATION_ENABLED),
    ("xxxx xxxx x00x 0111", QUICK_STOP_ACTIVE),
    ("xxxx xxxx x0xx 1111", FAULT_REACTION_ACTIVE),
    ("xxxx xxxx x0xx 1000", FAULT),
];

#[test]
fn each_state_has_the_pages_pattern_and_no_other() {
    for (_, state) in PATTERNS {
        let word = brought(*state, false).status(NODE);
        for (pattern, other) in PATTERNS {
            let digits = pattern.chars().filter(|c| *c != ' ').zip((0..16).rev());
            let fits = digits.into_iter().all(|(digit, bit)| match digit {
                '0' => word & 1 << bit == 0,
                '1' => word & 1 << bit != 0,
                _ => true,
            });
            assert_eq!(fits, state == other, "{word:04X} {pattern}");
        }
        // The page names bits 10 and 11 besides, and no others.
        assert_eq!(word & !0x0C6F, 0, "{word:04X}");
    }
}

#[test]
fn a_quick_stop_slows_down_on_its_ramp_and_ends_by_itself() {
    let mut master = turning();
    // 100 RPM at 100 RPM/s: a second (11, then 12).
    master.write_u16(NODE, 0x6040, 0, 2);
    for (ms, rpm) in [(500, 50.0), (300, 20.0)] {
        master.run_ms(ms);
        assert_eq!(master.state(NODE), QUICK_STOP_ACTIVE);
        let shown = master.read(NODE, 0x606C, 0) as f32;
        assert!((shown - rpm).abs() < 6.0, "{shown}, not {rpm}");
    }
    master.run_ms(400);
    assert_eq!(master.state(NODE), SWITCH_ON_DISABLED);
}

#[test]
fn modes_other_than_the_pages_are_refused_and_leave_the_mode_as_it_was() {
    let mut master = quiet();
    for value in i8::MIN..=i8::MAX {
        let result = master.try_write(NODE, 0x6060, 0, &[value as u8]);
        let shown = master.read(NODE, 0x6061, 0) as i8;
        match value {
            -1 | 0 | 1 | 3 | 8 | 9 => {
                assert_eq!((result, shown), (Ok(()), value));
                assert_eq!(master.read(NODE, 0x6060, 0) as i8, value);
            }
            // M3.
            -2 => assert_eq!((result, shown), (Ok(()), -1)),
            // The maker's tool writes its shutdown command here: taken without effect.
            6 => assert_eq!((result, shown), (Ok(()), 3)),
            _ => assert_eq!(result, Err(0x0609_0030), "{value}"),
        }
    }
}
