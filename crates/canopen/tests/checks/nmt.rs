//! NMT commands, states, boot-up, and what is allowed in which state (CiA 301 7.2.8, 7.3.2).

use canopen::{NmtState, Reset, TimeOfDay};

use crate::harness::FULL;
use crate::harness::stand::{BIT_30, ID, OFF, Stand, WIDE, frame, remote};

use NmtState::{Initialising, Operational, PreOperational, Stopped};

/// Commands that lead into a state, and its number in heartbeats.
pub(crate) const STATES: [(u8, NmtState, u8); 3] = [
    (0x01, Operational, 0x05),
    (0x02, Stopped, 0x04),
    (0x80, PreOperational, 0x7F),
];

/// A node in the state that `command` leads into.
pub(crate) fn after(command: u8) -> Stand {
    let mut stand = Stand::new();
    stand.nmt(command);
    stand.fresh();
    stand
}

pub(crate) fn boot_up() {
    let mut stand = Stand::unstarted(&FULL);
    assert_eq!(stand.node.state(), Initialising);
    assert_eq!(stand.start(), [(0x705, vec![0])]);
    assert_eq!(stand.wait_ms(100_000), [], "once");
}

pub(crate) fn enters_pre_operational() {
    let mut stand = Stand::unstarted(&FULL);
    stand.start();
    assert_eq!(stand.node.state(), PreOperational);
    assert_eq!(stand.log[0].entered, Some(PreOperational));
}

pub(crate) fn transitions() {
    for (from, before, _) in STATES {
        for (command, state, _) in STATES {
            let mut stand = after(from);
            stand.nmt(command);
            assert_eq!(stand.node.state(), state);
            assert_eq!(stand.log[0].entered, (state != before).then_some(state));
        }
    }
}

pub(crate) fn addressed() {
    for target in 0..=255 {
        let mut stand = after(0x01);
        assert_eq!(stand.send(0, &[0x02, target]), []);
        let obeys = target == 0 || u32::from(target) == ID;
        assert_eq!(stand.node.state() == Stopped, obeys, "to {target}");
    }
}

pub(crate) fn two_bytes() {
    for length in [0, 1, 3, 4, 5, 6, 7, 8] {
        let mut stand = after(0x01);
        assert_eq!(stand.send(0, &[0x02, 5, 0, 0, 0, 0, 0, 0][..length]), []);
        assert_eq!(stand.node.state(), Operational, "{length} bytes");
    }
}

pub(crate) fn unknown_commands() {
    for specifier in (0..=255).filter(|known| ![0x01, 0x02, 0x80, 0x81, 0x82].contains(known)) {
        for (from, state, _) in STATES {
            let mut stand = after(from);
            assert_eq!(stand.send(0, &[specifier, 0]), []);
            assert_eq!(stand.node.state(), state);
            assert_eq!(stand.log, [canopen::Events::NOTHING]);
        }
    }
}

pub(crate) fn data_frames_of_identifier_0() {
    let mut stand = after(0x01);
    stand.give(&remote(0, 2));
    stand.give(&frame(WIDE, &[0x02, 5]));
    stand.give(&remote(WIDE, 2));
    assert_eq!(stand.node.state(), Operational);
}

pub(crate) fn resets() {
    for (from, state, _) in STATES {
        for (command, reset) in [(0x81, Reset::Node), (0x82, Reset::Communication)] {
            for target in [0, 5] {
                let mut stand = after(from);
                assert_eq!(stand.send(0, &[command, target]), []);
                assert_eq!(stand.log[0].reset, Some(reset));
                assert_eq!(stand.node.state(), state);
            }
        }
    }
}

pub(crate) fn reset_communication() {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x1A5, 1, &[0x2000_0108]);
    stand.must(0x1017, 0, 10);
    stand.must(0x1006, 0, 1000);
    stand.must(0x1005, 0, 0x81 | BIT_30);
    stand.must(0x2000, 1, 7);
    let id = stand.node.id();
    stand.node.restart_communication(&[], id);
    // Between the two a node is silent.
    assert_eq!(stand.wait_ms(100), []);
    assert_eq!(stand.start(), [(0x705, vec![0])]);
    assert_eq!(stand.node.state(), PreOperational);
    for (index, sub, value) in [
        (0x1800, 1, 0x185),
        (0x1800, 2, 255),
        (0x1A00, 0, 0),
        (0x1017, 0, 0),
        (0x1006, 0, 0),
        (0x1005, 0, 0x80),
        (0x2000, 1, 7),
    ] {
        assert_eq!(stand.read(index, sub), Ok(value), "0x{index:04X},{sub}");
    }
    assert_eq!(stand.wait_ms(100), []);
}

