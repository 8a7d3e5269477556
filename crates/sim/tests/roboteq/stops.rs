//! What slows down on EDEC: halt in every mode (table 7), quick stop, faults.

use personalities::roboteq::ROBOTEQ;

use crate::bench::{Channel, REACHED, near, with_machine};
use crate::master::Master;

/// 1,000 RPM/s.
const EDEC: i32 = 10_000;

/// At some speed in a mode, with a far target.
fn running(mode: i8) -> Master {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, EDEC);
    master.write(1, 0x3038, 1, &[0]);
    // Thirty turns to either side for a position of 1000.
    master.write_i32(1, 0x30F2, 1, -122_880);
    master.write_i32(1, 0x30F3, 1, 122_880);
    for rate in [0x6083, 0x6084] {
        master.write_i32(1, rate, 0, 100_000);
    }
    for rate in [0x6048, 0x6049] {
        master.write_i32(1, rate, 1, 100_000);
    }
    master.enable_channel(1, mode);
    match mode {
        1 => master.write_i32(1, 0x607A, 0, 122_880),
        -1 => master.write_i32(1, 0x607A, 0, 1000),
        2 | -4 => master.write_i16(1, 0x6042, 0, 800),
        3 | -3 => master.write_i32(1, 0x60FF, 0, 800),
        4 => master.write_i16(1, 0x6071, 0, 1),
        _ => master.write_i32(1, 0x2000, 1, 190),
    }
    master.word(1, start_of(mode));
    master.run_ms(if mode == 0 { 1500 } else { 300 });
    master
}

/// With what a mode moves.
fn start_of(mode: i8) -> u16 {
    match mode {
        1 | -1 => 0x1F,
        2 | -4 => 0x7F,
        _ => 0x0F,
    }
}

#[test]
fn halt_stops_every_mode_on_edec_and_what_was_wanted_goes_on() {
    // -2 has no speed of its own: see `modes.rs`.
    for mode in [-4, -3, -1, 0, 1, 2, 3, 4] {
        let mut master = running(mode);
        let speed = master.rpm(1);
        assert!(speed > 500.0, "{mode}: {speed}");
        let begun = master.drive(1).plant().truth().position_turns();
        master.word(1, start_of(mode) | 0x100);
        master.run_ms(200);
        if mode != 0 {
            // In open loop it is the voltage that goes down so.
            near(master.rpm(1), speed - 200.0, 40.0);
        }
        assert_eq!(master.status_of(1) & (REACHED | 0x6F), 0x27, "{mode}");
        master.run_ms(2500);
        near(master.rpm(1), 0.0, 6.0);
        // Table 15, and table 7: it stays in operation enabled.
        assert_eq!(
            master.status_of(1) & (REACHED | 0x6F),
            REACHED | 0x27,
            "{mode}"
        );
        let way = master.drive(1).plant().truth().position_turns() - begun;
        let wanted = speed * speed / 1000.0 / 60.0 / 2.0;
        if mode != 0 {
            near(way, wanted, 0.12 * wanted);
        }
        master.word(1, start_of(mode));
        master.run_ms(if mode == 0 { 1500 } else { 300 });
        assert!(master.rpm(1) > 500.0, "{mode}: {}", master.rpm(1));
        if matches!(mode, 1 | -1) {
            // To where it should have gone.
            master.run_ms(3000);
            near(f64::from(master.read(1, 0x2104, 1)), 122_880.0, 20.0);
        }
    }
}

#[test]
fn quick_stop_is_on_edec_in_every_mode_and_ends_in_switch_on_disabled() {
    for mode in [-4, -3, -1, 1, 2, 3, 4] {
        let mut master = running(mode);
        let speed = master.rpm(1);
        master.word(1, 0x0002);
        assert_eq!(master.status_of(1) & !(REACHED | 0x1800), 0x0217, "{mode}");
        master.run_ms(200);
        near(master.rpm(1), speed - 200.0, 40.0);
        assert_eq!(master.status_of(1) & !(REACHED | 0x1800), 0x0217, "{mode}");
        master.run_ms(4000);
        near(master.rpm(1), 0.0, 3.0);
        assert_eq!(master.status_of(1), 0x0250, "{mode}");
    }
}

