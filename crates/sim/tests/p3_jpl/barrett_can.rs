//! BarrettCAN, and how NMT messages end it.

use crate::bench::{answers, of, property, quiet};

#[test]
fn it_waits_in_barrett_can() {
    let mut master = quiet(&[1, 2]);
    assert_eq!(answers(&master), [], "no boot-up");
    master.run_ms(2000);
    assert_eq!(answers(&master), [], "and no heartbeat");
    // No SDO, no PDO, no LSS.
    for (id, data) in [
        (0x601u16, &[0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0][..]),
        (0x601, &[0x22, 0x60, 0x60, 0x00, 0x01]),
        (0x080, &[]),
        (0x201, &[0, 0, 0, 0]),
        (0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]),
        // An SDO request and a heartbeat of node 32 look like messages of others to group 0.
        (0x620, &[0x40]),
        (0x720, &[0x05]),
    ] {
        assert_eq!(of(&mut master, id, data), [], "{id:03X}");
    }
    // Firmware 145, node IDs, ready, THERM about 25 °C in Q8.8, 4096 counts a turn.
    assert_eq!(property(&mut master, 1, 0), 145);
    assert_eq!(property(&mut master, 1, 3), 1);
    assert_eq!(property(&mut master, 2, 3), 2);
    assert_eq!(property(&mut master, 1, 5), 2);
    let therm = property(&mut master, 1, 20);
    assert!((24 * 256..26 * 256).contains(&therm), "{therm}");
    assert_eq!(property(&mut master, 1, 68), 4096);
    assert_eq!(property(&mut master, 1, 50), 0x8000);
    // The supply is 48 V.
    let supply = property(&mut master, 1, 21);
    assert!((supply - 48 * 256).abs() < 64, "{supply}");
    // Two bytes, or four of a property with two numbers.
    assert_eq!(of(&mut master, 1, &[90]), [(0x426, vec![0xDA, 0, 2, 0])]);
    assert_eq!(
        of(&mut master, 1, &[68]),
        [(0x426, vec![0xC4, 0, 0, 0x10, 0, 0])]
    );
    // To a group: all answer.
    let mut all = of(&mut master, 0x400, &[3]);
    all.sort_unstable();
    assert_eq!(
        all,
        [(0x426, vec![0x83, 0, 1, 0]), (0x446, vec![0x83, 0, 2, 0])]
    );
    // A set, a number that is no property, a frame without one, too long a frame: nothing.
    for data in [&[0x88, 0, 3, 0][..], &[109], &[127], &[], &[3, 0]] {
        assert_eq!(of(&mut master, 1, data), [], "{data:02X?}");
    }
    assert_eq!(property(&mut master, 1, 8), 0, "the mode was not set");
}

/// Every drive belongs to the groups 0, 1 and 4, and a number above 31 has no place in an identifier.
#[test]
fn groups_and_numbers() {
    let mut master = quiet(&[1, 31, 32, 127]);
    for group in 0..=31 {
        let mut frames = of(&mut master, 0x400 | group, &[3]);
        frames.sort_unstable();
        let all = [(0x426, vec![0x83, 0, 1, 0]), (0x7E6, vec![0x83, 0, 31, 0])];
        match group {
            0 | 1 | 4 => assert_eq!(frames, all, "group {group}"),
            _ => assert_eq!(frames, [], "group {group}"),
        }
    }
    assert_eq!(property(&mut master, 31, 26), 0, "GRPA");
    assert_eq!(property(&mut master, 31, 27), 1, "GRPB");
    assert_eq!(property(&mut master, 31, 28), 4, "GRPC");
    // Nobody is spoken to but those two: by no other receiver, and by no other sender than the host.
    for receiver in 0..=31 {
        let frames = of(&mut master, receiver, &[3]);
        assert_eq!(
            frames.len(),
            usize::from(matches!(receiver, 1 | 31)),
            "{receiver}"
        );
        if receiver != 0 {
            assert_eq!(
                of(&mut master, receiver << 5 | 1, &[3]),
                [],
                "from {receiver}"
            );
        }
    }
    // As CANopen nodes they are there all the same.
    of(&mut master, 0, &[0x80, 0]);
    assert_eq!(master.read(127, 0x3F00, 3), 127);
}

/// J9: each NMT message but "reset node" ends it; one heartbeat tells the state.
#[test]
fn the_first_nmt_message_ends_it() {
    for (command, state) in [(0x01, 0x05), (0x80, 0x7F), (0x02, 0x04), (0x82, 0x7F)] {
        for target in [1, 0] {
            let mut master = quiet(&[1]);
            assert_eq!(
                of(&mut master, 0, &[command, target]),
                [(0x701, vec![state])],
                "{command:02X}"
            );
            assert_eq!(of(&mut master, 1, &[3]), [], "BarrettCAN is over");
            master.run_ms(500);
            assert_eq!(answers(&master), [], "0x1017 is 0");
        }
    }
    // Not for it, no command, too long: it goes on waiting.
    let mut master = quiet(&[1]);
    for data in [&[0x01, 2][..], &[0x03, 1], &[0x01], &[0x01, 1, 0]] {
        assert_eq!(of(&mut master, 0, data), [], "{data:02X?}");
    }
    assert_eq!(of(&mut master, 0, &[0x81, 1]), []);
    master.run_ms(50);
    assert_eq!(property(&mut master, 1, 3), 1, "reset, it waits again");
    of(&mut master, 0, &[0x80, 1]);
    assert_eq!(master.read(1, 0x1000, 0), 0x0002_0192);
    // Changes of state are not told, until a heartbeat is on.
    assert_eq!(of(&mut master, 0, &[0x01, 1]), []);
    assert_eq!(of(&mut master, 0, &[0x81, 1]), []);
    master.run_ms(50);
    assert_eq!(property(&mut master, 1, 3), 1, "a reset leads back");
}

/// Every NMT message in every state, BarrettCAN among them.
#[test]
fn every_nmt_message_in_every_state() {
    const BARRETT_CAN: u8 = 0;
    let lead = |from: u8| -> &'static [u8] {
        match from {
            BARRETT_CAN => &[],
            0x05 => &[0x01],
            0x04 => &[0x02],
            _ => &[0x80],
        }
    };
    for from in [BARRETT_CAN, 0x05, 0x04, 0x7F] {
        for (command, to) in [
            (0x01, 0x05),
            (0x02, 0x04),
            (0x80, 0x7F),
            (0x81, BARRETT_CAN),
            (0x82, 0x7F),
        ] {
            let mut master = quiet(&[1]);
            for command in lead(from) {
                of(&mut master, 0, &[*command, 1]);
            }
            let frames = of(&mut master, 0, &[command, 1]);
            // Told by a heartbeat at the start only, and communication starts with a reset of it.
            let starts = from == BARRETT_CAN || command == 0x82;
            let told = (starts && to != BARRETT_CAN).then(|| (0x701, vec![to]));
            assert_eq!(frames, Vec::from_iter(told), "{from:02X} {command:02X}");
            master.run_ms(50);
            let answers_property = !of(&mut master, 1, &[3]).is_empty();
            assert_eq!(
                answers_property,
                to == BARRETT_CAN,
                "{from:02X} {command:02X}"
            );
            let answers_sdo = !of(&mut master, 0x601, &[0x40, 0x00, 0x10, 0x00]).is_empty();
            assert_eq!(
                answers_sdo,
                matches!(to, 0x05 | 0x7F),
                "{from:02X} {command:02X}"
            );
            let core = master.drive(1).core().expect("it has booted");
            assert_eq!(core.comms().node().state() as u8, to);
        }
    }
}