pub(crate) fn initialising() {
    let mut stand = Stand::unstarted(&FULL);
    for (key, data) in [
        (0x000, &[0x01, 5][..]),
        (0x000, &[0x81, 5]),
        (0x000, &[0x82, 0]),
        (0x080, &[]),
        (0x100, &[0; 6]),
        (0x205, &[0; 8]),
        (0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]),
        (0x701, &[5]),
    ] {
        assert_eq!(stand.send(key, data), []);
    }
    assert_eq!(stand.request(0x705, 1), []);
    assert_eq!(stand.announce(0x1000, 1), []);
    assert_eq!(stand.wait_ms(100_000), []);
    assert!(
        stand
            .log
            .iter()
            .all(|events| *events == canopen::Events::NOTHING)
    );
    assert_eq!(stand.node.state(), Initialising);
}

pub(crate) fn sdo() {
    for (command, state, _) in STATES {
        let mut stand = after(command);
        let sent = stand.send(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        let answer = (0x585, vec![0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]);
        assert_eq!(
            sent,
            if state == Stopped {
                vec![]
            } else {
                vec![answer]
            }
        );
    }
}

pub(crate) fn sync() {
    for (command, state, _) in STATES {
        let mut stand = after(command);
        stand.sync();
        assert_eq!(stand.log[0].sync, state != Stopped);
    }
}

pub(crate) fn time() {
    for (command, state, _) in STATES {
        let mut stand = Stand::new();
        stand.must(0x1012, 0, 0x100 | BIT_30 | OFF);
        stand.nmt(command);
        stand.send(0x100, &[1, 0, 0, 0, 2, 0]);
        assert_eq!(stand.node.time_of_day().is_some(), state != Stopped);
        let sends = stand.node.send_time(TimeOfDay { ms: 1, days: 2 });
        assert_eq!(
            (sends, stand.drain().len() == 1),
            (state != Stopped, state != Stopped)
        );
    }
}

pub(crate) fn emcy() {
    for (command, state, _) in STATES {
        let mut stand = Stand::new();
        stand.must(0x1028, 7, 0x87);
        stand.nmt(command);
        assert_eq!(stand.announce(0x1000, 1).is_empty(), state == Stopped);
        stand.send(0x87, &[0; 8]);
        assert_eq!(stand.node.received_emergency().is_some(), state != Stopped);
    }
}

pub(crate) fn produced_sync() {
    let mut stand = Stand::new();
    stand.must(0x1006, 0, 1000);
    stand.must(0x1005, 0, 0x80 | BIT_30);
    for (command, state, _) in STATES {
        stand.nmt(command);
        let expected = if state == Stopped { 0 } else { 10 };
        assert_eq!(stand.wait_ms(10).len(), expected, "{state}");
    }
}

pub(crate) fn error_control() {
    for (command, _, number) in STATES {
        let mut stand = after(command);
        assert_eq!(stand.request(0x705, 1), [(0x705, vec![number])]);
        let mut stand = Stand::new();
        stand.must(0x1017, 0, 10);
        stand.must(0x1016, 1, 0x0007_000A);
        stand.must(0x1029, 1, 1);
        stand.nmt(command);
        stand.send(0x707, &[5]);
        assert_eq!(stand.wait_ms(10), [(10_000, 0x705, vec![number])]);
        assert!(
            stand
                .node
                .errors()
                .has(canopen::CommunicationErrors::HEARTBEAT)
        );
    }
}

pub(crate) fn stopped_is_silent() {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 253, &[0x2000_0108]);
    stand.map(0x1801, 0x285, 254, &[0x2000_0108]);
    stand.must(0x1012, 0, 0x100 | BIT_30 | OFF);
    stand.nmt(0x02);
    for key in 1..0x800 {
        for length in [0, 6, 8] {
            assert_eq!(stand.send(key, &[0x40; 8][..length]), [], "{key:03X}");
        }
        if key != 0x705 {
            assert_eq!(stand.request(key, 1), [], "{key:03X}");
        }
    }
    assert_eq!(stand.detect(), []);
    assert_eq!(stand.wait_ms(100_000), []);
    assert_eq!(stand.node.state(), Stopped);
}