/// What leaves the controller its control brakes the motor on EDEC, in fault reaction active; what does
/// not lets it go.
#[test]
fn a_fault_is_on_edec_where_the_controller_can() {
    let mut master = running(3);
    let speed = master.rpm(1);
    master.write(1, 0x200C, 0, &[1]);
    master.run_ms(200);
    near(master.rpm(1), speed - 200.0, 30.0);
    assert_eq!(master.status_of(1) & !REACHED, 0x021F);
    // Nothing but its end leads out of it.
    master.word(1, 0x80);
    master.word(1, 0x06);
    assert_eq!(master.status_of(1) & !REACHED, 0x021F);
    master.run_ms(1500);
    near(master.rpm(1), 0.0, 3.0);
    assert_eq!(master.status_of(1), 0x0218);
    // Without its encoder it cannot brake.
    let mut master = running(3);
    let speed = master.rpm(1);
    let fault = plant::EncoderFault::NoAnswer;
    master.drive(1).plant().set_encoder_fault(fault);
    master.run_ms(100);
    assert_eq!(master.status_of(1) & !REACHED, 0x0218);
    near(master.rpm(1), speed, 60.0);
}

/// MS stops its channel only, until that is commanded again.
#[test]
fn ms_stops_a_channel_in_every_mode() {
    for mode in [-3, -1, 0, 1, 2, 3, 4] {
        let mut master = running(mode);
        let speed = master.rpm(1);
        assert_eq!(master.try_write(1, 0x200E, 0, &[2]), Err(0x0609_0030));
        master.write(1, 0x200E, 0, &[1]);
        master.run_ms(200);
        if mode != 0 {
            near(master.rpm(1), speed - 200.0, 40.0);
        }
        master.run_ms(4000);
        near(master.rpm(1), 0.0, 6.0);
        // What is commanded next.
        master.word(1, start_of(mode));
        master.run_ms(300);
        match mode {
            1 | -1 => assert!(master.rpm(1) > 500.0, "{mode}"),
            _ => near(master.rpm(1), 0.0, 6.0),
        }
    }
}

#[test]
fn bit_11_tells_of_the_current_limit_and_of_no_other() {
    const LIMIT: u16 = 0x800;
    let mut master = with_machine(&ROBOTEQ);
    master.write(1, 0x3038, 1, &[0]);
    master.enable_channel(1, 0);
    // All the voltage that there is, and no load.
    master.write_i32(1, 0x2000, 1, 1000);
    master.run_ms(3000);
    assert!(master.rpm(1) > 4000.0, "{}", master.rpm(1));
    assert_eq!(master.status_of(1) & (LIMIT | 0x6F), 0x27);
    // More speed than that.
    master.mode(1, 3);
    master.write_i32(1, 0x60FF, 0, 6000);
    master.run_ms(3000);
    assert!(master.rpm(1) > 4000.0);
    assert_eq!(master.status_of(1) & (LIMIT | 0x6F), 0x27);
    // A limit of speed is none of current.
    master.mode(1, 2);
    master.word(1, 0x7F);
    master.write_i16(1, 0x6042, 0, 5000);
    master.run_ms(3000);
    near(master.rpm(1), 1000.0, 15.0);
    assert_eq!(master.status_of(1) & (LIMIT | 0x6F), 0x27);
    master.drive(1).plant().set_blocked(true);
    master.run_ms(300);
    assert_eq!(master.status_of(1) & (LIMIT | 0x6F), LIMIT | 0x27);
    assert_eq!(master.read(1, 0x2122, 1) & 1, 1);
}
