//! The state machine against a table written from CiA 402: every state × every controlword × the
//! previous bit 7 × dialect × quick stop option code.

mod rig;

use State::*;
use cia402::{Actual, Axis, Configuration, Dialect, Mode, State, Statusword, Targets};
use rig::{P3, Rig, STANDARD};

/// CiA 402-2, "command coding" and "transition events": in which state which bits 7, 3, 2, 1, 0
/// lead where. What is in no row changes nothing. Bit 7 is looked at where the row says so.
const TABLE: &[(State, &str, State, &str)] = &[
    // state               7 3210   next                 transition
    (SwitchOnDisabled, "0 x110", ReadyToSwitchOn, "2 shutdown"),
    (ReadyToSwitchOn, "0 0111", SwitchedOn, "3 switch on"),
    (
        ReadyToSwitchOn,
        "0 1111",
        OperationEnabled,
        "3+4 switch on and enable operation",
    ),
    (
        ReadyToSwitchOn,
        "0 xx0x",
        SwitchOnDisabled,
        "7 disable voltage",
    ),
    (ReadyToSwitchOn, "0 x01x", SwitchOnDisabled, "7 quick stop"),
    (SwitchedOn, "0 1111", OperationEnabled, "4 enable operation"),
    (SwitchedOn, "0 x110", ReadyToSwitchOn, "6 shutdown"),
    (SwitchedOn, "0 xx0x", SwitchOnDisabled, "10 disable voltage"),
    (SwitchedOn, "0 x01x", SwitchOnDisabled, "10 quick stop"),
    (
        OperationEnabled,
        "0 0111",
        SwitchedOn,
        "5 disable operation",
    ),
    (OperationEnabled, "0 x110", ReadyToSwitchOn, "8 shutdown"),
    (
        OperationEnabled,
        "0 xx0x",
        SwitchOnDisabled,
        "9 disable voltage",
    ),
    (OperationEnabled, "0 x01x", QuickStopActive, "11 quick stop"),
    (
        QuickStopActive,
        "0 xx0x",
        SwitchOnDisabled,
        "12 disable voltage",
    ),
    (
        QuickStopActive,
        "0 1111",
        OperationEnabled,
        "16 enable operation, codes 5 to 8 only",
    ),
];

fn matches(pattern: &str, word: u16, bit_7_counts: bool) -> bool {
    let bits = [7, 3, 2, 1, 0];
    pattern
        .chars()
        .filter(|c| *c != ' ')
        .zip(bits)
        .all(|(c, bit)| match c {
            _ if bit == 7 && !bit_7_counts => true,
            'x' => true,
            '0' => word & (1 << bit) == 0,
            '1' => word & (1 << bit) != 0,
            other => panic!("pattern {other}"),
        })
}

/// What the table says: the state after, and whether the fault was reset.
fn expected(
    state: State,
    word: u16,
    previous_bit_7: bool,
    one_write: bool,
    ramps: bool,
    option: i8,
) -> (State, bool) {
    let rising = word & 0x80 != 0 && !previous_bit_7;
    let (from, reset) = if state == Fault && rising {
        (SwitchOnDisabled, true) // 15
    } else {
        (state, false)
    };
    let rows: Vec<_> = TABLE
        .iter()
        .filter(|row| row.0 == from && matches(row.1, word, !one_write))
        .collect();
    // Two rows may speak (disable voltage, quick stop) only if they agree.
    let next = match rows.as_slice() {
        [] => from,
        [first, rest @ ..] => {
            assert!(
                rest.iter().all(|row| row.2 == first.2),
                "{word:04X}: {rows:?}"
            );
            let stays = (5..=8).contains(&option);
            match first.3 {
                name if name.starts_with("16") && !stays => from,
                // Code 0 ends the quick stop at once; so do 1 to 4 of a drive without ramps: 12.
                name if name.starts_with("11") && (option == 0 || (!ramps && !stays)) => {
                    SwitchOnDisabled
                }
                _ => first.2,
            }
        }
    };
    (next, reset)
}

