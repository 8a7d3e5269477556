//! Transitions 0 and 1 take no time that a master could see: what is written right after `^FSA 1`, or
//! right after the boot-up, counts.

use personalities::roboteq::{ROBOTEQ, ROBOTEQ_3};

use crate::bench::{Channel, FSA, controller, near, window};
use crate::master::Master;

/// A download of at most four bytes.
fn download(index: u16, sub: u8, data: &[u8]) -> [u8; 8] {
    let mut frame = [0; 8];
    let [low, high] = index.to_le_bytes();
    frame[..4].copy_from_slice(&[0x23 | (4 - data.len() as u8) << 2, low, high, sub]);
    frame[4..4 + data.len()].copy_from_slice(data);
    frame
}

#[test]
fn a_controlword_right_after_fsa_counts_in_every_channel() {
    // From rest, and while the motors run without the state machine.
    for runs in [false, true] {
        let mut master = controller(&ROBOTEQ_3);
        if runs {
            for channel in 1..=3 {
                master.write_i32(1, 0x2000, channel, 300);
            }
            master.run_ms(1000);
            assert!(master.rpm(3) > 500.0);
        }
        // Not a millisecond between the first of them and the last: frame after frame.
        master.log.clear();
        let began = master.now();
        master.send(0x601, &download(FSA.0, FSA.1, &[1]));
        for channel in [2_u8, 1, 3] {
            let index = window(channel, 0x6040);
            master.send(0x601, &download(index, 0, &[6, 0]));
        }
        while master
            .log
            .iter()
            .filter(|t| t.frame.raw_id() == 0x581)
            .count()
            < 4
        {
            master.run_us(10);
        }
        assert!(master.now().since_ns(began) < 1_500_000);
        for answer in master.log.iter().filter(|t| t.frame.raw_id() == 0x581) {
            assert_eq!(answer.frame.data()[0], 0x60);
        }
        for channel in 1..=3 {
            assert_eq!(master.status_of(channel), 0x0231, "{runs} {channel}");
            master.word(channel, 0x0F);
        }
        master.run_ms(5);
        for channel in 1..=3 {
            assert_eq!(master.status_of(channel) & 0x6F, 0x27);
        }
    }
}

/// Table 6 over the bus, R1, R3 and R22: what each command leads to in each state at rest.
#[test]
fn every_command_in_every_state() {
    const SOD: u16 = 0x0250;
    const RTSO: u16 = 0x0231;
    const SO: u16 = 0x0233;
    const OE: u16 = 0x0237;
    let mut master = controller(&ROBOTEQ);
    master.write(1, FSA.0, FSA.1, &[1]);
    let states: [(u16, &[u16]); 4] = [(SOD, &[]), (RTSO, &[6]), (SO, &[6, 7]), (OE, &[6, 15])];
    for (from, way) in states {
        for command in 0..16 {
            master.word(1, 0);
            for word in way {
                master.word(1, *word);
            }
            assert_eq!(master.status_of(1) & !0x400, from);
            master.word(1, command);
            // A quick stop at rest is over within a millisecond or two.
            master.run_ms(5);
            let to = match (command, from) {
                (6 | 14, _) => RTSO,
                (7, SO | OE | RTSO) => SO,
                (15, RTSO | SO | OE) => OE,
                (7 | 15, _) => from,
                // Disable voltage, and quick stop.
                _ => SOD,
            };
            assert_eq!(
                master.status_of(1) & !0x400,
                to,
                "{command:04b} in {from:04X}"
            );
        }
    }
    // Nothing but a fault reset leads out of a fault, and bit 7 must rise.
    master.write(1, 0x200C, 0, &[1]);
    master.run_ms(5);
    master.write(1, 0x200D, 0, &[1]);
    for command in 0..16 {
        master.word(1, command);
        assert_eq!(master.status_of(1), 0x0218, "{command:04b}");
    }
    master.word(1, 0x8F);
    assert_eq!(master.status_of(1), SOD);
    master.word(1, 0x86);
    assert_eq!(master.status_of(1), SOD, "bit 7 must be 0 for a command");
}

/// The controlword is 0x0F already, and means nothing until one is written.
#[test]
fn what_was_written_before_does_not_count() {
    for before in [6, 15] {
        let mut master = controller(&ROBOTEQ);
        master.word(1, before);
        master.write(1, FSA.0, FSA.1, &[1]);
        assert_eq!(master.status_of(1), 0x0250);
        master.run_ms(5);
        assert_eq!(master.status_of(1), 0x0250);
        // Off and on again within a millisecond are the transitions again.
        for word in [6, 15] {
            master.word(1, word);
        }
        assert_eq!(master.status_of(1) & 0x6F, 0x27);
        master.send(0x601, &download(FSA.0, FSA.1, &[0]));
        master.send(0x601, &download(FSA.0, FSA.1, &[1]));
        master.run_us(900);
        assert_eq!(master.status_of(1), 0x0250);
        master.run_ms(2);
        assert_eq!(master.status_of(1), 0x0250);
        // Once more is none.
        master.word(1, 6);
        master.write(1, FSA.0, FSA.1, &[1]);
        assert_eq!(master.status_of(1), 0x0231);
    }
}

#[test]
fn what_is_written_right_after_the_boot_up_counts() {
    let mut master = controller(&ROBOTEQ);
    master.write(1, FSA.0, FSA.1, &[1]);
    master.write(1, 0x3027, 1, &[1]); // begins in mode 3
    master.write_i32(1, 0x3033, 1, 7000);
    master.write(1, 0x2017, 0, &[1]);
    master.run_ms(500);
    master.log.clear();
    master.send(0, &[0x81, 1]);
    let booted = |master: &Master| master.log.iter().any(|t| t.frame.raw_id() == 0x701);
    while !booted(&master) {
        master.run_us(10);
    }
    let began = master.now();
    for frame in [
        download(0x6060, 0, &[1]),
        download(0x6083, 0, &1234_u32.to_le_bytes()),
        download(0x6040, 0, &[6, 0]),
    ] {
        master.send(0x601, &frame);
    }
    while master
        .log
        .iter()
        .filter(|t| t.frame.raw_id() == 0x581)
        .count()
        < 3
    {
        master.run_us(10);
    }
    assert!(
        master.now().since_ns(began) < 900_000,
        "not before the first millisecond"
    );
    master.run_ms(5);
    assert_eq!(master.status_of(1), 0x0231);
    assert_eq!(master.read(1, 0x6061, 0), 1);
    assert_eq!(master.read(1, 0x6083, 0), 1234);
    // What was not written begins as configured.
    assert_eq!(master.read(1, 0x6048, 1), 7000);
    near(master.rpm(1), 0.0, 0.1);
}
