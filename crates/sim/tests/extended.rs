//! The extended P3 on a simulated motor: what plain CiA 402 has and the faithful drive has not.

mod plain_master;

use cia402::State;
use plain_master::{HALT, Master, NODE, RUN, bus};

#[test]
fn a_halted_move_waits_and_then_ends_at_its_target() {
    // Deceleration 2,000,000 (0x6084) or 8,000,000 (0x6085) from 200,000 counts/s.
    for (option, counts) in [(1, 10_000.0), (2, 2500.0)] {
        let mut bus = bus();
        let mut master = Master::new(&mut bus);
        // The mode comes first, as most masters have it.
        master.write(0x6060, 0, 1);
        assert_eq!(master.read(0x6061, 0), 1);
        master.write(0x605D, 0, option);
        master.write(0x6085, 0, 8_000_000);
        master.enable();
        assert_eq!(master.read(0x6061, 0), 1, "enabling keeps the mode");
        let from = master.read(0x6064, 0);
        master.write(0x607A, 0, from + 60_000);
        master.write(0x6040, 0, RUN | 0x10);
        master.wait_ms(150);
        assert!((master.true_speed() - 200_000.0).abs() < 4000.0);
        let begun = master.read(0x6064, 0) as f64;
        master.write(0x6040, 0, HALT);
        assert!(!master.status().target_reached(), "{option}");
        assert_eq!(master.status().state(), Some(State::OperationEnabled));
        // The drive smooths the velocity that it reports; it takes a while to believe.
        master.wait_ms(250);
        assert!(master.status().target_reached(), "{option}: halted");
        assert!(master.true_speed().abs() < 683.0);
        let stood = master.read(0x6064, 0) as f64;
        // Some 200 counts pass between the reading and the halt for each millisecond of it.
        let way = stood - begun;
        assert!((way - counts).abs() < 600.0, "{option}: {way}");
        master.wait_ms(300);
        assert!((master.read(0x6064, 0) as f64 - stood).abs() < 20.0);
        master.write(0x6040, 0, RUN);
        assert!(!master.status().target_reached());
        master.wait_ms(600);
        assert!(master.status().target_reached());
        assert!((master.read(0x6064, 0) - from - 60_000).abs() <= 20);
    }
}

#[test]
fn a_halted_velocity_stands_and_goes_on() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.write(0x6060, 0, 3);
    master.write(0x60FF, 0, 100_000);
    // Halted before it is enabled.
    for word in [0x06, 0x07, HALT] {
        master.write(0x6040, 0, word);
    }
    master.wait_ms(200);
    assert!(master.true_speed().abs() < 200.0);
    assert!(master.status().target_reached() && master.status().speed_is_zero());
    master.write(0x6040, 0, RUN);
    master.wait_ms(200);
    assert!((master.true_speed() - 100_000.0).abs() < 1000.0);
    assert!(master.status().target_reached());
    // The demands have the standard's names, too (P28).
    assert_eq!(master.read(0x606B, 0), 100_000);
    assert_eq!(master.read(0x6043, 0), 100_000);
    for option in 1..=4 {
        master.write(0x605D, 0, option);
        master.write(0x6040, 0, HALT);
        master.wait_ms(200);
        assert!(master.true_speed().abs() < 683.0, "{option}");
        let status = master.status();
        assert!(
            status.target_reached() && status.speed_is_zero(),
            "{option}"
        );
        master.write(0x6040, 0, RUN);
        master.wait_ms(200);
        let speed = master.true_speed();
        assert!((speed - 100_000.0).abs() < 1000.0, "{option}: {speed}");
    }
    let refused = master.try_write(0x605D, 0, 0);
    assert!(refused.is_err());
}

#[test]
fn a_halted_torque_falls_on_its_slope() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.write(0x6060, 0, 4);
    master.write(0x6087, 0, 1000);
    master.enable();
    master.write(0x6071, 0, 100);
    master.wait_ms(100);
    assert_eq!(master.read(0x6074, 0), 100);
    master.write(0x6040, 0, HALT);
    master.wait_ms(50);
    let half = master.read(0x6074, 0);
    assert!((45..=55).contains(&half), "{half}");
    master.wait_ms(60);
    assert_eq!(master.read(0x6074, 0), 0);
    // It coasts: with no torque, but not at rest.
    assert!(master.true_speed() > 2000.0);
    assert!(!master.status().target_reached());
    // On the current limit the drive brakes.
    master.write(0x6040, 0, RUN);
    master.write(0x605D, 0, 3);
    master.write(0x6040, 0, HALT);
    master.wait_ms(300);
    assert!(master.true_speed().abs() < 683.0);
    assert!(master.status().target_reached());
}