/// An axis in a state, with bit 7 last written as given, reached by commands alone.
fn bring(dialect: &'static Dialect, configuration: &Configuration, to: State, bit_7: bool) -> Axis {
    let mut axis = Axis::new(dialect);
    let targets = Targets::default();
    // Moving, so that a quick stop takes time.
    let actual = Actual {
        velocity: 1000.0,
        voltage: true,
        ..Actual::default()
    };
    let write = |axis: &mut Axis, word: u16| {
        axis.write_controlword(word, configuration, &targets, &actual);
    };
    if to != NotReadyToSwitchOn {
        axis.initialised();
    }
    let way: &[u16] = match to {
        NotReadyToSwitchOn | SwitchOnDisabled | FaultReactionActive | Fault => &[0x00],
        ReadyToSwitchOn => &[0x06],
        SwitchedOn => &[0x06, 0x07],
        OperationEnabled => &[0x06, 0x07, 0x0F],
        QuickStopActive => &[0x06, 0x07, 0x0F, 0x02],
    };
    for &word in way {
        write(&mut axis, word);
        if word == 0x0F {
            let mode = Mode::PROFILE_VELOCITY;
            axis.write_mode(mode.0, configuration, &targets, &actual)
                .expect("mode 3");
        }
    }
    // The same command with bit 7 changes nothing: the edge means something in Fault only.
    if bit_7 {
        write(&mut axis, way[way.len() - 1] | 0x80);
    }
    if matches!(to, FaultReactionActive | Fault) {
        axis.fault();
    }
    if to == Fault {
        axis.tick(configuration, &targets, &actual);
    }
    assert_eq!(axis.state(), to);
    axis
}

#[test]
fn every_state_and_every_controlword() {
    let mut cases = 0u32;
    for (dialect, one_write, ramps) in [(&STANDARD, false, true), (&P3, true, false)] {
        for option in [0, 2, 6] {
            let configuration = Configuration {
                quick_stop_option: option,
                deceleration: 1000.0,
                quick_stop_deceleration: 1000.0,
                disable_option: 0,
                ..Configuration::default()
            };
            for state in State::ALL {
                let unreachable = option == 0 || (!ramps && option < 5);
                if state == QuickStopActive && unreachable {
                    continue;
                }
                for bit_7 in [false, true] {
                    let axis = bring(dialect, &configuration, state, bit_7);
                    for word in 0..=u16::MAX {
                        let mut axis = axis.clone();
                        let outcome = axis.write_controlword(
                            word,
                            &configuration,
                            &Targets::default(),
                            &Actual {
                                velocity: 1000.0,
                                ..Actual::default()
                            },
                        );
                        let (next, reset) = expected(state, word, bit_7, one_write, ramps, option);
                        let what = || {
                            format!("{state:?} word {word:04X} bit 7 was {bit_7}, option {option}")
                        };
                        assert_eq!(outcome.before, state, "{}", what());
                        assert_eq!(outcome.after, next, "{}", what());
                        assert_eq!(outcome.fault_reset, reset, "{}", what());
                        assert_eq!(axis.state(), next, "{}", what());
                        assert_eq!(axis.statusword().0 & 0x6F, next.pattern(), "{}", what());
                        cases += 1;
                    }
                }
            }
        }
    }
    // 2 dialects × 3 options × 8 states × 2 × 65,536, less three unreachable quick stops.
    assert_eq!(cases, (2 * 3 * 8 - 3) * 2 * 65_536);
}

#[test]
fn every_state_has_its_own_statusword() {
    // The patterns of CiA 402, x open.
    let patterns = [
        (NotReadyToSwitchOn, "x0xx0000"),
        (SwitchOnDisabled, "x1xx0000"),
        (ReadyToSwitchOn, "x01x0001"),
        (SwitchedOn, "x01x0011"),
        (OperationEnabled, "x01x0111"),
        (QuickStopActive, "x00x0111"),
        (FaultReactionActive, "x0xx1111"),
        (Fault, "x0xx1000"),
    ];
    for word in 0..=u16::MAX {
        let fits = |pattern: &str| {
            pattern.chars().zip((0..8).rev()).all(|(c, bit)| match c {
                '0' => word & (1 << bit) == 0,
                '1' => word & (1 << bit) != 0,
                _ => true,
            })
        };
        let state = patterns
            .iter()
            .find(|(_, pattern)| fits(pattern))
            .map(|(state, _)| *state);
        assert_eq!(Statusword(word).state(), state, "{word:04X}");
    }
}

#[test]
fn transitions_without_a_command() {
    let configuration = Configuration {
        quick_stop_option: 6,
        ..Configuration::default()
    };
    for dialect in [&STANDARD, &P3] {
        for state in State::ALL {
            if state == NotReadyToSwitchOn {
                continue;
            }
            // 0 and 1 happen once.
            let mut axis = bring(dialect, &configuration, state, false);
            axis.initialised();
            assert_eq!(axis.state(), state);
            // 13 from everywhere, 14 with the tick.
            axis.fault();
            let reacting = if state == Fault {
                Fault
            } else {
                FaultReactionActive
            };
            assert_eq!(axis.state(), reacting);
            assert_eq!(*axis.demand(), cia402::Demand::Off);
            axis.tick(&configuration, &Targets::default(), &Actual::default());
            assert_eq!(axis.state(), Fault);
            axis.tick(&configuration, &Targets::default(), &Actual::default());
            assert_eq!(axis.state(), Fault);
        }
    }
}

#[test]
fn the_manuals_first_two_writes() {
    // P3 l.244: 0x0086 from fault to ready to switch on, 0x000F on to operation enabled.
    let mut rig = Rig::new(&P3);
    rig.axis.fault();
    rig.run_ms(1);
    assert_eq!(rig.status(), 0x0018);
    let outcome = rig.word(0x0086);
    assert_eq!((outcome.before, outcome.after), (Fault, ReadyToSwitchOn));
    assert!(outcome.fault_reset);
    assert_eq!(rig.status(), 0x0031);
    // If the cause is still there, the owner says so at once.
    rig.axis.fault();
    rig.run_ms(1);
    assert_eq!(rig.axis.state(), Fault);
    // Bit 7 has not fallen: no second reset.
    assert!(!rig.word(0x0086).fault_reset);
    assert_eq!(rig.axis.state(), Fault);
    rig.word(0x0006);
    assert!(rig.word(0x0086).fault_reset);
    rig.word(0x000F);
    assert_eq!(rig.status(), 0x0037);
    // From switch on disabled 0x86 is a shutdown, without a reset.
    let mut rig = Rig::new(&P3);
    let outcome = rig.word(0x0086);
    assert_eq!(
        (outcome.after, outcome.fault_reset),
        (ReadyToSwitchOn, false)
    );
}

#[test]
fn the_modes_of_the_manual_only_when_enabled() {
    use cia402::ModeRefused::{NotNow, Unsupported};
    let mut rig = Rig::new(&P3);
    assert_eq!(
        rig.mode(Mode::PROFILE_TORQUE),
        Err(NotNow(SwitchOnDisabled))
    );
    assert_eq!(rig.mode(Mode(13)), Err(Unsupported(Mode(13))));
    assert_eq!(rig.mode(Mode::IDLE), Ok(()));
    rig.word(0x06);
    rig.word(0x0F);
    for number in i8::MIN..=i8::MAX {
        let works = (0..=12).contains(&number) && number != 5;
        let mode = Mode(number);
        assert_eq!(
            rig.mode(mode),
            if works {
                Ok(())
            } else {
                Err(Unsupported(mode))
            }
        );
    }
    assert_eq!(rig.axis.mode_display(), 12);
    // Asking for the mode in force is no failure.
    assert_eq!(rig.mode(Mode::PHASE_VOLTAGE_WITH_ANGLE), Ok(()));
    // The display keeps the mode when the drive is disabled, and is cleared when it is enabled.
    rig.word(0x07);
    assert_eq!(rig.axis.mode_display(), 12);
    rig.word(0x0F);
    assert_eq!(rig.axis.mode_display(), 0);
    assert_eq!(rig.demand, cia402::Demand::Idle);

    // The standard takes a mode in any state and keeps it.
    let mut rig = Rig::new(&STANDARD);
    assert_eq!(rig.mode(Mode::PROFILE_TORQUE), Ok(()));
    rig.word(0x06);
    rig.word(0x0F);
    assert_eq!(rig.axis.mode_display(), 4);
}

#[test]
fn supported_drive_modes_are_the_working_ones() {
    // Bits 0 PP, 1 VL, 2 PV, 3 TQ, 5 HM, 6 IP, 7 CSP, 8 CSV, 9 CST, 10 CSTCA.
    assert_eq!(STANDARD.supported_drive_modes(), 0x07EF);
    // A dialect cannot claim what does not work.
    let boastful = Dialect {
        modes: cia402::ModeSet::EMPTY
            .with(Mode::PROFILE_POSITION)
            .with(Mode(5))
            .with(Mode(-3)),
        ..Dialect::STANDARD
    };
    assert_eq!(boastful.supported_drive_modes(), 0x0001);
    // Each mode that is claimed is accepted, each that is not is refused.
    for number in (1..=16).filter(|number| *number != 12) {
        let mut rig = Rig::new(&STANDARD);
        let claimed = STANDARD.supported_drive_modes() & (1 << (number - 1)) != 0;
        assert_eq!(rig.mode(Mode(number)).is_ok(), claimed, "mode {number}");
    }
    // Homing and mode 11 have bits 5 and 10 (P54), a drive's own mode 12 has none.
    let all = cia402::ModeSet::IMPLEMENTED
        .with(Mode::HOMING)
        .with(Mode::CYCLIC_TORQUE_WITH_ANGLE)
        .with(Mode::PHASE_VOLTAGE_WITH_ANGLE)
        .with(Mode(-1));
    assert_eq!(all.supported_drive_modes(), 0x07EF);
}