#[test]
fn a_quick_stop_has_ramps() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.write(0x6060, 0, 3);
    master.write(0x60FF, 0, 200_000);
    master.write(0x6085, 0, 1_000_000);
    master.write(0x605A, 0, 6);
    master.enable();
    master.wait_ms(200);
    master.write(0x6040, 0, 0x02);
    // 200,000 at 1,000,000: 0.2 s.
    master.wait_ms(100);
    let speed = master.true_speed();
    assert!((speed - 100_000.0).abs() < 5000.0, "{speed}");
    master.wait_ms(250);
    let status = master.status();
    assert_eq!(status.state(), Some(State::QuickStopActive));
    assert!(status.target_reached());
    master.write(0x6040, 0, RUN);
    assert_eq!(master.status().state(), Some(State::OperationEnabled));
}

#[test]
fn a_target_counts_as_reached_within_its_window_for_its_time() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.write(0x6060, 0, 1);
    master.write(0x6067, 0, 50);
    master.write(0x6068, 0, 400);
    master.enable();
    let from = master.read(0x6064, 0);
    master.write(0x607A, 0, from + 4096);
    master.write(0x6040, 0, RUN | 0x10);
    // 4096 counts at 2,000,000 counts/s²: 0.09 s.
    master.wait_ms(300);
    assert!((master.read(0x6064, 0) - from - 4096).abs() < 20);
    assert!(!master.status().target_reached());
    master.wait_ms(300);
    assert!(master.status().target_reached());
    // Switched off: the end of the profile counts.
    master.write(0x6067, 0, 0xFFFF_FFFF);
    master.write(0x607A, 0, from);
    master.write(0x6040, 0, RUN);
    master.write(0x6040, 0, RUN | 0x10);
    master.wait_ms(150);
    assert!(master.status().target_reached());
}

#[test]
fn the_error_code_is_the_present_error() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.enable();
    let supply = |master: &mut Master<'_>, volts| {
        let drive = master.client.link().bus().drive(NODE).expect("the drive");
        drive.plant().set_supply_v(volts);
    };
    supply(&mut master, 10.0);
    assert_eq!(master.wait_ms(600), [0x3220]);
    assert_eq!(master.status().state(), Some(State::Fault));
    assert_eq!(master.read(0x603F, 0), 0x3220);
    supply(&mut master, 48.0);
    master.wait_ms(100);
    // Reset and shutdown in one write is the P3's own: here only the reset acts.
    master.write(0x6040, 0, 0x86);
    assert_eq!(master.status().state(), Some(State::SwitchOnDisabled));
    assert_eq!(master.read(0x603F, 0), 0);
    assert_eq!(master.read(0x1001, 0), 0);
}

#[test]
fn errors_without_an_object_in_the_manual_have_one() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    let defaults: Vec<i64> = (1..=12).map(|sub| master.read(0x2410, sub)).collect();
    assert_eq!(defaults, [1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert!(master.try_write(0x2410, 5, 2).is_err());

    // Soft stops: nothing until they are enabled.
    master.write(0x607D, 1, -5000);
    master.write(0x607D, 2, 5000);
    master.write(0x6060, 0, 1);
    master.enable();
    master.write(0x607A, 0, 6000);
    master.write(0x6040, 0, RUN | 0x10);
    assert_eq!(master.wait_ms(20), [0u16; 0]);
    master.write(0x2410, 9, 1);
    assert_eq!(master.wait_ms(20), [0x7383]);
    assert!(master.status().warning());
    master.write(0x2410, 10, 1);
    master.write(0x607A, 0, -6000);
    master.write(0x6040, 0, RUN);
    master.write(0x6040, 0, RUN | 0x30);
    assert_eq!(master.wait_ms(20), [0x0000, 0x7384]);
    assert_eq!(master.read(0x603F, 0), 0x7384);
    master.write(0x607A, 0, 0);
    master.write(0x6040, 0, RUN);
    master.write(0x6040, 0, RUN | 0x30);
    assert_eq!(master.wait_ms(300), [0x0000]);
    assert_eq!(master.read(0x603F, 0), 0);
    assert!(!master.status().warning());
}

#[test]
fn a_position_that_wraps_is_a_fault_if_wanted() {
    for wanted in [0, 1] {
        let mut bus = bus();
        let mut master = Master::new(&mut bus);
        master.write(0x2410, 11, wanted);
        master.write(0x6060, 0, 3);
        master.enable();
        // Another name for the position is no motion.
        master.write(0x6064, 0, i64::from(i32::MIN) + 5_000);
        assert_eq!(master.wait_ms(20), [0u16; 0]);
        master.write(0x6064, 0, i64::from(i32::MAX) - 5_000);
        assert_eq!(master.wait_ms(20), [0u16; 0], "renamed");
        master.write(0x60FF, 0, 100_000);
        let codes = master.wait_ms(200);
        if wanted == 1 {
            assert_eq!(codes, [0x73A0]);
            assert_eq!(master.status().state(), Some(State::Fault));
        } else {
            assert_eq!(codes, [0u16; 0]);
            assert!(master.read(0x6064, 0) < 0, "it has wrapped");
        }
    }
}
